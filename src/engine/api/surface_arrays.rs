//! The vertices, triangles and labels of a surface as arrays, and surfaces from arrays of other cells than triangles.

use super::{Error, Settings, Surface, guarded};
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::{CellBoundary, Note, NoteKind, Seed, SeedKind, SurfaceBuilder};
use tetdb_schema::code::Code;
use tetdb_schema::labels::LabelSet;

/// Cells of several kinds as arrays.
#[derive(Clone, Copy, Debug)]
pub struct CellArrays<'a> {
    /// Number of corners of each cell.
    pub counts: &'a [u32],
    /// The corners of all cells, one cell after the other, as positions in an array of points.
    pub corners: &'a [u32],
    /// The name of the label or region of each cell; `None` where they have none.
    pub names: Option<&'a [&'a str]>,
}

impl<'a> CellArrays<'a> {
    /// Each cell with its number, its corners and its name. Errors: arrays that do not fit together.
    fn checked(
        self,
        n_points: usize,
        is_allowed: impl Fn(u32) -> bool,
    ) -> Result<impl Iterator<Item = (&'a [u32], Option<&'a str>)>, Error> {
        let Self { counts, corners, names } = self;
        let at = |code, message: String, i: usize| {
            Err(Error::new(code, message).at(format!("cell {i}")))
        };
        let total: u64 = counts.iter().map(|&n| u64::from(n)).sum();
        if total != corners.len() as u64 || names.is_some_and(|all| all.len() != counts.len()) {
            let message = format!(
                "{} cells of {total} corners, but there are {} corners",
                counts.len(),
                corners.len()
            );
            return Err(Error::new(Code::CountMismatch, message)
                .with_help("give as many corners as the cells have, and a name for each cell"));
        }
        if let Some(i) = counts.iter().position(|&n| !is_allowed(n)) {
            return at(Code::UnsupportedContent, format!("a cell of {} corners", counts[i]), i);
        }
        let mut left = corners;
        let cells = counts.iter().enumerate().map(move |(i, &n)| {
            let (cell, rest) = left.split_at(n as usize);
            left = rest;
            (cell, names.map(|names| names[i]))
        });
        match cells.clone().position(|(cell, _)| cell.iter().any(|&v| v as usize >= n_points)) {
            Some(i) => at(
                Code::IndexOutOfRange,
                format!("it names a point beyond the {n_points} there are"),
                i,
            ),
            None => Ok(cells),
        }
    }
}

impl Surface {
    /// A surface from polygons of three corners or more, cut into triangles as those of files are. `names` are labels.
    ///
    /// Errors: `count-mismatch`, `unsupported-content`, `index-out-of-range` and `not-a-number` name the cell or the point.
    pub fn from_polygons(points: &[[f64; 3]], polygons: CellArrays<'_>) -> Result<Self, Error> {
        let cells = polygons.checked(points.len(), |n| n >= 3)?;
        guarded(&Settings::new(), || {
            let add = |builder: &mut SurfaceBuilder| {
                for (corners, name) in cells {
                    let label = builder.label(name.unwrap_or("surface"));
                    builder.polygon(corners, label)?;
                }
                Ok(())
            };
            Self::built(points, add)?.oriented(&ScratchSpace::boundless())
        })
    }

    /// The boundary of a mesh of volume cells, and faces between its regions.
    ///
    /// Shape: cells of 4, 5, 6 or 8 corners are tetrahedra, pyramids, prisms and hexahedra, numbered as in VTK. `names` are those of
    /// regions. A triangle has the name of its region as label, one between two regions both names. Each volume has a seed.
    ///
    /// Errors: as [`Surface::from_polygons`]; `unsupported-content` if three cells share a face.
    pub fn boundary_of_cells(points: &[[f64; 3]], cells: CellArrays<'_>) -> Result<Self, Error> {
        let all = cells.checked(points.len(), |n| matches!(n, 4 | 5 | 6 | 8))?;
        guarded(&Settings::new(), || {
            let add = |builder: &mut SurfaceBuilder| {
                let mut boundary = CellBoundary::new(&ScratchSpace::boundless());
                for (corners, name) in all {
                    let region = boundary.region(name.unwrap_or(""));
                    boundary.cell(builder, corners, region)?;
                }
                let n = u64::from(boundary.n_cells());
                let seeds = boundary.finish(builder, |builder, name| match name {
                    "" => builder.label("surface"),
                    name => builder.label(name),
                })?;
                for (point, name) in seeds {
                    let kind = SeedKind::Region((!name.is_empty()).then_some(name));
                    builder.seed(Seed { point, kind });
                }
                builder.note(NoteKind::BoundaryOfCells { n });
                Ok(())
            };
            Self::built(points, add)?.oriented(&ScratchSpace::boundless())
        })
    }

    /// Points that name volumes or mark holes, from the files, or one in each volume of the cells.
    pub fn seeds(&self) -> &[Seed] {
        &self.inner.seeds
    }

    /// The same surface with other notes and seeds: those that its arrays alone do not say.
    pub fn with_notes_and_seeds(mut self, notes: Vec<String>, seeds: Vec<Seed>) -> Self {
        let note = |text| Note { file: String::new(), kind: NoteKind::Said(text) };
        self.inner.notes = notes.into_iter().map(note).collect();
        self.inner.seeds = seeds;
        self
    }

