use super::*;
use crate::delaunay::enclose;
use crate::mesh::anatomy::MARK;
use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::{FaceRef, MeshFacet, VertexTag};
use tetdb_base::geom::orient;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Backing, Pager, kind};
use tetdb_schema::page::RECORDS;

/// A cube of fixed corners, divided until edges have length `h`.
fn cube(h: f64, pager: Pager) -> (Mesh<Pager>, RefineReport) {
    graded(pager, Lengths::Field, &|_| h, |_| ())
}

fn graded(
    pager: Pager,
    lengths: Lengths,
    h: &(dyn Fn(Point) -> f64 + Sync),
    prepare: impl FnOnce(&mut Mesh<Pager>),
) -> (Mesh<Pager>, RefineReport) {
    let mut mesh = Mesh::new(pager);
    let bounds = Aabb::around([Point::ZERO, Point::ONE]);
    enclose(&mut mesh, &bounds);
    for v in 0..8 {
        let p = mesh.point(v);
        mesh.set_size(v, h(p) as f32);
        assert_eq!(mesh.vertex_attribute(v).0, VertexTag::EnclosingBox);
    }
    prepare(&mut mesh);
    let field = Field { lengths, h, place: &super::Everywhere, bounds };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let space = Workspace { dir: &dir.path().into(), memory: 1 << 20 };
    let report = saturate(&mut mesh, &field, &space, &mut |_| ()).expect("room for runs");
    (mesh, report)
}

#[test]
fn edges_end_near_the_wanted_length() {
    let (mut mesh, report) = cube(0.5, Pager::new(1 << 28, None));
    assert!(report.inserted > 1000, "{report:?}");
    let (mut n, mut sum, mut long) = (0u32, 0.0, 0u32);
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let p = mesh.points(&tet);
        assert!(orient(p[0], p[1], p[2], p[3]) > 0.0);
        for [i, j] in crate::mesh::anatomy::EDGES {
            // The cube's own faces are two triangles each, so only what is inside can be saturated.
            let middle = (p[i] + p[j]) * 0.5 - Point::splat(0.5);
            if middle.abs().max_element() > 2.0 {
                continue;
            }
            let l = p[i].distance(p[j]) / 0.5;
            assert!(l > 0.7, "an edge of length {l}");
            n += 1;
            sum += l;
            long += u32::from(l > 1.5);
        }
    }
    let mean = sum / f64::from(n);
    assert!((0.95..1.1).contains(&mean), "mean {mean}");
    assert!(f64::from(long) < 0.02 * f64::from(n), "{long} of {n} edges are long");
    assert!(mesh.pages().n_pages::<{ kind::TETS }>() > 1);
}

/// Makes the faces of the enclosing box facets, as those of every domain are.
pub(super) fn wall_in(mesh: &mut Mesh<Pager>) {
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        for i in 0..4 {
            if !tet.neighbor[i].exists() {
                mesh.set_required(FaceRef::new(t, i), true);
                mesh.add_facet(MeshFacet {
                    vertices: tet.face(i),
                    label: 0,
                    input: 0,
                    regions: [0, 1],
                });
            }
        }
    }
}

/// Every tetrahedron is positive, neighbors know each other, and together they fill the box.
fn check_sound(mesh: &mut Mesh<Pager>, volume: f64) {
    let (mut sum, mut from) = (0.0, 0);
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let [a, b, c, d] = mesh.points(&tet);
        assert!(orient(a, b, c, d) > 0.0);
        sum += (b - a).cross(c - a).dot(d - a) / 6.0;
        for i in 0..4 {
            let across = tet.neighbor[i];
            if across.exists() {
                let other = mesh.tet(across.tet());
                assert_eq!(other.neighbor[across.face()], FaceRef::new(t, i));
                let [mut here, mut there] = [tet.face(i), other.face(across.face())];
                here.sort_unstable();
                there.sort_unstable();
                assert_eq!(here, there);
            }
        }
    }
    assert!((sum - volume).abs() < 1e-9 * volume, "{sum} of {volume}");
}

