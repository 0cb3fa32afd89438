//! The core of a cut: the tetrahedra at the cutting surface, copied into a mesh of their own.
//!
//! There they are optimized and the interface is chosen, with the same tools as any mesh; the sub-domain around them
//! stays as it is until the two children are written. Where the core was cut out, its faces are required and their vertices
//! fixed.

use super::surface::CuttingSurface;
use crate::geom::Point;
use crate::mesh::anatomy::mark::IN_CORE;
use crate::mesh::anatomy::{MARK, REQUIRED};
use crate::mesh::{FaceRef, Mesh, Tet, VertexTag, dense, sparse};
use crate::store::{Pages, stop_if_requested};
use tetdb_schema::page::NONE;

/// Tetrahedra with a vertex nearer than this, in units of its h, belong to the core: wider than the cutting zone, so that
/// what the interface is chosen from is optimized, narrower than the refined zone, so that all of it is final.
const CORE: f64 = 2.2;
/// In the host's scratch map: the vertex has this number in the core.
pub(super) const SHARED: u32 = 1 << 31;

/// Where a tetrahedron lies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Sides {
    pub low: bool,
    pub high: bool,
}

impl Sides {
    /// Whether vertices lie on both sides.
    pub(super) fn crosses(self) -> bool {
        self.low && self.high
    }
}

/// Sides of the vertices of `tet`, and the least distance in units of h.
pub(super) fn place<P: Pages>(
    mesh: &mut Mesh<P>,
    tet: &Tet,
    surface: &dyn CuttingSurface,
) -> (Sides, f64) {
    let mut sides = Sides {
        low: false,
        high: false,
    };
    let mut least = f64::INFINITY;
    for v in tet.vertices() {
        let (p, h) = mesh.point_and_size(v);
        let s = surface.distance(p);
        if s < 0.0 {
            sides.low = true;
        } else {
            sides.high = true;
        }
        least = least.min(s.abs() / f64::from(h));
    }
    (sides, least)
}

/// A face where the core was cut out.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct RimFace {
    /// Vertices in the core, ascending.
    pub vertices: [u32; 3],
    /// The tetrahedron of the host on the other side.
    pub host: FaceRef,
}

/// Where the core was cut out, ascending by vertices.
#[derive(Default)]
pub(super) struct Rim {
    pub faces: Vec<RimFace>,
}

impl Rim {
    /// The host's face at the core's face with these vertices, if it is one of the rim.
    pub(super) fn find(&self, mut vertices: [u32; 3]) -> Option<FaceRef> {
        vertices.sort_unstable();
        let at = self.faces.binary_search_by_key(&vertices, |f| f.vertices);
        at.ok().map(|at| self.faces[at].host)
    }
}

/// Whether `t` was copied into the core.
pub(super) fn is_in_core(tet: &Tet) -> bool {
    tet.node[IN_CORE] & MARK != 0
}

/// Copies the core of `host` into the empty `core`; tells the rim.
///
/// Effects: marks the host's tetrahedra; its scratch map holds, for each vertex, the number in the core with [`SHARED`] or
/// [`NONE`].
pub(super) fn extract<P: Pages, Q: Pages>(
    host: &mut Mesh<P>,
    core: &mut Mesh<Q>,
    surface: &dyn CuttingSurface,
) -> Rim {
    host.clear_scratch();
    let base = dense(host.vertex_ids_end());
    for n in 0..base {
        host.set_scratch(n, NONE);
    }
    let mut from = 0;
    while let Some((t, tet)) = host.next_tet(from) {
        from = t + 1;
        if t & 1023 == 0 {
            stop_if_requested();
        }
        let (sides, least) = place(host, &tet, surface);
        let inside = sides.crosses() || least <= CORE;
        host.set_mark(t, IN_CORE, inside);
        if inside {
            let copy = copy_tet(host, core, t, &tet);
            host.set_scratch(base + dense(t), copy);
        }
    }
    // The copies still name the host's neighbors.
    let mut rim = Rim::default();
    let mut from = 0;
    while let Some((t, mut tet)) = core.next_tet(from) {
        from = t + 1;
        for i in 0..4 {
            let across = tet.neighbor[i];
            if !across.exists() {
                continue;
            }
            if is_in_core(&host.tet(across.tet())) {
                let other = host.scratch(base + dense(across.tet()));
                tet.neighbor[i] = FaceRef::new(other, across.face());
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
            rim.faces.push(RimFace {
                vertices,
                host: across,
            });
        }
        core.set_tet(t, tet);
    }
    rim.faces.sort_unstable();
    rim
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
    if known != NONE {
        return known & !SHARED;
    }
    let (p, h) = host.point_and_size(v);
    let copy = core.add_vertex(p, h);
    copy_attribute(host, v, core, copy);
    host.set_scratch(dense(v), copy | SHARED);
    copy
}

/// Whether a vertex of the core is fixed only because it lies on the rim.
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
