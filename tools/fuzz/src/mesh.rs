//! A mesh of another program, read from a file as an import reads it.
//!
//! The folder of the file is in memory where the system has one there.

use std::path::Path;
use std::sync::OnceLock;

use tetdb_base::storage::ScratchSpace;
use tetdb_io::read::{MeshFields, RawMesh, ReadError, read_tets};

/// Memory of a reader: little, so that an input that asks for much is refused.
const SPACE_BYTES: u64 = 4 << 20;

/// The bytes as a file of this ending; the mesh, whose corners are vertices of it.
pub fn read(ending: &str, bytes: &[u8]) -> Result<RawMesh, ReadError> {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let shared = Path::new("/dev/shm");
        let folder = match shared.is_dir() {
            true => tempfile::tempdir_in(shared),
            false => tempfile::tempdir(),
        };
        folder.expect("a folder")
    });
    // Tests read side by side.
    let name = tempfile::Builder::new().suffix(&format!(".{ending}")).tempfile_in(folder.path());
    let path = name.expect("writable").into_temp_path();
    std::fs::write(&path, bytes).expect("writable");
    let mut mesh = RawMesh::new(ScratchSpace::new(SPACE_BYTES, folder.path()));
    let fields =
        MeshFields { part: None, region: None, values: Some(|name| !name.starts_with('-')) };
    read_tets(&path, fields, &mut mesh)?;
    let n = mesh.points.len();
    for t in 0..mesh.tets.len() {
        let tet = mesh.tets.get(t);
        assert!(tet[..4].iter().all(|&v| (v as usize) < n), "{tet:?} of {n} vertices");
        assert!((tet[4] as usize) < mesh.regions.list.len().max(1), "{tet:?}");
    }
    for t in 0..mesh.triangles.len() {
        let triangle = mesh.triangles.get(t);
        assert!(triangle[..3].iter().all(|&v| (v as usize) < n), "{triangle:?} of {n} vertices");
    }
    for v in 0..n {
        assert!(mesh.points.get(v).iter().all(|x| x.is_finite()));
    }
    Ok(mesh)
}
