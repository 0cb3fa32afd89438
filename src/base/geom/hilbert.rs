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
        Self { low: bounds.low, scale: if scale.is_finite() { scale } else { 0.0 } }
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
/// Walks down the levels, two at a time, with the curve's orientation as a state. Turning the lower bits at each level,
/// from which the tables are computed, takes three times as long.
///
/// Source: J. Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707 (2004).
#[inline]
pub fn hilbert_index(cell: [u32; 3]) -> u64 {
    let [x, y, z] = cell.map(|c| c as usize);
    let top = BITS - 1;
    let bits = (x >> top & 1) << 2 | (y >> top & 1) << 1 | z >> top & 1;
    let (digit, state) = ONE_LEVEL[0][bits];
    let mut index = u64::from(digit);
    let mut state = usize::from(state);
    let mut level = top;
    while level > 0 {
        level -= 2;
        let bits = (x >> level & 3) << 4 | (y >> level & 3) << 2 | z >> level & 3;
        let entry = TWO_LEVELS[state][bits];
        index = index << 6 | u64::from(entry & 63);
        state = usize::from(entry >> 6);
    }
    index
}

/// Orientation of the curve at a level: the axis that each of its axes is, the axes that run backward, and whether its
/// digits do.
#[derive(Clone, Copy)]
struct CurveTurn {
    axis: [u8; 3],
    back: [bool; 3],
    digits_back: bool,
}

/// Numbers of turns: six orders of axes, eight of directions, two of digits.
const TURNS: usize = 96;
const ORDERS: [[u8; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

impl CurveTurn {
    const fn from_number(n: usize) -> Self {
        Self {
            axis: ORDERS[n / 16],
            back: [n & 8 != 0, n & 4 != 0, n & 2 != 0],
            digits_back: n & 1 != 0,
        }
    }

    const fn number(&self) -> usize {
        let mut order = 0;
        while ORDERS[order][0] != self.axis[0] || ORDERS[order][1] != self.axis[1] {
            order += 1;
        }
        order * 16
            + self.back[0] as usize * 8
            + self.back[1] as usize * 4
            + self.back[2] as usize * 2
            + self.digits_back as usize
    }

    /// The digit of a cell's bits (x y z) at this level, and the turn of the level below.
    const fn step(mut self, bits: usize) -> (u8, Self) {
        let mut own = [false; 3];
        let mut i = 0;
        while i < 3 {
            own[i] = (bits >> (2 - self.axis[i]) & 1 != 0) != self.back[i];
            i += 1;
        }
        i = 0;
        while i < 3 {
            if own[i] {
                self.back[0] = !self.back[0];
            } else {
                let (axis, back) = (self.axis[0], self.back[0]);
                (self.axis[0], self.back[0]) = (self.axis[i], self.back[i]);
                (self.axis[i], self.back[i]) = (axis, back);
            }
            i += 1;
        }
        let (x, y) = (own[0], own[0] != own[1]);
        let z = y != own[2];
        let digit = ((x != self.digits_back) as u8) << 2
            | ((y != self.digits_back) as u8) << 1
            | (z != self.digits_back) as u8;
        self.digits_back = self.digits_back != z;
        (digit, self)
    }
}

/// Digit and next turn, by turn and bits.
const ONE_LEVEL: [[(u8, u8); 8]; TURNS] = {
    let mut table = [[(0, 0); 8]; TURNS];
    let mut n = 0;
    while n < TURNS {
        let mut bits = 0;
        while bits < 8 {
            let (digit, next) = CurveTurn::from_number(n).step(bits);
            table[n][bits] = (digit, next.number() as u8);
            bits += 1;
        }
        n += 1;
    }
    table
};

/// `next turn << 6 | two digits`, by turn and two bits of x, of y, of z.
static TWO_LEVELS: [[u16; 64]; TURNS] = {
    let mut table = [[0; 64]; TURNS];
    let mut n = 0;
    while n < TURNS {
        let mut bits = 0;
        while bits < 64 {
            let high = bits >> 3 & 4 | bits >> 2 & 2 | bits >> 1 & 1;
            let low = bits >> 2 & 4 | bits >> 1 & 2 | bits & 1;
            let (first, between) = ONE_LEVEL[n][high];
            let (second, next) = ONE_LEVEL[between as usize][low];
            table[n][bits] = (next as u16) << 6 | (first as u16) << 3 | second as u16;
            bits += 1;
        }
        n += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    use super::*;

    /// The curve as its source has it, bit by bit.
    fn by_bits([mut x, mut y, mut z]: [u32; 3]) -> u64 {
        let mut q = 1u32 << (BITS - 1);
        while q > 1 {
            let p = q - 1;
            if x & q != 0 {
                x ^= p;
            }
            for axis in [&mut y, &mut z] {
                if *axis & q != 0 {
                    x ^= p;
                } else {
                    let t = (x ^ *axis) & p;
                    x ^= t;
                    *axis ^= t;
                }
            }
            q >>= 1;
        }
        y ^= x;
        z ^= y;
        let t = (1..BITS).rev().fold(0, |t, k| t ^ ((z >> k & 1) * ((1 << k) - 1)));
        (0..BITS).rev().fold(0, |index, k| {
            [x ^ t, y ^ t, z ^ t]
                .iter()
                .fold(index, |index, axis| index << 1 | u64::from(axis >> k & 1))
        })
    }

    #[test]
    fn tables_agree_with_their_source() {
        let mut state = 1u64;
        for _ in 0..10_000 {
            let cell = [0; 3].map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (state >> 43) as u32
            });
            assert_eq!(hilbert_index(cell), by_bits(cell), "{cell:?}");
        }
    }

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
