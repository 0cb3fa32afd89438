//! Points that no tetrahedron is left without which would outreach a margin.
//!
//! A coarse mesh of a surface has tetrahedra from wall to wall. Before it is divided into blocks, those with an edge of several wanted lengths
//! get their center, if that is far enough from all vertices.

use super::field::Field;
use crate::delaunay::Kernel;
use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::anatomy::{EDGES, FACES, FROZEN, MARK};
use crate::mesh::{Mesh, Scan, Tet, scan_parts, tets_of_page};
use tetdb_schema::page::SLOT_BITS;

use tetdb_base::geom::{HilbertFrame, Point, mix, orient};
use tetdb_base::storage::{Pages, check_cancelled, kind};

use super::spawn::center;

/// Wanted lengths for which one length of the scaffold stands.
pub(super) const COARSER: f64 = 2.5;
/// Tetrahedra with an edge longer than this, in lengths of the scaffold, get a point.
const LONG: f64 = 2.0;
/// Least distance to a vertex in lengths of the scaffold.
const FILTER: f64 = 0.75;
/// Rounds at most: each halves what is long.
const ROUNDS_MAX: u32 = 30;
/// Pages of tetrahedra scanned before their marks are set.
const BATCH: usize = 256;
/// Levels of random order in the first round: its points come from cavities that would grow without.
const LEVELS: u64 = 7;

/// Inserts the points. Returns how many.
pub(super) fn build<P: Pages>(mesh: &mut Mesh<P>, field: &Field) -> u64 {
    let order = HilbertFrame::new(&field.bounds);
    let mut kernel = Kernel::default();
    let mut last = None;
    let mut inserted = 0;
    let mut pages: Vec<u32> = (0..mesh.pages().n_pages::<{ kind::TETS }>()).collect();
    for round in 0..ROUNDS_MAX {
        check_cancelled();
        let key = |point| {
            let key = order.index(point);
            if round > 0 {
                return key;
            }
            let random = mix(key ^ 77);
            let level = (0..LEVELS).find(|l| random >> (3 * l) & 7 == 0).unwrap_or(LEVELS);
            level << 61 | key >> 3
        };
        let mut found = wanted(mesh, field, &pages, &key);
        pages.clear();
        found.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.cmp(&b.1)));
        let before = inserted;
        for (_, t, point, h) in found {
            let mut place = kernel.locate(mesh, point, t);
            if let (Err(_), Some(last)) = (&place, last) {
                place = kernel.locate(mesh, point, last);
            }
            let Ok(place) = place else {
                continue;
            };
            let least = FILTER * COARSER * field.place.coarse_length(point, h);
            let is_near = |mesh: &mut Mesh<P>, v: u32| {
                (mesh.point(v) - point).length_squared() < least * least
            };
            if place.record.vertices().into_iter().any(|v| is_near(mesh, v)) {
                continue;
            }
            let (region, _) = mesh.tet_attribute(place.tet);
            if kernel.gather_constrained(mesh, point, &place, is_near).is_err() {
                continue;
            }
            let is_frozen = (kernel.faces().iter())
                .any(|f| f.required && mesh.tet_attribute(f.inside.tet()).1 & FROZEN != 0);
            if is_frozen {
                kernel.discard(mesh);
                continue;
            }
            let v = mesh.add_vertex(point, h as f32);
            let recycled = kernel.cavity().len();
            last = Some(kernel.fill(mesh, v));
            for &t in kernel.new_tets().iter().skip(recycled) {
                mesh.set_tet_attribute(t, region, 0);
            }
            for &t in kernel.new_tets() {
                if pages.last() != Some(&(t >> SLOT_BITS)) {
                    pages.push(t >> SLOT_BITS);
                }
            }
            inserted += 1;
        }
        if inserted == before {
            break;
        }
        pages.sort_unstable();
        pages.dedup();
    }
    inserted
}

/// A point, behind the key of its turn and the tetrahedron that gets it, and the length wanted there.
type Wanted = (u64, u32, Point, f64);

/// The points, with their `key`, of long tetrahedra of some pages that were not examined before, and that the field's place reaches. Effects: they are marked as
/// examined.
fn wanted<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    pages: &[u32],
    key: &(dyn Fn(Point) -> u64 + Sync),
) -> Vec<Wanted> {
    let mut found = Vec::new();
    for batch in pages.chunks(BATCH) {
        for (due, points) in scan_parts(mesh, batch, &Long(field, key)) {
            due.into_iter().for_each(|t| mesh.set_mark(t, EXAMINED, true));
            found.extend(points);
        }
    }
    found
}

/// Scan that returns the tetrahedra of a page that were not examined before, and the points of those that are long.
struct Long<'a, 'b>(&'a Field<'b>, &'a (dyn Fn(Point) -> u64 + Sync));

impl Scan for Long<'_, '_> {
    type Part = u32;
    type Output = (Vec<u32>, Vec<Wanted>);

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> Self::Output {
        let (mut due, mut points) = (Vec::new(), Vec::new());
        tets_of_page(mesh, page, |mesh, t, tet| {
            if tet.node[EXAMINED] & MARK == 0 && self.0.reaches(&mesh.ends(&tet)) {
                due.push(t);
                let point = point_of(mesh, &tet, self.0);
                points.extend(point.map(|(point, h)| (self.1(point), t, point, h)));
            }
        });
        (due, points)
    }
}

/// Whether a tetrahedron is too long for the scaffold, by the lengths wanted at its corners.
pub(super) fn is_void(corners: &[Point; 4], sizes: &[f64; 4]) -> bool {
    let least = sizes.iter().copied().fold(f64::INFINITY, f64::min);
    longest(corners) > (LONG * COARSER * least).powi(2)
}

/// The square of the longest edge.
fn longest(p: &[Point; 4]) -> f64 {
    EDGES.iter().map(|&[i, j]| (p[i] - p[j]).length_squared()).fold(0.0, f64::max)
}

/// The point that a long tetrahedron gets, and the length wanted there.
fn point_of<P: Pages>(mesh: &mut Mesh<P>, tet: &Tet, field: &Field) -> Option<(Point, f64)> {
    let ends = mesh.ends(tet);
    let p = mesh.points(tet);
    let longest = longest(&p);
    let least = ends.iter().map(|e| f64::from(e.h)).fold(f64::INFINITY, f64::min);
    let is_long = |h: f64| longest > (LONG * COARSER * h) * (LONG * COARSER * h);
    let middle = (p[0] + p[1] + p[2] + p[3]) * 0.25;
    if !is_long(least) && !is_long((field.h)(middle)) {
        return None;
    }
    let sphere = p[0] + center(p)?;
    let is_inside = FACES.iter().all(|&[a, b, c]| orient(sphere, p[a], p[b], p[c]) >= 0.0);
    let point = if is_inside { sphere } else { middle };
    let h = (field.h)(point);
    let length = field.place.coarse_length(point, h);
    let filter = FILTER * COARSER * length;
    let is_far = p.iter().all(|&q| (q - point).length_squared() >= filter * filter);
    (is_long(length) && is_far && !field.place.forbids(point, h)).then_some((point, h))
}
