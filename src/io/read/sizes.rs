//! Sizes at the vertices of a mesh: MEDIT `.sol` or `.solb`, and the `.mesh` or `.meshb` beside it.
//!
//! One number per vertex is wanted. With tetrahedra in the mesh it is a background; without a mesh, or with one of triangles
//! alone, the sizes are those of the surface's own vertices.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use super::error::{FilePlace, ReadError, Spot};
use super::feed::{Feed, Result};
use super::meditb::{DIMENSION, Numbers, TETRAHEDRA, VERTICES};
use super::open::open_plain;
use tetdb_base::geom::Point;

/// Keyword of sizes in binary files.
const SOL_AT_VERTICES: i64 = 62;
/// The kind of a solution that is one number.
const SCALAR: i64 = 1;
/// Bytes held for each vertex and tetrahedron of a background.
const VERTEX_BYTES: u64 = 112;
const TET_BYTES: u64 = 96;

/// The file of sizes and the mesh beside it that `path` names, whichever of the two it is.
///
/// # Errors
/// Another kind of file; a mesh without sizes.
pub fn size_files(path: &Path) -> Result<(PathBuf, Option<PathBuf>)> {
    let beside = |endings: [&str; 2]| {
        let all = endings.map(|e| path.with_extension(e));
        all.into_iter().find(|p| p.is_file())
    };
    let place = || FilePlace { file: path.display().to_string(), spot: Spot::Totals };
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    match extension.to_ascii_lowercase().as_str() {
        "sol" => Ok((path.to_owned(), beside(["mesh", "meshb"]))),
        "solb" => Ok((path.to_owned(), beside(["meshb", "mesh"]))),
        "mesh" | "meshb" => match beside(["sol", "solb"]) {
            Some(sizes) => Ok((sizes, Some(path.to_owned()))),
            None => Err(ReadError::Alone {
                place: place(),
                expected: path.with_extension("sol").display().to_string(),
            }),
        },
        _ => Err(ReadError::UnknownFormat {
            place: place(),
            help: "sizes are read from .sol or .solb, with their mesh beside them, and by `tetdb resaturate` also from .npy",
        }),
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
/// The place of what is no size, no scalar, or does not fit the mesh.
pub fn read_sizes(path: &Path, limit: u64) -> Result<FileSizes> {
    let (sizes, mesh) = size_files(path)?;
    let h = match is_binary(&sizes) {
        true => binary_sizes(feed(&sizes)?, limit)?,
        false => text_sizes(feed(&sizes)?, limit)?,
    };
    let Some(mesh) = mesh else {
        return Ok(FileSizes::AtVertices(h));
    };
    let mut solid = Solid { limit, ..Solid::default() };
    match is_binary(&mesh) {
        true => binary_solid(feed(&mesh)?, &mut solid)?,
        false => text_solid(feed(&mesh)?, &mut solid)?,
    }
    if solid.tets.is_empty() {
        return Ok(FileSizes::AtVertices(h));
    }
    if h.len() != solid.points.len() {
        return Err(ReadError::CountMismatch {
            place: FilePlace { file: sizes.display().to_string(), spot: Spot::Totals },
            what: "sizes",
            declared: h.len().to_string(),
            found: format!("{} vertices in {}", solid.points.len(), mesh.display()),
        });
    }
    Ok(FileSizes::Mesh { points: solid.points, tets: solid.tets, h })
}

fn feed(path: &Path) -> Result<Feed<BufReader<File>>> {
    let (reader, length) = open_plain(path)?;
    Ok(Feed::new(&path.to_string_lossy(), reader, length))
}

fn is_binary(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    extension.to_ascii_lowercase().ends_with('b')
}

/// Vertices and tetrahedra of a mesh.
#[derive(Default)]
struct Solid {
    points: Vec<Point>,
    tets: Vec<[u32; 4]>,
    limit: u64,
}

impl Solid {
    fn check<R: BufRead>(&self, feed: &Feed<R>, n_more: u64, bytes: u64) -> Result<()> {
        let held = VERTEX_BYTES * self.points.len() as u64;
        check(feed, "the background mesh", held + n_more * bytes, self.limit)
    }

    fn add_tet<R: BufRead>(&mut self, feed: &Feed<R>, tet: [u32; 4]) -> Result<()> {
        let [a, b, c, d] = tet.map(|v| self.points[v as usize]);
        if (b - a).cross(c - a).dot(d - a) == 0.0 {
            let found = format!("tetrahedron {} without volume", self.tets.len() + 1);
            return Err(feed.unexpected("tetrahedra with a volume", found.as_bytes()));
        }
        self.tets.push(tet);
        Ok(())
    }
}

fn check<R: BufRead>(feed: &Feed<R>, what: &'static str, needed: u64, limit: u64) -> Result<()> {
    if needed > limit {
        return Err(ReadError::TooLarge { place: feed.place(), what, needed, limit });
    }
    Ok(())
}

/// Refuses what is no length.
fn size<R: BufRead>(feed: &Feed<R>, h: f64) -> Result<f64> {
    if h.is_normal() && h > 0.0 {
        return Ok(h);
    }
    Err(feed.unexpected("a length above zero", h.to_string().as_bytes()))
}

fn check_dimension<R: BufRead>(feed: &Feed<R>, dimension: i64) -> Result<()> {
    match dimension {
        3 => Ok(()),
        _ => Err(feed.unsupported(format!("sizes in dimension {dimension}"))),
    }
}

fn check_scalar<R: BufRead>(feed: &Feed<R>, n_kinds: i64, kind: i64) -> Result<()> {
    match (n_kinds, kind) {
        (1, SCALAR) => Ok(()),
        _ => Err(feed.unsupported("a solution that is not one number per vertex")),
    }
}

fn no_sizes<R: BufRead>(feed: &Feed<R>) -> ReadError {
    feed.unexpected("a section `SolAtVertices`", b"none")
}

/// Takes words up to the next keyword, in lower case; false at the end.
fn next_keyword<R: BufRead>(feed: &mut Feed<R>) -> Result<Option<String>> {
    while feed.next_word()? {
        if feed.word().first().is_some_and(u8::is_ascii_alphabetic) {
            let word = String::from_utf8_lossy(feed.word()).to_ascii_lowercase();
            return Ok((word != "end").then_some(word));
        }
    }
    Ok(None)
}

fn text_sizes<R: BufRead>(mut feed: Feed<R>, limit: u64) -> Result<Vec<f64>> {
    feed.comment = Some(b'#');
    feed.need_keyword("MeshVersionFormatted")?;
    while let Some(keyword) = next_keyword(&mut feed)? {
        if keyword == "dimension" {
            let dimension = feed.integer("the dimension")?;
            check_dimension(&feed, dimension)?;
        }
        if keyword != "solatvertices" {
            continue;
        }
        let n = feed.count("sizes", 2)?;
        check(&feed, "the sizes", 8 * n, limit)?;
        let (n_kinds, kind) = (feed.integer("a count")?, feed.integer("a kind")?);
        check_scalar(&feed, n_kinds, kind)?;
        let mut sizes = Vec::new();
        for i in 0..n {
            if feed.at_end()? {
                return Err(feed.too_few("sizes", n, i));
            }
            feed.need_word("a size")?;
            let h = feed.parse("a size")?;
            sizes.push(size(&feed, h)?);
        }
        return Ok(sizes);
    }
    Err(no_sizes(&feed))
}

fn binary_sizes<R: BufRead>(feed: Feed<R>, limit: u64) -> Result<Vec<f64>> {
    let mut numbers = Numbers::open(feed)?;
    let mut found = None;
    numbers.sections(|numbers, keyword| {
        if keyword == DIMENSION {
            let dimension = i64::from(numbers.i32()?);
            check_dimension(&numbers.feed, dimension)?;
        }
        if keyword == SOL_AT_VERTICES {
            let n = numbers.count("sizes", if numbers.version == 1 { 4 } else { 8 })?;
            check(&numbers.feed, "the sizes", 8 * n, limit)?;
            let (n_kinds, kind) = (numbers.i32()?, numbers.i32()?);
            check_scalar(&numbers.feed, n_kinds.into(), kind.into())?;
            let mut sizes = Vec::new();
            for _ in 0..n {
                let h = numbers.coordinate()?;
                sizes.push(size(&numbers.feed, h)?);
            }
            found = Some(sizes);
        }
        Ok(())
    })?;
    found.ok_or_else(|| no_sizes(&numbers.feed))
}

fn text_solid<R: BufRead>(mut feed: Feed<R>, solid: &mut Solid) -> Result<()> {
    feed.comment = Some(b'#');
    feed.need_keyword("MeshVersionFormatted")?;
    while let Some(keyword) = next_keyword(&mut feed)? {
        match keyword.as_str() {
            "dimension" => {
                let dimension = feed.integer("the dimension")?;
                check_dimension(&feed, dimension)?;
            }
            "vertices" => {
                let n = feed.count("vertices", 8)?;
                solid.check(&feed, n, VERTEX_BYTES)?;
                for i in 0..n {
                    if feed.at_end()? {
                        return Err(feed.too_few("vertices", n, i));
                    }
                    let p = feed.point()?;
                    feed.integer("a vertex reference")?;
                    solid.points.push(p);
                }
            }
            "tetrahedra" => {
                let n = feed.count("tetrahedra", 10)?;
                solid.check(&feed, n, TET_BYTES)?;
                for i in 0..n {
                    if feed.at_end()? {
                        return Err(feed.too_few("tetrahedra", n, i));
                    }
                    let mut tet = [0; 4];
                    for corner in &mut tet {
                        *corner = feed.index(1, solid.points.len() as u64)?;
                    }
                    feed.integer("a reference")?;
                    solid.add_tet(&feed, tet)?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}

fn binary_solid<R: BufRead>(feed: Feed<R>, solid: &mut Solid) -> Result<()> {
    let mut numbers = Numbers::open(feed)?;
    numbers.sections(|numbers, keyword| {
        let int = numbers.integer_bytes();
        match keyword {
            DIMENSION => {
                let dimension = i64::from(numbers.i32()?);
                check_dimension(&numbers.feed, dimension)?;
            }
            VERTICES => {
                let coordinate = if numbers.version == 1 { 4 } else { 8 };
                let n = numbers.count("vertices", 3 * coordinate + int)?;
                solid.check(&numbers.feed, n, VERTEX_BYTES)?;
                for _ in 0..n {
                    let [x, y, z] =
                        [numbers.coordinate()?, numbers.coordinate()?, numbers.coordinate()?];
                    numbers.integer()?;
                    solid.points.push(Point::new(x, y, z));
                }
            }
            TETRAHEDRA => {
                let n = numbers.count("tetrahedra", 5 * int)?;
                solid.check(&numbers.feed, n, TET_BYTES)?;
                for _ in 0..n {
                    let mut tet = [0; 4];
                    for corner in &mut tet {
                        let index = numbers.integer()?;
                        let n_points = solid.points.len() as u64;
                        *corner = numbers.feed.check_index(index, 1, n_points)?;
                    }
                    numbers.integer()?;
                    solid.add_tet(&numbers.feed, tet)?;
                }
            }
            _ => {}
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
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
