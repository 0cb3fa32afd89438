//! The side of the cut that each tetrahedron of the core is on, and the cost of the interface.

use std::collections::BTreeSet;

use super::core::{CoreBoundary, is_in_core, middle, sides_and_distance, tet_ids};
use super::surface::CuttingSurface;
use crate::mesh::{FaceRef, Mesh, Tet, dense};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Pages, check_cancelled};
use tetdb_schema::page::NONE;

/// Tetrahedra with a vertex nearer than this, in units of its h, may go to either side: the cutting zone. At 2.5 the interface has
/// one face in a hundred less, and its spheres reach out of the refined zone.
const FREE: f64 = 1.4;

/// Bits of a label.
const HIGH: u8 = 1;
const MAY_CHANGE: u8 = 2;

/// The side of each tetrahedron of the core, and whether it may change. Memory: one byte each.
pub(super) struct SideLabels {
    /// By id.
    by_tet: Vec<u8>,
}

impl SideLabels {
    /// Labels every tetrahedron by the side of its middle; lists those of the cutting zone, in id order.
    ///
    /// At the core boundary the side is that of the core boundary face: the tetrahedron beyond has all its vertices there.
    pub fn new<P: Pages>(
        core: &mut Mesh<P>,
        surface: &impl CuttingSurface,
        core_boundary: &CoreBoundary,
    ) -> (Self, Vec<u32>) {
        let mut by_tet = vec![0; core.tet_ids_end() as usize];
        let mut free = Vec::new();
        for t in tet_ids(core) {
            let tet = core.tet(t);
            if !tet.is_live() {
                continue;
            }
            let (sides, least) = sides_and_distance(core, &tet, surface);
            let mut high = surface.distance(middle(core, &tet)) >= 0.0;
            let mut may_change = sides.crosses() || least <= FREE;
            for i in 0..4 {
                if !tet.neighbor[i].exists() && core_boundary.find(tet.face(i)).is_some() {
                    may_change = false;
                    high = surface.distance(core.point(tet.face(i)[0])) >= 0.0;
                }
            }
            if !sides.crosses() {
                // A middle that rounds to the other side must not contradict its vertices.
                high = sides.high;
            }
            if may_change {
                free.push(t);
            }
            let label = if high { HIGH } else { 0 } | if may_change { MAY_CHANGE } else { 0 };
            by_tet[t as usize] = label;
            if t & 1023 == 0 {
                check_cancelled();
            }
        }
        (Self { by_tet }, free)
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        self.by_tet.len() as u64
    }

    /// Side of `t`: `true` for the high one.
    #[inline]
    pub fn is_high(&self, t: u32) -> bool {
        self.by_tet[t as usize] & HIGH != 0
    }

    /// Returns whether `t` may go to either side.
    #[inline]
    pub fn is_free(&self, t: u32) -> bool {
        self.by_tet[t as usize] & MAY_CHANGE != 0
    }

    /// Puts `t` on a side.
    #[inline]
    pub fn set_high(&mut self, t: u32, high: bool) {
        let label = &mut self.by_tet[t as usize];
        *label = if high { *label | HIGH } else { *label & !HIGH };
    }

    /// Faces of the interface at `tet`: local numbers.
    #[inline]
    pub fn interface_faces(&self, t: u32, tet: &Tet) -> impl Iterator<Item = usize> + use<> {
        let high = self.is_high(t);
        let mut found = [false; 4];
        for (i, across) in tet.neighbor.into_iter().enumerate() {
            found[i] = across.exists() && self.is_high(across.tet()) != high;
        }
        (0..4).filter(move |&i| found[i])
    }
}

/// Longest edge of a triangle over its inradius, 1 for the regular one.
pub(super) fn triangle_quality([a, b, c]: [Point; 3]) -> f64 {
    let (x, y, z) = (a.distance(b), b.distance(c), c.distance(a));
    let area = 0.5 * (b - a).cross(c - a).length();
    let inradius = 2.0 * area / (x + y + z);
    x.max(y).max(z) / (2.0 * 3f64.sqrt() * inradius.max(f64::MIN_POSITIVE))
}

/// Greatest shape term of a face; worse shapes cost the same.
const SHAPE_MAX: f64 = 20.0;

/// Cost of a face on the interface: 1, and more for a bad shape or a slope.
pub(super) fn face_cost(corners: [Point; 3], surface: &impl CuttingSurface) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let shape = (triangle_quality(corners) - 1.0).min(SHAPE_MAX);
    1.0 + 0.5 * shape + 0.5 * (1.0 - normal.dot(surface.normal(a)).abs())
}

/// Measures of an interface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InterfaceMeasures {
    /// Number of faces.
    pub faces: u64,
    /// Sum of the faces' qualities (longest edge over inradius, 1 is regular).
    pub quality_sum: f64,
    /// Tetrahedra with two or more interface faces.
    pub over_constrained: u64,
    /// Tetrahedra with one interface face and a required one: where the interface ends at the surface, most have both.
    pub at_surface: u64,
    /// Vertices around which a side has more than one part.
    pub pinched: u64,
}

impl InterfaceMeasures {
    /// Mean quality of the faces.
    pub fn quality_mean(&self) -> f64 {
        self.quality_sum / (self.faces.max(1)) as f64
    }
}

