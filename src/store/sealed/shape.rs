//! The shape of one tetrahedron in numbers.

use tetdb_schema::catalog::QUALITY_BINS;

use tetdb_base::geom::Point;

/// Volume, quality and dihedral angles of a tetrahedron.
///
/// Units: volume in cubed lengths of the input. Not exact: validity is decided by `geom::orient`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Signed volume.
    pub volume: f64,
    /// q = (sqrt(6)/12) * longest edge / inradius; infinite when the volume is not positive.
    pub quality: f64,
    /// Least and greatest cosine of the six dihedral angles.
    pub cosines: [f64; 2],
    /// Length of the longest edge.
    pub edge_max: f64,
}

impl Shape {
    /// Measures the positive tetrahedron with these corners. Unused results are not computed.
    #[inline]
    pub fn new(corners: [Point; 4]) -> Self {
        Self::with(corners, cosines)
    }

    /// Like [`Shape::new`], but skips the six divisions of the cosines and returns `known` unless one may exceed these extremes.
    #[inline]
    pub(super) fn beyond(corners: [Point; 4], known: [f64; 2]) -> Self {
        Self::with(corners, |normals, lengths| {
            let mut beyond = false;
            for (i, j) in PAIRS {
                let (dot, unit) = (-normals[i].dot(normals[j]), lengths[i] * lengths[j]);
                let within =
                    dot > (known[0] + ROUNDING) * unit && dot < (known[1] - ROUNDING) * unit;
                beyond |= !within;
            }
            if beyond { cosines(normals, lengths) } else { known }
        })
    }

    #[inline(always)]
    fn with(
        [a, b, c, d]: [Point; 4],
        cosines: impl FnOnce(&[Point; 4], &[f64; 4]) -> [f64; 2],
    ) -> Self {
        let (ab, ac, ad, bc, bd) = (b - a, c - a, d - a, c - b, d - b);
        // Twice the areas, outward.
        let normals = [bc.cross(bd), ad.cross(ac), ab.cross(ad), ac.cross(ab)];
        // No `map`, which would call a function for each.
        let [e, f, g, h] = &normals;
        let lengths = [e.length(), f.length(), g.length(), h.length()];
        let six_volumes = ab.dot(ac.cross(ad));
        let edges = [ab, ac, ad, bc, bd, d - c];
        let longest = edges.iter().fold(0.0, |m: f64, e| m.max(e.length_squared()));
        let inradius = six_volumes / lengths.iter().sum::<f64>();
        let quality = if six_volumes > 0.0 {
            6f64.sqrt() / 12.0 * longest.sqrt() / inradius
        } else {
            f64::INFINITY
        };
        Self {
            volume: six_volumes / 6.0,
            quality,
            cosines: cosines(&normals, &lengths),
            edge_max: longest.sqrt(),
        }
    }
}

/// The pairs of faces.
const PAIRS: [(usize, usize); 6] = [(1, 0), (2, 0), (2, 1), (3, 0), (3, 1), (3, 2)];
/// Bound of the rounding of a cosine.
const ROUNDING: f64 = 1e-15;

#[inline]
fn cosines(normals: &[Point; 4], lengths: &[f64; 4]) -> [f64; 2] {
    let mut cosines = [1.0, -1.0];
    for (i, j) in PAIRS {
        let cosine = -normals[i].dot(normals[j]) / (lengths[i] * lengths[j]);
        cosines = [cosine.min(cosines[0]), cosine.max(cosines[1])];
    }
    cosines
}

/// The bin of a quality; NaN, as of a vertex without a position, is in the worst bin.
pub fn quality_bin(quality: f64) -> usize {
    if quality.is_nan() {
        return QUALITY_BINS - 1;
    }
    (quality.clamp(1.0, 10.0) as usize).min(QUALITY_BINS) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_are_those_of_all() {
        let mut state = 7u64;
        let mut next = || {
            state = tetdb_base::geom::mix(state);
            (state >> 40) as f64 / f64::from(1u32 << 24)
        };
        let (mut all, mut known) = ([1.0, -1.0f64], [1.0, -1.0f64]);
        let mut skipped = 0;
        for k in 0..2000 {
            // A hundredth are flat, some altogether.
            let flat = [1.0, 1e-9, 0.0][if k % 100 == 0 { k / 100 % 3 } else { 0 }];
            let p = [0; 4].map(|_| Point::new(next(), next(), flat * next()));
            let (whole, beyond) = (Shape::new(p), Shape::beyond(p, known));
            let same = |f: fn(&Shape) -> f64| f(&whole).to_bits() == f(&beyond).to_bits();
            assert!(same(|s| s.volume) && same(|s| s.quality) && same(|s| s.edge_max));
            skipped += usize::from(beyond.cosines == known);
            for (extremes, shape) in [(&mut all, whole), (&mut known, beyond)] {
                extremes[0] = extremes[0].min(shape.cosines[0]);
                extremes[1] = extremes[1].max(shape.cosines[1]);
            }
            assert_eq!(all, known);
        }
        assert!(skipped > 1900, "{skipped}");
    }

    #[test]
    fn the_regular_tetrahedron_is_the_unit_of_quality() {
        let p = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]];
        for scale in [1e-9, 1.0, 1e9] {
            let [a, b, c, d] = p.map(|p| Point::from_array(p) * scale);
            let shape = Shape::new([a, c, b, d]);
            let shape = if shape.volume > 0.0 { shape } else { Shape::new([a, b, c, d]) };
            assert!((shape.quality - 1.0).abs() < 1e-12, "{shape:?}");
            assert!((shape.volume / scale.powi(3) - 8.0 / 3.0).abs() < 1e-12);
            for cosine in shape.cosines {
                assert!((cosine - 1.0 / 3.0).abs() < 1e-12);
            }
        }
        assert_eq!(
            [0.999, 1.0, 1.99, 2.0, 9.99, 10.0, f64::INFINITY, f64::NAN].map(quality_bin),
            [0, 0, 0, 1, 8, 9, 9, 9]
        );
    }
}
