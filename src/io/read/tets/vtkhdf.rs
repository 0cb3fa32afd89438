//! Meshes in VTK's HDF5 files of unstructured grids, `.vtkhdf`: partitions with points of their own, one behind the other in each array.
//!
//! Source: the VTKHDF file format, versions 1 and 2.

use std::path::Path;
use std::sync::Arc;

use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, FileStorage, Hdf5File, OpenOptions};

use super::hdf_rows::kind;
use super::vtu::{ArrayAt, Grid, Piece};
use super::{FilePlace, ReadError, ReadFault, Result};

/// Bytes of an array of a partition, with its names.
const PIECE_ARRAY_BYTES: u64 = 256;

/// Finds the arrays of a file. Errors: what is no such grid; time steps; more partitions than a memory of `cap` bytes holds.
pub fn open(path: &Path, cap: u64) -> Result<Grid> {
    let cap = cap as usize;
    let place = FilePlace::new(path);
    std::fs::File::open(path).map_err(|e| place.refuse(ReadFault::Unreadable(e.to_string())))?;
    let options = OpenOptions::default()
        .with_chunk_cache_bytes(cap / 32)
        .with_max_chunk_bytes(cap / 16)
        .with_max_read_bytes(cap / 16);
    let open = || Hdf5File::from_storage_with_options(Arc::new(FileStorage::open(path)?), options);
    let file = open().map_err(|e| refuse(&place, "an HDF5 file", &e))?;
    let pieces = pieces(&file, cap as u64 / 16, &place)?;
    let root = file.group("VTKHDF").map_err(|e| refuse(&place, "a group VTKHDF", &e))?;
    let texts = group_arrays(&root, "FieldData", &place)?;
    Ok(Grid::of_hdf(path, file, pieces, texts))
}

fn refuse(place: &FilePlace, what: &str, error: &hdf5_reader::error::Error) -> ReadError {
    let (expected, found) = (what.to_owned(), format!("something else ({error})"));
    place.refuse(ReadFault::Unexpected { expected, found })
}

/// The partitions of a file, and their share of each array. Errors: they take more than `limit` bytes.
fn pieces(file: &Hdf5File, limit: u64, place: &FilePlace) -> Result<Vec<Piece>> {
    let root = file.group("VTKHDF").map_err(|e| refuse(place, "a group VTKHDF", &e))?;
    let kind = root.attribute("Type").and_then(|kind| kind.read_string());
    let kind = kind.map_err(|e| refuse(place, "an attribute Type of VTKHDF", &e))?;
    let kind = kind.trim_end_matches('\0');
    if kind != "UnstructuredGrid" {
        let what = format!("a VTKHDF file of type {kind:?}");
        return Err(place.refuse(ReadFault::Unsupported(what)));
    }
    if root.group("Steps").is_ok() {
        let what = "a VTKHDF file of time steps".to_owned();
        return Err(place.refuse(ReadFault::Unsupported(what)));
    }
    let counts = |name: &str| {
        let path = format!("VTKHDF/{name}");
        let read = || file.dataset(&path)?.read_array::<i64>();
        let list = read().map_err(|e| refuse(place, &format!("the array {path}"), &e))?;
        Ok(list.iter().map(|&n| u64::try_from(n).unwrap_or(u64::MAX)).collect::<Vec<u64>>())
    };
    let n_points = counts("NumberOfPoints")?;
    let (n_cells, n_corners) = (counts("NumberOfCells")?, counts("NumberOfConnectivityIds")?);
    let arrays = arrays(file, &root, place)?;
    if n_points.len() != n_cells.len() || n_points.len() != n_corners.len() {
        let (what, found) = ("partitions", format!("{} with cells", n_cells.len()));
        let declared = n_points.len().to_string();
        return Err(place.refuse(ReadFault::CountMismatch { what, declared, found }));
    }
    let needed = (n_points.len() * (arrays.len() + 1)) as u64 * PIECE_ARRAY_BYTES;
    if needed > limit {
        let what = "the partitions of the file";
        return Err(place.refuse(ReadFault::TooLarge { what, needed, limit }));
    }
    let n_all = n_points.iter().fold(0u64, |sum, &n| sum.saturating_add(n));
    if n_all > u64::from(u32::MAX) {
        return Err(place.refuse(ReadFault::Unsupported(format!("a mesh of {n_all} vertices"))));
    }
    let (mut first, mut pieces) = ([0u64; 4], Vec::new());
    for (number, ((&points, &cells), &corners)) in
        (0..).zip(n_points.iter().zip(&n_cells).zip(&n_corners))
    {
        let own = |array: &ArrayAt| {
            let (at, rows) = match (array.section.as_str(), array.name.as_str()) {
                ("Points" | "PointData", _) => (first[0], points),
                ("Cells", "connectivity") => (first[2], corners),
                // The offsets of each partition begin with a 0.
                ("Cells", "offsets") => (first[3] + 1, cells),
                _ => (first[1], cells),
            };
            ArrayAt { at, rows, ..array.clone() }
        };
        let arrays = arrays.iter().map(own).collect();
        let partition = Some(number);
        pieces.push(Piece { n_points: points, n_cells: cells, partition, arrays });
        let counts = [points, cells, corners, cells.saturating_add(1)];
        first = std::array::from_fn(|i| counts[i].saturating_add(first[i]));
    }
    check_rows(&arrays, first, place)?;
    Ok(pieces)
}

