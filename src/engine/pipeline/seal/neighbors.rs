//! Neighbors of renumbered tetrahedra: faces are sorted by vertices and matched, and the matches are sorted by tetrahedron.

use tetdb_schema::page::NONE;

use super::records::{NeighborLink, SortedTetFace, TetRecord};
use super::target::SealTarget;
use crate::pipeline::error::PipelineError;
use tetdb_base::storage::{Sorted, Sorter, StorageError, check_cancelled};
use tetdb_kernel::mesh::anatomy::FACES;
use tetdb_store::sealed::sorted_face;

/// Stream of the four neighbors of each tetrahedron, in order.
pub struct Neighbors {
    /// A link for every face with a tetrahedron on its other side.
    links: std::iter::Peekable<Sorted<NeighborLink>>,
    tet: u32,
}

impl Neighbors {
    /// Finds the neighbors of tetrahedra in their new order. Errors: the disk.
    pub fn of(
        order: impl Iterator<Item = Result<TetRecord, StorageError>>,
        target: &SealTarget,
    ) -> Result<Self, PipelineError> {
        let memory = target.memory / 4;
        let mut faces = Sorter::new(target.scratch, memory);
        for (t, record) in order.enumerate() {
            let nodes = record?.nodes;
            for (i, corners) in FACES.into_iter().enumerate() {
                let (vertices, _) = sorted_face(corners.map(|k| nodes[k]));
                let place = (t as u32) << 2 | i as u32;
                faces.push(SortedTetFace { vertices, place })?;
            }
            if t & 0xffff == 0 {
                check_cancelled();
            }
        }
        let mut links = Sorter::new(target.scratch, memory);
        let mut open = None::<SortedTetFace>;
        for face in faces.finish()? {
            let face = face?;
            match open.take() {
                Some(before) if before.vertices == face.vertices => {
                    let [from, to] = [before.place, face.place];
                    links.push(NeighborLink { from, to })?;
                    links.push(NeighborLink { from: to, to: from })?;
                }
                _ => open = Some(face),
            }
        }
        Ok(Self { links: links.finish()?.peekable(), tet: 0 })
    }

    /// Returns the neighbors of the next tetrahedron. Errors: the disk.
    pub fn next(&mut self) -> Result<[u32; 4], PipelineError> {
        let mut four = [NONE; 4];
        let tet = self.tet;
        let is_here = |link: &Result<NeighborLink, _>| match link {
            Ok(link) => link.from >> 2 == tet,
            Err(_) => true,
        };
        while let Some(link) = self.links.next_if(is_here) {
            let link = link?;
            four[(link.from & 3) as usize] = link.to;
        }
        self.tet += 1;
        Ok(four)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::mesh;
    use crate::pipeline::plan::{MeshOptions, Options, RunOptions, Subdomains, Trial};
    use tetdb_base::storage::{Backing, Budget, Pager, StoreFile};
    use tetdb_kernel::mesh::{FaceRef, Mesh, MeshState, dense, sparse};
    use tetdb_kernel::samples::SampleSpec;
    use tetdb_schema::catalog::Job;
    use tetdb_store::sealed::Form;
    use tetdb_store::store::Catalog;

    /// A sub-domain stored as pages opens as a working mesh.
    #[test]
    fn kept_pages_open_as_a_working_mesh() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        let surface = SampleSpec::parse("box,h=0.12")?.make()?.into();
        let (subdomains, seal) = (Subdomains::Exactly(2), Form::Pages);
        let trial = Trial { subdomains_small: true, plan: None };
        let options = Options {
            mesh: MeshOptions { subdomains, seal, ..MeshOptions::default() },
            run: RunOptions { trial, ..RunOptions::default() },
        };
        let mut catalog = Catalog::create(dir.path().join("a.tetdb"), &Job::default())?;
        let budget = Budget::new(256 << 20);
        mesh(&mut catalog, &surface, &options, &budget, &|_| {})?;
        for row in catalog.subdomains()? {
            assert_eq!(Form::from_state(row.state), Some(Form::Pages));
            let path = catalog.file_path(row.rank, row.generation);
            let backing = Backing {
                subdomain: row.rank,
                generation: row.generation + 1,
                spill: dir.path().into(),
                output: None,
                base: Some(StoreFile::open_repaired(&path, 1 << 20, false)?),
                cache_bytes: 1 << 20,
            };
            let mut pager = Pager::new(1 << 24, Some(backing));
            let [tets, vertices, facets, faces, ..] = row.chunks;
            let beside = |pages: u32| pages.div_ceil(4);
            let extents = [tets, beside(tets), vertices, beside(vertices), facets, faces, 0];
            pager.adopt(extents.map(|n| [0, n]));
            let counts = [row.tets, row.vertices, row.facets, row.interface_faces];
            let words: Vec<u32> =
                (counts.iter()).flat_map(|&n| [sparse(n as u32), NONE, n as u32]).collect();
            let state = MeshState::from_words(words.try_into().expect("four arenas"));
            let mut mesh = Mesh::with_state(pager, state);

            let (mut open, mut required, mut from, mut n) = (0, 0, 0, 0);
            while let Some((t, tet)) = mesh.next_tet(from) {
                from = t + 1;
                n += 1;
                let points = mesh.points(&tet);
                assert!(tetdb_base::geom::orient(points[0], points[1], points[2], points[3]) > 0.0);
                assert_eq!(mesh.tet_attribute(t).0, 1);
                for i in 0..4 {
                    required += u64::from(tet.is_required(i));
                    let face = tet.neighbor[i];
                    if !face.exists() {
                        assert!(tet.is_required(i), "an open face that nothing asks for");
                        open += 1;
                        continue;
                    }
                    let other = mesh.tet(face.tet());
                    assert_eq!(other.neighbor[face.face()], FaceRef::new(t, i));
                    let [mut a, mut b] = [tet.face(i), other.face(face.face())];
                    a.sort_unstable();
                    b.sort_unstable();
                    assert_eq!(a, b);
                }
            }
            assert_eq!(n, row.tets);
            assert_eq!(open, row.facets + row.interface_faces);
            assert_eq!(required, open);
            let fixed = (mesh.vertex_ids()).filter(|&v| mesh.is_fixed(v)).count();
            assert!(fixed > 0 && fixed < dense(mesh.vertex_ids_end()) as usize);
        }
        Ok(())
    }
}
