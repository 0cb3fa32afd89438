//! Sizes at the vertices of a mesh: MEDIT `.sol` or `.solb`, and the `.mesh` or `.meshb` beside it; the files of other programs.
//!
//! A file has one number for each vertex. A mesh with tetrahedra is a background; without a mesh, or with one of triangles
//! alone, the sizes of MEDIT and TetGen are those of the surface's own vertices, all others are at points.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use super::error::{FilePlace, ReadFault};
use super::feed::{Feed, Result};
use super::gmsh_old::{self, NodeData};
use super::lengths::read_rows;
use super::medit_numbers::{MeditNumbers, SectionRead};
use super::open::{open, open_plain};
use super::volume_cells::VolumeCells;
use super::{PointColumns, PointTable, SurfaceSink, tetgen, vtk_xml};
use tetdb_base::geom::Point;
use tetdb_base::surface::SurfaceBuilder;

/// The kind of a solution that is one number.
const SCALAR: i64 = 1;
/// Bytes held for each vertex and tetrahedron of a background.
const VERTEX_BYTES: u64 = 112;
const TET_BYTES: u64 = 96;

/// The file of sizes and the mesh beside it, where `path` is either of the two.
///
/// # Errors
/// Another kind of file; a mesh without sizes.
pub fn size_files(path: &Path) -> Result<(PathBuf, Vec<PathBuf>)> {
    let beside = |endings: [&str; 2]| {
        let all = endings.map(|e| path.with_extension(e));
        all.into_iter().find(|p| p.is_file()).into_iter().collect()
    };
    let refuse = |fault| Err(FilePlace::new(path).refuse(fault));
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    match extension.to_ascii_lowercase().as_str() {
        "sol" => Ok((path.to_owned(), beside(["mesh", "meshb"]))),
        "solb" => Ok((path.to_owned(), beside(["meshb", "mesh"]))),
        "csv" | "tsv" | "npy" | "msh" | "vtu" => Ok((path.to_owned(), Vec::new())),
        "mtr" => {
            let files = ["node", "ele"].map(|e| path.with_extension(e));
            Ok((path.to_owned(), files.into_iter().filter(|p| p.is_file()).collect()))
        }
        "mesh" | "meshb" => match beside(["sol", "solb"]).pop() {
            Some(sizes) => Ok((sizes, vec![path.to_owned()])),
            None => refuse(ReadFault::Alone(path.with_extension("sol").display().to_string())),
        },
        _ => refuse(ReadFault::UnknownFormat(
            "sizes are read from .sol, .solb or .mtr, with their mesh beside them, from .csv, .tsv and .npy of x, y, z and a length, from .msh with $NodeData and from .vtu",
        )),
    }
}

/// Wanted edge lengths as a file has them.
#[derive(Clone, Debug)]
pub enum FileSizes {
    /// At the vertices of a tetrahedral mesh, or at points where there are no tetrahedra. Shape: `h` runs parallel to `points`, which
    /// `tets` index.
    Mesh {
        /// The vertices.
        points: Vec<Point>,
        /// The tetrahedra.
        tets: Vec<[u32; 4]>,
        /// The wanted edge lengths, above zero.
        h: Vec<f64>,
    },
    /// At the vertices of the surface itself, in their order.
    AtVertices(Vec<f64>),
}

/// Reads the sizes that `path` names, holding at most `limit` bytes.
///
/// # Errors
/// The place of a bad size, a solution that is no scalar, sizes that do not fit the mesh.
pub fn read_sizes(path: &Path, limit: u64) -> Result<FileSizes> {
    let (sizes, beside) = size_files(path)?;
    let extension = sizes.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    if !extension.starts_with("sol") {
        return read_foreign(path, &extension, &beside, limit);
    }
    let mesh = beside.into_iter().next();
    let h = sizes_in(open_medit(&sizes)?, limit)?;
    let Some(mesh_path) = mesh else {
        return Ok(FileSizes::AtVertices(h));
    };
    let SolidMesh { points, tets } = mesh_in(open_medit(&mesh_path)?, limit)?;
    if tets.is_empty() {
        return Ok(FileSizes::AtVertices(h));
    }
    if h.len() != points.len() {
        return Err(FilePlace::new(&sizes).refuse(ReadFault::CountMismatch {
            what: "sizes",
            declared: h.len().to_string(),
            found: format!("{} vertices in {}", points.len(), mesh_path.display()),
        }));
    }
    Ok(FileSizes::Mesh { points, tets, h })
}

