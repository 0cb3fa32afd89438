//! A mesh as NumPy arrays, a file each: `NAME_points.npy`, `NAME_tets.npy` and so on beside `NAME.npy`, which is not written.
//!
//! Numbers of vertices are those of the other formats; they have the narrowest signed type that holds them.

use std::path::{Path, PathBuf};

use super::draft::Draft;
use super::error::Result;
use super::merged::{Measured, Merged};
use super::npy::{HEAD_BYTES, head};
use super::stream::Strip;
use super::vtu_layout::Index;

/// Makes the files of one mesh.
struct Columns<'a> {
    draft: &'a mut Draft,
    out: &'a Path,
}

impl Columns<'_> {
    /// A file of `rows` entries of `kind` with `width` numbers each (0: a plain number), its head written.
    fn open(&mut self, name: &str, kind: &str, rows: u64, width: u64) -> Result<Strip> {
        let bytes: u64 = kind[2..].parse().expect("kinds end with their length");
        let length = rows * width.max(1) * bytes;
        let whole = HEAD_BYTES as u64 + length;
        let path = self.draft.create(&beside(self.out, name), whole)?;
        let inner = match width {
            0 => String::new(),
            width => format!(" {width}"),
        };
        let mut strip = Strip::open(&path, 0, whole)?;
        strip.put(&head(&format!("'{kind}'"), rows, &inner))?;
        Ok(strip)
    }
}

/// `NAME_column.npy` beside `NAME.npy`.
fn beside(out: &Path, column: &str) -> PathBuf {
    let mut name = out.file_stem().unwrap_or_default().to_owned();
    name.push(format!("_{column}.npy"));
    out.with_file_name(name)
}

pub(super) fn write(mesh: &mut Merged, draft: &mut Draft, out: &Path) -> Result<()> {
    mesh.expect_passes(1, 1);
    let (n_vertices, n_tets, n_faces) = (mesh.n_vertices(), mesh.n_tets(), mesh.n_faces());
    let index = Index::new(n_vertices, 0);
    let number = if index.kind() == "Int32" { "<i4" } else { "<i8" };
    let mut columns = Columns { draft, out };
    let mut points = columns.open("points", "<f8", n_vertices, 3)?;
    let mut vertex_ids = columns.open("vertex_id", "<i8", n_vertices, 0)?;
    mesh.vertices(|_, vertex| {
        vertex_ids.put(&vertex.id.to_le_bytes())?;
        vertex.point.iter().try_for_each(|x| points.put(&x.to_le_bytes()))
    })?;
    points.finish()?;
    vertex_ids.finish()?;

    let mut nodes = columns.open("tets", number, n_tets, 4)?;
    let mut regions = columns.open("region", "<u4", n_tets, 0)?;
    let mut ranks = columns.open("subdomain", "<u4", n_tets, 0)?;
    let mut qualities = columns.open("quality", "<f8", n_tets, 0)?;
    let mut ids = columns.open("global_id", "<i8", n_tets, 0)?;
    mesh.measured_tets(Measured::Quality, |tet| {
        tet.nodes.iter().try_for_each(|&v| index.put(&mut nodes, v))?;
        regions.put(&tet.region.to_le_bytes())?;
        ranks.put(&tet.subdomain.to_le_bytes())?;
        qualities.put(&tet.quality.to_le_bytes())?;
        ids.put(&tet.id.number().to_le_bytes())
    })?;

    let mut faces = columns.open("triangles", number, n_faces, 3)?;
    let mut labels = columns.open("label", "<u4", n_faces, 0)?;
    let mut inputs = columns.open("input_id", "<i8", n_faces, 0)?;
    mesh.faces().each(|face| {
        face.vertices.iter().try_for_each(|&v| index.put(&mut faces, v))?;
        labels.put(&face.label.to_le_bytes())?;
        let input = face.triangle().map_or(-1, |t| t as i64);
        inputs.put(&input.to_le_bytes())
    })?;
    [nodes, regions, ranks, qualities, ids, faces, labels, inputs]
        .into_iter()
        .try_for_each(Strip::finish)
}