/// All arrays of numbers of a file.
fn arrays(file: &Hdf5File, root: &Group, place: &FilePlace) -> Result<Vec<ArrayAt>> {
    let mut arrays = Vec::new();
    for (section, path, name) in [
        ("Points", "VTKHDF/Points", "Points"),
        ("Cells", "VTKHDF/Connectivity", "connectivity"),
        ("Cells", "VTKHDF/Offsets", "offsets"),
        ("Cells", "VTKHDF/Types", "types"),
    ] {
        let dataset = file.dataset(path);
        let dataset = dataset.map_err(|e| refuse(place, &format!("the array {path}"), &e))?;
        arrays.extend(array(section, name.to_owned(), path.to_owned(), &dataset));
    }
    for section in ["PointData", "CellData"] {
        arrays.extend(group_arrays(root, section, place)?);
    }
    Ok(arrays)
}

/// The arrays of numbers of a group; none where there is no such group.
fn group_arrays(root: &Group, section: &str, place: &FilePlace) -> Result<Vec<ArrayAt>> {
    let Ok(group) = root.group(section) else { return Ok(Vec::new()) };
    let datasets = group.datasets().map_err(|e| refuse(place, section, &e))?;
    let found = datasets.iter().filter_map(|dataset| {
        let name = dataset.name().rsplit('/').next().unwrap_or_default().to_owned();
        let path = format!("VTKHDF/{section}/{name}");
        array(section, name, path, dataset)
    });
    Ok(found.collect())
}

/// Compares the rows of all arrays with the points, cells, corners and offsets of all partitions.
fn check_rows(arrays: &[ArrayAt], counts: [u64; 4], place: &FilePlace) -> Result<()> {
    for ArrayAt { section, name, format, rows, .. } in arrays {
        let declared = match (section.as_str(), name.as_str()) {
            ("Points" | "PointData", _) => counts[0],
            ("Cells", "connectivity") => counts[2],
            ("Cells", "offsets") => counts[3],
            _ => counts[1],
        };
        if declared != *rows {
            let (what, found) = ("rows of an array", format!("{rows} in {format}"));
            let declared = declared.to_string();
            return Err(place.refuse(ReadFault::CountMismatch { what, declared, found }));
        }
    }
    Ok(())
}

/// An array as it is in the file; `None` for one that holds no numbers.
fn array(section: &str, name: String, path: String, dataset: &Dataset) -> Option<ArrayAt> {
    let kind = kind(dataset.dtype())?.to_owned();
    let n_components = dataset.shape().iter().skip(1).product::<u64>() as usize;
    let (section, rows) = (section.to_owned(), dataset.shape().first().copied()?);
    Some(ArrayAt { section, name, kind, n_components, format: path, at: 0, rows })
}
