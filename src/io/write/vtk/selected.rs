//! Selected tetrahedra as a VTK file, with their vertices once each.
//!
//! Their number is known at the end only, so they wait in a scratch file; their vertices are numbered by two sorts.

use std::path::{Path, PathBuf};

use super::grid::{Container, VtkGrid};
use crate::write::columns::column;
use crate::write::error::Result;
use crate::write::numbering::CornerSorter;
use crate::write::output_files::OutputFiles;
use crate::write::stream::{RecordReader, Stream, scratch};
use tetdb_base::storage::{Payload, sort_record};

/// A tetrahedron to be written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelectedTet {
    /// Lasting id as a number.
    pub id: u64,
    /// Rank of its sub-domain.
    pub subdomain: u32,
    /// Number of its region.
    pub region: u32,
    /// Its quality q.
    pub quality: f64,
    /// Lasting ids of its vertices; positive volume in this order.
    pub vertices: [u64; 4],
    /// Positions of its vertices, parallel to `vertices`.
    pub corners: [[f64; 3]; 4],
}

sort_record! {
    /// A tetrahedron in the scratch file.
    struct TetRow {
        subdomain: u32,
        region: u32,
        quality: Payload<f64>,
        id: u64,
    }
}

sort_record! {
    /// A vertex in the scratch file.
    struct VertexRow {
        id: u64,
        position: Payload<[f64; 3]>,
    }
}

/// Tetrahedra being gathered for one `.vtu` file; nothing has its name until [`SelectedVtu::finish`].
pub struct SelectedVtu {
    outputs: OutputFiles,
    out: PathBuf,
    tets: Stream,
    tets_path: PathBuf,
    corners: CornerSorter,
    n: u64,
}

impl SelectedVtu {
    /// Begins `out`, holding about `memory_bytes`. Errors: its folder cannot be written.
    pub fn new(out: &Path, memory_bytes: u64) -> Result<Self> {
        let outputs = OutputFiles::new(out)?;
        let tets_path = outputs.dir().join("cells");
        Ok(Self {
            tets: scratch(&tets_path)?,
            corners: CornerSorter::new(outputs.dir(), memory_bytes / 2),
            outputs,
            out: out.to_owned(),
            tets_path,
            n: 0,
        })
    }

    /// Adds a tetrahedron. Errors: the disk.
    pub fn push(&mut self, tet: &SelectedTet) -> Result<()> {
        for (vertex, corner) in tet.vertices.into_iter().zip(tet.corners) {
            self.corners.push(vertex, corner)?;
        }
        self.n += 1;
        let &SelectedTet { id, subdomain, region, quality, .. } = tet;
        let row = TetRow { subdomain, region, quality: Payload(quality), id };
        self.tets.record(&row)
    }

    /// Writes the file and gives it its name; returns its length. Errors: the disk.
    pub fn finish(mut self) -> Result<u64> {
        self.tets.finish()?;
        let vertices_path = self.outputs.dir().join("points");
        let mut vertices = scratch(&vertices_path)?;
        let (n_vertices, mut nodes) = self.corners.finish(|id, position| {
            vertices.record(&VertexRow { id, position: Payload(position) })
        })?;
        vertices.finish()?;
        let vertex_columns = vec![column("global_id", |vertex: &VertexRow| vertex.id as i64)];
        let tet_columns = vec![
            column("subdomain", |tet: &TetRow| tet.subdomain),
            column("region", |tet: &TetRow| tet.region),
            column("quality", |tet: &TetRow| tet.quality.0),
            column("global_id", |tet: &TetRow| tet.id as i64),
        ];
        let counts = [n_vertices, self.n, 4];
        let grid = VtkGrid::new(&Container::Xml, counts, ("", &[]), vertex_columns, tet_columns);
        let path = self.outputs.create(&self.out, grid.file_bytes())?;
        let mut file = grid.open(&path)?;
        RecordReader::open(&vertices_path, 0)?
            .each(|vertex: &VertexRow| file.point(vertex, vertex.position.0))?;
        RecordReader::open(&self.tets_path, 0)?
            .each(|tet: &TetRow| file.cell(tet, nodes.by_ref().take(4)))?;
        file.finish()?;
        self.outputs.publish_one()
    }
}