#[test]
fn pieces_of_the_pattern_are_set_in_whole() {
    let set_in = |h: &(dyn Fn(Point) -> f64 + Sync)| {
        let pager = Pager::new(1 << 28, None);
        let (mut mesh, report) = graded(pager, Lengths::Field, h, wall_in);
        check_sound(&mut mesh, 216.0);
        assert_eq!(u64::from(mesh.n_vertices()), 8 + report.inserted);
        assert!(report.inserted > 400, "{report:?}");
        (report.set_in, report.inserted)
    };
    let (inside, all) = set_in(&|_| 0.2);
    assert!(4 * inside > all, "{inside} of {all}");
    // Where sizes vary a piece of one size does not fit.
    let (inside, _) = set_in(&|p| 0.2 + 0.3 * (p - Point::splat(0.5)).length());
    assert_eq!(inside, 0);
}

#[test]
fn between_vertices_only_the_field_knows() {
    // Fine in the middle, where no vertex of the coarse mesh is.
    let middle = |p: Point| 0.3 + 0.5 * (p - Point::splat(0.5)).length();
    let inserted = |lengths| {
        let pager = Pager::new(1 << 28, None);
        graded(pager, lengths, &middle, |_| ()).1.inserted
    };
    let (field, ends) = (inserted(Lengths::Field), inserted(Lengths::Ends));
    assert!(ends > 0 && 3 * ends < field, "{ends} of {field}");
}

#[test]
fn the_same_points_whatever_the_pool() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (mut all, report) = cube(0.45, Pager::new(1 << 28, None));
    let backing = Backing {
        subdomain: 0,
        generation: 1,
        spill: dir.path().into(),
        output: None,
        base: None,
        cache_bytes: 1 << 20,
    };
    let (mut few, same) = cube(0.45, Pager::new(16 << 16, Some(backing)));
    assert_eq!(same, report);
    assert!(few.pages().stats().pages_read > 0, "the small pool must have missed");
    let mut from = 0;
    while let Some((t, tet)) = all.next_tet(from) {
        from = t + 1;
        assert_eq!(few.tet(t), tet);
    }
}

/// Points go where x is at most this.
struct Below(f64);

impl PlacementRule for Below {
    fn is_partial(&self) -> bool {
        true
    }
    fn reaches(&self, points: &[Point; 4], _: &[f32; 4]) -> bool {
        points.iter().any(|p| p.x <= self.0)
    }
    fn stretch(&self, _: Point, _: Point, _: [f64; 2]) -> Option<[f64; 2]> {
        Some([0.0, 1.0])
    }
    fn admits(&self, p: Point, _: f64) -> bool {
        p.x <= self.0
    }
    fn forbids(&self, _: Point, _: f64) -> bool {
        false
    }
}

#[test]
fn pages_far_from_a_zone_are_not_changed() {
    let (mut mesh, _) = cube(0.3, Pager::new(1 << 28, None));
    let bounds = Aabb::around(mesh.vertex_ids().map(|v| mesh.point(v)).collect::<Vec<_>>());
    let place = Below(bounds.low.x + 0.2);
    let tets: Vec<u32> = (0..dense(mesh.tet_ids_end())).map(sparse).collect();
    for &t in &tets {
        mesh.set_mark(t, EXAMINED, false);
    }
    for v in mesh.vertex_ids() {
        mesh.set_size(v, 0.2);
    }
    let field = Field { lengths: Lengths::Field, h: &|_| 0.2, place: &place, bounds };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let space = Workspace { dir: &dir.path().into(), memory: 1 << 20 };
    let reaches = |&t: &u32| {
        let tet = mesh.tet(t);
        tet.is_live() && place.reaches(&mesh.points(&tet), &[0.2; 4])
    };
    let near: Vec<u32> = tets.iter().copied().filter(reaches).collect();
    let before = mesh.n_tets();
    let report = saturate(&mut mesh, &field, &space, &mut |_| ()).expect("room for runs");
    let grown = f64::from(mesh.n_tets()) / f64::from(before);
    assert!(report.inserted > 100 && grown < GROWTH_LAST, "{report:?} {grown}");
    let is_far = |page: &&[u32]| !page.iter().any(|t| near.binary_search(t).is_ok());
    let (n, far) = (tets.chunks(RECORDS).count(), tets.chunks(RECORDS).filter(is_far));
    let mut examined = |&t: &u32| mesh.tet(t).node[EXAMINED] & MARK != 0;
    let changed: Vec<bool> = far.map(|page| page.iter().any(&mut examined)).collect();
    assert!(n > 20 && changed.len() > n / 4 && changed.len() < n, "{n} {changed:?}");
    // Few: those with tetrahedra of a cavity that reaches there.
    let n_changed = changed.iter().filter(|changed| **changed).count();
    assert!(n_changed < changed.len() / 4, "{changed:?}");
}