/// Reads the sizes of another program.
fn read_foreign(path: &Path, extension: &str, beside: &[PathBuf], limit: u64) -> Result<FileSizes> {
    let whole = FilePlace::new(path);
    let (points, tets, h) = match extension {
        "npy" => {
            let rows = read_rows(path, limit)?;
            let rows = rows.chunks_exact(4);
            let points = rows.clone().map(Point::from_slice).collect();
            (points, Vec::new(), rows.map(|row| row[3]).collect())
        }
        "msh" => {
            let mut builder = SurfaceBuilder::within(limit);
            let mut target = SurfaceSink {
                builder: &mut builder,
                stem: String::new(),
                prefix: None,
                cells: VolumeCells::default(),
            };
            target.builder.begin_file(&whole.file);
            gmsh_old::read_node_data(open(path, limit)?, &mut target)?
        }
        "vtu" => read_vtu(path, limit)?,
        "mtr" => match read_mtr(path, beside, limit)? {
            (false, (_, _, h)) => {
                return check_sizes(&whole, &h).map(|()| FileSizes::AtVertices(h));
            }
            (true, data) => data,
        },
        _ => {
            let (mut points, mut h) = (Vec::new(), Vec::new());
            for row in PointTable::open(path, PointColumns::Sized, limit)? {
                let row = row?;
                let [x, y, z, size] = row.numbers;
                check_sizes(&row.place, &[size])?;
                points.push(Point::new(x, y, z));
                h.push(size);
                if VERTEX_BYTES * points.len() as u64 > limit {
                    let needed = VERTEX_BYTES * points.len() as u64;
                    return Err(whole.refuse(ReadFault::TooLarge {
                        what: "the sizes",
                        needed,
                        limit,
                    }));
                }
            }
            (points, Vec::new(), h)
        }
    };
    check_sizes(&whole, &h)?;
    let needed = VERTEX_BYTES * points.len() as u64 + TET_BYTES * tets.len() as u64;
    let fault = match (h.len() == points.len(), points.is_empty()) {
        _ if needed > limit => ReadFault::TooLarge { what: "the background mesh", needed, limit },
        (true, false) => return Ok(FileSizes::Mesh { points, tets, h }),
        (true, true) => {
            ReadFault::Unexpected { expected: "sizes".to_owned(), found: "none".to_owned() }
        }
        (false, _) => {
            let found = format!("{} points", points.len());
            ReadFault::CountMismatch { what: "sizes", declared: h.len().to_string(), found }
        }
    };
    Err(whole.refuse(fault))
}

fn check_sizes(place: &FilePlace, h: &[f64]) -> Result<()> {
    match h.iter().position(|h| !(h.is_normal() && *h > 0.0)) {
        None => Ok(()),
        Some(i) => {
            let (expected, found) =
                ("a length above zero".to_owned(), format!("{} as number {i}", h[i]));
            Err(place.refuse(ReadFault::Unexpected { expected, found }))
        }
    }
}

