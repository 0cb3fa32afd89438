//! Estimates of the error of a field that is linear in tetrahedra, as relative lengths at nodes.
//!
//! With lengths h and K(x) for the second derivatives, the error of interpolation is about h²K, and that of its gradient hK. For a fixed
//! number of tetrahedra, proportional to ∫ h⁻³, the integral of its square is least where
//!
//! ```text
//!   values:    4 h³ K² = 3 λ h⁻⁴,  h = c K^(-2/7)
//!   gradients: 2 h K²  = 3 λ h⁻⁴,  h = c K^(-2/5)
//! ```
//!
//! See F. Alauzet and A. Loseille, "Continuous mesh framework", SIAM Journal on Numerical Analysis 49 (2011), where the first is the case
//! of isotropic lengths and the norm of L². The second spreads the error evenly: tetrahedra of volume h³ have h²K²·h³ each.

use super::arrays::{MeshArrays, ON_SURFACE};
use crate::pipeline::error::PipelineError;
use tetdb_base::geom::Point;
use tetdb_base::storage::{ScratchSpace, SpillVec, sort_record};
use tetdb_schema::word::Word;

/// How the error of a field is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorEstimate {
    /// From second derivatives, for the least error of values.
    #[default]
    Hessian,
    /// From jumps of the normal derivative at faces, for the least error of gradients.
    Jump,
}

impl Word for ErrorEstimate {
    const WORDS: &'static [(Self, &'static str)] =
        &[(Self::Hessian, "hessian"), (Self::Jump, "jump")];
}

/// Second derivatives that change values by less than this share of their range along an edge are rounding.
const ROUNDING: f64 = 1e-10;

sort_record! {
    /// A face of a tetrahedron, and the flux of the field's gradient through it.
    struct FaceFlux {
        /// Nodes, ascending.
        a: u32,
        b: u32,
        c: u32,
        /// Bits of the flux, outwards.
        flux: u64,
    }
}

impl ErrorEstimate {
    /// Relative lengths at nodes, infinite where none is wanted; `None` where the field is linear but for rounding: values have the relative
    /// precision `epsilon`.
    ///
    /// Errors: the disk.
    pub fn relative_sizes(
        self,
        mesh: &mut MeshArrays,
        epsilon: f64,
        scratch: &ScratchSpace,
    ) -> Result<Option<SpillVec<f64>>, PipelineError> {
        let (mut curvature, exponent) = match self {
            Self::Hessian => (curvature_of_gradients(mesh, scratch), -2.0 / 7.0),
            Self::Jump => (curvature_of_jumps(mesh, scratch)?, -2.0 / 5.0),
        };
        let (mut most, mut range) = (0.0f64, [f64::INFINITY, f64::NEG_INFINITY]);
        for v in 0..mesh.n_nodes() {
            let (h, value) = (mesh.present.get(v), mesh.values.get(v));
            if h == 0.0 {
                continue;
            }
            most = most.max(curvature.get(v) * h * h);
            range = [range[0].min(value), range[1].max(value)];
        }
        let greatest = range[0].abs().max(range[1].abs());
        if most <= (ROUNDING * (range[1] - range[0])).max(16.0 * epsilon * greatest) {
            return Ok(None);
        }
        for v in 0..mesh.n_nodes() {
            // Where the second derivatives vanish the length is infinite; the greatest length and the gradation bound it.
            curvature.change(v, |k| *k = libm::pow(*k, exponent));
        }
        Ok(Some(curvature))
    }
}

/// The gradients of the barycentric coordinates of a tetrahedron, times its volume, and the volume.
///
/// Times the volume they stay finite however flat it is.
fn gradients([a, b, c, d]: [Point; 4]) -> ([Point; 4], f64) {
    let (u, v, w) = (b - a, c - a, d - a);
    let of = [v.cross(w), w.cross(u), u.cross(v)].map(|g| g / 6.0);
    ([-(of[0] + of[1] + of[2]), of[0], of[1], of[2]], u.dot(v.cross(w)) / 6.0)
}

/// The gradient of the field in a tetrahedron, times its volume, with what [`gradients`] returns.
fn gradient(mesh: &mut MeshArrays, tet: [u32; 4]) -> (Point, [Point; 4], f64) {
    let (of, volume) = gradients(mesh.corners(tet));
    let [first, values @ ..] = tet.map(|v| mesh.values.get(v as usize));
    let slope = values.iter().zip(&of[1..]).map(|(value, &g)| g * (value - first)).sum();
    (slope, of, volume)
}

