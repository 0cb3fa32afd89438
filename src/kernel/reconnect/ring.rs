//! The best triangulation of a shell's ring, by dynamic programming over its chords.
//!
//! Each triangle of the ring becomes two tetrahedra, one with a and one with b. The best worst value for
//! the ring's part from i to j is the best over k of the triangle i k j and the two parts it leaves.
//!
//! Source: G. T. Klincsek, "Minimal triangulations of polygonal domains" (1980); its use for edge removal:
//! L. A. Freitag and C. Ollivier-Gooch, "Tetrahedral mesh improvement using swapping and smoothing" (1997).

/// Requirement on a triangulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Forced {
    /// Any triangulation will do.
    Nothing,
    /// The chord between two positions of the ring.
    Diagonal(usize, usize),
    /// The triangle of three positions of the ring.
    Triangle(usize, usize, usize),
}

impl Forced {
    /// Returns whether the chord `i j` may occur: it must not cross forced chords.
    fn allows(self, i: usize, j: usize) -> bool {
        let crosses = |p: usize, q: usize| {
            let inside = |x: usize| p.min(q) < x && x < p.max(q);
            let on = |x: usize| x == p || x == q;
            !on(i) && !on(j) && inside(i) != inside(j)
        };
        match self {
            Self::Nothing => true,
            Self::Diagonal(p, q) => !crosses(p, q),
            Self::Triangle(p, q, r) => !crosses(p, q) && !crosses(q, r) && !crosses(p, r),
        }
    }
}

/// A triangulation of a ring, with the tables that found it; meant to be used again.
#[derive(Clone, Debug, Default)]
pub struct RingTriangulation {
    /// Positions in the ring, ascending; counter-clockwise seen from b. `n - 2` of them when solved.
    pub triangles: Vec<[u8; 3]>,
    /// The least cone value of the triangles.
    pub worst: f64,
    /// `best[i * n + j]`: best worst value for the part from i to j.
    best: Vec<f64>,
    /// The third vertex of the triangle on chord i j.
    apex: Vec<u8>,
    parts: Vec<(u8, u8)>,
}

impl RingTriangulation {
    /// Finds the triangulation of a ring of `n` (3..=255) whose least `cone(i, j, k)` is largest and above `floor`.
    ///
    /// `cone` is called with i < j < k, at most once per triangle, and only for triangles that could still count. It
    /// must return `f64::NEG_INFINITY` unless both its tetrahedra, `i j k b` and `a i j k`, are exactly positive.
    /// `false` if there is none above `floor`. Ties go to the smallest positions.
    pub fn solve(
        &mut self,
        n: usize,
        floor: f64,
        forced: Forced,
        cone: impl FnMut(usize, usize, usize) -> f64,
    ) -> bool {
        self.solve_by(n, floor, forced, f64::INFINITY, f64::min, cone)
    }

    /// Finds the triangulation whose cone values, none of them above zero, have the largest sum, if that is above `floor`.
    ///
    /// Else as [`RingTriangulation::solve`]; `worst` is the sum.
    pub fn solve_sum(
        &mut self,
        n: usize,
        floor: f64,
        cone: impl FnMut(usize, usize, usize) -> f64,
    ) -> bool {
        self.solve_by(n, floor, Forced::Nothing, 0.0, |a, b| a + b, cone)
    }

    /// The triangulation of largest value above `floor`. `join` combines two values; `nothing` is its neutral element.
    #[inline(always)]
    fn solve_by(
        &mut self,
        n: usize,
        floor: f64,
        forced: Forced,
        nothing: f64,
        join: impl Fn(f64, f64) -> f64,
        mut cone: impl FnMut(usize, usize, usize) -> f64,
    ) -> bool {
        assert!((3..=255).contains(&n), "a ring of {n} vertices");
        self.triangles.clear();
        self.best.clear();
        self.best.resize(n * n, f64::NEG_INFINITY);
        self.apex.clear();
        self.apex.resize(n * n, 0);
        for i in 0..n - 1 {
            self.best[i * n + i + 1] = nothing;
        }
        for width in 2..n {
            for i in 0..n - width {
                let j = i + width;
                if !forced.allows(i, j) {
                    continue;
                }
                let mut best = floor;
                let mut apex = None;
                for k in i + 1..j {
                    let parts = join(self.best[i * n + k], self.best[k * n + j]);
                    if parts > best {
                        let value = join(cone(i, k, j), parts);
                        if value > best {
                            best = value;
                            apex = Some(k);
                        }
                    }
                }
                if let Some(k) = apex {
                    self.best[i * n + j] = best;
                    self.apex[i * n + j] = k as u8;
                }
            }
        }
        self.worst = self.best[n - 1];
        if self.worst == f64::NEG_INFINITY {
            return false;
        }
        self.parts.clear();
        self.parts.push((0, n as u8 - 1));
        while let Some((i, j)) = self.parts.pop() {
            if j - i < 2 {
                continue;
            }
            let k = self.apex[usize::from(i) * n + usize::from(j)];
            self.triangles.push([i, k, j]);
            self.parts.push((k, j));
            self.parts.push((i, k));
        }
        true
    }
}
