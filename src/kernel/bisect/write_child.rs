//! Writes a child: the host's tetrahedra of one side and the core's of that label, joined at the core's boundary.
//!
//! Vertices and tetrahedra get their final numbers before they are written. Vertices are sorted along the curve;
//! tetrahedra are counted, since they follow their first vertex. Each record is then written once, at its place. Input
//! is read in page order, and only the child's tetrahedra of the host are read, by the scratch map.

use super::child_builder::ChildBuilder;
use super::inherit::inherit;
use super::open_cut::OpenCut;
use crate::mesh::{Mesh, Workspace, dense};
use tetdb_base::geom::{Aabb, HilbertFrame};
use tetdb_base::storage::{Pages, StorageError};

/// Writes one side into the empty `child`, numbered along the curve: vertices in the order of their positions, tetrahedra in that of
/// their first vertex, those of the core before others.
///
/// Effects: the core's scratch map is used up; the host's has the child's numbers in place of those from the
/// extraction. Errors: the disk, while sorting.
pub fn write_child<P: Pages, Q: Pages, R: Pages>(
    host: &mut Mesh<P>,
    core: &mut Mesh<Q>,
    child: &mut Mesh<R>,
    open_cut: &OpenCut,
    high: bool,
    bounds: &Aabb,
    space: &Workspace,
) -> Result<(), StorageError> {
    let mut split = ChildBuilder {
        host_base: dense(host.vertex_ids_end()),
        core_base: dense(core.vertex_ids_end()),
        host,
        core,
        child,
        open_cut,
        high,
        tets_at_core: Vec::new(),
    };
    split.add_vertices(&HilbertFrame::new(bounds), space)?;
    split.number_tets();
    split.write_host();
    split.write_core();
    split.new_interface();
    inherit(&mut split, space)
}
