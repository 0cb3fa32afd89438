//! Sizes on a background mesh given as arrays. The store keeps them as files of its own.

use std::io::Write;
use std::path::Path;
use tetdb_schema::code::Code;

use xxhash_rust::xxh3::{Xxh3, xxh3_128};

use super::Error;
use tetdb_base::geom::Point;
use tetdb_kernel::sizing::{Background, BackgroundMesh};

/// Recorded in place of a path for lengths given as arrays: a file in the store, with its mesh next to it.
#[doc(hidden)]
pub const IN_STORE: &str = "store:sizes.solb";
const SIZES: &str = "sizes.solb";
const MESH: &str = "sizes.meshb";
/// Version 3 of the MEDIT format: integers of 4 bytes, coordinates and file positions of 8 bytes.
const VERSION: i32 = 3;
const DIMENSION: i32 = 3;
const VERTICES: i32 = 4;
const TETRAHEDRA: i32 = 8;
const END: i32 = 54;
const SOL_AT_VERTICES: i32 = 62;

/// A background mesh with a length at each vertex.
#[derive(Clone, Debug, PartialEq)]
#[doc(hidden)]
pub struct FieldArrays {
    points: Vec<[f64; 3]>,
    tets: Vec<[u32; 4]>,
    lengths: Vec<f64>,
}

fn check(points: &[[f64; 3]], tets: &[[u32; 4]], lengths: &[f64]) -> Result<(), Error> {
    if lengths.len() != points.len() || tets.is_empty() {
        let message = format!(
            "{} lengths for {} points and {} tetrahedra of a background mesh",
            lengths.len(),
            points.len(),
            tets.len()
        );
        return Err(Error::new(Code::CountMismatch, message)
            .with_help("give one length for each point, and the tetrahedra between them"));
    }
    if let Some(i) = (points.iter()).position(|p| p.iter().any(|x| !x.is_finite())) {
        let error = Error::new(Code::NotANumber, "a coordinate is not a finite number");
        return Err(error.at(format!("point {i} of the sizes")));
    }
    if let Some(i) = (lengths.iter()).position(|h| !(h.is_normal() && *h > 0.0)) {
        let message = format!("{} is no length, expected one above zero", lengths[i]);
        return Err(Error::new(Code::BadSize, message).at(format!("point {i} of the sizes")));
    }
    for (i, tet) in tets.iter().enumerate() {
        let at = || format!("tetrahedron {i} of the sizes");
        if let Some(v) = tet.iter().find(|v| **v as usize >= points.len()) {
            let message = format!("it names point {v}, but there are {}", points.len());
            return Err(Error::new(Code::IndexOutOfRange, message).at(at()));
        }
        let [a, b, c, d] = tet.map(|v| Point::from_array(points[v as usize]));
        if (b - a).cross(c - a).dot(d - a) == 0.0 {
            return Err(Error::new(Code::UnsupportedContent, "it has no volume").at(at()));
        }
    }
    Ok(())
}

impl FieldArrays {
    /// Checks the arrays and copies them. Errors: arrays that form no field, with the place.
    #[doc(hidden)]
    pub fn new(points: &[[f64; 3]], tets: &[[u32; 4]], lengths: &[f64]) -> Result<Self, Error> {
        check(points, tets, lengths)?;
        Ok(Self { points: points.to_vec(), tets: tets.to_vec(), lengths: lengths.to_vec() })
    }

    /// The background mesh for the mesher. Errors: `memory` if it needs more than half of `cap`.
    #[doc(hidden)]
    pub fn background(&self, cap: u64) -> Result<Background, Error> {
        let needed = BackgroundMesh::bytes(self.points.len() as u64, self.tets.len() as u64);
        if needed > cap / 2 {
            let message = format!("the sizes need {} MiB", needed.div_ceil(1 << 20));
            return Err(Error::new(Code::Memory, message)
                .with_help("allow more memory, or give sizes on a coarser background mesh"));
        }
        let points = self.points.iter().map(|p| Point::from_array(*p)).collect();
        Ok(Background::Mesh(Box::new(BackgroundMesh::new(
            points,
            self.tets.clone(),
            self.lengths.clone(),
        ))))
    }

    /// Writes the two files to the store's folder. Errors: the disk.
    #[doc(hidden)]
    pub fn keep_in(&self, store: &Path) -> Result<(), Error> {
        for (name, bytes) in [(MESH, self.mesh()), (SIZES, self.sizes())] {
            let path = store.join(name);
            let write = || {
                let mut file = std::fs::File::create(&path)?;
                file.write_all(&bytes)?;
                file.sync_all()
            };
            write().map_err(|e| Error::new(Code::Io, e).at(path.display()))?;
        }
        Ok(())
    }

    /// Hash of the two files, computed as [`job`](super::job) does for files.
    #[doc(hidden)]
    pub fn hash(&self) -> String {
        let mut all = Xxh3::new();
        for file in [self.sizes(), self.mesh()] {
            all.update(&xxh3_128(&file).to_le_bytes());
        }
        format!("{:032x}", all.digest128())
    }

