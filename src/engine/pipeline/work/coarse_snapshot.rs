//! Coarse snapshots: the mesh before the fine step of a sub-domain, kept so that the sub-domain can be remeshed.

use crate::pipeline::error::PipelineError;
use tetdb_base::storage::{Backing, DiskPath, Pager, Pages, check_cancelled};
use tetdb_kernel::mesh::{Mesh, Workspace};
use tetdb_schema::catalog::CoarseRow;
use tetdb_store::sealed::SealedError;
use tetdb_store::sealed::{CoarseSnapshot, CoarseWriter};
use tetdb_store::store::StoreError;

/// Coordinates from this magnitude on are refused, as by the readers of surfaces: signs would not be exact.
const COORDINATE_MAX: f64 = 1e30;

/// Writes the working mesh of sub-domain `rank`, whose ids have no gaps, to `path`. Errors: ids with gaps; the disk.
pub fn save<P: Pages>(
    mesh: &mut Mesh<P>,
    path: &DiskPath,
    rank: u32,
    generation: u32,
    memory: u64,
) -> Result<CoarseRow, PipelineError> {
    if !mesh.is_dense() {
        // Cuts leave no gaps.
        return Err(PipelineError::from(SealedError::Content {
            path: path.path().to_owned(),
            subdomain: rank,
            what: "the mesh it begins with has ids without a record".to_owned(),
        }));
    }
    let mut writer = CoarseWriter::create(path, rank, generation, memory as usize)?;
    for n in 0..mesh.n_vertices() {
        writer.push_vertex(mesh.snapshot_vertex(n))?;
    }
    for n in 0..mesh.n_tets() {
        writer.push_tet(mesh.snapshot_tet(n))?;
        if n & 0xffff == 0 {
            check_cancelled();
        }
    }
    for n in 0..mesh.n_facets() {
        writer.push_facet(mesh.snapshot_facet(n))?;
    }
    for n in 0..mesh.n_interface_faces() {
        writer.push_face(mesh.snapshot_face(n))?;
    }
    Ok(writer.finish()?)
}