    /// The same surface with a note more, for callers that leave out something of what they give.
    pub fn noted(mut self, text: impl Into<String>) -> Self {
        let file = self.inner.files.first().map_or(String::new(), |file| file.name.clone());
        let kind = NoteKind::Said(text.into());
        self.inner.notes.push(Note { file, kind });
        self
    }

    /// The same surface with triangles in several groups: those of a label have the labels of its groups instead.
    ///
    /// Each item is the name of a label and the names of its groups, one at least. Labels get new numbers; a label that stands for
    /// several is called by their names with `+` between them. Errors: `count-mismatch` for a label without
    /// groups; `usage` if something is embedded.
    pub fn with_groups(mut self, groups: &[(&str, &[&str])]) -> Result<Self, Error> {
        if let Some((label, _)) = groups.iter().find(|(_, groups)| groups.is_empty()) {
            let message = format!("the label {label:?} has no group");
            return Err(
                Error::new(Code::CountMismatch, message).with_help("give one group at least")
            );
        }
        if self.inner.has_sheets() || self.inner.has_embedded() {
            let message = "groups are given before sheets, edges and points are embedded";
            return Err(Error::new(Code::Usage, message));
        }
        if !groups.is_empty() {
            self.inner.divide_labels(groups);
            self.sources = self.copied(&self.inner);
        }
        Ok(self)
    }

    /// Labels of triangles in several groups, and the labels of those groups.
    pub fn label_sets(&self) -> &[LabelSet] {
        &self.inner.label_sets
    }

    /// Positions of the vertices; vertices with equal coordinates appear once.
    pub fn points(&self) -> &[[f64; 3]] {
        bytemuck::cast_slice(&self.inner.points[..self.inner.n_input_vertices()])
    }

    /// Corners of each triangle as three positions in [`Surface::points`]. All triangles are oriented like their neighbors.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.inner.triangles[..self.inner.n_input_triangles()]
    }

    /// The label of each triangle, a position in [`Surface::labels`].
    pub fn labels_of_triangles(&self) -> &[u32] {
        &self.inner.labels[..self.inner.n_input_triangles()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_comes_back_as_arrays_with_the_places_of_its_defects() {
        let surface = Surface::sample("box,h=0.5").unwrap();
        let names: Vec<&str> = (surface.labels_of_triangles().iter())
            .map(|&label| surface.labels()[label as usize].as_str())
            .collect();
        let (points, triangles) = (surface.points(), surface.triangles());
        let again = Surface::from_arrays(points, triangles, Some(&names)).unwrap();
        assert_eq!(again.points(), points);
        assert_eq!(again.triangles(), triangles);
        let open = Surface::from_arrays(points, &triangles[1..], None).unwrap();
        let report = open.check().unwrap();
        assert_eq!(report.places.len(), report.defects.len());
        assert_eq!(report.places[0].code, "open-surface");
        assert!(report.places[0].triangles[0].is_some() && report.places[0].at.is_some());
    }
    #[test]
    fn cells_of_other_kinds_become_triangles_or_are_refused() {
        let unit = |i: u32| [i & 1, i >> 1 & 1, i >> 2].map(f64::from);
        let points: Vec<[f64; 3]> = (0..8).map(unit).collect();
        let quads: Vec<u32> =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
                .concat();
        let cells = |counts, corners| CellArrays { counts, corners, names: None };
        let cube = Surface::from_polygons(&points, cells(&[4; 6], &quads)).unwrap();
        assert_eq!(cube.n_triangles(), 12);
        assert!(cube.check().unwrap().is_valid());
        assert!(cube.notes()[0].contains("6 polygons"), "{:?}", cube.notes());
        let hexahedron = [0, 1, 3, 2, 4, 5, 7, 6];
        let named = CellArrays { names: Some(&["rock"]), ..cells(&[8], &hexahedron) };
        let boundary = Surface::boundary_of_cells(&points, named).unwrap().noted("by hand");
        assert_eq!((boundary.n_triangles(), boundary.labels()), (12, &["rock".to_owned()][..]));
        assert!(boundary.notes().iter().any(|note| note.contains("1 volume cell")));
        assert!(boundary.notes().iter().any(|note| note == "arrays: by hand"));
        let (notes, seeds) = (boundary.notes(), boundary.seeds().to_vec());
        assert_eq!(seeds.len(), 1);
        let again = Surface::from_arrays(boundary.points(), boundary.triangles(), None).unwrap();
        let again = again.with_notes_and_seeds(notes.clone(), seeds.clone());
        assert_eq!((again.notes(), again.seeds()), (notes, &seeds[..]));
        for (counts, corners) in
            [(&[4][..], &[0, 1, 2][..]), (&[2], &[0, 1]), (&[3, 3], &[0, 1, 2, 0, 1, 8])]
        {
            let error = Surface::from_polygons(&points, cells(counts, corners)).unwrap_err();
            assert!(error.place().or(error.help()).is_some(), "{error}");
            assert!(Surface::boundary_of_cells(&points, cells(counts, corners)).is_err());
        }
    }
}
