//! Chosen tetrahedra, of any number, as a VTK file with their vertices once each.
//!
//! How many there are is known at the end only, so they wait in a scratch file; their vertices are numbered by two sorts,
//! as those of whole meshes are.

use std::path::{Path, PathBuf};

use super::draft::Draft;
use super::error::Result;
use super::npy::length;
use super::stream::{Records, Stream, scratch};
use super::vtu::TETRA;
use super::vtu_layout::{Array, Container, Group, Index, Layout};
use tetdb_base::storage::{Payload, Sorted, Sorter, sort_record};

/// Region, sub-domain, quality, number.
const CELL: usize = 4 + 4 + 8 + 8;

/// A tetrahedron to be written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelectedTet {
    /// Its lasting id as a number.
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
    /// A corner of a tetrahedron by its vertex.
    struct Corner {
        vertex: u64,
        /// 4 · tetrahedron + corner.
        place: u64,
        point: Payload<[f64; 3]>,
    }
}

sort_record! {
    /// A corner of a tetrahedron and the dense number of its vertex.
    struct CornerNumber {
        /// 4 · tetrahedron + corner.
        place: u64,
        number: u64,
    }
}

/// Tetrahedra being gathered for one `.vtu` file; nothing has its name until [`SelectedVtu::finish`].
pub struct SelectedVtu {
    draft: Draft,
    out: PathBuf,
    cells: Stream,
    cells_path: PathBuf,
    corners: Sorter<Corner>,
    n: u64,
    memory_bytes: u64,
}

impl SelectedVtu {
    /// Begins `out`, holding about `memory_bytes`. Errors: its folder cannot be written.
    pub fn new(out: &Path, memory_bytes: u64) -> Result<Self> {
        let draft = Draft::new(out)?;
        let cells_path = draft.dir().join("cells");
        Ok(Self {
            cells: scratch(&cells_path)?,
            corners: Sorter::new(draft.dir(), memory_bytes / 2),
            draft,
            out: out.to_owned(),
            cells_path,
            n: 0,
            memory_bytes,
        })
    }

    /// Adds a tetrahedron. Errors: the disk.
    pub fn push(&mut self, tet: &SelectedTet) -> Result<()> {
        for (place, (vertex, corner)) in (0u64..).zip(tet.vertices.iter().zip(tet.corners)) {
            self.corners.push(Corner {
                vertex: *vertex,
                place: 4 * self.n + place,
                point: Payload(corner),
            })?;
        }
        self.n += 1;
        self.cells.bytes(&tet.region.to_le_bytes());
        self.cells.bytes(&tet.subdomain.to_le_bytes());
        self.cells.bytes(&tet.quality.to_le_bytes());
        self.cells.bytes(&tet.id.to_le_bytes());
        self.cells.end()
    }

    /// Writes the file and gives it its name; returns its length. Errors: the disk.
    pub fn finish(mut self) -> Result<u64> {
        self.cells.finish()?;
        let points_path = self.draft.dir().join("points");
        let mut points = scratch(&points_path)?;
        let dir = self.draft.dir().to_owned();
        let mut numbers = Sorter::new(&dir, self.memory_bytes / 2);
        let n_points = number(self.corners.finish()?, &mut points, &mut numbers)?;
        points.finish()?;
        let index = Index::new(n_points, 4 * self.n);
        let arrays = vec![
            Array::new(Group::PointData, "global_id", "Int64"),
            Array::new(Group::CellData, "subdomain", "UInt32"),
            Array::new(Group::CellData, "region", "UInt32"),
            Array::new(Group::CellData, "quality", "Float64"),
            Array::new(Group::CellData, "global_id", "Int64"),
            Array::new(Group::Points, "Points", "Float64").vectors(),
            Array::new(Group::Cells, "connectivity", index.kind()),
            Array::new(Group::Cells, "offsets", index.kind()),
            Array::new(Group::Cells, "types", "UInt8"),
        ];
        let counts = [n_points, self.n, 4];
        let layout = Layout::new(&Container::Xml, &arrays, counts, ("", &[]));
        let path = self.draft.create(&self.out, layout.file_bytes())?;
        let mut strips = layout.open::<9>(&path)?;
        let [vertex_ids, ranks, regions, qualities, ids, places, nodes, ends, types] = &mut strips;
        let mut points = Records::<32>::open(&points_path, 0)?;
        while let Some(record) = points.next()? {
            vertex_ids.put(&record[..8])?;
            places.put(&record[8..])?;
        }
        let mut cells = Records::<CELL>::open(&self.cells_path, 0)?;
        let mut end = 0;
        while let Some(record) = cells.next()? {
            end += 4;
            regions.put(&record[..4])?;
            ranks.put(&record[4..8])?;
            qualities.put(&record[8..16])?;
            ids.put(&record[16..])?;
            index.put(ends, end)?;
            types.put(&[TETRA])?;
        }
        for corner in numbers.finish()? {
            index.put(nodes, corner?.number)?;
        }
        strips.into_iter().try_for_each(super::stream::Strip::finish)?;
        length(self.draft)
    }
}

/// Gives vertices dense numbers by their ids: writes id and position of each once, and (corner, number) of every corner.
fn number(
    corners: Sorted<Corner>,
    points: &mut Stream,
    numbers: &mut Sorter<CornerNumber>,
) -> Result<u64> {
    let mut last = None;
    let mut n = 0u64;
    for corner in corners {
        let Corner { vertex, place, point } = corner?;
        if last != Some(vertex) {
            last = Some(vertex);
            n += 1;
            points.bytes(&vertex.to_le_bytes());
            (point.0.iter()).for_each(|x| points.bytes(&x.to_le_bytes()));
            points.end()?;
        }
        let number = n - 1;
        numbers.push(CornerNumber { place, number })?;
    }
    Ok(n)
}
