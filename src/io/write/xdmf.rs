//! XDMF 3: `NAME.xdmf` describes the tetrahedra, `NAME_boundary.xdmf` the boundary faces; each has its arrays in an `.h5` file of its own name.
//!
//! Vertices are in the first alone, and faces name them by the same numbers as tetrahedra do: so programs find the faces in the mesh. Names of regions and
//! labels are in the element `Information`, in the form that meshio reads. Source: the XDMF model and format; midpoints have VTK's order.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::columns::{Number, TableColumn, column, put_row};
use super::error::Result;
use super::faces::MergedFace;
use super::hdf5::{self, Hdf5Object};
use super::merged::{Measured, Merged, MergedTet};
use super::midpoints::Midpoints;
use super::names::escaped;
use super::output_files::OutputFiles;
use super::stream::{Stream, Strip};
use super::vtk::{NO_ID, VertexRow, boundary_path, group_columns, tet_columns, vertex_columns};
use tetdb_schema::field::FieldRow;

/// Writes the four files.
pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    midpoints: Option<&Midpoints>,
) -> Result<()> {
    mesh.expect_passes(1, 1);
    let [at_vertices, at_tets] = mesh.read_fields(midpoints.is_some(), false)?;
    let arrays = Arrays::new(mesh, midpoints, [&at_vertices, &at_tets]);
    let Arrays { vertices, tets, faces } = &arrays;
    let kinds = match midpoints {
        None => ["Tetrahedron", "Triangle"],
        Some(_) => ["Tetrahedron_10", "Triangle_6"],
    };
    let outs = [out.to_owned(), boundary_path(out)];
    let data = outs.each_ref().map(|out| out.with_extension("h5"));
    let names = data.each_ref().map(|path| path.file_name().unwrap_or_default().to_string_lossy());
    let mut describe = |path: &Path, title: &str, body: String| -> Result<()> {
        let geometry = vertices.item(&names[0], 0);
        let path = outputs.create(path, 4096)?;
        let mut stream = Stream::open(&path)?;
        stream.text(&format!(
            "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n    <Grid Name=\"{title}\" GridType=\"Uniform\">\n      \
             <Geometry GeometryType=\"XYZ\">{geometry}</Geometry>\n{body}    </Grid>\n  </Domain>\n</Xdmf>\n"
        ));
        stream.finish()
    };
    let regions = mesh.filled_regions()?.into_iter();
    let regions = regions.map(|region| (region, mesh.region_name(region))).collect();
    let body = tets.topology(&names[0], kinds[0]) + &tets.attributes(&names[0], "Cell");
    let body = body + &vertices.attributes(&names[0], "Node") + &information(&regions, 3);
    describe(&outs[0], "mesh", body)?;
    let body = faces.topology(&names[1], kinds[1]) + &faces.attributes(&names[1], "Cell");
    describe(&outs[1], "boundary", body + &information(&mesh.labels(), 2))?;

    let mut begin = |data: &Path, groups: Vec<Hdf5Object>| -> Result<(PathBuf, Vec<[u64; 2]>)> {
        let layout = hdf5::plan(&Hdf5Object::group("", groups));
        let path = outputs.create(data, layout.file_bytes)?;
        let mut head = Strip::open(&path, 0, layout.head.len() as u64)?;
        head.put(&layout.head)?;
        head.finish()?;
        Ok((path, layout.arrays))
    };
    let (path, places) = begin(&data[0], vec![vertices.object(), tets.object()])?;
    arrays.fill(mesh, (&path, &places), (midpoints, &at_vertices))?;
    let (path, places) = begin(&data[1], vec![faces.object()])?;
    arrays.fill_faces(mesh, (&path, &places), midpoints)
}

/// The arrays of both `.h5` files.
struct Arrays {
    vertices: Table<VertexRow>,
    tets: Table<MergedTet>,
    faces: Table<MergedFace>,
}

