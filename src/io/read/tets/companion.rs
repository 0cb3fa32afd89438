//! The boundary that exports write beside `NAME.vtu` or `NAME.vtkhdf`, as `NAME_boundary.vtu` or `NAME_boundary.vtkhdf`: labelled triangles.

use std::path::{Path, PathBuf};

use super::vtu::{Grid, Piece, name_of};
use super::{MeshFields, RawMesh, Result};
use tetdb_base::geom::{Point, counted};
use tetdb_base::storage::SpillVecBuilder;

/// Reads a file and its boundary, which `open` opens within a memory of so many bytes. Errors: those of the file; a boundary that cannot be taken is noted.
pub fn read_both(
    path: &Path,
    open: impl Fn(&Path, u64) -> Result<Grid>,
    fields: MeshFields,
    mesh: &mut RawMesh,
) -> Result<()> {
    let cap = mesh.space.cap();
    open(path, cap)?.read(fields, mesh)?;
    let beside = beside(path);
    if !mesh.triangles.is_empty() || !beside.is_file() {
        return Ok(());
    }
    let name = beside.file_name().unwrap_or_default().to_string_lossy();
    let taken = open(&beside, cap).and_then(|grid| grid.take_triangles(mesh));
    let note = match taken {
        Ok(Some(n)) => {
            counted(n, &format!("[triangle is|triangles are] taken from {name} beside it"))
        }
        Ok(None) => format!("{name} beside it is not of this mesh, and was left out"),
        Err(error) => format!("{name} beside it was left out: {error}"),
    };
    mesh.notes.push(note);
    Ok(())
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push("_boundary.");
    name.push(path.extension().unwrap_or_default());
    path.with_file_name(name)
}

impl Grid {
    /// Adds the triangles of a boundary to its mesh, but for faces between sub-domains; returns their number.
    ///
    /// `None`, and nothing is added, if its vertices are not those of the mesh. Errors: those of the file.
    fn take_triangles(&self, mesh: &mut RawMesh) -> Result<Option<u64>> {
        let [piece] = &self.pieces[..] else { return Ok(None) };
        let Some(mut vertices) = self.vertices(piece, mesh)? else { return Ok(None) };
        let Some(mut triangles) = self.triangles(piece, &mut vertices, mesh)? else {
            return Ok(None);
        };
        let names = self.names("label_names")?;
        for i in 0..triangles.len() {
            let [corners @ .., label] = triangles.get(i);
            let name = || name_of(&names, label.into());
            let label = mesh.labels.with_name(label.into(), name);
            mesh.triangle(corners, label);
        }
        Ok(Some(triangles.len() as u64))
    }

    /// The vertex of the mesh for each vertex of the boundary; `None` if there is no such vertex at its place.
    fn vertices(&self, piece: &Piece, mesh: &mut RawMesh) -> Result<Option<SpillVecBuilder<u32>>> {
        let [numbers, points] = [("PointData", "mesh_vertex"), ("Points", "Points")]
            .map(|(section, name)| piece.array(section, name));
        let (Some(numbers), Some(points)) = (numbers, points) else { return Ok(None) };
        let mut numbers = self.numbers(numbers, "the number of a vertex")?;
        let mut points = self.numbers(points, "a coordinate")?;
        let (n, mut vertices) = (mesh.points.len(), mesh.space.builder());
        for _ in 0..piece.n_points {
            let p = Point::new(points.real()?, points.real()?, points.real()?);
            let v = usize::try_from(numbers.integer()?).ok().filter(|&v| v < n);
            let Some(v) = v.filter(|&v| mesh.points.get(v) == p.to_array()) else {
                return Ok(None);
            };
            vertices.push(v as u32);
        }
        Ok(Some(vertices))
    }

    /// Vertices in the mesh and label of each triangle of the input; `None` if there are other cells.
    fn triangles(
        &self,
        piece: &Piece,
        vertices: &mut SpillVecBuilder<u32>,
        mesh: &RawMesh,
    ) -> Result<Option<SpillVecBuilder<[u32; 4]>>> {
        let mut numbers = Vec::new();
        for (section, name) in [
            ("Cells", "offsets"),
            ("Cells", "connectivity"),
            ("CellData", "label"),
            ("CellData", "input_id"),
        ] {
            let Some(array) = piece.array(section, name) else { return Ok(None) };
            numbers.push(self.numbers(array, "a number of a triangle")?);
        }
        let [ends, corners, labels, inputs] = &mut numbers[..] else { return Ok(None) };
        let (mut from, mut triangles) = (0, mesh.space.builder());
        for _ in 0..piece.n_cells {
            let end = ends.integer()?;
            // The corners come before the middles of edges.
            if ![3, 6].contains(&(end - from)) {
                return Ok(None);
            }
            let mut vertices_of = [0; 3];
            for k in 0..(end - from) as usize {
                let v = usize::try_from(corners.integer()?).ok();
                let Some(v) = v.filter(|&v| v < vertices.len()) else { return Ok(None) };
                if let Some(vertex) = vertices_of.get_mut(k) {
                    *vertex = vertices.get(v);
                }
            }
            from = end;
            let (label, input) = (u32::try_from(labels.integer()?), inputs.integer()?);
            let Ok(label) = label else { return Ok(None) };
            let [a, b, c] = vertices_of;
            if input >= 0 {
                triangles.push([a, b, c, label]);
            }
        }
        Ok(Some(triangles))
    }
}

impl Piece {
    fn array(&self, section: &str, name: &str) -> Option<&super::vtu::ArrayAt> {
        self.arrays.iter().find(|array| array.section == section && array.name == name)
    }
}
