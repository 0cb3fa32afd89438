//! What each grain has to know: where something stands in its way, and where there is room.

use std::collections::HashSet;
use std::ops::Range;

use tetdb_schema::page::NONE;

use super::super::activity::Activity;
use super::super::field::Field;
use super::super::grain::{Around, Site, nearest, octave, width};
use crate::mesh::anatomy::EDGES;
use crate::mesh::{Mesh, Scan, Tet, Workspace, dense, scan_parts, sparse, tets_of_page};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Pages, Payload, Sorted, Sorter, StorageError, kind, sort_record};

sort_record! {
    /// A position that concerns a grain.
    pub(super) struct Claim {
        /// The grain, as [`key`] tells it.
        pub grain: u64,
        /// The tetrahedron that holds the position; [`NONE`] where something is in the way.
        pub tet: u32,
        /// The position.
        pub at: Payload<[f64; 3]>,
    }
}

impl Claim {
    pub fn point(&self) -> Point {
        Point::from_array(self.at.0)
    }
}

/// A tetrahedron with an edge longer than this, in units of the least size of its ends, may have room for a piece of the pattern.
const ROOMY: f64 = 4.0;
/// Places on required faces no farther apart than this, in units of h, stand for all of them: where the size of a grain is less by a sixth,
/// nothing passes between them that keeps clear of each.
const COVERED: f64 = 1.15;
/// How far beyond its limits a grain minds what is in the way, in units of h.
const REACH: f64 = 1.0;
/// Sizes are known to this factor when the octave of a grain beside a vertex is guessed.
const GUESS: f64 = 1.2;
/// Vertices or faces looked at as one part, and parts before what was found is sorted.
const PART: u32 = 2046;
const BATCH: usize = 64;

/// Bits of a cell's place along each axis in a grain's key.
const CELL_BITS: u32 = 17;

/// An octave and a cell as one number; none for cells too far away from the mesh's corner.
pub(super) fn key(octave: u32, corner: Point) -> Option<u64> {
    let half = i64::from(1 << (CELL_BITS - 1));
    corner.to_array().into_iter().try_fold(u64::from(octave), |key, c| {
        let cell = c as i64 + half;
        (0..2 * half).contains(&cell).then_some(key << CELL_BITS | cell as u64)
    })
}

/// The inverse of [`key`].
pub(super) fn octave_and_corner(key: u64) -> (u32, Point) {
    let half = f64::from(1 << (CELL_BITS - 1));
    let cell = |k: u32| (key >> (k * CELL_BITS) & ((1 << CELL_BITS) - 1)) as f64 - half;
    ((key >> (3 * CELL_BITS)) as u32, Point::new(cell(2), cell(1), cell(0)))
}

/// All claims of a mesh on grains with room, in the order of grains; none when there is no room at all. `active` learns which pages are
/// far from where points may go.
///
/// Sizes must be set at all vertices. Errors: the disk, while sorting.
pub(super) fn gather<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    space: &Workspace,
    active: &mut Activity,
) -> Result<Option<Sorted<Claim>>, StorageError> {
    let mut sorter = Sorter::new(space.dir, space.memory);
    // A zone has few of the grains that all the mesh's vertices and facets concern.
    let mut roomy = HashSet::new();
    let pages: Vec<u32> = (0..mesh.pages().n_pages::<{ kind::TETS }>()).collect();
    for batch in pages.chunks(BATCH) {
        let found = scan_parts(mesh, batch, &Rooms { field });
        for (&page, (claims, near)) in batch.iter().zip(found) {
            if !near {
                active.set_far(page);
            }
            for claim in claims {
                roomy.insert(claim.grain);
                sorter.push(claim)?;
            }
        }
    }
    if roomy.is_empty() {
        return Ok(None);
    }
    let vertices = Vertices { field, roomy: &roomy };
    for batch in parts(dense(mesh.vertex_ids_end())).chunks(BATCH) {
        let found = scan_parts(mesh, batch, &vertices);
        for claim in found.into_iter().flatten() {
            sorter.push(claim)?;
        }
    }
    let mut push = |claim: Claim| match roomy.contains(&claim.grain) {
        true => sorter.push(claim),
        false => Ok(()),
    };
    let mut lister = Lister::new(field);
    for of in [Faces::Facets, Faces::Interface] {
        let n = match of {
            Faces::Facets => mesh.n_facets(),
            Faces::Interface => mesh.n_interface_faces(),
        };
        for batch in parts(n).chunks(BATCH) {
            for (corners, least) in scan_parts(mesh, batch, &of).into_iter().flatten() {
                lister.cover(corners, least, &mut push)?;
            }
        }
    }
    Ok(Some(sorter.finish()?))
}

