//! The digest of a mesh: a sum over its parts, so that the order of a pass does not matter.

use std::fmt;

const VERTEX_SEED: u64 = 0x7665_7274;
const TET_SEEDS: [u64; 2] = [0x7465_742D_6C6F_0000, 0x7465_742D_6869_0000];
const FACE_SEEDS: [u64; 2] = [0x6661_6365_6C6F_0000, 0x6661_6365_6869_0000];

/// One step of the mix: the finalizer of splitmix64 (Steele, Lea and Flood, "Fast splittable
/// pseudorandom number generators", 2014) of the state joined with `value`.
#[inline]
pub const fn mix(state: u64, value: u64) -> u64 {
    let mut z = (state ^ value).wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The mix of a vertex, from the bits of its coordinates.
#[inline]
pub const fn vertex_mix([x, y, z]: [f64; 3]) -> u64 {
    mix(mix(mix(VERTEX_SEED, x.to_bits()), y.to_bits()), z.to_bits())
}

/// Two lanes of wrapping sums. `Default` is the digest of nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Digest {
    /// Sums of two independent mixes of every element.
    pub lanes: [u64; 2],
}

impl Digest {
    /// Adds a tetrahedron: the mixes of its vertices in any order, its region, the rank of its sub-domain.
    #[inline]
    pub fn add_tet(&mut self, mut vertices: [u64; 4], region: u32, rank: u32) {
        sort4(&mut vertices);
        for (lane, seed) in self.lanes.iter_mut().zip(TET_SEEDS) {
            let state = vertices.iter().fold(seed, |s, &v| mix(s, v));
            let state = mix(mix(state, u64::from(region)), u64::from(rank));
            *lane = lane.wrapping_add(state);
        }
    }

    /// Adds an interface face: the mixes of its vertices in any order, the number of its cut.
    pub fn add_face(&mut self, mut vertices: [u64; 3], cut: u32) {
        vertices.sort_unstable();
        for (lane, seed) in self.lanes.iter_mut().zip(FACE_SEEDS) {
            let state = vertices.iter().fold(seed, |s, &v| mix(s, v));
            *lane = lane.wrapping_add(mix(state, u64::from(cut)));
        }
    }

    /// Adds what another digest holds.
    pub fn merge(&mut self, other: &Self) {
        for (lane, o) in self.lanes.iter_mut().zip(other.lanes) {
            *lane = lane.wrapping_add(o);
        }
    }
}

/// Sorts four numbers with five exchanges, without branches.
#[inline]
fn sort4(v: &mut [u64; 4]) {
    for (i, j) in [(0, 1), (2, 3), (0, 2), (1, 3), (1, 2)] {
        let (low, high) = (v[i].min(v[j]), v[i].max(v[j]));
        v[i] = low;
        v[j] = high;
    }
}

/// 32 hexadecimal digits, the first lane first.
impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}{:016x}", self.lanes[0], self.lanes[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_does_not_depend_on_order_and_sees_every_part() {
        let v: Vec<u64> = (0..5).map(|i| vertex_mix([f64::from(i), 0.5, -1.0])).collect();
        let mut a = Digest::default();
        a.add_tet([v[0], v[1], v[2], v[3]], 1, 0);
        a.add_tet([v[1], v[2], v[3], v[4]], 2, 0);
        let (mut b, mut c) = (Digest::default(), Digest::default());
        b.add_tet([v[4], v[3], v[1], v[2]], 2, 0);
        c.add_tet([v[3], v[2], v[1], v[0]], 1, 0);
        b.merge(&c);
        assert_eq!(a, b);
        assert_eq!(a.to_string().len(), 32);
        c.add_tet([v[1], v[2], v[3], v[4]], 2, 1);
        assert_ne!(a, c);
    }

    /// The value is part of the format: a program in another language must find the same.
    #[test]
    fn the_digest_of_a_known_tetrahedron_stays() {
        assert_eq!(mix(0, 0), 0xE220_A839_7B1D_CDAF);
        let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
        let mut d = Digest::default();
        d.add_tet(corners.map(vertex_mix), 1, 0);
        assert_eq!(d.to_string(), "6a5fcbe250dfa6ac6fe7761ca20a7637");
    }
}