/// The greatest absolute second derivative at nodes: that of the means of gradients, both recovered by volume.
///
/// Means at the surface are of one side. There it is that of the nodes inside beside it.
fn curvature_of_gradients(mesh: &mut MeshArrays, scratch: &ScratchSpace) -> SpillVec<f64> {
    let n = mesh.n_nodes();
    let mut slopes = scratch.vec(n, [0.0f64; 4]);
    for t in 0..mesh.tets.len() {
        let tet = mesh.tet(t);
        let (slope, _, volume) = gradient(mesh, tet);
        let more = [slope.x, slope.y, slope.z, volume];
        tet.iter().for_each(|&v| slopes.change(v as usize, |sum| add(sum, more)));
    }
    let mut second = scratch.vec(n, [0.0f64; 6]);
    for t in 0..mesh.tets.len() {
        let tet = mesh.tet(t);
        let (of, _) = gradients(mesh.corners(tet));
        let mut sum = [0.0; 6];
        for (v, g) in tet.into_iter().zip(of) {
            let [x, y, z, volume] = slopes.get(v as usize);
            if volume <= 0.0 {
                continue;
            }
            let s = Point::new(x, y, z) / volume;
            let mixed = |a: usize, b: usize| 0.5 * (s[a] * g[b] + s[b] * g[a]);
            let own = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|(a, b)| mixed(a, b));
            add(&mut sum, own);
        }
        tet.iter().for_each(|&v| second.change(v as usize, |all| add(all, sum)));
    }
    let mut curvature = scratch.vec(n, 0.0);
    for v in 0..n {
        let volume = slopes.get(v)[3];
        // A vertex may be in no tetrahedron.
        let greatest = greatest_eigenvalue(second.get(v).map(|x| x / volume));
        if volume > 0.0 && greatest.is_finite() {
            curvature.set(v, greatest);
        }
    }
    drop((slopes, second));
    let mut beside = scratch.vec(n, [0.0f64; 2]);
    for t in 0..mesh.tets.len() {
        let tet = mesh.tet(t);
        let (_, volume) = gradients(mesh.corners(tet));
        let (outer, inner): (Vec<u32>, Vec<u32>) =
            tet.iter().partition(|&&v| mesh.skin.get(v as usize) & ON_SURFACE != 0);
        for v in outer {
            for &w in &inner {
                let more = [volume * curvature.get(w as usize), volume];
                beside.change(v as usize, |sum| add(sum, more));
            }
        }
    }
    for v in 0..n {
        let [sum, volume] = beside.get(v);
        if volume > 0.0 {
            curvature.set(v, sum / volume);
        }
    }
    curvature
}

fn add<const N: usize>(sum: &mut [f64; N], more: [f64; N]) {
    sum.iter_mut().zip(more).for_each(|(sum, x)| *sum += x);
}

/// The greatest absolute eigenvalue of a symmetric matrix xx, yy, zz, xy, yz, xz; by its characteristic polynomial.
///
/// O. K. Smith, "Eigenvalues of a symmetric 3 × 3 matrix", Communications of the ACM 4 (1961).
fn greatest_eigenvalue([xx, yy, zz, xy, yz, xz]: [f64; 6]) -> f64 {
    let mean = (xx + yy + zz) / 3.0;
    let [a, b, c] = [xx - mean, yy - mean, zz - mean];
    let spread = ((a * a + b * b + c * c + 2.0 * (xy * xy + yz * yz + xz * xz)) / 6.0).sqrt();
    if spread == 0.0 {
        return mean.abs();
    }
    let det = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
    let half = (det / (2.0 * spread * spread * spread)).clamp(-1.0, 1.0);
    let angle = libm::acos(half) / 3.0;
    let high = mean + 2.0 * spread * libm::cos(angle);
    let low = mean + 2.0 * spread * libm::cos(angle + 2.0 * std::f64::consts::FRAC_PI_3);
    high.abs().max(low.abs())
}