/// The one array of single numbers at points, or that called `h` or `size`, with the tetrahedra of a grid.
fn read_vtu(path: &Path, limit: u64) -> Result<NodeData> {
    let place = FilePlace::new(path);
    let (mut points, mut tets, mut h) = (Vec::new(), Vec::new(), Vec::new());
    for piece in vtk_xml::pieces(open(path, limit)?, limit)? {
        let n = piece.points().len();
        let all: Vec<&vtk_xml::Array> = (piece.arrays.iter())
            .filter(|a| a.section == "PointData" && a.n_components == 1 && a.values.len() == n)
            .collect();
        let named =
            all.iter().find(|a| ["h", "size"].contains(&a.name.to_ascii_lowercase().as_str()));
        let array = match (named, &all[..]) {
            (Some(array), _) | (None, [array]) => array,
            _ => {
                let names: Vec<&str> = all.iter().map(|a| a.name.as_str()).collect();
                let expected =
                    "one array of single numbers at points, or one called `h`".to_owned();
                let found = format!("{} ({})", all.len(), names.join(", "));
                return Err(place.refuse(ReadFault::Unexpected { expected, found }));
            }
        };
        let first = points.len() as u32;
        for (cell, &kind) in
            piece.cells("Cells", &place)?.iter().zip(piece.values("Cells", "types"))
        {
            match (kind as i64, &cell[..]) {
                (10 | 24 | 71, &[a, b, c, d, ..]) => tets.push([a, b, c, d].map(|v| v + first)),
                (1..=9 | 21..=23 | 28 | 30 | 34 | 35, _) => {}
                _ => {
                    let what = "a background of other cells than tetrahedra".to_owned();
                    return Err(place.refuse(ReadFault::Unsupported(what)));
                }
            }
        }
        h.extend(&array.values);
        points.extend(piece.points());
    }
    Ok((points, tets, h))
}

/// The numbers of a `.mtr` file with the points and tetrahedra of the files beside it. False
/// if there are no points: then they are for the surface's own vertices.
fn read_mtr(path: &Path, beside: &[PathBuf], limit: u64) -> Result<(bool, NodeData)> {
    let mut feed = open(path, limit)?;
    feed.comment = Some(b'#');
    let n = feed.count("sizes", 2)?;
    if feed.integer("how many numbers a node has")? != 1 {
        return Err(feed.unsupported("a .mtr file of tensors"));
    }
    let mut h = Vec::new();
    for i in 0..n {
        feed.need_record("sizes", n, i)?;
        feed.need_word("a size")?;
        h.push(feed.parse("a size")?);
    }
    let of =
        |extension: &str| beside.iter().find(|p| p.extension().is_some_and(|e| e == extension));
    let Some(nodes) = of("node") else {
        return Ok((false, (Vec::new(), Vec::new(), h)));
    };
    let (first, points) = tetgen::read_positions(open(nodes, limit)?)?;
    let mut tets = Vec::new();
    if let Some(elements) = of("ele") {
        let mut feed = open(elements, limit)?;
        feed.comment = Some(b'#');
        let n = feed.count("tetrahedra", 8)?;
        feed.skip_line()?;
        for i in 0..n {
            feed.need_record("tetrahedra", n, i)?;
            feed.integer("the number of a tetrahedron")?;
            let mut tet = [0; 4];
            for corner in &mut tet {
                *corner = feed.index(first, points.len() as u64)?;
            }
            tets.push(tet);
            feed.skip_line()?;
        }
    }
    Ok((true, (points, tets, h)))
}

fn open_medit(path: &Path) -> Result<MeditNumbers<BufReader<File>>> {
    let (reader, length) = open_plain(path)?;
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let is_binary = extension.to_ascii_lowercase().ends_with('b');
    MeditNumbers::open(Feed::new(&path.to_string_lossy(), reader, length), is_binary)
}

/// Vertices and tetrahedra of a mesh.
#[derive(Default)]
struct SolidMesh {
    points: Vec<Point>,
    tets: Vec<[u32; 4]>,
}

/// Refuses what would take more memory than there is.
fn check<R: BufRead>(feed: &Feed<R>, what: &'static str, needed: u64, limit: u64) -> Result<()> {
    match needed > limit {
        true => Err(feed.refuse(ReadFault::TooLarge { what, needed, limit })),
        false => Ok(()),
    }
}

