//! Every format on small made inputs: the good, the odd and the bad.

mod fem;
mod gmsh;
mod groups;
mod indexed;
mod losses;
mod medit;
mod packed_xml;
mod ply;
mod stl;
mod tetgen;
mod vtk;

use super::*;
use gmsh::{MSH2, MSH4};
use indexed::{indexed, off_body};
use medit::{MEDIT, meshb};
use ply::ply;
use stl::{stl_binary, stl_text};
use tetdb_base::geom::Point;
use tetdb_base::surface::NoteKind;

const POINTS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

fn read(format: Format, bytes: impl AsRef<[u8]>) -> Result<Surface> {
    read_memory(format, "folder/part.x", bytes.as_ref())
}

/// Reads a tetrahedron and checks its points and triangles.
fn read_tetrahedron(format: Format, bytes: impl AsRef<[u8]>) -> Surface {
    let surface = read(format, bytes).unwrap_or_else(|e| panic!("{format:?}: {}: {e}", e.place()));
    assert_eq!((surface.n_vertices(), surface.n_triangles()), (4, 4));
    for (t, face) in FACES.iter().enumerate() {
        assert_eq!(surface.corners(t as u32), face.map(|v| Point::from_array(POINTS[v])));
    }
    surface
}

/// The code and spot of the error that must come.
fn refuse(format: Format, bytes: impl AsRef<[u8]>) -> (&'static str, Spot) {
    let error = read(format, bytes).expect_err("the file is bad");
    assert!(!error.help().is_empty() && !error.to_string().is_empty());
    (error.code().as_str(), error.place().spot)
}

#[test]
fn files_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("a.stl"), stl_binary(b"")).unwrap();
    std::fs::write(
        path("b.OBJ"),
        indexed(|v| format!("{}", v + 1), "v 2", "f ", "").replace("f ", "g top\nf "),
    )
    .unwrap();
    std::fs::write(path("c"), "OFF 4 4 0\n".to_owned() + &off_body()).unwrap();
    std::fs::write(path("d"), "what is this").unwrap();
    let surface = read_surface(&[path("a.stl"), path("b.OBJ")], 1 << 22).unwrap();
    assert_eq!(surface.label_names, ["a", "b:top"]);
    assert_eq!((surface.n_triangles(), surface.n_vertices()), (8, 8));
    assert_eq!(surface.source(5).map(|(f, t)| (f.ends_with("b.OBJ"), t)), Some((true, 1)));
    assert_eq!(read_surface(&[path("c")], 1 << 22).unwrap().n_triangles(), 4);
    let twice = read_surface(&[path("a.stl"), path("a.stl")], 1 << 22).unwrap();
    assert_eq!(twice.label_names, ["a", "a~2"]);
    let code = |name: &str| read_surface(&[path(name)], 1 << 22).unwrap_err().code();
    assert_eq!(
        [code("d"), code("none.stl"), code("")],
        ["unknown-format", "unreadable-file", "unreadable-file"]
    );
}

#[test]
fn any_cut_of_a_good_file_is_refused_or_read_without_panic() {
    let files: [(Format, Vec<u8>); 8] = [
        (Format::Stl, stl_text("endsolid").into_bytes()),
        (Format::Stl, stl_binary(b"solid")),
        (Format::Ply, ply("binary_big_endian")),
        (Format::Ply, ply("ascii")),
        (Format::Medit, MEDIT.as_bytes().to_vec()),
        (Format::MeditBinary, meshb(2, false)),
        (Format::Gmsh, MSH2.as_bytes().to_vec()),
        (Format::Gmsh, MSH4.as_bytes().to_vec()),
    ];
    for (format, whole) in files {
        for n in 0..whole.len() {
            let _ = read(format, &whole[..n]);
            let mut changed = whole.clone();
            for value in [0, b'-', b'9', b' ', 0xff] {
                changed[n] = value;
                let _ = read(format, &changed);
            }
        }
    }
}
