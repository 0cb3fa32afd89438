//! Neighbors of subtrees: the owners of the faces of each cut.
//!
//! The faces of a cut have numbers. For each face, the table of the cut names the subtree on its low and on its high side, each by its
//! first rank. When a subtree is bisected, its low child keeps the name: only faces of the high child change owner, and no file of a
//! neighbor is read.
//!
//! Source: the paper, section 1.3.

use rkyv::{Archive, Deserialize, Serialize};

use crate::blob::{BlobContent, f64_bytes, f64s, u32s};

/// Owners of the faces of one cut.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FaceOwners {
    /// Shape: `faces[i]` = names of the subtrees on the low and on the high side of face `i`.
    pub faces: Vec<[u32; 2]>,
}

impl FaceOwners {
    /// The faces of a new cut between two subtrees.
    pub fn new(faces: u32, low: u32, high: u32) -> Self {
        Self { faces: vec![[low, high]; faces as usize] }
    }

    /// The owner on the other side of a face; `None` when the cut has no such face.
    pub fn other(&self, index: u32, side: u32) -> Option<u32> {
        let owners = self.faces.get(index as usize)?;
        Some(owners[1 - (side as usize & 1)])
    }

    /// The faces of one subtree, with the owners on the other side.
    pub fn across(&self, name: u32) -> FacesAcross {
        let faces = (0..).zip(&self.faces);
        let other = |(index, &owners): (u32, &[u32; 2])| match owners {
            [a, b] if a == name => Some([index, b]),
            [a, b] if b == name => Some([index, a]),
            _ => None,
        };
        FacesAcross { faces: faces.filter_map(other).collect() }
    }
}

/// Words, low before high.
impl BlobContent for FaceOwners {
    fn to_bytes(&self) -> Vec<u8> {
        self.faces.iter().flatten().flat_map(|w| w.to_le_bytes()).collect()
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let words = u32s(bytes)?;
        let (faces, rest) = words.as_chunks();
        rest.is_empty().then(|| Self { faces: faces.to_vec() })
    }
}

/// The faces that one subtree has in a cut.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, Default, PartialEq, Eq)]
pub struct FacesAcross {
    /// Shape: `faces[i]` = the number of a face and the subtree on its other side. Invariant: numbers ascend.
    faces: Vec<[u32; 2]>,
}

impl FacesAcross {
    /// The owner on the other side of a face; `None` when the subtree has no such face.
    pub fn other(&self, index: u32) -> Option<u32> {
        let at = self.faces.binary_search_by_key(&index, |face| face[0]);
        Some(self.faces[at.ok()?][1])
    }
}

/// The positions of three vertices.
pub type Triangle = [[f64; 3]; 3];

/// Faces around a cut before and after its interface was chosen; kept with the stages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StageFaces {
    /// Faces between the tetrahedra on either side of the plane.
    pub natural: Vec<Triangle>,
    /// The faces of the interface.
    pub chosen: Vec<Triangle>,
}

/// The number of natural faces as u64, then nine f64 for each face.
impl BlobContent for StageFaces {
    fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = (self.natural.len() as u64).to_le_bytes().to_vec();
        for faces in [&self.natural, &self.chosen] {
            bytes.extend(f64_bytes(faces.as_flattened().as_flattened()));
        }
        bytes
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (head, rest) = bytes.split_first_chunk()?;
        let numbers = f64s(rest)?;
        let (corners, _) = numbers.as_chunks();
        let (faces, _) = corners.as_chunks();
        let natural = usize::try_from(u64::from_le_bytes(*head)).ok()?;
        if natural > faces.len() || rest.len() != size_of_val(faces) {
            return None;
        }
        let (natural, chosen) = faces.split_at(natural);
        Some(Self { natural: natural.to_vec(), chosen: chosen.to_vec() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn owners_come_back_from_their_bytes() {
        let mut owners = FaceOwners::new(5, 0, 2);
        for index in [3, 4] {
            owners.faces[index][1] = 3;
        }
        assert_eq!(owners.other(4, 0), Some(3));
        let [two, three] = [2, 3].map(|name| owners.across(name));
        assert_eq!((two.other(2), two.other(3)), (Some(0), None));
        assert_eq!((three.other(2), three.other(3)), (None, Some(0)));
        assert_eq!(owners.across(0).other(4), Some(3));
        assert_eq!(FaceOwners::from_bytes(&owners.to_bytes()), Some(owners));
        assert_eq!(FaceOwners::from_bytes(&[1]), None);
    }

    #[test]
    fn faces_come_back_from_their_bytes() {
        let face = |x: f64| [[x; 3], [1.0, 0.0, 0.0], [0.1, x, 3.0]];
        let faces = StageFaces { natural: vec![face(1.0), face(-2.5)], chosen: vec![face(1e9)] };
        let bytes = faces.to_bytes();
        assert_eq!(StageFaces::from_bytes(&bytes), Some(faces));
        assert_eq!(StageFaces::from_bytes(&bytes[..bytes.len() - 8]), None);
        assert_eq!(StageFaces::from_bytes(&[7, 0, 0, 0, 0, 0, 0, 0]), None);
    }
}
