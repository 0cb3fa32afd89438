//! Surfaces as files, exactly: a format that would round is refused.

use std::path::Path;

use super::error::{Result, WriteError};
use super::output_files::OutputFiles;
use super::stream::Stream;
use tetdb_base::surface::{EmbeddedSet, Surface};

/// A writer of one format.
type Write = fn(&Surface, &mut Stream) -> Result<()>;

/// The result of writing a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct SurfaceWritten {
    /// Length of the file in bytes.
    pub bytes: u64,
    /// True if the format keeps the labels.
    pub labels_kept: bool,
}

/// Writes `surface` to `out` in the format of its extension; replaces an existing file.
///
/// `.stl` is text, because binary STL has single precision; `.stlb` is binary when nothing is rounded.
/// `.ply` is binary with doubles. Errors: [`WriteError`]; `out` is not touched then.
pub fn surface(surface: &Surface, out: &Path) -> Result<SurfaceWritten> {
    let (write, labels, is_double) = writer_of(out)?;
    if !is_double {
        refuse_rounding(surface, out)?;
    }
    let mut outputs = OutputFiles::new(out)?;
    let path = outputs.create(out, 0)?;
    let mut stream = Stream::open(&path)?;
    write(surface, &mut stream)?;
    stream.finish()?;
    let files = outputs.publish()?;
    Ok(SurfaceWritten {
        bytes: files.iter().map(|f| f.1).sum(),
        labels_kept: labels || surface.label_names.len() <= 1,
    })
}

/// Checks that a surface can be written to a file of that name. Errors: [`WriteError::UnknownFormat`].
pub fn check_surface_format(out: &Path) -> Result<()> {
    writer_of(out).map(|_| ())
}

/// The writer for a name, whether it keeps labels, and whether it keeps doubles.
fn writer_of(out: &Path) -> Result<(Write, bool, bool)> {
    let extension = out.extension().and_then(|e| e.to_str()).unwrap_or_default();
    Ok(match extension.to_ascii_lowercase().as_str() {
        "stl" | "stla" => (stl, true, true),
        "stlb" => (stl_binary, false, false),
        "off" => (off, false, true),
        "obj" => (obj, true, true),
        "ply" => (ply, true, true),
        _ => {
            return Err(WriteError::UnknownFormat {
                path: out.to_owned(),
                known: ".stl, .off, .obj or .ply",
            });
        }
    })
}

fn refuse_rounding(surface: &Surface, out: &Path) -> Result<()> {
    let rounds = |x: f64| f64::from(x as f32) != x;
    let vertex = surface.points.iter().position(|p| p.to_array().into_iter().any(rounds));
    vertex.map_or(Ok(()), |vertex| {
        Err(WriteError::Lossy { path: out.to_owned(), vertex: vertex as u32 })
    })
}

/// Unit normal of triangle `t`, or zero where it has none.
fn normal(surface: &Surface, t: usize) -> [f64; 3] {
    let [a, b, c] = surface.corners(t as u32);
    (b - a).cross(c - a).normalize_or_zero().to_array()
}

/// The name of a triangle's label on one line.
fn label(surface: &Surface, t: usize) -> std::borrow::Cow<'_, str> {
    one_line(surface.label_name(t as u32))
}

fn one_line(name: &str) -> std::borrow::Cow<'_, str> {
    if name.contains(['\n', '\r']) {
        return name.replace(['\n', '\r'], " ").into();
    }
    name.into()
}

fn doubles(stream: &mut Stream, before: &str, [x, y, z]: [f64; 3]) {
    stream.text(before);
    stream.double(x, b' ');
    stream.double(y, b' ');
    stream.double(z, b'\n');
}

/// Returns whether triangle `t` begins a run of its label.
fn begins_run(surface: &Surface, t: usize) -> bool {
    t == 0 || surface.labels[t] != surface.labels[t - 1]
}

fn stl(surface: &Surface, stream: &mut Stream) -> Result<()> {
    for t in 0..surface.n_triangles() {
        if begins_run(surface, t) {
            if t > 0 {
                stream.text(&format!("endsolid {}\n", label(surface, t - 1)));
            }
            stream.text(&format!("solid {}\n", label(surface, t)));
        }
        doubles(stream, " facet normal ", normal(surface, t));
        stream.text("  outer loop\n");
        for p in surface.corners(t as u32) {
            doubles(stream, "   vertex ", p.to_array());
        }
        stream.text("  endloop\n endfacet\n");
        stream.end()?;
    }
    match surface.n_triangles() {
        0 => stream.text("solid\nendsolid\n"),
        n => stream.text(&format!("endsolid {}\n", label(surface, n - 1))),
    }
    Ok(())
}