fn parts(n: u32) -> Vec<Range<u32>> {
    let starts = (0..n).step_by(PART as usize);
    starts.map(|from| from..n.min(from + PART)).collect()
}

/// Lists positions in tetrahedra that are large beside the wanted length, and tells whether points may go near any of a page.
struct Rooms<'a> {
    field: &'a Field<'a>,
}

impl Scan for Rooms<'_> {
    type Part = u32;
    type Output = (Vec<Claim>, bool);

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> (Vec<Claim>, bool) {
        let mut lister = Lister::new(self.field);
        let (mut claims, mut near) = (Vec::new(), false);
        tets_of_page(mesh, page, |mesh, t, tet| {
            near |= self.list(mesh, &tet, &mut |p, h| claims.extend(lister.room(t, p, h)));
        });
        (claims, near)
    }
}

impl Rooms<'_> {
    /// Whether points may go near the tetrahedron.
    fn list<P: Pages>(
        &self,
        mesh: &mut Mesh<P>,
        tet: &Tet,
        found: &mut impl FnMut(Point, f64),
    ) -> bool {
        let place = self.field.place;
        let ends = mesh.ends(tet);
        let [a, b, c, d] = &ends;
        let points = [a.point, b.point, c.point, d.point];
        let sizes = [a.h, b.h, c.h, d.h];
        let squared = |e: [usize; 2]| (points[e[0]] - points[e[1]]).length_squared();
        let least = f64::from(sizes[0].min(sizes[1]).min(sizes[2].min(sizes[3])));
        let roomy = ROOMY * ROOMY * least * least;
        if !self.field.reaches(&ends) {
            return false;
        }
        if !EDGES.into_iter().any(|e| squared(e) > roomy) {
            return true;
        }
        let mut add = |p: Point| {
            let h = (self.field.h)(p);
            if place.admits(p, h) {
                found(p, h);
            }
        };
        add((points[0] + points[1] + points[2] + points[3]) * 0.25);
        let longest = EDGES.into_iter().max_by(|&e, &f| squared(e).total_cmp(&squared(f)));
        let [i, j] = longest.expect("a tetrahedron has edges");
        let sizes = [i, j].map(|k| f64::from(sizes[k]));
        if let Some([from, to]) = place.stretch(points[i], points[j], sizes) {
            add(points[i] + (points[j] - points[i]) * (0.5 * (from + to)));
        }
        true
    }
}

/// Lists vertices for the grains with room.
struct Vertices<'a> {
    field: &'a Field<'a>,
    roomy: &'a HashSet<u64>,
}

impl Scan for Vertices<'_> {
    type Part = Range<u32>;
    type Output = Vec<Claim>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, numbers: &Range<u32>) -> Vec<Claim> {
        let mut lister = Lister::new(self.field);
        let mut claims = Vec::new();
        for n in numbers.clone() {
            let (p, h) = mesh.point_and_size(sparse(n));
            let known = lister.obstacle(p, f64::from(h));
            claims.extend(known.filter(|claim| self.roomy.contains(&claim.grain)));
        }
        claims
    }
}

/// Lists required faces between whose vertices something could pass: corners, and the least size there.
enum Faces {
    Facets,
    Interface,
}

impl Scan for Faces {
    type Part = Range<u32>;
    type Output = Vec<([Point; 3], f64)>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, numbers: &Range<u32>) -> Self::Output {
        let mut large = Vec::new();
        for n in numbers.clone() {
            let vertices = match self {
                Self::Facets => mesh.facet(n).vertices,
                Self::Interface => mesh.interface_face(n).vertices,
            };
            let [a, b, c] = vertices.map(|v| mesh.point_and_size(v));
            let least = f64::from(a.1.min(b.1).min(c.1));
            let corners = [a.0, b.0, c.0];
            let (p, q, _) = longest_side(corners);
            if (p - q).length_squared() > (COVERED * least).powi(2) {
                large.push((corners, least));
            }
        }
        large
    }
}

/// Ends of a triangle's longest side, and its third corner.
fn longest_side([a, b, c]: [Point; 3]) -> (Point, Point, Point) {
    let sides = [(b, c, a), (c, a, b), (a, b, c)];
    let squared = |side: &(Point, Point, Point)| (side.0 - side.1).length_squared();
    let longest = sides.into_iter().max_by(|s, t| squared(s).total_cmp(&squared(t)));
    longest.expect("a triangle has sides")
}

