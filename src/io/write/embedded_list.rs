//! Embedded edges and points as a table, for formats that have none.

use std::path::Path;

use super::error::Result;
use super::merged::Merged;
use super::output_files::OutputFiles;
use super::stream::Stream;

/// Writes `NAME_wires.csv`: the name of each edge and point and the numbers of its vertices, from 0. Errors: the disk.
pub(super) fn write_list(mesh: &Merged, outputs: &mut OutputFiles, out: &Path) -> Result<()> {
    let embedded = mesh.embedded();
    if embedded.is_empty() {
        return Ok(());
    }
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let path = outputs.create(&out.with_file_name(format!("{stem}_wires.csv")), 0)?;
    let mut stream = Stream::open(&path)?;
    stream.text("kind,name,vertex,to\n");
    let name = |label| mesh.label_name(label).replace('"', "\"\"").replace(['\n', '\r'], " ");
    for ([a, b], label) in &embedded.edges {
        stream.text(&format!("edge,\"{}\",{a},{b}\n", name(*label)));
        stream.end()?;
    }
    for point in &embedded.points {
        stream.text(&format!("point,\"{}\",{},\n", name(point.label), point.vertex));
        stream.end()?;
    }
    stream.finish()
}
