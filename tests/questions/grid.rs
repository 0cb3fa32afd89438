//! A store of cubes cut into six tetrahedra each, in slabs. Coordinates are integers, so that many elements touch.

use std::collections::BTreeMap;
use std::path::Path;

use tetdb_schema::ids::{Owner, SubdomainId, VertexId};
use tetdb_schema::record::{
    FACES, InterfaceFace, NO_TET, SealedFacet, SealedTet, SealedVertex, tag,
};

use tetdb_schema::catalog::{InterfaceRow, Job, StoreState};
use tetdb_store::sealed::{Sealed, SealedWriter};
use tetdb_store::store::{Catalog, StoreError};

/// Axes in all orders, even ones first.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

type GridPlace = [usize; 3];

/// A grid of `cells` cubes along each axis, in `parts` slabs along x. `parts` must divide `cells`.
pub(super) struct Grid {
    pub cells: usize,
    pub parts: usize,
}

impl Grid {
    pub fn write(&self, path: &Path) -> Result<(), StoreError> {
        let mut catalog = Catalog::create(path, &Job::default())?;
        let mut sealed = Vec::new();
        for rank in 0..self.parts {
            sealed.push(self.part(&catalog, rank)?);
        }
        let interfaces: Vec<InterfaceRow> = sealed
            .iter()
            .enumerate()
            .flat_map(|(rank, part)| part.interfaces.iter().map(move |side| (rank, side)))
            .filter(|(rank, side)| side.other as usize > *rank)
            .map(|(rank, side)| InterfaceRow {
                cut: side.cut,
                low: rank as u32,
                high: side.other,
                faces: side.faces,
                digest: side.digest.lanes,
            })
            .collect();
        catalog.commit(|step| {
            for part in &sealed {
                step.list_file(part.row.rank, 1);
                step.set_subdomain(&part.row);
            }
            for row in &interfaces {
                step.set_interfaces(row.cut, &vec![*row]);
            }
            step.set_labels(&["x0", "y0", "z0", "x1", "y1", "z1"].map(str::to_owned).to_vec());
            step.set_state(StoreState::Sealed);
            Ok(())
        })?;
        catalog.close()
    }

    fn slab(&self) -> usize {
        self.cells / self.parts
    }

    /// The planes x = multiple of a slab's width, inside the grid, are the cuts 1, 2, …
    fn cut_of(&self, x: usize) -> Option<u32> {
        (x.is_multiple_of(self.slab()) && x > 0 && x < self.cells).then(|| (x / self.slab()) as u32)
    }

    fn vertex(&self, rank: usize, local: u32, at: GridPlace) -> SealedVertex {
        let index = ((at[0] * (self.cells + 1) + at[1]) * (self.cells + 1) + at[2]) as u32;
        let is_outer = at.iter().any(|&c| c == 0 || c == self.cells);
        let id = SubdomainId::new(rank as u32).expect("few parts");
        let (owner, index, tag) = match self.cut_of(at[0]) {
            _ if is_outer => (Owner::Surface, index, tag::SURFACE),
            Some(cut) => (Owner::Cut(cut), index, tag::INTERFACE),
            None => (Owner::Subdomain(id), local, tag::FREE),
        };
        SealedVertex {
            point: at.map(|c| c as f64),
            h: 1.0,
            tag,
            id: VertexId { owner, index }.number(),
        }
    }

    fn part(&self, catalog: &Catalog, rank: usize) -> Result<Sealed, StoreError> {
        let id = SubdomainId::new(rank as u32).expect("few parts");
        let file = catalog.file_path(rank as u32, 1);
        let mut writer = SealedWriter::create(&file, id, 1, 4 << 20)?;
        let (x0, n) = (rank * self.slab(), self.cells);
        let mut numbers: BTreeMap<GridPlace, u32> = BTreeMap::new();
        for x in x0..=x0 + self.slab() {
            for (y, z) in (0..=n).flat_map(|y| (0..=n).map(move |z| (y, z))) {
                let local = numbers.len() as u32;
                numbers.insert([x, y, z], local);
                writer.push_vertex(self.vertex(rank, local, [x, y, z]))?;
            }
        }
        let mut tets: Vec<([GridPlace; 4], SealedTet)> = self
            .cells_of(x0)
            .flat_map(|cell| ORDERS.iter().enumerate().map(move |(i, o)| corners(cell, *o, i > 2)))
            .map(|places| {
                let tet = SealedTet {
                    nodes: places.map(|p| numbers[&p]),
                    region: 1 + (places[0][1] * 2 / n) as u32,
                };
                (places, tet.rotated())
            })
            .collect();
        tets.sort_by_key(|(_, tet)| tet.nodes);
        writer.push_all_tets(tets.iter().map(|(_, tet)| (tet.nodes, tet.region)))?;
        let places: Vec<GridPlace> = numbers.keys().copied().collect();
        self.faces(&mut writer, rank, &places, &tets)?;
        Ok(writer.finish()?)
    }

    fn cells_of(&self, x0: usize) -> impl Iterator<Item = GridPlace> + use<> {
        let n = self.cells;
        (x0..x0 + self.slab())
            .flat_map(move |x| (0..n).flat_map(move |y| (0..n).map(move |z| [x, y, z])))
    }

    /// Faces on the sides are facets. Faces on cuts are interface faces, numbered by position.
    fn faces(
        &self,
        writer: &mut SealedWriter,
        rank: usize,
        places: &[GridPlace],
        tets: &[([GridPlace; 4], SealedTet)],
    ) -> Result<(), StoreError> {
        let mut interface = Vec::new();
        for (number, (_, tet)) in (0u32..).zip(tets) {
            for face in FACES {
                let vertices = face.map(|i| tet.nodes[i]);
                let at = vertices.map(|v| places[v as usize]);
                let on = |axis: usize, c: usize| at.iter().all(|p| p[axis] == c);
                let label = (0..6).find(|&l| on(l % 3, if l < 3 { 0 } else { self.cells }));
                let cut = self.cut_of(at[0][0]).filter(|_| on(0, at[0][0]));
                if let Some(label) = label {
                    writer.push_facet(SealedFacet {
                        vertices,
                        label: label as u32,
                        triangle: u64::from(number),
                        regions: [0, tet.region],
                        tets: [NO_TET, number],
                    })?;
                } else if let Some(cut) = cut {
                    let low = at[0][0] == rank * self.slab();
                    let other = if low { rank - 1 } else { rank + 1 } as u32;
                    let mut key = at;
                    key.sort_unstable();
                    interface.push((key, vertices, cut, other, number));
                }
            }
        }
        interface.sort_unstable();
        for (index, (_, vertices, cut, other, tet)) in (0u32..).zip(interface) {
            writer.push_interface_face(InterfaceFace { vertices, cut, index, other, tet })?;
        }
        Ok(())
    }
}

/// Corners from a cell's low corner to its high one, along the axes in this order. Two are exchanged if the order is odd.
fn corners(cell: GridPlace, order: [usize; 3], odd: bool) -> [GridPlace; 4] {
    let mut corners = [cell; 4];
    for i in 1..4 {
        corners[i] = corners[i - 1];
        corners[i][order[i - 1]] += 1;
    }
    if odd {
        corners.swap(1, 2);
    }
    corners
}
