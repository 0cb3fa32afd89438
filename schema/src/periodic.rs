//! Periodic pairs: two labels with the same triangles, one moved onto the other.

use rkyv::{Archive, Deserialize, Serialize};

use crate::blob::{BlobContent, u32s, u64s};

/// A pair of labels. Its pairs of vertices and triangles are the blobs [`PeriodicVertices`](crate::blob::Blob::PeriodicVertices) and
/// [`PeriodicTriangles`](crate::blob::Blob::PeriodicTriangles).
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, serde::Serialize)]
pub struct PeriodicRow {
    /// Its number.
    pub id: u32,
    /// The label that is moved, and the label that it is moved onto.
    pub labels: [u32; 2],
    /// Three rows of four: x of the moved point = row · (x, y, z, 1).
    pub map: [[f64; 4]; 3],
    /// Angle of the rotation in radians; 0 for a translation.
    pub angle: f64,
    /// Greatest distance between a moved vertex and its partner.
    pub deviation: f64,
    /// Allowed distance.
    pub tolerance: f64,
    /// Number of pairs of vertices.
    pub vertices: u64,
    /// Number of pairs of triangles.
    pub triangles: u64,
}

/// Pairs of vertices, by their numbers in the input.
impl BlobContent for Vec<[u32; 2]> {
    fn to_bytes(&self) -> Vec<u8> {
        self.as_flattened().iter().flat_map(|n| n.to_le_bytes()).collect()
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        pairs(&u32s(bytes)?)
    }
}

/// Pairs of triangles, by their numbers in the input.
impl BlobContent for Vec<[u64; 2]> {
    fn to_bytes(&self) -> Vec<u8> {
        self.as_flattened().iter().flat_map(|n| n.to_le_bytes()).collect()
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        pairs(&u64s(bytes)?)
    }
}

fn pairs<T: Copy>(numbers: &[T]) -> Option<Vec<[T; 2]>> {
    let (pairs, rest) = numbers.as_chunks::<2>();
    rest.is_empty().then(|| pairs.to_vec())
}