    fn mesh(&self) -> Vec<u8> {
        let mut vertices = (self.points.len() as i32).to_le_bytes().to_vec();
        for point in &self.points {
            point.iter().for_each(|x| vertices.extend(x.to_le_bytes()));
            vertices.extend(0i32.to_le_bytes());
        }
        let mut tets = (self.tets.len() as i32).to_le_bytes().to_vec();
        for tet in &self.tets {
            tet.iter().for_each(|v| tets.extend((v + 1).to_le_bytes()));
            tets.extend(0i32.to_le_bytes());
        }
        file_of(&[(VERTICES, vertices), (TETRAHEDRA, tets)])
    }

    fn sizes(&self) -> Vec<u8> {
        let head = [self.lengths.len() as i32, 1, 1];
        let mut sizes: Vec<u8> = head.into_iter().flat_map(i32::to_le_bytes).collect();
        sizes.extend(self.lengths.iter().flat_map(|h| h.to_le_bytes()));
        file_of(&[(SOL_AT_VERTICES, sizes)])
    }
}

/// Returns whether `file` stands for lengths given as arrays.
#[doc(hidden)]
pub fn is_in_store(file: &str) -> bool {
    file == IN_STORE
}

/// Builds a binary MEDIT file. Each section has a keyword, the position of the next section, and content.
fn file_of(sections: &[(i32, Vec<u8>)]) -> Vec<u8> {
    let mut bytes: Vec<u8> = [1, VERSION].into_iter().flat_map(i32::to_le_bytes).collect();
    let mut section = |keyword: i32, content: &[u8]| {
        bytes.extend(keyword.to_le_bytes());
        let next = bytes.len() + 8 + content.len();
        bytes.extend((next as u64).to_le_bytes());
        bytes.extend(content);
    };
    section(DIMENSION, &3i32.to_le_bytes());
    for (keyword, content) in sections {
        section(*keyword, content);
    }
    bytes.extend(END.to_le_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use crate::api::{CancelToken, Event, Length, Mesher, Settings, Sizes, Store, Surface};

    fn field() -> Sizes {
        let corner = |c: u32| [0, 1, 2].map(|k| f64::from(c >> k & 1));
        let points: Vec<_> = (0..8).map(corner).collect();
        let lengths = points.iter().map(|p| 0.08 + 0.2 * p[0]).collect::<Vec<_>>();
        let tets =
            [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]];
        let sizes = Sizes::interior(Length::units(0.4));
        sizes.field_of_arrays(&points, &tets, &lengths).unwrap()
    }

    #[test]
    fn a_run_with_a_field_of_arrays_goes_on_from_the_copy_in_its_store() {
        let dir = tempfile::tempdir().unwrap();
        let [whole, begun] = ["whole", "begun"].map(|name| dir.path().join(name));
        let mesher = Mesher::new(Surface::sample("box,h=0.3").unwrap()).sizes(field());
        let store = mesher.clone().create(&whole).unwrap();
        let token = CancelToken::new();
        let stop = token.clone();
        let listener = move |event: &Event| {
            if matches!(event, Event::StoreBegun(_)) {
                stop.cancel();
            }
        };
        let stopped = mesher.clone().cancel(&token).progress(listener);
        assert!(stopped.create(&begun).is_err_and(|e| e.is_cancelled()));
        let resumed = Store::resume(&begun, Settings::new()).unwrap();
        assert!(resumed.is_same_mesh(&store));
        // The store has the same job on record, so the finished mesh is returned.
        assert!(mesher.create(&begun).unwrap().is_same_mesh(&store));
        let plain = Mesher::new(Surface::sample("box,h=0.3").unwrap())
            .sizes(Sizes::interior(Length::units(0.4)));
        let plain = plain.create(dir.path().join("plain")).unwrap();
        assert!(plain.summary().n_tets < store.summary().n_tets);
    }

    #[test]
    fn arrays_that_are_no_field_are_refused_with_a_place() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let refused = |points: &[[f64; 3]], tets: &[[u32; 4]], lengths: &[f64]| {
            let sizes = Sizes::from_surface().field_of_arrays(points, tets, lengths);
            sizes.unwrap_err()
        };
        let good = [[0, 1, 2, 3]];
        assert_eq!(refused(&points, &good, &[1.0; 3]).code(), "count-mismatch");
        let error = refused(&points, &good, &[1.0, 1.0, f64::NAN, 1.0]);
        assert_eq!(error.code(), "bad-size");
        assert_eq!(error.place(), Some("point 2 of the sizes"));
        let error = refused(&points, &[[0, 1, 2, 4]], &[1.0; 4]);
        assert_eq!(error.code(), "index-out-of-range");
        let error = refused(&points, &[[0, 1, 2, 2]], &[1.0; 4]);
        assert_eq!(error.place(), Some("tetrahedron 0 of the sizes"));
    }
}
