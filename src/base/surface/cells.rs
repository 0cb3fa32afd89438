//! The boundary of a mesh of volume cells as a surface: faces of one cell, and faces between two regions.
//!
//! Faces are matched by the positions of their corners, so cells with vertices of their own at the same places are neighbors. Each
//! volume of cells that hang together by faces, and are of one region, has a point returned.
//! Is not: a check of the cells; what their boundary does not close, validation reports.

use std::collections::HashMap;

use super::{SurfaceBuilder, SurfaceError};
use crate::geom::Point;
use crate::sort_record;
use crate::storage::{OrRaise, ScratchSpace, Sorter, SpillVec, check_cancelled};

/// Faces of each kind of cell, by its number of corners: counter-clockwise seen from outside, corners numbered as in VTK.
const TETRAHEDRON: &[&[usize]] = &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]];
const PYRAMID: &[&[usize]] = &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];
const PRISM: &[&[usize]] = &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
const HEXAHEDRON: &[&[usize]] =
    &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];

/// No corner: the fourth of a triangle.
const NONE: u32 = u32::MAX;

sort_record! {
    /// A face of a cell.
    struct VolumeFace {
        /// Vertices of the surface, ascending.
        key: [u32; 4],
        /// The cell, in the order given.
        cell: u32,
        /// Its region.
        region: u32,
        /// Vertices of the file, counter-clockwise seen from outside.
        corners: [u32; 4],
        /// A corner of the cell that is not on the face.
        apex: u32,
    }
}

/// Collects cells of a file and adds their boundary to the surface being built.
///
/// Memory: a quarter of that of `space` for sorting and 4 bytes for each cell, which spill to its folder.
pub struct CellBoundary {
    space: ScratchSpace,
    faces: Sorter<VolumeFace>,
    regions: Vec<String>,
    region_ids: HashMap<String, u32>,
    n_cells: u32,
}

impl CellBoundary {
    /// No cells yet.
    pub fn new(space: &ScratchSpace) -> Self {
        Self {
            space: space.clone(),
            faces: space.sorter(),
            regions: Vec::new(),
            region_ids: HashMap::new(),
            n_cells: 0,
        }
    }

    /// Number of cells so far.
    pub fn n_cells(&self) -> u32 {
        self.n_cells
    }

    /// The id of the region `name`; an empty name is that of cells without one.
    pub fn region(&mut self, name: &str) -> u32 {
        if let Some(&id) = self.region_ids.get(name) {
            return id;
        }
        let id = self.regions.len() as u32;
        self.regions.push(name.to_owned());
        self.region_ids.insert(name.to_owned(), id);
        id
    }

    /// Adds a cell of 4, 5, 6 or 8 vertices of the file, which `builder` has. Repeated corners collapse its faces.
    ///
    /// # Errors
    /// A vertex that is not there yet; 2^32 cells. Unwinds where the disk fails.
    pub fn cell(
        &mut self,
        builder: &SurfaceBuilder,
        corners: &[u32],
        region: u32,
    ) -> Result<(), SurfaceError> {
        let faces = match corners.len() {
            4 => TETRAHEDRON,
            5 => PYRAMID,
            6 => PRISM,
            8 => HEXAHEDRON,
            n => unreachable!("no cell has {n} corners"),
        };
        let cell = self.n_cells;
        if cell == NONE {
            return Err(SurfaceError::TooLarge { what: "cells", limit: NONE as usize });
        }
        let mut verts = [0; 8];
        for (vert, &v) in verts.iter_mut().zip(corners) {
            *vert = builder.vert(v).ok_or(SurfaceError::NoSuchVertex {
                triangle: cell,
                vertex: v,
                n_vertices: builder.n_file_vertices(),
            })?;
        }
        for face in faces {
            let (mut key, mut of_file, mut n) = ([NONE; 4], [NONE; 4], 0);
            for &i in *face {
                if !key[..n].contains(&verts[i]) {
                    (key[n], of_file[n]) = (verts[i], corners[i]);
                    n += 1;
                }
            }
            if n < 3 {
                continue;
            }
            let apex = (0..corners.len()).find(|&i| !key[..n].contains(&verts[i]));
            let Some(apex) = apex else { continue };
            key.sort_unstable();
            let apex = corners[apex];
            self.faces.push(VolumeFace { key, cell, region, corners: of_file, apex }).or_raise();
        }
        self.n_cells += 1;
        if self.n_cells & 1023 == 0 {
            check_cancelled();
        }
        Ok(())
    }

