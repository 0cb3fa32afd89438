//! Faces of a set of tetrahedra, matched in pairs.

/// A face as its vertices ascending, and whether an odd number of exchanges sorted them.
///
/// The two tetrahedra of a face see it from both sides: their parities differ.
#[inline]
pub fn sorted_face([a, b, c]: [u32; 3]) -> ([u32; 3], bool) {
    // Without branches, which would be guessed wrong half of the time.
    let (low, high, ab) = (a.min(b), a.max(b), a > b);
    let (mid, top, bc) = (high.min(c), high.max(c), high > c);
    ([low.min(mid), low.max(mid), top], ab ^ bc ^ (low > mid))
}

/// The faces of a tetrahedron: the number of each, its vertices ascending, and whether that order is odd in the tetrahedron.
///
/// One sort serves all four: of ascending vertices, faces 1 and 3 are odd.
#[inline]
pub fn sorted_faces(nodes: [u32; 4]) -> [(usize, [u32; 3], bool); 4] {
    let mut keys: [u64; 4] = std::array::from_fn(|i| u64::from(nodes[i]) << 2 | i as u64);
    let mut odd = false;
    for (i, j) in [(0, 1), (2, 3), (0, 2), (1, 3), (1, 2)] {
        let (a, b) = (keys[i], keys[j]);
        odd ^= a > b;
        (keys[i], keys[j]) = (a.min(b), a.max(b));
    }
    let [a, b, c, d] = keys.map(|key| (key >> 2) as u32);
    let number = keys.map(|key| key as usize & 3);
    [
        (number[0], [b, c, d], odd),
        (number[1], [a, c, d], !odd),
        (number[2], [a, b, d], odd),
        (number[3], [a, b, c], !odd),
    ]
}

/// Marks the face of a tetrahedron that has these three of its vertices: the one opposite the fourth vertex.
pub fn face_of(face: [u32; 3], nodes: [u32; 4]) -> [bool; 4] {
    nodes.map(|v| !face.contains(&v))
}

/// The result of adding a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paired {
    /// The face is the first with its vertices.
    Open,
    /// The face is the other side of the face with this reference.
    With(u32),
    /// The face with this reference has the same side.
    Same(u32),
    /// Both sides were added before.
    Third,
}

#[derive(Clone, Copy)]
struct FaceEntry {
    face: [u32; 3],
    /// `reference << 1 | parity`, or one of the two markers.
    reference: u32,
}

impl FaceEntry {
    const NONE: Self = Self { face: [0; 3], reference: VACANT };
}

const VACANT: u32 = u32::MAX;
const CLOSED: u32 = u32::MAX - 1;
/// Distance in slots between the faces of successive vertices, a power of two: about three for each face that has a vertex as its smallest.
const VERTEX_SLOTS: u32 = 32;
/// Number of neighboring slots that are tried first; later steps go all over the table, because a vertex may have any number of faces.
const NEAR: u32 = 16;

/// An open table of faces, for up to some hundred thousand at a time.
///
/// Faces of close smallest vertices are close in the table, so tetrahedra along a curve find them in the cache.
/// Invariant: at most three quarters full. The results depend on the order of the faces alone.
pub struct FacePairs {
    entries: Vec<FaceEntry>,
    used: usize,
}

impl FacePairs {
    /// A table for the faces of `tets` tetrahedra that share most of them; for others it grows.
    ///
    /// Tetrahedra of a mesh have little more than two faces each. Twice as many slots make a table that is larger than the cache of a core.
    pub fn new(tets: usize) -> Self {
        let slots = (tets * 4).next_power_of_two().max(16);
        Self { entries: vec![FaceEntry::NONE; slots], used: 0 }
    }

    /// Empties the table.
    pub fn clear(&mut self) {
        self.entries.iter_mut().for_each(|e| e.reference = VACANT);
        self.used = 0;
    }

