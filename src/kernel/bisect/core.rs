//! The core of a cut: the tetrahedra at the cutting surface, copied into a mesh of their own.
//!
//! There they are optimized and the interface is chosen, with the same tools as any mesh; the sub-domain around them
//! stays as it is until the two children are written. Where the core was cut out, its faces are required and their vertices
//! fixed.

use super::surface::CuttingSurface;
use crate::mesh::anatomy::REQUIRED;
use crate::mesh::{FaceRef, Mesh, Tet, VertexTag, dense, next_id, sparse};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Pages, check_cancelled};
use tetdb_schema::page::NONE;

/// Tetrahedra with a vertex nearer than this, in units of its h, belong to the core. It is wider than the cutting zone,
/// so that all candidates for the interface are optimized, and narrower than the refined zone, so that all of it is
/// final.
const CORE: f64 = 2.2;
/// In the host's scratch map, at a vertex: it has this number in the core.
pub(super) const SHARED: u32 = 1 << 31;

/// The host's scratch map from the extraction of the core to the end of the split, after one word per vertex: the new
/// place of each tetrahedron in the two highest bits, with a number.
pub(super) mod placement {
    use tetdb_schema::page::NONE;

    /// On neither side and not in the core: the id is not in use.
    pub(in super::super) const UNUSED: u32 = NONE;
    /// In the core, with its id there.
    pub(in super::super) const IN_CORE: u32 = 1 << 30;
    /// Left on the high side; without a bit: on the low one.
    pub(in super::super) const HIGH: u32 = 1 << 31;
    /// The bits.
    pub(in super::super) const BITS: u32 = IN_CORE | HIGH;
}

/// Sides of the plane on which a tetrahedron has vertices.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Sides {
    pub low: bool,
    pub high: bool,
}

impl Sides {
    /// Returns whether vertices lie on both sides.
    pub fn crosses(self) -> bool {
        self.low && self.high
    }
}

/// Sides of the vertices of `tet`, and the least distance in units of h.
#[inline]
pub(super) fn sides_and_distance<P: Pages>(
    mesh: &mut Mesh<P>,
    tet: &Tet,
    surface: &impl CuttingSurface,
) -> (Sides, f64) {
    let mut sides = Sides { low: false, high: false };
    let mut least = f64::INFINITY;
    for end in mesh.ends(tet) {
        let s = surface.distance(end.point);
        sides.low |= s < 0.0;
        sides.high |= s >= 0.0;
        least = least.min(s.abs() / f64::from(end.h));
    }
    (sides, least)
}

/// A face where the core was cut out.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct BoundaryFace {
    /// Vertices in the core, ascending.
    pub vertices: [u32; 3],
    /// The tetrahedron of the host on the other side.
    pub host: FaceRef,
}

/// Boundary of the core, ascending by vertices.
#[derive(Default)]
pub(super) struct CoreBoundary {
    pub faces: Vec<BoundaryFace>,
}

impl CoreBoundary {
    /// The host's face at the core's face with these vertices, if it is one of the core boundary.
    pub fn find(&self, mut vertices: [u32; 3]) -> Option<FaceRef> {
        vertices.sort_unstable();
        let at = self.faces.binary_search_by_key(&vertices, |f| f.vertices);
        at.ok().map(|at| self.faces[at].host)
    }
}

/// Returns whether `t` was copied into the core, by the scratch map of [`extract`].
pub(super) fn is_in_core<P: Pages>(host: &mut Mesh<P>, t: u32) -> bool {
    let base = dense(host.vertex_ids_end());
    host.scratch(base + dense(t)) & placement::BITS == placement::IN_CORE
}