    /// Adds the boundary to the current file of `builder`; `label` gives the id of a name, which is empty where no region has one.
    ///
    /// A face of one cell has the name of its region, one between two regions both names. Returns a point in each volume, with the
    /// name of its region.
    ///
    /// # Errors
    /// A face of three cells; the builder's. Unwinds where the disk fails.
    pub fn finish(
        self,
        builder: &mut SurfaceBuilder,
        mut label: impl FnMut(&mut SurfaceBuilder, &str) -> u32,
    ) -> Result<Vec<(Point, String)>, SurfaceError> {
        let mut volumes = self.space.vec(self.n_cells as usize, 0u32);
        (0..self.n_cells).for_each(|cell| volumes.set(cell as usize, cell));
        // Cell, region, three corners of an outer face and one inside.
        let mut outer = self.space.builder::<[u32; 6]>();
        let mut all = self.faces.finish().or_raise().map(OrRaise::or_raise).peekable();
        // Of two regions the lower first; each pair of regions has its label.
        let mut labels = HashMap::new();
        while let Some(face) = all.next() {
            let other = all.next_if(|other| other.key == face.key);
            if let Some(third) = all.peek().filter(|third| third.key == face.key) {
                return Err(SurfaceError::SharedFace {
                    cells: [face.cell, other.map_or(face.cell, |o| o.cell), third.cell],
                });
            }
            let regions = match other {
                Some(other) if other.region == face.region => {
                    let [a, b] = [face.cell, other.cell].map(|cell| root(&mut volumes, cell));
                    volumes.set(a.max(b) as usize, a.min(b));
                    continue;
                }
                Some(other) => [face.region.min(other.region), face.region.max(other.region)],
                None => [face.region, NONE],
            };
            let id = *labels.entry(regions).or_insert_with(|| {
                let names = regions.iter().filter_map(|&r| self.regions.get(r as usize));
                let names: Vec<&str> =
                    names.map(String::as_str).filter(|n| !n.is_empty()).collect();
                label(builder, &names.join("-"))
            });
            let n = 3 + usize::from(face.corners[3] != NONE);
            builder.polygon(&face.corners[..n], id)?;
            for side in [Some(face), other].into_iter().flatten() {
                let [a, b, c, _] = side.corners;
                outer.push([side.cell, side.region, a, b, c, side.apex]);
            }
        }
        let mut outer = outer.finish();
        let mut seeds = Vec::new();
        let mut seeded = self.space.vec(self.n_cells as usize, 0u8);
        for i in 0..outer.len() {
            let [cell, region, a, b, c, apex] = outer.get(i);
            let volume = root(&mut volumes, cell) as usize;
            if seeded.get(volume) == 1 {
                continue;
            }
            seeded.set(volume, 1);
            if let Some(point) = builder.middle([a, b, c, apex]) {
                seeds.push((point, self.regions[region as usize].clone()));
            }
        }
        Ok(seeds)
    }
}