/// Opens the mesh of a snapshot with the same ids, in the same order.
///
/// Sizes and `tet_of` are not restored; the fine step sets them. Errors: damage; the disk.
pub fn reopen(
    snapshot: &mut CoarseSnapshot,
    backing: Backing,
    frames: u64,
    space: &Workspace,
) -> Result<Mesh, PipelineError> {
    let (rank, path) = (snapshot.row().rank, snapshot.path().to_owned());
    let damaged = |what: &str| {
        StoreError::Sealed(SealedError::Content {
            path: path.clone(),
            subdomain: rank,
            what: format!("its coarse snapshot has {what}"),
        })
    };
    let mut mesh = Mesh::new(Pager::new(frames, Some(backing)));
    for chunk in snapshot.vertices() {
        for vertex in &chunk?.records {
            if !vertex.point.into_iter().all(|x| x.abs() < COORDINATE_MAX) {
                return Err(damaged("a vertex without a place").into());
            }
            mesh.add_snapshot_vertex(vertex);
        }
    }
    for chunk in snapshot.tets() {
        for tet in &chunk?.records {
            if !mesh.add_snapshot_tet(tet) {
                return Err(damaged("a tetrahedron without its vertices").into());
            }
        }
    }
    let n_vertices = mesh.n_vertices();
    let is_here = |v: &[u32; 3]| v.iter().all(|&v| v < n_vertices);
    for chunk in snapshot.facets() {
        for facet in chunk?.records.iter() {
            if !is_here(&facet.vertices) {
                return Err(damaged("a facet without its vertices").into());
            }
            mesh.add_snapshot_facet(facet);
        }
    }
    for chunk in snapshot.faces() {
        for face in chunk?.records.iter() {
            if !is_here(&face.vertices) {
                return Err(damaged("an interface face without its vertices").into());
            }
            mesh.add_snapshot_face(face);
        }
    }
    match mesh.match_neighbors(space)? {
        true => Ok(mesh),
        false => Err(damaged("tetrahedra that overlap or are flat").into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::{Aabb, HilbertFrame, Point};
    use tetdb_kernel::delaunay::{Kernel, enclose};
    use tetdb_kernel::mesh::{FaceRef, MeshFacet, MeshInterfaceFace, VertexTag, renumber};
    use tetdb_schema::record::{CoarseTet, CoarseVertex};

    /// A random Delaunay mesh numbered along the curve, with tags, regions, flags, required faces and faces of both kinds.
    fn made(space: &Workspace) -> Mesh {
        let mut mesh = Mesh::new(Pager::new(1 << 26, None));
        let bounds = Aabb::around([Point::ZERO, Point::ONE]);
        let mut hint = enclose(&mut mesh, &bounds);
        let mut kernel = Kernel::default();
        for i in 0..5000u32 {
            let f = |k: u32| {
                f64::from(i.wrapping_mul(2_654_435_761).wrapping_mul(k) >> 8) / f64::from(1 << 24)
            };
            let p = Point::new(f(1), f(3), f(7));
            let v = mesh.add_vertex(p, 1.0);
            match i % 5 {
                0 => mesh.set_vertex_attribute(v, VertexTag::Surface, i),
                1 => mesh.set_interface_vertex(v, 1 + i % 3, i),
                _ => {}
            }
            hint = kernel.insert(&mut mesh, v, p, hint).unwrap_or(hint);
            mesh.set_tet_attribute(hint, 1 + i % 3, i & 1);
            if i % 7 == 0 {
                mesh.set_required(FaceRef::new(hint, 2), true);
                mesh.set_mark(hint, 1, true);
            }
        }
        for i in 0..300 {
            let vertices = [i, i + 1, i + 2];
            mesh.add_facet(MeshFacet {
                vertices,
                label: i % 4,
                input: u64::from(i) << 30,
                regions: [1, 0],
            });
            mesh.add_interface_face(MeshInterfaceFace {
                vertices,
                cut: 2,
                index: 3 * i,
                side: i & 1,
            });
        }
        renumber(&mut mesh, &HilbertFrame::new(&bounds), space).expect("room for runs");
        mesh
    }

    #[test]
    fn a_kept_mesh_comes_back_with_its_ids() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let scratch = DiskPath::from(dir.path());
        let space = Workspace { dir: &scratch, memory: 1 << 20 };
        let mut mesh = made(&space);
        let path = scratch.join("coarse.redb");
        let row = save(&mut mesh, &path, 3, 7, 1 << 20).expect("space for the snapshot");
        assert_eq!((row.tets, row.rank), (u64::from(mesh.n_tets()), 3));
        let mut snapshot = CoarseSnapshot::open(&path, row, 1 << 20).expect("just written");
        for frames in [1 << 26, 16 << 16] {
            let backing = Backing {
                subdomain: 3,
                generation: 8,
                spill: scratch.clone(),
                output: None,
                base: None,
                cache_bytes: 1 << 20,
            };
            let mut again = reopen(&mut snapshot, backing, frames, &space).expect("no damage");
            assert_eq!(again.state().to_words(), mesh.state().to_words());
            let mut from = 0;
            while let Some((t, tet)) = mesh.next_tet(from) {
                from = t + 1;
                assert_eq!(again.tet(t), tet);
                assert_eq!(again.tet_attribute(t), mesh.tet_attribute(t));
            }
            for v in mesh.vertex_ids() {
                assert_eq!(again.point(v), mesh.point(v));
                assert_eq!(again.vertex_attribute(v), mesh.vertex_attribute(v));
                assert_eq!(again.interface_vertex(v), mesh.interface_vertex(v));
                assert_eq!(again.is_fixed(v), mesh.is_fixed(v));
            }
            for n in 0..mesh.n_facets() {
                assert_eq!(again.facet(n), mesh.facet(n));
                assert_eq!(again.interface_face(n), mesh.interface_face(n));
            }
        }
    }

    /// A forged snapshot can have correct checksums: flips must not run on tetrahedra that are no mesh.
    #[test]
    fn tetrahedra_that_are_no_mesh_are_damage() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let scratch = DiskPath::from(dir.path());
        let space = Workspace { dir: &scratch, memory: 1 << 20 };
        let opened = |name: &str, points: [[f64; 3]; 5], tets: &[[u32; 4]]| {
            let path = scratch.join(name);
            let writer = CoarseWriter::create(&path, 0, 1, 1 << 20);
            let mut writer = writer.expect("space for the snapshot");
            let (tag, owner) = (0, 0);
            for point in points {
                let vertex = CoarseVertex { point, tag, owner };
                writer.push_vertex(vertex).expect("space for the snapshot");
            }
            for &nodes in tets {
                let tet = CoarseTet { nodes, bits: 0, region: 1, flags: 0 };
                writer.push_tet(tet).expect("space for the snapshot");
            }
            let row = writer.finish().expect("space for the snapshot");
            let mut snapshot = CoarseSnapshot::open(&path, row, 1 << 20).expect("just written");
            let backing = Backing {
                subdomain: 0,
                generation: 2,
                spill: scratch.clone(),
                output: None,
                base: None,
                cache_bytes: 1 << 20,
            };
            reopen(&mut snapshot, backing, 1 << 20, &space).map(|mesh| mesh.n_tets())
        };
        // One on either side of the triangle 0 1 2.
        let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0.2, 0.2, -1.]];
        let (above, below) = ([0, 1, 2, 3], [0, 2, 1, 4]);
        let sound = opened("sound", points, &[above, below]);
        assert_eq!(sound.expect("a mesh"), 2);
        let mut far = points;
        far[4][0] = f64::NAN;
        let mut same_side = points;
        same_side[4][2] = 2.0;
        let bad: [(&str, _, &[[u32; 4]]); 5] = [
            ("no place", far, &[above, below]),
            ("negative", points, &[above, [0, 1, 2, 4]]),
            ("flat", points, &[above, [0, 1, 2, 2]]),
            ("same side", same_side, &[above, [0, 1, 2, 4]]),
            ("thrice", points, &[above, below, below]),
        ];
        for (name, points, tets) in bad {
            let error = opened(name, points, tets).expect_err(name);
            let is_damage = matches!(
                error,
                PipelineError::Store(StoreError::Sealed(SealedError::Content { .. }))
            );
            assert!(is_damage, "{name}: {error}");
        }
    }
}
