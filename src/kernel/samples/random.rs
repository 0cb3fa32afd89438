//! Random numbers that are the same on every machine.

use tetdb_base::geom::{Point, STEP, mix};

/// SplitMix64: a counter and a mixing function.
#[derive(Clone, Debug)]
pub(super) struct Random {
    state: u64,
}

impl Random {
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    fn bits(&mut self) -> u64 {
        let bits = mix(self.state);
        self.state = self.state.wrapping_add(STEP);
        bits
    }

    /// Uniform in `[0, 1[`, a multiple of 2^-53.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in the unit cube.
    pub fn in_cube(&mut self) -> Point {
        let x = self.unit();
        let y = self.unit();
        Point::new(x, y, self.unit())
    }

    /// A uniformly random rotation, as its three columns.
    pub fn rotation(&mut self) -> [Point; 3] {
        loop {
            let q = [0; 4].map(|_| 2.0 * self.unit() - 1.0);
            let norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
            // Inside the ball for uniformity; not at its center, where directions are rounded.
            if (0.01..=1.0).contains(&norm2) {
                let norm = norm2.sqrt();
                return rotation_of(q.map(|x| x / norm));
            }
        }
    }
}

/// Columns of the rotation of a unit quaternion.
fn rotation_of([w, x, y, z]: [f64; 4]) -> [Point; 3] {
    [
        Point::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        Point::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        Point::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    ]
}

/// `ratio^t` for `ratio > 0` and `t` in `[0, 1[`, by square roots: one per bit of `t`.
pub(super) fn power(ratio: f64, t: f64) -> f64 {
    let (mut root, mut rest, mut result) = (ratio, t, 1.0);
    for _ in 0..53 {
        root = root.sqrt();
        rest *= 2.0;
        if rest >= 1.0 {
            result *= root;
            rest -= 1.0;
        }
    }
    result
}

/// Cube root of a positive number by Newton's iteration from above.
pub(super) fn cube_root(a: f64) -> f64 {
    let mut x = a.max(1.0);
    // From above each step takes at least a third off until it converges quadratically.
    for _ in 0..120 {
        x = (2.0 * x + a / (x * x)) / 3.0;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_and_roots_are_right() {
        for (a, t) in [(5.333, 0.25), (0.1, 0.75), (1000.0, 0.333)] {
            assert!((power(a, t) / a.powf(t) - 1.0).abs() < 1e-13);
            assert!((cube_root(a) / a.cbrt() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn rotations_keep_lengths_and_orientation() {
        let mut random = Random::new(7);
        for _ in 0..100 {
            let [x, y, z] = random.rotation();
            assert!((x.length() - 1.0).abs() < 1e-14 && x.dot(y).abs() < 1e-14);
            assert!((x.cross(y) - z).length() < 1e-14);
        }
    }
}