/// The least cell of the volume of `cell`, with the way to it halved.
fn root(volumes: &mut SpillVec<u32>, mut cell: u32) -> u32 {
    loop {
        let next = volumes.get(cell as usize);
        if next == cell {
            return cell;
        }
        let after = volumes.get(next as usize);
        volumes.set(cell as usize, after);
        cell = after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{Seed, SeedKind, Surface, closedness};

    /// The boundary of cells with the names of their regions, in `space`.
    fn boundary(
        points: &[[f64; 3]],
        cells: &[(&[u32], &str)],
        space: &ScratchSpace,
    ) -> Result<Surface, SurfaceError> {
        let mut builder = SurfaceBuilder::new();
        builder.begin_file("cells");
        points.iter().try_for_each(|&p| builder.vertex(Point::from_array(p)))?;
        let mut all = CellBoundary::new(space);
        for (corners, name) in cells {
            let region = all.region(name);
            all.cell(&builder, corners, region)?;
        }
        for (point, name) in all.finish(&mut builder, |builder, name| builder.label(name))? {
            builder.seed(Seed { point, kind: SeedKind::Region(Some(name)) });
        }
        builder.end_file()?;
        Ok(builder.finish())
    }

    /// Corners of `n` by one by one cubes, numbered so that the next layer follows.
    fn bar(n: u32) -> Vec<[f64; 3]> {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        (0..=n).flat_map(|z| square.map(|[x, y]| [x, y, f64::from(z)])).collect()
    }

    #[test]
    fn cells_of_all_kinds_have_closed_boundaries() {
        let points = bar(1);
        let everything: [&[u32]; 4] =
            [&[0, 1, 2, 5], &[0, 1, 2, 3, 4], &[0, 1, 2, 4, 5, 6], &[0, 1, 2, 3, 4, 5, 6, 7]];
        for (cell, n) in everything.into_iter().zip([4, 6, 8, 12]) {
            let surface = boundary(&points, &[(cell, "")], &ScratchSpace::boundless()).unwrap();
            assert_eq!(surface.n_triangles(), n, "{cell:?}");
            assert!(closedness(&surface).open.is_empty(), "{cell:?}");
            assert_eq!(surface.seeds.len(), 1);
        }
        // A hexahedron with two corners in one place is a prism.
        let prism: &[u32] = &[0, 1, 2, 2, 4, 5, 6, 6];
        let surface = boundary(&points, &[(prism, "")], &ScratchSpace::boundless()).unwrap();
        assert_eq!(surface.n_triangles(), 8);
    }

    #[test]
    fn regions_are_parted_and_each_volume_has_its_seed() {
        let cube = |z: u32| -> [u32; 8] { std::array::from_fn(|i| 4 * z + i as u32) };
        let cubes: Vec<[u32; 8]> = (0..5).map(cube).collect();
        let names = ["a", "a", "b", "a", "a"];
        let cells: Vec<(&[u32], &str)> =
            cubes.iter().zip(names).map(|(cube, name)| (cube.as_slice(), name)).collect();
        let surface = boundary(&bar(5), &cells, &ScratchSpace::boundless()).unwrap();
        // Twenty sides and two ends, and two faces inside.
        assert_eq!(surface.n_triangles(), 2 * (20 + 2 + 2));
        let mut names = surface.label_names.clone();
        names.sort();
        assert_eq!(names, ["a", "a-b", "b"]);
        let mut heights: Vec<f64> = surface.seeds.iter().map(|seed| seed.point.z).collect();
        heights.sort_by(f64::total_cmp);
        assert_eq!(heights.len(), 3, "{heights:?}");
        assert!(heights[0] < 2.0 && (2.0..3.0).contains(&heights[1]) && heights[2] > 3.0);
    }

    #[test]
    fn a_large_mesh_spills_and_is_the_same() {
        let n = 30_000;
        let cubes: Vec<[u32; 8]> =
            (0..n).map(|z| std::array::from_fn(|i| 4 * z + i as u32)).collect();
        let cells: Vec<(&[u32], &str)> =
            (0..).zip(&cubes).map(|(z, cube)| (cube.as_slice(), ["p", "q"][z / 100 % 2])).collect();
        let dir = tempfile::tempdir().unwrap();
        let small = ScratchSpace::new(1 << 20, dir.path());
        let [a, b] = [ScratchSpace::boundless(), small]
            .map(|space| boundary(&bar(n), &cells, &space).unwrap());
        assert_eq!(a, b);
        assert_eq!((a.n_triangles() as u32, a.seeds.len()), (2 * (4 * n + 2 + 299), 300));
    }

    #[test]
    fn cells_that_overlap_or_name_nothing_are_refused() {
        let points = bar(1);
        let tet: &[u32] = &[0, 1, 2, 5];
        let one = |cells: &[(&[u32], &str)]| boundary(&points, cells, &ScratchSpace::boundless());
        let error = one(&[(tet, ""), (tet, ""), (tet, "")]).unwrap_err();
        assert!(error.to_string().contains("cells 0, 1 and 2"), "{error}");
        assert!(one(&[(&[0, 1, 2, 8], "")]).is_err());
        // Corners on one another bound nothing.
        assert_eq!(one(&[(&[0, 1, 1, 0], "")]).unwrap().n_triangles(), 0);
    }
}
