//! The shape of one tetrahedron in numbers.

use tetdb_schema::catalog::QUALITY_BINS;

use crate::geom::Point;

/// Volume, quality and dihedral angles of a tetrahedron.
///
/// Units: volume in cubed lengths of the input. Not exact: validity is decided by `geom::orient`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Of the tetrahedron, with its sign.
    pub volume: f64,
    /// q = (sqrt(6)/12) * longest edge / inradius; infinite when the volume is not positive.
    pub quality: f64,
    /// Least and greatest cosine of the six dihedral angles.
    pub cosines: [f64; 2],
    /// Length of the longest edge.
    pub edge_max: f64,
}

impl Shape {
    /// Of the positive tetrahedron with these corners. What the caller does not use is not computed.
    #[inline]
    pub fn of([a, b, c, d]: [Point; 4]) -> Self {
        let (ab, ac, ad, bc, bd) = (b - a, c - a, d - a, c - b, d - b);
        // Twice the areas, outward.
        let normals = [bc.cross(bd), ad.cross(ac), ab.cross(ad), ac.cross(ab)];
        // Not by `map`, which calls a function for each.
        let [e, f, g, h] = &normals;
        let lengths = [e.length(), f.length(), g.length(), h.length()];
        let six_volumes = ab.dot(ac.cross(ad));
        let edges = [ab, ac, ad, bc, bd, d - c];
        let longest = edges
            .iter()
            .fold(0.0, |m: f64, e| m.max(e.length_squared()));
        let inradius = six_volumes / lengths.iter().sum::<f64>();
        let quality = if six_volumes > 0.0 {
            6f64.sqrt() / 12.0 * longest.sqrt() / inradius
        } else {
            f64::INFINITY
        };
        let mut cosines = [1.0, -1.0];
        for i in 0..4 {
            for j in 0..i {
                let cosine = -normals[i].dot(normals[j]) / (lengths[i] * lengths[j]);
                cosines = [cosine.min(cosines[0]), cosine.max(cosines[1])];
            }
        }
        Self {
            volume: six_volumes / 6.0,
            quality,
            cosines,
            edge_max: longest.sqrt(),
        }
    }
}

/// The bin of a quality; what is no number, as of a vertex without a place, is in the worst.
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
    fn the_regular_tetrahedron_is_the_unit_of_quality() {
        let p = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]];
        for scale in [1e-9, 1.0, 1e9] {
            let [a, b, c, d] = p.map(|p| Point::from_array(p) * scale);
            let shape = Shape::of([a, c, b, d]);
            let shape = if shape.volume > 0.0 {
                shape
            } else {
                Shape::of([a, b, c, d])
            };
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