/// Second derivatives that explain the jumps at the faces around nodes.
///
/// A tetrahedron has the error ½ h ∫ (jump)² over its faces; C. Carstensen and R. Verfürth, "Edge residuals dominate a posteriori error
/// estimates", SIAM Journal on Numerical Analysis 36 (1999). Per volume this is (hK)², with the present lengths h.
fn curvature_of_jumps(
    mesh: &mut MeshArrays,
    scratch: &ScratchSpace,
) -> Result<SpillVec<f64>, PipelineError> {
    let n = mesh.n_nodes();
    let mut faces = scratch.sorter::<FaceFlux>();
    let mut sums = scratch.vec(n, [0.0f64; 2]);
    for t in 0..mesh.tets.len() {
        let tet = mesh.tet(t);
        let (slope, of, volume) = gradient(mesh, tet);
        tet.iter().for_each(|&v| sums.change(v as usize, |sum| sum[1] += volume / 4.0));
        // One that is flat to the last digit has no gradient.
        if !volume.is_normal() {
            continue;
        }
        for (i, g) in of.into_iter().enumerate() {
            let mut nodes = [1, 2, 3].map(|k| tet[(i + k) % 4]);
            nodes.sort_unstable();
            let ([a, b, c], flux) = (nodes, -3.0 * g.dot(slope) / volume);
            faces.push(FaceFlux { a, b, c, flux: flux.to_bits() })?;
        }
    }
    let mut last: Option<FaceFlux> = None;
    for face in faces.finish()? {
        let face = face?;
        let nodes = [face.a, face.b, face.c];
        match last.take() {
            Some(other) if [other.a, other.b, other.c] == nodes => {
                let [a, b, c] = mesh.corners(nodes);
                let area = 0.5 * (b - a).cross(c - a).length();
                let width = a.distance(b).max(b.distance(c)).max(c.distance(a));
                let jump = f64::from_bits(face.flux) + f64::from_bits(other.flux);
                let own = 0.5 * width * jump * jump / area.max(f64::MIN_POSITIVE) / 3.0;
                nodes.iter().for_each(|&v| sums.change(v as usize, |sum| sum[0] += own));
            }
            _ => last = Some(face),
        }
    }
    let mut curvature = scratch.vec(n, 0.0);
    for v in 0..n {
        let [sum, volume] = sums.get(v);
        if volume > 0.0 {
            curvature.set(v, (sum / volume).sqrt() / mesh.present.get(v));
        }
    }
    Ok(curvature)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The unit cube as a grid of `n³` cells of six tetrahedra, with a field.
    fn grid(n: u32, value: impl Fn(Point) -> f64) -> MeshArrays {
        let scratch = ScratchSpace::boundless();
        let m = n + 1;
        let (mut points, mut values, mut skin) =
            (scratch.builder(), scratch.builder(), scratch.builder());
        for k in 0..m * m * m {
            let at = [k % m, k / m % m, k / m / m];
            let p = Point::from_array(at.map(|i| f64::from(i) / f64::from(n)));
            points.push(p.to_array());
            values.push(value(p));
            skin.push(if at.iter().any(|i| i % n == 0) { ON_SURFACE } else { 0 });
        }
        let mut tets = scratch.builder();
        for k in 0..n * n * n {
            let low = k % n + k / n % n * m + k / n / n * m * m;
            let steps = [1, m, m * m];
            for ([i, j, l], is_odd) in [
                ([0, 1, 2], false),
                ([1, 2, 0], false),
                ([2, 0, 1], false),
                ([0, 2, 1], true),
                ([2, 1, 0], true),
                ([1, 0, 2], true),
            ] {
                let a = low + steps[i];
                let b = a + steps[j];
                let c = b + steps[l];
                tets.push(if is_odd { [low, b, a, c] } else { [low, a, b, c] });
            }
        }
        let n_points = points.len();
        MeshArrays {
            parts: Vec::new(),
            nodes: scratch.vec(0, 0),
            tets: tets.finish(),
            points: points.finish(),
            values: values.finish(),
            present: scratch.vec(n_points, 1.0 / f64::from(n)),
            skin: skin.finish(),
        }
    }

    /// Where the second derivative of exp(-x/e) falls, lengths grow as its power; those of a quadratic are everywhere the same.
    #[test]
    fn relative_lengths_are_powers_of_known_second_derivatives() {
        const E: f64 = 0.2;
        let scratch = ScratchSpace::boundless();
        for (estimate, exponent) in
            [(ErrorEstimate::Hessian, 2.0 / 7.0), (ErrorEstimate::Jump, 2.0 / 5.0)]
        {
            for is_layer in [true, false] {
                let mut mesh = grid(20, |p| match is_layer {
                    true => (-p.x / E).exp(),
                    false => p.x * p.x + p.y * p.y - 2.0 * p.z * p.z,
                });
                let sizes = estimate
                    .relative_sizes(&mut mesh, f64::EPSILON, &scratch)
                    .expect("memory alone");
                let mut sizes = sizes.expect("a field that bends");
                let at = |x: usize| x + 10 * 21 + 10 * 21 * 21;
                for x in 4..17 {
                    let growth = if is_layer { 1.0 / 20.0 / E * exponent } else { 0.0 };
                    let ratio = sizes.get(at(x + 1)) / sizes.get(at(x));
                    assert!((ratio / growth.exp() - 1.0).abs() < 0.01, "{estimate:?} {x}: {ratio}");
                }
            }
            for (offset, is_short) in [(300.0, false), (1e6, false), (3.0, true)] {
                let mut linear = grid(4, |p| match offset + p.x - 2.0 * p.y {
                    value if is_short => f64::from(value as f32),
                    value => value,
                });
                let epsilon = if is_short { f64::from(f32::EPSILON) } else { f64::EPSILON };
                let sizes = estimate.relative_sizes(&mut linear, epsilon, &scratch);
                assert!(sizes.expect("memory alone").is_none(), "{offset} {estimate:?}");
            }
        }
    }

    #[test]
    fn greatest_eigenvalues_of_known_matrices() {
        for (matrix, expected) in [
            ([1.0, 2.0, -3.0, 0.0, 0.0, 0.0], 3.0),
            ([2.0, 2.0, 2.0, 0.0, 0.0, 0.0], 2.0),
            ([0.0, 0.0, 0.0, 5.0, 0.0, 0.0], 5.0),
            // The projection onto (1, 2, 2), times nine.
            ([1.0, 4.0, 4.0, 2.0, 4.0, 2.0], 9.0),
            ([0.0; 6], 0.0),
        ] {
            let found = greatest_eigenvalue(matrix);
            assert!((found - expected).abs() < 1e-12 * expected.max(1.0), "{matrix:?}: {found}");
        }
    }
}