/// Counts faces and over-constrained tetrahedra; pinched vertices are counted elsewhere.
pub(super) fn measure<P: Pages>(
    core: &mut Mesh<P>,
    labels: &SideLabels,
    core_boundary: &CoreBoundary,
) -> InterfaceMeasures {
    let mut measures = InterfaceMeasures::default();
    for t in tet_ids(core) {
        let tet = core.tet(t);
        if !tet.is_live() {
            continue;
        }
        let high = labels.is_high(t);
        let mut constrained = 0;
        let mut cut = 0;
        for i in labels.interface_faces(t, &tet) {
            cut += 1;
            if !high {
                measures.faces += 1;
                let corners = tet.face(i).map(|v| core.point(v));
                measures.quality_sum += triangle_quality(corners);
            }
        }
        if cut == 0 {
            continue;
        }
        for i in 0..4 {
            constrained += u32::from(is_constrained(&tet, i, core_boundary));
        }
        measures.over_constrained += u64::from(cut >= 2);
        measures.at_surface += u64::from(cut == 1 && constrained >= 1);
    }
    measures
}

/// Returns whether face `i` is required for ever, not only as a part of the core boundary.
pub(super) fn is_constrained(tet: &Tet, i: usize, core_boundary: &CoreBoundary) -> bool {
    tet.is_required(i) && (tet.neighbor[i].exists() || core_boundary.find(tet.face(i)).is_none())
}

/// Layers counted, at most: two are required.
const LAYERS_MAX: u32 = 3;

/// The least number of tetrahedra, from face to face, between the interface and the first with a vertex out of the refined zone;
/// [`LAYERS_MAX`] stands for more.
///
/// The walk leads through the core and over its boundary into the host. Effects: uses the core's scratch map. `None` if
/// there is no interface.
pub(super) fn layers_least<P: Pages, Q: Pages>(
    host: &mut Mesh<P>,
    core: &mut Mesh<Q>,
    labels: &SideLabels,
    core_boundary: &CoreBoundary,
    surface: &impl CuttingSurface,
) -> Option<u32> {
    core.reset_scratch(dense(core.tet_ids_end()), NONE);
    let mut layer = Vec::new();
    for t in tet_ids(core) {
        let tet = core.tet(t);
        if tet.is_live() && labels.interface_faces(t, &tet).next().is_some() {
            core.set_scratch(dense(t), 1);
            layer.push(t);
        }
    }
    if layer.is_empty() {
        return None;
    }
    // Tetrahedra of the host in the current layer and the one before: a walk never leads farther back.
    let (mut beyond, mut before) = (BTreeSet::new(), BTreeSet::new());
    for n in 1..=LAYERS_MAX {
        check_cancelled();
        let mut next = Vec::new();
        let mut next_beyond = BTreeSet::new();
        for t in layer {
            let tet = core.tet(t);
            if !is_in_zone(core, &tet, surface) {
                return Some(n - 1);
            }
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                if !across.exists() {
                    next_beyond.extend(core_boundary.find(tet.face(i)).map(FaceRef::tet));
                } else if core.scratch(dense(across.tet())) == NONE {
                    core.set_scratch(dense(across.tet()), n + 1);
                    next.push(across.tet());
                }
            }
        }
        for &t in &beyond {
            let tet = host.tet(t);
            if !is_in_zone(host, &tet, surface) {
                return Some(n - 1);
            }
            let onward = tet.neighbor.into_iter().filter(|across| across.exists());
            // Back into the core the walk is shorter.
            for across in onward.map(FaceRef::tet) {
                if !beyond.contains(&across)
                    && !before.contains(&across)
                    && !is_in_core(host, across)
                {
                    next_beyond.insert(across);
                }
            }
        }
        next_beyond.retain(|t| !beyond.contains(t) && !before.contains(t));
        (before, beyond, layer) = (beyond, next_beyond, next);
    }
    Some(LAYERS_MAX)
}

/// Returns whether all vertices of `tet` lie in the refined zone at its narrowest.
fn is_in_zone<P: Pages>(mesh: &mut Mesh<P>, tet: &Tet, surface: &impl CuttingSurface) -> bool {
    tet.vertices().into_iter().all(|v| {
        let (p, h) = mesh.point_and_size(v);
        surface.distance(p).abs() <= super::zone::WIDTH_MIN * f64::from(h)
    })
}

/// Tetrahedra with a face on the interface, and how many of them have their circumsphere within the refined zone.
///
/// The zone is taken at its narrowest, with h as at the center. That is the whole condition if h is uniform. Where h
/// falls towards the zone's limit, a sphere may count that is not wholly within; `frozen_hits` is the proof.
pub(super) fn enclosed<P: Pages>(
    core: &mut Mesh<P>,
    labels: &SideLabels,
    surface: &impl CuttingSurface,
    h: &dyn Fn(Point) -> f64,
) -> (u64, u64) {
    let (mut all, mut within) = (0, 0);
    for t in tet_ids(core) {
        let tet = core.tet(t);
        if !tet.is_live() || labels.interface_faces(t, &tet).next().is_none() {
            continue;
        }
        all += 1;
        let [a, b, c, d] = core.points(&tet);
        let (u, v, w) = (b - a, c - a, d - a);
        let sum = v.cross(w) * u.dot(u) + w.cross(u) * v.dot(v) + u.cross(v) * w.dot(w);
        let to_center = sum / (2.0 * u.cross(v).dot(w));
        let (center, radius) = (a + to_center, to_center.length());
        let size = h(center) * super::zone::WIDTH_MIN;
        within += u64::from(surface.distance(center).abs() + radius * 1.0001 <= size);
    }
    (all, within)
}
