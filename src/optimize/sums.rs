//! Four sums at each vertex of a part of the mesh, to be added to those of the other parts.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use super::odt::{four, set_four};
use crate::mesh::Mesh;
use crate::storage::{Pages, kind};

/// Spreads vertex ids, which are consecutive more often than not.
#[derive(Default)]
struct Spread(u64);

impl Hasher for Spread {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, _: &[u8]) {
        unreachable!("ids are hashed as numbers")
    }
    fn write_u32(&mut self, v: u32) {
        self.0 = u64::from(v)
            .wrapping_mul(0x9E37_79B9_7F4A_7C15)
            .rotate_left(29);
    }
}

/// Sums by vertex.
#[derive(Default)]
pub(super) struct Sums(HashMap<u32, [f64; 4], BuildHasherDefault<Spread>>);

impl Sums {
    /// Adds to the sums of `v`.
    #[inline(always)]
    pub(super) fn add(&mut self, v: u32, terms: [f64; 4]) {
        let sums = self.0.entry(v).or_default();
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum += term;
        }
    }

    /// Adds the sums to those in the scratch pages, vertex by vertex: their order does not matter.
    pub(super) fn add_to<P: Pages>(self, mesh: &mut Mesh<P>) {
        for (v, sums) in self.0 {
            let slot = mesh.pages_mut().write::<{ kind::SCRATCH }>(v);
            let mut total = four(slot);
            for (total, sum) in total.iter_mut().zip(sums) {
                *total += sum;
            }
            set_four(slot, total);
        }
    }
}
