//! Vertices by position: welds points with identical bits.

use crate::geom::Point;
use crate::storage::{filled, push};

/// Open-addressing table from coordinate bits to vertex ids; at most half full.
#[derive(Default)]
pub struct VertexTable {
    /// Vertex id + 1; 0 is free. The length is a power of two.
    slots: Vec<u32>,
}

impl VertexTable {
    /// A table of `points`, which are all different.
    pub fn new(points: &[Point]) -> Self {
        // Half of the final size.
        let len = (points.len() + 1).next_power_of_two();
        let mut table = Self { slots: filled(len, 0) };
        table.grow(points);
        table
    }

    /// Number of slots, of 4 bytes each.
    pub fn n_slots(&self) -> usize {
        self.slots.len()
    }

    /// The id of the vertex at `p`, which is added if new.
    pub fn find_or_add(&mut self, p: Point, points: &mut Vec<Point>) -> u32 {
        if points.len() * 2 >= self.slots.len() {
            self.grow(points);
        }
        let mask = self.slots.len() - 1;
        let mut slot = point_hash(p) as usize & mask;
        loop {
            match self.slots[slot] {
                0 => {
                    push(points, p);
                    self.slots[slot] = points.len() as u32;
                    return points.len() as u32 - 1;
                }
                id if points[id as usize - 1] == p => return id - 1,
                _ => slot = (slot + 1) & mask,
            }
        }
    }

    /// Returns whether `p` is one of the points.
    pub fn find(&self, p: Point, points: &[Point]) -> bool {
        let mask = self.slots.len() - 1;
        let mut slot = point_hash(p) as usize & mask;
        while let Some(id) = self.slots[slot].checked_sub(1) {
            if points[id as usize] == p {
                return true;
            }
            slot = (slot + 1) & mask;
        }
        false
    }

    fn grow(&mut self, points: &[Point]) {
        let len = (self.slots.len() * 2).max(1024);
        self.slots = Vec::new();
        self.slots = filled(len, 0);
        for (i, &p) in points.iter().enumerate() {
            let mut slot = point_hash(p) as usize & (len - 1);
            while self.slots[slot] != 0 {
                slot = (slot + 1) & (len - 1);
            }
            self.slots[slot] = i as u32 + 1;
        }
    }
}

/// Mixes the 192 coordinate bits; the same on every machine.
fn point_hash(p: Point) -> u64 {
    let mut h = 0x9e37_79b9_7f4a_7c15u64;
    for x in p.to_array() {
        h = (h ^ x.to_bits()).wrapping_mul(0xff51_afd7_ed55_8ccd);
        h ^= h >> 32;
    }
    h.wrapping_mul(0xc4ce_b9fe_1a85_ec53) >> 20
}