fn stl_binary(surface: &Surface, stream: &mut Stream) -> Result<()> {
    stream.bytes(&[b' '; 80]);
    stream.bytes(&(surface.n_triangles() as u32).to_le_bytes());
    for t in 0..surface.n_triangles() {
        let corners = surface.corners(t as u32).map(|p| p.to_array());
        let numbers = normal(surface, t).into_iter().chain(corners.into_iter().flatten());
        for x in numbers {
            stream.bytes(&(x as f32).to_le_bytes());
        }
        stream.bytes(&[0, 0]);
        stream.end()?;
    }
    Ok(())
}

fn off(surface: &Surface, stream: &mut Stream) -> Result<()> {
    let (n, m) = (surface.n_vertices(), surface.n_triangles());
    stream.text(&format!("OFF\n{n} {m} 0\n"));
    for p in &surface.points {
        doubles(stream, "", p.to_array());
        stream.end()?;
    }
    for triangle in &surface.triangles {
        stream.text("3");
        for v in triangle {
            stream.text(" ");
            stream.text(&v.to_string());
        }
        stream.text("\n");
        stream.end()?;
    }
    Ok(())
}

/// Writes OBJ. Labels for several groups are declared in comments, which the reader knows.
fn obj(surface: &Surface, stream: &mut Stream) -> Result<()> {
    let names = if surface.label_sets.is_empty() { &[][..] } else { &surface.label_names };
    for (label, name) in (0u32..).zip(names) {
        let name = one_line(name);
        match surface.label_members(&label) {
            [_] => stream.text(&format!("# tetdb label {name}\n")),
            members => {
                let numbers: Vec<String> = members.iter().map(u32::to_string).collect();
                stream.text(&format!("# tetdb labels {} = {name}\n", numbers.join(" ")));
            }
        }
    }
    for p in &surface.points {
        doubles(stream, "v ", p.to_array());
        stream.end()?;
    }
    for (t, triangle) in surface.triangles.iter().enumerate() {
        if begins_run(surface, t) {
            stream.text(&format!("g {}\n", label(surface, t)));
        }
        let [a, b, c] = triangle.map(|v| u64::from(v) + 1);
        stream.text("f ");
        stream.integer(a, b' ');
        stream.integer(b, b' ');
        stream.integer(c, b'\n');
        stream.end()?;
    }
    Ok(())
}

/// Writes edges and points to `out` as an `.obj` file of lines (`l`) and points (`p`), exactly.
///
/// Errors: [`WriteError`]; `out` is not touched then.
pub fn wires(set: &EmbeddedSet, out: &Path) -> Result<()> {
    let mut outputs = OutputFiles::new(out)?;
    let path = outputs.create(out, 0)?;
    let mut stream = Stream::open(&path)?;
    for p in &set.points {
        doubles(&mut stream, "v ", p.to_array());
        stream.end()?;
    }
    let mut last = None;
    let edges = set.edges.iter().map(|&[a, b, label]| (vec![a, b], label));
    let points = set.marks.iter().map(|&[v, label]| (vec![v], label));
    for (vertices, label) in edges.chain(points) {
        if last.replace(label) != Some(label) {
            let name = set.label_names[label as usize].replace(['\n', '\r'], " ");
            stream.text(&format!("g {name}\n"));
        }
        stream.text(if vertices.len() == 2 { "l" } else { "p" });
        for v in vertices {
            stream.text(&format!(" {}", v + 1));
        }
        stream.text("\n");
        stream.end()?;
    }
    stream.finish()?;
    outputs.publish()?;
    Ok(())
}

fn ply(surface: &Surface, stream: &mut Stream) -> Result<()> {
    stream.text("ply\nformat binary_little_endian 1.0\n");
    // A property of labels that are all equal is left out: some readers take lists of corners alone.
    let has_labels = surface.label_names.len() > 1;
    for (number, name) in surface.label_names.iter().enumerate() {
        let name = name.replace(['\n', '\r'], " ");
        stream.text(&format!("comment label {number} {name}\n"));
    }
    stream.text(&format!(
        "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar int vertex_indices\n{}end_header\n",
        surface.n_vertices(),
        surface.n_triangles(),
        if has_labels { "property int label\n" } else { "" }
    ));
    for p in &surface.points {
        for x in p.to_array() {
            stream.bytes(&x.to_le_bytes());
        }
        stream.end()?;
    }
    for (triangle, label) in surface.triangles.iter().zip(&surface.labels) {
        stream.bytes(&[3]);
        for v in triangle.iter().chain(has_labels.then_some(label)) {
            stream.bytes(&v.to_le_bytes());
        }
        stream.end()?;
    }
    Ok(())
}
