//! Positions along a space-filling curve, so that points near in space are near in order.

use super::{Aabb, Point};

/// Bits per axis: three axes fill 63 of 64 bits.
const BITS: u32 = 21;

/// Maps points of a box to the integer grid of the curve.
#[derive(Clone, Copy, Debug)]
pub struct HilbertFrame {
    low: Point,
    scale: f64,
}

impl HilbertFrame {
    /// A frame for the points of `bounds`; points outside are clamped to it.
    ///
    /// The scale is one number for the three axes, so that the curve's cells are cubes.
    pub fn new(bounds: &Aabb) -> Self {
        let extent = (bounds.high - bounds.low).max_element();
        let cells = f64::from(1u32 << BITS);
        let scale = if extent > 0.0 { cells / extent } else { 0.0 };
        Self {
            low: bounds.low,
            scale: if scale.is_finite() { scale } else { 0.0 },
        }
    }

    /// Index of the curve cell of `p`, below 2^63.
    #[inline]
    pub fn index(&self, p: Point) -> u64 {
        let max = f64::from((1u32 << BITS) - 1);
        let q = ((p - self.low) * self.scale).clamp(Point::ZERO, Point::splat(max));
        hilbert_index([q.x as u32, q.y as u32, q.z as u32])
    }
}

/// Index along the three-dimensional Hilbert curve of a cell with 21 bits per axis.
///
/// Source: J. Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707 (2004).
#[inline]
pub fn hilbert_index(cell: [u32; 3]) -> u64 {
    let [mut x, mut y, mut z] = cell;
    let mut q = 1u32 << (BITS - 1);
    while q > 1 {
        let p = q - 1;
        if x & q != 0 {
            x ^= p;
        }
        if y & q != 0 {
            x ^= p;
        } else {
            let t = (x ^ y) & p;
            x ^= t;
            y ^= t;
        }
        if z & q != 0 {
            x ^= p;
        } else {
            let t = (x ^ z) & p;
            x ^= t;
            z ^= t;
        }
        q >>= 1;
    }
    y ^= x;
    z ^= y;
    let mut t = 0;
    let mut q = 1u32 << (BITS - 1);
    while q > 1 {
        if z & q != 0 {
            t ^= q - 1;
        }
        q >>= 1;
    }
    (spread(x ^ t) << 2) | (spread(y ^ t) << 1) | spread(z ^ t)
}

/// Moves bit `i` of a 21-bit number to bit `3 i`.
#[inline]
fn spread(v: u32) -> u64 {
    let mut v = u64::from(v) & 0x1f_ffff;
    v = (v | v << 32) & 0x001f_0000_0000_ffff;
    v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_cells_are_neighbors() {
        // The first 8^4 indices fill the corner cube of side 16; each step moves by one cell.
        let mut cells: Vec<(u64, [u32; 3])> = Vec::new();
        for x in 0..16 {
            for y in 0..16 {
                for z in 0..16 {
                    cells.push((hilbert_index([x, y, z]), [x, y, z]));
                }
            }
        }
        cells.sort_unstable();
        for (i, pair) in cells.windows(2).enumerate() {
            assert_eq!(pair[0].0, i as u64);
            let step: u32 = (0..3).map(|k| pair[0].1[k].abs_diff(pair[1].1[k])).sum();
            assert_eq!(step, 1, "{pair:?}");
        }
    }
}