fn check_dimension<R: BufRead>(numbers: &mut MeditNumbers<R>) -> Result<()> {
    match numbers.small_integer("the dimension")? {
        3 => Ok(()),
        dimension => Err(numbers.feed.unsupported(format!("sizes in dimension {dimension}"))),
    }
}

fn sizes_in<R: BufRead>(mut numbers: MeditNumbers<R>, limit: u64) -> Result<Vec<f64>> {
    let mut found = None;
    numbers.sections(SectionRead::Part, |numbers, keyword| {
        if keyword == "dimension" {
            check_dimension(numbers)?;
        }
        if keyword == "solatvertices" {
            let n = numbers.count("sizes", 1, 0)?;
            check(&numbers.feed, "the sizes", 8 * n, limit)?;
            let n_kinds = numbers.small_integer("a count")?;
            let kind = numbers.small_integer("a kind")?;
            if (n_kinds, kind) != (1, SCALAR) {
                let what = "a solution that is not one number per vertex";
                return Err(numbers.feed.unsupported(what));
            }
            let mut sizes = Vec::new();
            for i in 0..n {
                numbers.feed.need_record("sizes", n, i)?;
                let h = numbers.real("a size")?;
                if !h.is_normal() || h < 0.0 {
                    let found = h.to_string();
                    return Err(numbers.feed.unexpected("a length above zero", found.as_bytes()));
                }
                sizes.push(h);
            }
            found = Some(sizes);
        }
        Ok(SectionRead::Part)
    })?;
    found.ok_or_else(|| numbers.feed.unexpected("a section `SolAtVertices`", b"none"))
}