/// Copies the core of `host` into the empty `core`; returns its boundary.
///
/// Effects: the host's scratch map has for each vertex its number in the core with [`SHARED`]; for others the order in
/// which they were met in tetrahedra outside the core, or [`NONE`]. After that it has the [`placement`] of each
/// tetrahedron.
pub(super) fn extract<P: Pages, Q: Pages>(
    host: &mut Mesh<P>,
    core: &mut Mesh<Q>,
    surface: &impl CuttingSurface,
) -> CoreBoundary {
    let base = dense(host.vertex_ids_end());
    host.reset_scratch(base, NONE);
    let (mut at, mut met) = (base, 0);
    let mut t = 0;
    while t < host.tet_ids_end() {
        if t & 1023 == 0 {
            check_cancelled();
        }
        let tet = host.tet(t);
        let word = if tet.is_live() {
            let (sides, least) = sides_and_distance(host, &tet, surface);
            if sides.crosses() || least <= CORE {
                placement::IN_CORE | copy_tet(host, core, t, &tet)
            } else {
                for v in tet.vertices() {
                    if host.scratch(dense(v)) == NONE {
                        host.set_scratch(dense(v), met);
                        met += 1;
                    }
                }
                if sides.high { placement::HIGH } else { 0 }
            }
        } else {
            placement::UNUSED
        };
        host.set_scratch(at, word);
        at += 1;
        t = next_id(t);
    }
    // The copies still name the host's neighbors.
    let mut core_boundary = CoreBoundary::default();
    let mut from = 0;
    while let Some((t, mut tet)) = core.next_tet(from) {
        from = t + 1;
        for i in 0..4 {
            let across = tet.neighbor[i];
            if !across.exists() {
                continue;
            }
            let word = host.scratch(base + dense(across.tet()));
            if word & placement::BITS == placement::IN_CORE {
                tet.neighbor[i] = FaceRef::new(word & !placement::BITS, across.face());
                continue;
            }
            tet.neighbor[i] = FaceRef::NONE;
            tet.node[i] |= REQUIRED;
            let mut vertices = tet.face(i);
            for v in vertices {
                if !core.is_fixed(v) {
                    core.set_interface_vertex(v, 0, 0);
                }
            }
            vertices.sort_unstable();
            core_boundary.faces.push(BoundaryFace { vertices, host: across });
        }
        core.set_tet(t, tet);
    }
    core_boundary.faces.sort_unstable();
    core_boundary
}

fn copy_tet<P: Pages, Q: Pages>(host: &mut Mesh<P>, core: &mut Mesh<Q>, t: u32, tet: &Tet) -> u32 {
    let mut copy = *tet;
    for i in 0..4 {
        let v = copy_vertex(host, core, tet.vertex(i));
        copy.node[i] = v | tet.node[i] & REQUIRED;
    }
    let number = core.take_tet();
    core.set_tet(number, copy);
    let (region, _) = host.tet_attribute(t);
    core.set_tet_attribute(number, region, 0);
    number
}

fn copy_vertex<P: Pages, Q: Pages>(host: &mut Mesh<P>, core: &mut Mesh<Q>, v: u32) -> u32 {
    let known = host.scratch(dense(v));
    if known != NONE && known & SHARED != 0 {
        return known & !SHARED;
    }
    let (p, h) = host.point_and_size(v);
    let copy = core.add_vertex(p, h);
    copy_attribute(host, v, core, copy);
    host.set_scratch(dense(v), copy | SHARED);
    copy
}

/// Returns whether a vertex of the core is fixed only because it lies on the core boundary.
pub(super) fn is_held<P: Pages>(core: &mut Mesh<P>, v: u32) -> bool {
    core.vertex_attribute(v).0 == VertexTag::Interface && core.interface_vertex(v).0 == 0
}

/// Gives `to` the tag of `v`, as far as it has one.
pub(super) fn copy_attribute<P: Pages, Q: Pages>(
    from: &mut Mesh<P>,
    v: u32,
    into: &mut Mesh<Q>,
    to: u32,
) {
    match from.vertex_attribute(v) {
        (VertexTag::Free, _) => {}
        (VertexTag::Interface, _) => {
            let (cut, index) = from.interface_vertex(v);
            into.set_interface_vertex(to, cut, index);
        }
        (tag, owner) => into.set_vertex_attribute(to, tag, owner),
    }
}

/// Centroid of `tet`.
pub(super) fn middle<P: Pages>(mesh: &mut Mesh<P>, tet: &Tet) -> Point {
    let [a, b, c, d] = mesh.points(tet);
    (a + b + c + d) * 0.25
}

/// Ids of all tetrahedra that may be in use, in order.
pub(super) fn tet_ids<P: Pages>(mesh: &Mesh<P>) -> impl Iterator<Item = u32> + use<P> {
    (0..dense(mesh.tet_ids_end())).map(sparse)
}
