//! Axes of inertia: moments of weighted points, and the eigenvectors of their matrix.

use tetdb_base::geom::Point;

/// Sums of first and second moments.
#[derive(Clone, Copy, Default)]
pub(super) struct Moments {
    weight: f64,
    first: Point,
    /// xx, yy, zz, xy, xz, yz.
    second: [f64; 6],
}

impl Moments {
    pub fn add(&mut self, p: Point, weight: f64) {
        self.weight += weight;
        self.first += p * weight;
        let products = [p.x * p.x, p.y * p.y, p.z * p.z, p.x * p.y, p.x * p.z, p.y * p.z];
        for (sum, product) in self.second.iter_mut().zip(products) {
            *sum += weight * product;
        }
    }

    /// Adds a body of even density in the shape of a tetrahedron: five points have its moments.
    pub fn add_tet(&mut self, points: [Point; 4], weight: f64) {
        self.add(points.iter().sum::<Point>() * 0.25, 0.8 * weight);
        points.into_iter().for_each(|p| self.add(p, 0.05 * weight));
    }

    pub fn add_all(&mut self, other: &Self) {
        self.weight += other.weight;
        self.first += other.first;
        self.second.iter_mut().zip(other.second).for_each(|(sum, more)| *sum += more);
    }

    /// The matrix of central moments.
    pub fn matrix(&self) -> [[f64; 3]; 3] {
        let g = self.first / self.weight;
        let s = self.second.map(|s| s / self.weight);
        let (xy, xz, yz) = (s[3] - g.x * g.y, s[4] - g.x * g.z, s[5] - g.y * g.z);
        [[s[0] - g.x * g.x, xy, xz], [xy, s[1] - g.y * g.y, yz], [xz, yz, s[2] - g.z * g.z]]
    }

    /// Standard deviation along a unit vector.
    pub fn spread(&self, axis: Point) -> f64 {
        let [x, y, z] = self.matrix().map(Point::from_array);
        axis.dot(Point::new(x.dot(axis), y.dot(axis), z.dot(axis))).sqrt()
    }
}

/// Unit eigenvectors of a symmetric matrix, the largest eigenvalue first, by Jacobi's rotations.
///
/// Their sign is such that the largest component (the first of equals) is positive.
pub fn principal_axes(matrix: &[[f64; 3]; 3]) -> [Point; 3] {
    let mut a = *matrix;
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..60 {
        let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
        if off <= 1e-300 {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let t = if theta == 0.0 { 1.0 } else { t };
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                let (x, y) = (row[p], row[q]);
                (row[p], row[q]) = (c * x - s * y, s * x + c * y);
            }
            let (x, y) = (a[p], a[q]);
            a[p] = std::array::from_fn(|k| c * x[k] - s * y[k]);
            a[q] = std::array::from_fn(|k| s * x[k] + c * y[k]);
            for row in &mut v {
                let (x, y) = (row[p], row[q]);
                (row[p], row[q]) = (c * x - s * y, s * x + c * y);
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
    order.map(|k| {
        let axis = Point::new(v[0][k], v[1][k], v[2][k]).normalize();
        let largest = axis
            .to_array()
            .into_iter()
            .fold(0.0, |m: f64, x| if x.abs() > m.abs() + 1e-9 { x } else { m });
        if largest < 0.0 { -axis } else { axis }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_five_tetrahedra_of_a_box_have_its_moments() {
        let corner =
            |k: usize| Point::new((k & 1) as f64, (2 * (k >> 1 & 1)) as f64, (3 * (k >> 2)) as f64);
        let mut moments = Moments::default();
        for (tet, volume) in [
            ([0, 1, 2, 4], 1.0),
            ([3, 1, 2, 7], 1.0),
            ([5, 1, 4, 7], 1.0),
            ([6, 2, 4, 7], 1.0),
            ([1, 2, 4, 7], 2.0),
        ] {
            moments.add_tet(tet.map(corner), volume);
        }
        let matrix = moments.matrix();
        for (i, side) in [1.0, 2.0, 3.0].into_iter().enumerate() {
            for j in 0..3 {
                let wanted = if i == j { side * side / 12.0 } else { 0.0 };
                assert!((matrix[i][j] - wanted).abs() < 1e-14, "{matrix:?}");
            }
        }
    }

    #[test]
    fn principal_axes_are_eigenvectors() {
        let mut seed = 7u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        for _ in 0..200 {
            let [a, b, c, d, e, f] = std::array::from_fn(|_| next());
            let m = [[a, d, e], [d, b, f], [e, f, c]];
            let mut before = f64::INFINITY;
            for axis in principal_axes(&m) {
                let x = axis.to_array();
                let y: [f64; 3] = std::array::from_fn(|i| (0..3).map(|j| m[i][j] * x[j]).sum());
                let value: f64 = (0..3).map(|i| x[i] * y[i]).sum();
                let error: f64 = (0..3).map(|i| (y[i] - value * x[i]).abs()).sum();
                assert!(error < 1e-12, "{m:?} {axis} {error}");
                assert!(value <= before + 1e-12);
                before = value;
            }
        }
    }
}