/// Tells which grains a position concerns.
struct Lister<'a> {
    field: &'a Field<'a>,
    /// By the last bit of the octave.
    around: [Around; 2],
}

impl<'a> Lister<'a> {
    fn new(field: &'a Field<'a>) -> Self {
        Self { field, around: [Around::new(), Around::new()] }
    }

    /// What the grain of `p`, where `h` is wanted, learns of a tetrahedron that holds it.
    fn room(&mut self, tet: u32, p: Point, h: f64) -> Option<Claim> {
        let octave = octave(h);
        let at = (p - self.field.bounds.low) / width(octave);
        let corner = self.around[octave as usize & 1].nearest(at, octave).corner;
        Some(Claim { grain: key(octave, corner)?, tet, at: Payload(p.to_array()) })
    }

    /// What the grains near `p`, where about `h` is wanted, learn: that something is there.
    fn obstacle(&mut self, p: Point, h: f64) -> impl Iterator<Item = Claim> + use<> {
        let mut grains = [None; 16];
        let mut n = 0;
        let octaves = [octave(h / GUESS), octave(h * GUESS)];
        let n_octaves = match h > 0.0 {
            true if octaves[0] == octaves[1] => 1,
            true => 2,
            false => 0,
        };
        for &octave in &octaves[..n_octaves] {
            let width = width(octave);
            let at = (p - self.field.bounds.low) / width;
            let sites = self.around[octave as usize & 1].sites(at, octave);
            let squared = |site: &Site| (site.at - at).length_squared();
            let nearest = sites[nearest(sites, at)];
            let least = squared(&nearest);
            for site in &*sites {
                let apart = 2.0 * (site.at - nearest.at).length();
                if squared(site) - least <= apart * (REACH * h / width) {
                    grains[n] = key(octave, site.corner);
                    n += 1;
                }
            }
        }
        let at = Payload(p.to_array());
        let claim = move |grain| Claim { grain, tet: NONE, at };
        grains.into_iter().flatten().map(claim)
    }

    /// Puts places on a triangle in the way, so near to each other that nothing passes between them and its corners; `least` is the
    /// least size at its corners.
    fn cover(
        &mut self,
        corners: [Point; 3],
        least: f64,
        push: &mut impl FnMut(Claim) -> Result<(), StorageError>,
    ) -> Result<(), StorageError> {
        let mut stack = vec![corners];
        while let Some(corners) = stack.pop() {
            let (p, q, apex) = longest_side(corners);
            let middle = (p + q) * 0.5;
            // Corners may want less than all between them.
            let h = (self.field.h)(middle).max(least);
            if (p - q).length_squared() <= (COVERED * h).powi(2) {
                continue;
            }
            for claim in self.obstacle(middle, h) {
                push(claim)?;
            }
            stack.push([p, middle, apex]);
            stack.push([middle, q, apex]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::{Everywhere, Lengths};
    use tetdb_base::geom::Aabb;

    #[test]
    fn nothing_passes_through_a_covered_triangle() {
        let field = Field {
            lengths: Lengths::Field,
            h: &|p| 0.1 + 0.02 * p.x,
            place: &Everywhere,
            bounds: Aabb::around([Point::ZERO, Point::ONE]),
        };
        let corners = [Point::ZERO, Point::X * 3.0, Point::new(0.5, 2.0, 0.7)];
        let mut places = corners.to_vec();
        let mut lister = Lister::new(&field);
        let mut push = |claim: Claim| {
            assert_eq!(claim.tet, NONE);
            places.push(claim.point());
            Ok(())
        };
        let covered = lister.cover(corners, 0.1, &mut push);
        covered.expect("nothing is written");
        let (mut n, steps) = (0, 60);
        for i in 0..=steps {
            for j in 0..=steps - i {
                let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(steps));
                let p = corners[1] * u + corners[2] * v;
                let near = places.iter().map(|q| q.distance(p));
                let near = near.fold(f64::INFINITY, f64::min);
                assert!(near < 0.82 * (field.h)(p), "{p} {near}");
                n += 1;
            }
        }
        assert!(n > 1000 && places.len() > 100, "{n} {}", places.len());
    }

    #[test]
    fn a_key_tells_octave_and_cell() {
        for corner in [Point::ZERO, Point::new(-3.0, 12.0, 65_535.0)] {
            let key = key(1017, corner).expect("near enough");
            assert_eq!(octave_and_corner(key), (1017, corner));
        }
        assert_eq!(key(1017, Point::new(0.0, 1e6, 0.0)), None);
    }
}