fn mesh_in<R: BufRead>(mut numbers: MeditNumbers<R>, limit: u64) -> Result<SolidMesh> {
    let mut mesh = SolidMesh::default();
    numbers.sections(SectionRead::Part, |numbers, keyword| {
        let held = VERTEX_BYTES * mesh.points.len() as u64;
        match keyword {
            "dimension" => check_dimension(numbers)?,
            "vertices" => {
                let n = numbers.count("vertices", 3, 1)?;
                check(&numbers.feed, "the background mesh", held + n * VERTEX_BYTES, limit)?;
                for i in 0..n {
                    numbers.feed.need_record("vertices", n, i)?;
                    let point = numbers.point()?;
                    numbers.integer("a vertex reference")?;
                    mesh.points.push(point);
                }
            }
            "tetrahedra" => {
                let n = numbers.count("tetrahedra", 0, 5)?;
                check(&numbers.feed, "the background mesh", held + n * TET_BYTES, limit)?;
                for i in 0..n {
                    numbers.feed.need_record("tetrahedra", n, i)?;
                    let tet = numbers.corners(mesh.points.len() as u64)?;
                    numbers.integer("a reference")?;
                    let [a, b, c, d] = tet.map(|v| mesh.points[v as usize]);
                    if (b - a).cross(c - a).dot(d - a) == 0.0 {
                        let found = format!("tetrahedron {} without volume", mesh.tets.len() + 1);
                        let expected = "tetrahedra with a volume";
                        return Err(numbers.feed.unexpected(expected, found.as_bytes()));
                    }
                    mesh.tets.push(tet);
                }
            }
            _ => {}
        }
        Ok(SectionRead::Part)
    })?;
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::super::error::Spot;
    use super::*;

    const POINTS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const SIZES: [f64; 4] = [0.25, 0.5, 0.125, 1.0];

    /// Sections of a binary file of that version, with the places after them.
    fn binary(version: i32, sections: &[(i32, Vec<u8>)]) -> Vec<u8> {
        let mut bytes = [1, version].map(i32::to_le_bytes).concat();
        let position = if version >= 3 { 8 } else { 4 };
        for (keyword, content) in sections {
            bytes.extend(keyword.to_le_bytes());
            let next = (bytes.len() + position + content.len()) as u64;
            bytes.extend(&next.to_le_bytes()[..position]);
            bytes.extend(content);
        }
        bytes.extend(54i32.to_le_bytes());
        bytes
    }

    fn integers(version: i32, list: &[i64]) -> Vec<u8> {
        let width = if version >= 4 { 8 } else { 4 };
        let bytes = list.iter().flat_map(|i| i.to_le_bytes()[..width].to_vec());
        bytes.collect()
    }

    fn numbers(version: i32, list: &[f64]) -> Vec<u8> {
        let bytes = list.iter().flat_map(|&x| match version {
            1 => (x as f32).to_le_bytes().to_vec(),
            _ => x.to_le_bytes().to_vec(),
        });
        bytes.collect()
    }

    #[test]
    fn binary_and_text_say_the_same() {
        let dir = tempfile::tempdir().unwrap();
        for version in 1..=4 {
            let mut vertices = integers(version, &[4]);
            for p in POINTS {
                vertices.extend(numbers(version, &p));
                vertices.extend(integers(version, &[0]));
            }
            let tets = integers(version, &[1, 1, 2, 3, 4, 7]);
            let mut sizes = integers(version, &[4]);
            sizes.extend([1, 1].map(i32::to_le_bytes).concat());
            sizes.extend(numbers(version, &SIZES));
            let dimension = 3i32.to_le_bytes().to_vec();
            let mesh = [(3, dimension.clone()), (4, vertices), (8, tets)];
            let path = dir.path().join("a.solb");
            std::fs::write(dir.path().join("a.meshb"), binary(version, &mesh)).unwrap();
            std::fs::write(&path, binary(version, &[(3, dimension), (62, sizes)])).unwrap();
            let Ok(FileSizes::Mesh { points, tets, h }) = read_sizes(&path, 1 << 20) else {
                panic!("version {version} is not read");
            };
            assert_eq!(points, POINTS.map(Point::from_array));
            assert_eq!((tets, h), (vec![[0, 1, 2, 3]], SIZES.to_vec()));
            // More than there may be is refused from the count alone.
            let refused = read_sizes(&path, 100).unwrap_err();
            assert_eq!(refused.code(), "memory");
            assert!(matches!(refused.place().spot, Spot::Byte(_)), "{refused}");
        }
    }

    #[test]
    fn files_of_other_programs_say_the_same() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| {
            std::fs::write(dir.path().join(name), bytes).unwrap();
            dir.path().join(name)
        };
        let rows = |separator: &str| -> String {
            let row = |(p, h): (&[f64; 3], &f64)| {
                [p[0], p[1], p[2], *h].map(|x| x.to_string()).join(separator) + "\n"
            };
            POINTS.iter().zip(&SIZES).map(row).collect()
        };
        let nodes = |from: usize| -> String {
            let row =
                |(i, p): (usize, &[f64; 3])| format!("{} {} {} {}\n", i + from, p[0], p[1], p[2]);
            POINTS.iter().enumerate().map(row).collect()
        };
        let mut npy = b"\x93NUMPY\x01\x00".to_vec();
        let head = "{'descr': '<f8', 'fortran_order': False, 'shape': (4, 4), }\n";
        npy.extend((head.len() as u16).to_le_bytes());
        npy.extend(head.bytes());
        for (p, h) in POINTS.iter().zip(&SIZES) {
            p.iter().chain([h]).for_each(|x| npy.extend(x.to_le_bytes()));
        }
        let data = (1..).zip(SIZES).map(|(i, h)| format!("{i} {h}\n")).collect::<String>();
        let msh = format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n{}$EndNodes\n$Elements\n1\n1 4 2 0 1 1 2 3 4\n$EndElements\n\
             $NodeData\n1\n\"wanted size\"\n1\n0.0\n3\n0\n1\n4\n{data}$EndNodeData\n",
            nodes(1)
        );
        let points = POINTS.map(|p| p.map(|x| x.to_string()).join(" ")).join(" ");
        let array = |name: &str, n: u8, text: &str| {
            format!(
                "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{n}\" format=\"ascii\">{text}</DataArray>"
            )
        };
        let vtu = format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece><PointData>{}{}</PointData><Points>{}</Points><Cells>{}{}{}</Cells></Piece></UnstructuredGrid></VTKFile>",
            array("velocity", 3, "0 0 0 0 0 0 0 0 0 0 0 0"),
            array("size", 1, "0.25 0.5 0.125 1"),
            array("", 3, &points),
            array("connectivity", 1, "0 1 2 3"),
            array("offsets", 1, "4"),
            array("types", 1, "10")
        );
        let mtr = write("b.mtr", b"4 1\n0.25\n0.5\n0.125\n1\n");
        let Ok(FileSizes::AtVertices(h)) = read_sizes(&mtr, 1 << 20) else { panic!("no points") };
        assert_eq!(h, SIZES);
        write("b.node", format!("4 3 0 0\n{}", nodes(0)).as_bytes());
        let tet = vec![[0, 1, 2, 3]];
        for (path, expected) in [
            (write("a.csv", rows(",").as_bytes()), vec![]),
            (write("b.tsv", format!("# z h\nx y z h\n{}", rows(" ")).as_bytes()), vec![]),
            (
                write(
                    "c.csv",
                    ("h;x;y;z\n0,25;0;0;0\n0,5;1;0;0\n0,125;0;1;0\n1;0;0;1\n").as_bytes(),
                ),
                vec![],
            ),
            (write("a.npy", &npy), vec![]),
            (write("a.msh", msh.as_bytes()), tet.clone()),
            (write("p.msh", msh.replace("1\n1 4 2 0 1 1 2 3 4", "0").as_bytes()), vec![]),
            (write("a.vtu", vtu.as_bytes()), tet.clone()),
            (mtr.clone(), vec![]),
            (mtr, tet),
        ] {
            if path.ends_with("b.mtr") && !expected.is_empty() {
                write("b.ele", b"1 4 0\n0 0 1 2 3\n");
            }
            let Ok(FileSizes::Mesh { points, tets, h }) = read_sizes(&path, 1 << 20) else {
                panic!("{}: {:?}", path.display(), read_sizes(&path, 1 << 20));
            };
            assert_eq!(points, POINTS.map(Point::from_array), "{}", path.display());
            assert_eq!((tets, h), (expected, SIZES.to_vec()), "{}", path.display());
        }
        for (name, text, code) in [
            ("d.csv", rows(",").replace("0.125", "-1"), "unexpected-text"),
            ("e.csv", "1,2,3\n".to_owned(), "not-a-number"),
            ("f.msh", msh.replace("\n4 1\n", "\n4 0\n"), "unexpected-text"),
            (
                "g.msh",
                msh.replace("$NodeData", "$Else").replace("$EndNodeData", "$EndElse"),
                "unexpected-text",
            ),
            (
                "h.vtu",
                vtu.replace("NumberOfComponents=\"1\" format=\"ascii\">0.25", ">0.25 1"),
                "unexpected-text",
            ),
            (
                "i.vtu",
                vtu.replace(
                    "\"types\" NumberOfComponents=\"1\" format=\"ascii\">10",
                    "\"types\">12",
                ),
                "unsupported-content",
            ),
            ("j.mtr", "1 6\n1 0 0 1 0 1\n".to_owned(), "unsupported-content"),
            ("k.csv", String::new(), "unexpected-text"),
        ] {
            let path = write(name, text.as_bytes());
            let error =
                read_sizes(&path, 1 << 20).err().unwrap_or_else(|| panic!("{name} is read"));
            assert_eq!(error.code(), code, "{name}: {error}");
        }
    }
}
