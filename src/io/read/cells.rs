//! Volume cells of a file: left out, or, where the surface is their boundary, collected.

use std::io::BufRead;
use std::path::{Path, PathBuf};

use super::SurfaceSink;
use super::feed::{Feed, Result, name};
use super::tetgen::read_node_file;
use super::volume_cells::VolumeCells;
use tetdb_base::geom::counted;
use tetdb_base::surface::{NoteKind, Seed, SeedKind};
use tetdb_schema::source::BOUNDARY_OF;

impl SurfaceSink<'_> {
    /// Counts cells that are left out, so that the file may be read again for their boundary.
    pub(super) fn leave_out_cells(&mut self, n: u64) {
        self.cells.n_left_out += n;
    }

    /// Returns whether the file has volume cells and nothing else.
    pub(super) fn has_cells_alone(&self) -> bool {
        self.cells.n_left_out > 0 && self.builder.n_file_triangles() == 0
    }

    /// Counts a face that is left out; returns whether it is.
    pub(super) fn leaves_out_face(&mut self) -> bool {
        self.cells.n_faces += u64::from(self.cells.are_wanted());
        self.cells.are_wanted()
    }

    /// Adds a volume cell of the region `name`; `n_nodes` are its nodes, corners among them.
    pub(super) fn cell<R: BufRead>(
        &mut self,
        feed: &Feed<R>,
        (corners, n_nodes): (&[u32], usize),
        name: &str,
    ) -> Result<()> {
        self.cells.n_curved += u64::from(n_nodes > corners.len());
        let boundary = self.cells.boundary.as_mut().expect("cells are wanted");
        let region = boundary.region(name);
        feed.placed(boundary.cell(self.builder, corners, region))
    }

    /// Adds the boundary of the cells, where it is the surface.
    pub(super) fn end_cells<R: BufRead>(&mut self, feed: &Feed<R>) -> Result<()> {
        let Some(boundary) = self.cells.boundary.take() else { return Ok(()) };
        let VolumeCells { n_faces, n_curved, .. } = self.cells;
        let n = u64::from(boundary.n_cells());
        let (stem, prefix) = (self.stem.clone(), self.prefix.clone());
        let label = |builder: &mut _, name: &str| {
            let (stem, prefix) = (stem.clone(), prefix.clone());
            SurfaceSink { builder, stem, prefix, cells: VolumeCells::default() }.label(name)
        };
        for (point, name) in feed.placed(boundary.finish(self.builder, label))? {
            match name.as_str() {
                "" => self.builder.seed(Seed { point, kind: SeedKind::Region(None) }),
                name => drop(self.region(point, name)),
            }
        }
        if n > 0 {
            self.builder.note(NoteKind::BoundaryOfCells { n });
        }
        for (n, what) in [
            (
                n_faces,
                "surface [cell was|cells were] left out; the boundary of the volume cells is read",
            ),
            (
                n_curved,
                "[cell has nodes on its|cells have nodes on their] edges; only corners were taken",
            ),
        ] {
            if n > 0 {
                self.builder.note(NoteKind::Said(counted(n, what)));
            }
        }
        Ok(())
    }
}

/// The file of a word that asks for the boundary of its volume cells: `boundary-of:` and the path.
pub fn boundary_of(word: &Path) -> Option<PathBuf> {
    word.to_str()?.strip_prefix(BOUNDARY_OF).map(PathBuf::from)
}

/// Reads TetGen's `.ele`: tetrahedra of the points in the `.node` file `nodes`; an attribute names the region.
pub(super) fn read_ele<R: BufRead>(
    mut feed: Feed<R>,
    nodes: Option<&Path>,
    limit: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    feed.comment = Some(b'#');
    let n = feed.integer("the number of tetrahedra")?;
    let n = feed.check_count("tetrahedra", n, 10)?;
    let nodes_each = feed.integer("4 or 10, the number of nodes of a tetrahedron")?;
    if ![4, 10].contains(&nodes_each) {
        return Err(feed.unsupported(format!("tetrahedra of {nodes_each} nodes")));
    }
    feed.skip_line()?;
    if !target.cells.are_wanted() {
        target.leave_out_cells(n);
        return Err(feed.empty());
    }
    let numbering = read_node_file(&feed, nodes, limit, target)?;
    for i in 0..n {
        feed.need_record("tetrahedra", n, i)?;
        feed.integer("the number of a tetrahedron")?;
        let mut corners = [0; 4];
        for corner in &mut corners {
            *corner = feed.index(numbering.first, numbering.n)?;
        }
        for _ in 4..nodes_each {
            feed.index(numbering.first, numbering.n)?;
        }
        let attribute = match feed.next_word_in_line()? {
            true => name(feed.word()),
            false => String::new(),
        };
        let region = match attribute.as_str() {
            "" | "0" => String::new(),
            attribute => format!("attribute_{attribute}"),
        };
        feed.skip_line()?;
        target.cell(&feed, (&corners, nodes_each as usize), &region)?;
    }
    target.end_cells(&feed)?;
    feed.finish(target.builder)
}