impl Arrays {
    fn new(mesh: &Merged, midpoints: Option<&Midpoints>, fields: [&[FieldRow]; 2]) -> Self {
        let n_nodes = mesh.n_vertices() + midpoints.map_or(0, Midpoints::n);
        let index = if n_nodes <= i32::MAX as u64 { Number::I32 } else { Number::I64 };
        let corners = if midpoints.is_some() { [10, 6] } else { [4, 3] };
        let mut of_tets = tet_columns(fields[1]);
        // First what programs read that take the first array alone.
        of_tets.sort_by_key(|column| column.name != "region");
        let mut of_faces = vec![
            column("label", |face: &MergedFace| face.label),
            column("input_id", |face: &MergedFace| face.triangle().map_or(-1, |t| t as i64)),
            column("region_front", |face: &MergedFace| face.regions[0]),
            column("region_back", |face: &MergedFace| face.regions[1]),
        ];
        of_faces.extend(group_columns(mesh));
        let points = ("points", Number::F64, 3);
        let nodes = |n| ("connectivity", index, n);
        Self {
            vertices: Table::new("vertices", n_nodes, points, vertex_columns(fields[0])),
            tets: Table::new("tets", mesh.n_tets(), nodes(corners[0]), of_tets),
            faces: Table::new("faces", mesh.n_faces(), nodes(corners[1]), of_faces),
        }
    }

    /// Fills the arrays of vertices and tetrahedra at their places. Errors: damage, the disk.
    fn fill(
        &self,
        mesh: &mut Merged,
        (path, places): (&Path, &[[u64; 2]]),
        (midpoints, fields): (Option<&Midpoints>, &[FieldRow]),
    ) -> Result<()> {
        let mut places = places.iter();
        let mut vertices = self.vertices.open(path, &mut places)?;
        let mut tets = self.tets.open(path, &mut places)?;
        mesh.vertices_with(fields, |_, vertex, words| {
            vertices.row(&(vertex.id as i64, words.to_vec()), vertex.point.map(f64::to_bits))
        })?;
        if let Some(midpoints) = midpoints {
            for row in midpoints.rows(fields)? {
                let (point, words) = row?;
                vertices.row(&(NO_ID, words), point.map(f64::to_bits))?;
            }
        }
        vertices.finish()?;
        let first_midpoint = mesh.n_vertices();
        let mut edges = midpoints.map(Midpoints::tets).transpose()?;
        mesh.measured_tets(Measured::Excess, |tet| {
            let edges = edges.as_mut().map(|edges| edges.next()).transpose()?;
            let edges = edges.into_iter().flatten().map(|edge| first_midpoint + edge);
            tets.row(tet, tet.nodes.into_iter().chain(edges))
        })?;
        tets.finish()
    }

    /// Fills the arrays of the boundary faces at their places. Errors: the disk.
    fn fill_faces(
        &self,
        mesh: &Merged,
        (path, places): (&Path, &[[u64; 2]]),
        midpoints: Option<&Midpoints>,
    ) -> Result<()> {
        let mut faces = self.faces.open(path, &mut places.iter())?;
        let first_midpoint = mesh.n_vertices();
        let mut edges = midpoints.map(Midpoints::faces).transpose()?;
        mesh.faces().each(|face| {
            let edges = edges.as_mut().map(|edges| edges.next()).transpose()?;
            let edges = edges.into_iter().flatten().map(|edge| first_midpoint + edge);
            faces.row(face, face.vertices.into_iter().chain(edges))
        })?;
        faces.finish()
    }
}

/// Name, type and numbers in a row of an array.
type Shape<'a> = (&'a str, Number, u64);

/// A group of arrays of equally many rows: positions or nodes, then columns.
struct Table<T> {
    name: &'static str,
    rows: u64,
    main: Shape<'static>,
    columns: Vec<TableColumn<T>>,
}

impl<T> Table<T> {
    fn new(
        name: &'static str,
        rows: u64,
        main: Shape<'static>,
        columns: Vec<TableColumn<T>>,
    ) -> Self {
        Self { name, rows, main, columns }
    }

