//! Sizes at the vertices of a mesh: MEDIT `.sol` or `.solb`, and the `.mesh` or `.meshb` beside it.
//!
//! A file has one number for each vertex. A mesh with tetrahedra is a background; without a mesh, or with one of triangles
//! alone, the sizes are those of the surface's own vertices.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use super::error::{FilePlace, ReadFault};
use super::feed::{Feed, Result};
use super::medit_numbers::{MeditNumbers, SectionRead};
use super::open::open_plain;
use tetdb_base::geom::Point;

/// The kind of a solution that is one number.
const SCALAR: i64 = 1;
/// Bytes held for each vertex and tetrahedron of a background.
const VERTEX_BYTES: u64 = 112;
const TET_BYTES: u64 = 96;

/// The file of sizes and the mesh beside it, where `path` is either of the two.
///
/// # Errors
/// Another kind of file; a mesh without sizes.
pub fn size_files(path: &Path) -> Result<(PathBuf, Option<PathBuf>)> {
    let beside = |endings: [&str; 2]| {
        let all = endings.map(|e| path.with_extension(e));
        all.into_iter().find(|p| p.is_file())
    };
    let refuse = |fault| Err(FilePlace::new(path).refuse(fault));
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    match extension.to_ascii_lowercase().as_str() {
        "sol" => Ok((path.to_owned(), beside(["mesh", "meshb"]))),
        "solb" => Ok((path.to_owned(), beside(["meshb", "mesh"]))),
        "mesh" | "meshb" => match beside(["sol", "solb"]) {
            Some(sizes) => Ok((sizes, Some(path.to_owned()))),
            None => refuse(ReadFault::Alone(path.with_extension("sol").display().to_string())),
        },
        _ => refuse(ReadFault::UnknownFormat(
            "sizes are read from .sol or .solb, with their mesh beside them; new sizes for sub-domains also from .npy",
        )),
    }
}

/// Wanted edge lengths as a file has them.
#[derive(Clone, Debug)]
pub enum FileSizes {
    /// At the vertices of a tetrahedral mesh. Shape: `h` runs parallel to `points`, which `tets` index.
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
    let (sizes, mesh) = size_files(path)?;
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
}