#[cfg(test)]
mod tests {
    use super::super::{read_surface, read_surface_in};
    use super::*;
    use tetdb_base::storage::ScratchSpace;
    use tetdb_base::surface::{Surface, closedness};

    /// Two tetrahedra on one another, each of its reference, and a triangle.
    const MEDIT: &str = "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 -1 0\n\
        Triangles\n1\n1 2 4 9\nTetrahedra\n2\n1 2 3 4 1\n1 3 2 5 2\nEnd\n";
    /// A hexahedron in a group with a name and a prism beside it in one without.
    const GMSH: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"rock\"\n$EndPhysicalNames\n\
        $Nodes\n10\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n9 2 0 0\n10 2 0 1\n$EndNodes\n\
        $Elements\n2\n1 5 2 7 1 1 2 3 4 5 6 7 8\n2 6 2 8 2 2 9 3 6 10 7\n$EndElements\n";
    const NODE: &str = "5 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 0 -1\n";
    const ELE: &str = "2 4 1\n1 1 2 3 4 3\n2 1 3 2 5 3\n";

    fn read(files: &[(&str, &str)], word: &str) -> Result<Surface> {
        let dir = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(dir.path().join(name), text).unwrap();
        }
        let path = dir.path().join(files[0].0).to_string_lossy().into_owned();
        read_surface_in(
            &[PathBuf::from(format!("{word}{path}"))],
            &ScratchSpace::new(1 << 30, dir.path()),
        )
    }

    fn check(surface: &Surface, triangles: usize, labels: &[&str], seeds: usize, note: &str) {
        assert_eq!(surface.n_triangles(), triangles);
        let mut found = surface.label_names.clone();
        found.sort();
        assert_eq!(found, labels);
        assert_eq!(surface.seeds.len(), seeds);
        assert!(closedness(surface).open.is_empty());
        let notes: Vec<String> = surface.notes.iter().map(ToString::to_string).collect();
        assert!(notes.iter().any(|n| n.contains(note)), "{notes:?}");
        assert!(!notes.iter().any(|n| n.contains("repeat the coordinates")), "{notes:?}");
    }

    #[test]
    fn cells_alone_give_their_boundary() {
        let alone = MEDIT.replace("Triangles\n1\n1 2 4 9\n", "");
        let labels = ["ref_1", "ref_1-ref_2", "ref_2"];
        check(
            &read(&[("a.mesh", &alone)], "").unwrap(),
            7,
            &labels,
            2,
            "boundary of 2 volume cells",
        );
        let gmsh = read(&[("a.msh", GMSH)], "").unwrap();
        check(&gmsh, 12 + 6, &["rock", "rock-volume_8", "volume_8"], 2, "of 2 volume cells");
        let ele = read(&[("a.ele", ELE), ("a.node", NODE)], "").unwrap();
        check(&ele, 6, &["attribute_3"], 1, "of 2 volume cells");
        assert!(read(&[("a.ele", ELE)], "").is_err());
        assert!(
            read(&[("a.ele", &ELE.replace("1 3 2 5", "1 3 2 6")), ("a.node", NODE)], "").is_err()
        );
    }

    #[test]
    fn a_surface_beside_cells_is_read_unless_their_boundary_is_asked_for() {
        let file = [("a.mesh", MEDIT)];
        assert_eq!(read(&file, "").unwrap().n_triangles(), 1);
        let boundary = read(&file, BOUNDARY_OF).unwrap();
        check(&boundary, 7, &["ref_1", "ref_1-ref_2", "ref_2"], 2, "1 surface cell was left out");
        for (name, text) in
            [("a.mesh", MEDIT.split("Tetrahedra").next().unwrap()), ("a.off", "OFF\n")]
        {
            assert!(read(&[(name, text)], BOUNDARY_OF).is_err(), "{name}");
        }
        let before = MEDIT.replace("Dimension 3\n", "Dimension 3\nTetrahedra\n1\n1 2 3 4 1\n");
        assert!(read(&[("a.mesh", &before)], BOUNDARY_OF).is_err());
    }

    #[test]
    fn several_files_keep_their_names_apart() {
        let dir = tempfile::tempdir().unwrap();
        let moved = GMSH.replace("\n1 0 0 0\n", "\n1 0 0 -0.5\n");
        let paths = [("one.msh", GMSH), ("two.msh", &moved)].map(|(name, text)| {
            std::fs::write(dir.path().join(name), text).unwrap();
            dir.path().join(name)
        });
        let surface = read_surface(&paths, 1 << 30).unwrap();
        assert!(surface.label_names.contains(&"one:rock".to_owned()));
        assert!(surface.label_names.contains(&"two:rock-volume_8".to_owned()));
    }
}