    fn shapes(&self) -> impl Iterator<Item = Shape<'_>> {
        let columns = self.columns.iter().map(|c| (&*c.name, c.number, c.components));
        std::iter::once(self.main).chain(columns)
    }

    fn object(&self) -> Hdf5Object {
        let array = |(name, number, components): Shape| {
            let (shape, rank) = ([self.rows, components], if components == 1 { 1 } else { 2 });
            Hdf5Object::array(name.to_owned(), number, &shape[..rank])
        };
        Hdf5Object::group(self.name, self.shapes().map(array).collect())
    }

    /// The element that leads to array `i` of the `.h5` file.
    fn item(&self, file: &str, i: usize) -> String {
        let (name, number, components) = self.shapes().nth(i).expect("the caller counts them");
        let components = if components == 1 { String::new() } else { format!(" {components}") };
        let kind = match number {
            Number::F32 | Number::F64 => "Float",
            Number::I32 | Number::I64 => "Int",
            Number::U8 | Number::U32 => "UInt",
        };
        format!(
            "<DataItem Dimensions=\"{}{components}\" NumberType=\"{kind}\" Precision=\"{}\" Format=\"HDF\">{}:/{}/{name}</DataItem>",
            self.rows,
            number.bytes(),
            escaped(file),
            self.name,
        )
    }

    fn topology(&self, file: &str, kind: &str) -> String {
        let (item, n) = (self.item(file, 0), self.rows);
        format!(
            "      <Topology TopologyType=\"{kind}\" NumberOfElements=\"{n}\">{item}</Topology>\n"
        )
    }

    /// The columns. Six components are no `Tensor6`, whose order is another.
    fn attributes(&self, file: &str, center: &str) -> String {
        let attribute = |(i, (name, _, components)): (usize, Shape)| {
            let kind = match components {
                1 => "Scalar",
                3 => "Vector",
                9 => "Tensor",
                _ => "Matrix",
            };
            let item = self.item(file, i);
            format!(
                "      <Attribute Name=\"{name}\" AttributeType=\"{kind}\" Center=\"{center}\">{item}</Attribute>\n"
            )
        };
        self.shapes().enumerate().skip(1).map(attribute).collect()
    }

    /// Opens the arrays, whose places come next.
    fn open<'a>(
        &self,
        path: &Path,
        places: &mut impl Iterator<Item = &'a [u64; 2]>,
    ) -> Result<OpenTable<'_, T>> {
        let strips = places.take(1 + self.columns.len()).map(|&[at, n]| Strip::open(path, at, n));
        let mut strips = strips.collect::<Result<Vec<_>>>()?;
        let main = strips.remove(0);
        Ok(OpenTable { table: self, main, strips })
    }
}

/// The arrays of a table being filled.
struct OpenTable<'t, T> {
    table: &'t Table<T>,
    main: Strip,
    strips: Vec<Strip>,
}

impl<T> OpenTable<'_, T> {
    /// Writes the next row, its positions or nodes as words. Errors: the disk.
    fn row(&mut self, row: &T, main: impl IntoIterator<Item = u64>) -> Result<()> {
        let bytes = self.table.main.1.bytes() as usize;
        for word in main {
            self.main.put(&word.to_le_bytes()[..bytes])?;
        }
        put_row(row, &self.table.columns, &mut self.strips)
    }

    fn finish(self) -> Result<()> {
        self.main.finish()?;
        self.strips.into_iter().try_for_each(Strip::finish)
    }
}

/// Names by number: of regions (dimension 3) or labels (2).
fn information(names: &BTreeMap<u32, String>, dimension: u32) -> String {
    let line = |(number, name): (&u32, &String)| {
        format!("<map key=\"{}\" dim=\"{dimension}\">{number}</map>", escaped(name))
    };
    let lines: String = names.iter().map(line).collect();
    format!("      <Information Name=\"names\"><![CDATA[<main>{lines}</main>]]></Information>\n")
}
