//! MEDIT `.mesh` text and `.meshb` binary version 4: references are label + 1 and region.
//!
//! Version 4 is the one with 64-bit numbers everywhere. Source: the libMeshb documentation of the GMF format.

use std::path::Path;

use super::error::Result;
use super::merged::Merged;
use super::output_files::OutputFiles;
use super::stream::Stream;

/// Least bytes of a line with three doubles; few of them are shorter than fifteen digits.
const VERTEX_BYTES_LEAST: u64 = 48;

const VERTICES: (&str, u32) = ("Vertices", 4);
const EDGES: (&str, u32) = ("Edges", 5);
const TRIANGLES: (&str, u32) = ("Triangles", 6);
const TETRAHEDRA: (&str, u32) = ("Tetrahedra", 8);
const DIMENSION: u32 = 3;
const REQUIRED_VERTICES: (&str, u32) = ("RequiredVertices", 15);
const END: u32 = 54;

/// A MEDIT file being written.
trait Medit {
    /// Begins a section of `n` records of `bytes` bytes each (in binary).
    fn section(&mut self, keyword: (&str, u32), n: u64, bytes: u64);
    fn vertex(&mut self, point: [f64; 3], reference: u64) -> Result<()>;
    /// Vertices are counted from 0 here, from 1 in the file.
    fn element(&mut self, vertices: &[u64], reference: u64) -> Result<()>;
    /// A vertex in a list of them.
    fn listed(&mut self, vertex: u64) -> Result<()>;
}

struct TextMedit(Stream);

impl Medit for TextMedit {
    fn section(&mut self, keyword: (&str, u32), n: u64, _: u64) {
        self.0.text(&format!("\n{}\n{n}\n", keyword.0));
    }

    fn vertex(&mut self, point: [f64; 3], reference: u64) -> Result<()> {
        for x in point {
            self.0.double(x, b' ');
        }
        self.0.integer(reference, b'\n');
        self.0.end()
    }

    fn element(&mut self, vertices: &[u64], reference: u64) -> Result<()> {
        for v in vertices {
            self.0.integer(v + 1, b' ');
        }
        self.0.integer(reference, b'\n');
        self.0.end()
    }

    fn listed(&mut self, vertex: u64) -> Result<()> {
        self.0.integer(vertex + 1, b'\n');
        self.0.end()
    }
}

/// A binary file, and the position reached: each section has the position of the next one.
struct BinaryMedit(Stream, u64);

impl Medit for BinaryMedit {
    fn section(&mut self, keyword: (&str, u32), n: u64, bytes: u64) {
        self.1 += 4 + 8 + 8 + n * bytes;
        self.0.bytes(&keyword.1.to_le_bytes());
        self.0.bytes(&self.1.to_le_bytes());
        self.0.bytes(&n.to_le_bytes());
    }

    fn vertex(&mut self, point: [f64; 3], reference: u64) -> Result<()> {
        for x in point {
            self.0.bytes(&x.to_le_bytes());
        }
        self.0.bytes(&reference.to_le_bytes());
        self.0.end()
    }

    fn element(&mut self, vertices: &[u64], reference: u64) -> Result<()> {
        for v in vertices {
            self.0.bytes(&(v + 1).to_le_bytes());
        }
        self.0.bytes(&reference.to_le_bytes());
        self.0.end()
    }

    fn listed(&mut self, vertex: u64) -> Result<()> {
        self.0.bytes(&(vertex + 1).to_le_bytes());
        self.0.end()
    }
}

/// The reference of an embedded point is its label + 1, that of other vertices 0.
fn vertices(mesh: &mut Merged, file: &mut impl Medit) -> Result<()> {
    let points = mesh.embedded().points.iter();
    let mut points: Vec<(u64, u32)> = points.map(|p| (p.vertex, p.label)).collect();
    points.sort_unstable();
    let mut points = points.into_iter().peekable();
    file.section(VERTICES, mesh.n_vertices(), 32);
    mesh.vertices(|number, vertex| {
        let point = points.next_if(|(v, _)| *v == number);
        let reference = point.map_or(0, |(_, label)| u64::from(label) + 1);
        file.vertex(vertex.point, reference)
    })
}

fn embedded(mesh: &Merged, file: &mut impl Medit) -> Result<()> {
    let embedded = mesh.embedded();
    if !embedded.edges.is_empty() {
        file.section(EDGES, embedded.edges.len() as u64, 24);
        for (ends, label) in &embedded.edges {
            file.element(ends, u64::from(*label) + 1)?;
        }
    }
    if !embedded.points.is_empty() {
        file.section(REQUIRED_VERTICES, embedded.points.len() as u64, 8);
        for point in &embedded.points {
            file.listed(point.vertex)?;
        }
    }
    Ok(())
}

fn sections(mesh: &mut Merged, file: &mut impl Medit) -> Result<()> {
    mesh.expect_passes(1, 1);
    vertices(mesh, file)?;
    embedded(mesh, file)?;
    file.section(TRIANGLES, mesh.n_faces(), 32);
    mesh.faces().each(|face| file.element(&face.vertices, u64::from(face.label) + 1))?;
    file.section(TETRAHEDRA, mesh.n_tets(), 40);
    mesh.tets(|tet| file.element(&tet.nodes, u64::from(tet.region)))
}

pub(super) fn write_text(mesh: &mut Merged, outputs: &mut OutputFiles, out: &Path) -> Result<()> {
    let digits = u64::from(mesh.n_vertices().max(1).ilog10());
    let (faces, tets) = (mesh.n_faces(), mesh.n_tets());
    let bytes =
        VERTEX_BYTES_LEAST * mesh.n_vertices() + (3 * digits + 5) * faces + (4 * digits + 6) * tets;
    let path = outputs.create(out, bytes)?;
    let mut file = TextMedit(Stream::open(&path)?);
    file.0.text("MeshVersionFormatted 2\n\nDimension 3\n");
    sections(mesh, &mut file)?;
    file.0.text("\nEnd\n");
    file.0.finish()
}

pub(super) fn write_binary(mesh: &mut Merged, outputs: &mut OutputFiles, out: &Path) -> Result<()> {
    let bytes = 100 + 32 * (mesh.n_vertices() + mesh.n_faces()) + 40 * mesh.n_tets();
    let path = outputs.create(out, bytes)?;
    let mut stream = Stream::open(&path)?;
    // Byte order, version, then the dimension as a section without a count.
    for value in [1u32, 4, DIMENSION] {
        stream.bytes(&value.to_le_bytes());
    }
    let begin: u64 = 8 + 16;
    stream.bytes(&begin.to_le_bytes());
    stream.bytes(&3u32.to_le_bytes());
    let mut file = BinaryMedit(stream, begin);
    sections(mesh, &mut file)?;
    file.0.bytes(&END.to_le_bytes());
    file.0.bytes(&0u64.to_le_bytes());
    file.0.finish()
}