    /// Adds one side of a face; `reference` is below 2^31 - 1.
    pub fn add(&mut self, face: [u32; 3], odd: bool, reference: u32) -> Paired {
        let at = self.slot(face);
        let entry = &mut self.entries[at];
        if entry.reference == VACANT {
            *entry = FaceEntry { face, reference: reference << 1 | u32::from(odd) };
            self.used += 1;
            if self.used * 4 > self.entries.len() * 3 {
                self.grow();
            }
            return Paired::Open;
        }
        if entry.reference == CLOSED {
            return Paired::Third;
        }
        let other = entry.reference >> 1;
        if (entry.reference & 1 == 1) == odd {
            return Paired::Same(other);
        }
        entry.reference = CLOSED;
        Paired::With(other)
    }

    /// The slot of a face, or the vacant one for it.
    #[inline]
    fn slot(&self, face: [u32; 3]) -> usize {
        let mask = self.entries.len() - 1;
        let mut hash = u64::from(face[1]).wrapping_mul(0xD6E8_FEB8_6659_FD93);
        hash = (hash ^ hash >> 32 ^ u64::from(face[2])).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let within = (hash >> 32) as u32 % VERTEX_SLOTS;
        let mut at = face[0].wrapping_mul(VERTEX_SLOTS).wrapping_add(within) as usize & mask;
        let mut looked_at = 0;
        loop {
            let entry = &self.entries[at];
            if entry.reference == VACANT || entry.face == face {
                return at;
            }
            looked_at += 1;
            // Odd, so that the steps reach all slots.
            let step = if looked_at < NEAR { 1 } else { hash >> 20 | 1 };
            at = at.wrapping_add(step as usize) & mask;
        }
    }

    fn grow(&mut self) {
        let slots = 2 * self.entries.len();
        let before = std::mem::replace(&mut self.entries, vec![FaceEntry::NONE; slots]);
        for entry in before.into_iter().filter(|entry| entry.reference != VACANT) {
            let at = self.slot(entry.face);
            self.entries[at] = entry;
        }
    }

    /// The faces with one side only: vertices ascending, parity, reference.
    pub fn open(&self) -> impl Iterator<Item = ([u32; 3], bool, u32)> + '_ {
        self.entries
            .iter()
            .filter(|e| e.reference < CLOSED)
            .map(|e| (e.face, e.reference & 1 == 1, e.reference >> 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_schema::record::FACES;

    #[test]
    fn faces_are_sorted_as_one_by_one() {
        for code in 0..256usize {
            let nodes = [0, 2, 4, 6].map(|shift| 7 * (code as u32 >> shift & 3) + 1);
            if (1..4).any(|i| nodes[..i].contains(&nodes[i])) {
                continue;
            }
            for (i, face, odd) in sorted_faces(nodes) {
                assert_eq!((face, odd), sorted_face(FACES[i].map(|k| nodes[k])), "{nodes:?} {i}");
            }
        }
    }

    #[test]
    fn two_sides_close_a_face() {
        let mut pairs = FacePairs::new(4);
        let (face, odd) = sorted_face([7, 3, 5]);
        assert_eq!(face, [3, 5, 7]);
        assert_eq!(pairs.add(face, odd, 1), Paired::Open);
        assert_eq!(pairs.open().count(), 1);
        assert_eq!(pairs.add(face, odd, 2), Paired::Same(1));
        let (face, odd) = sorted_face([3, 7, 5]);
        assert_eq!(pairs.add(face, odd, 3), Paired::With(1));
        assert_eq!(pairs.add(face, odd, 4), Paired::Third);
        assert_eq!(pairs.open().count(), 0);
        for turn in [[1, 2, 3], [2, 3, 1], [3, 1, 2]] {
            assert_eq!(sorted_face(turn), ([1, 2, 3], false));
        }
    }

    #[test]
    fn a_vertex_may_have_all_faces() {
        let mut pairs = FacePairs::new(1000);
        let faces = || (1..4000u32).map(|v| [0, v, v + 1]);
        for (face, k) in faces().zip(0..) {
            assert_eq!(pairs.add(face, false, k), Paired::Open);
        }
        assert_eq!(pairs.open().count(), faces().count());
        for (face, k) in faces().zip(0..) {
            assert_eq!(pairs.add(face, true, 0), Paired::With(k));
        }
        assert_eq!(pairs.open().count(), 0);
    }
}
