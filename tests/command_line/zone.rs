//! The frozen tetrahedra at interfaces stay when a sub-domain is meshed again.
//!
//! Why: a sub-domain is meshed alone, so the tetrahedra that its neighbors were fitted to must not change.
//! How: the tetrahedra of a coarse snapshot with a face on an interface are looked up in the mesh, before and after a change to half the
//! size. They are compared as sets of four positions. Insertion may change none of them. Optimization may replace them by others on the
//! same faces, in the first run as in the second; with it, only the faces are checked.

use std::collections::BTreeSet;

use tetdb_store::sealed::Subdomain;
use tetdb_store::store::Catalog;

use super::place::Place;

type Position = [u64; 3];
/// Positions of the corners, in ascending order.
type Tet = [Position; 4];
type Face = [Position; 3];

fn bits(point: [f64; 3]) -> Position {
    point.map(f64::to_bits)
}

fn sorted<const N: usize>(mut corners: [Position; N]) -> [Position; N] {
    corners.sort_unstable();
    corners
}

/// The frozen tetrahedra of a coarse snapshot, and its interface faces.
fn frozen(place: &Place, rank: u32) -> (BTreeSet<Tet>, BTreeSet<Face>) {
    /// Flag of frozen tetrahedra in the attribute.
    const FROZEN: u32 = 1;
    let mut store = Catalog::open(place.path("a.tetdb")).expect("a store");
    let mut leaf = store.open_coarse(rank, 1 << 20).expect("it was kept");
    let vertices: Vec<Position> = (leaf.vertices())
        .flat_map(|chunk| chunk.expect("sound").records)
        .map(|v| bits(v.point))
        .collect();
    let corner = |v: u32| vertices[v as usize];
    let tets = leaf.tets().flat_map(|chunk| chunk.expect("sound").records);
    let frozen = tets
        .filter(|tet| tet.flags & FROZEN != 0)
        .map(|tet| sorted(tet.nodes.map(corner)))
        .collect();
    let faces = leaf.faces().flat_map(|chunk| chunk.expect("sound").records);
    let faces = faces.map(|f| sorted(f.vertices.map(corner))).collect();
    (frozen, faces)
}

fn part(place: &Place, rank: u32) -> Subdomain {
    let mut store = Catalog::open(place.path("a.tetdb")).expect("a store");
    store.open_subdomain(rank, 16 << 20).expect("it is finished")
}

/// All tetrahedra of a sub-domain, and those with a face on an interface.
fn tets(place: &Place, rank: u32) -> (BTreeSet<Tet>, BTreeSet<Tet>) {
    let mut part = part(place, rank);
    let vertices: Vec<Position> =
        (part.vertices()).map(|v| bits(v.expect("sound").point)).collect();
    let corner = |v: u32| vertices[v as usize];
    let list: Vec<Tet> =
        (part.tets()).map(|tet| sorted(tet.expect("sound").1.nodes.map(corner))).collect();
    let at_interface =
        (part.interfaces()).map(|face| list[face.expect("sound").tet as usize]).collect();
    (list.into_iter().collect(), at_interface)
}

/// The interface faces of a sub-domain.
fn faces(place: &Place, rank: u32) -> BTreeSet<Face> {
    let mut part = part(place, rank);
    let faces: Vec<[u32; 3]> =
        (part.interfaces()).map(|face| face.expect("sound").vertices).collect();
    let mut corners = |v: u32| bits(part.corner(v).expect("sound").point.to_array());
    faces.into_iter().map(|face| sorted(face.map(&mut corners))).collect()
}

#[test]
fn what_is_frozen_stays_whatever_the_sizes() {
    for optimize in ["none", "full"] {
        let place = Place::new();
        let line = format!(
            "mesh sample:box,h=0.045 -o a.tetdb --subdomains 2 --no-verify --optimize {optimize}"
        );
        place.run_line(&line).succeeds();
        let (frozen, coarse_faces) = frozen(&place, 1);
        assert!(frozen.len() > 500, "{}", frozen.len());
        assert!(coarse_faces.len() > 500, "{}", coarse_faces.len());
        assert_eq!(faces(&place, 1), coarse_faces);
        let (before, at_interface) = tets(&place, 1);
        place.run_line("resaturate a.tetdb --subdomain 1 --refine-by 0.5 --no-verify").succeeds();
        let (after, at_interface_after) = tets(&place, 1);
        assert_eq!(faces(&place, 1), coarse_faces, "{optimize}");
        assert!(after.len() > 2 * before.len());
        let kept = |all: &BTreeSet<Tet>, of: &BTreeSet<Tet>| of.intersection(all).count();
        println!(
            "{optimize}: of {} frozen {} before, {} after; of {} at the interface {} after",
            frozen.len(),
            kept(&before, &frozen),
            kept(&after, &frozen),
            at_interface.len(),
            kept(&at_interface_after, &at_interface)
        );
        if optimize == "none" {
            assert!(frozen.is_subset(&before), "the first run touched frozen tetrahedra");
            assert!(frozen.is_subset(&after), "the change touched frozen tetrahedra");
            // The tetrahedra at the interface are among the frozen ones.
            assert!(at_interface.is_subset(&frozen));
            assert_eq!(at_interface, at_interface_after);
        }
    }
}
