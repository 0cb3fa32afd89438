//! Convex parts of space around a triangle, and convex polygons cut by them.
//!
//! The distance bound rests on three sets around a triangle T, each a slab around its plane times a figure in the plane:
//!
//! ```text
//! inner  ⊂  T thickened by a disc of radius `margin`  ⊂  outer
//! ```
//!
//! Inner and outer figure are bounded by lines beside the edges and, at each corner, by a line across the outward bisector; so they
//! have six sides at most. Every point of the middle set is within `sqrt(height² + margin²)` of T.

use std::f64::consts::SQRT_2;

use tetdb_base::geom::Point;

/// Corners of a polygon at most; one that would have more counts as not covered.
const CORNERS_MAX: usize = 14;
/// Share of the tolerance by which a triangle is thickened in its plane: less and pieces remain at edges, more and the slab gets thin.
const MARGIN: f64 = 0.25;
/// Heights of inner regions are less by this share, far above the rounding of a product.
const ROUNDING: f64 = 1e-5;

/// A convex polygon.
#[derive(Clone, Copy)]
pub struct Polygon {
    n: usize,
    corners: [Point; CORNERS_MAX],
}

impl Polygon {
    /// A triangle as a polygon.
    pub fn new(corners: [Point; 3]) -> Self {
        let mut polygon = Self { n: 3, corners: [Point::ZERO; CORNERS_MAX] };
        polygon.corners[..3].copy_from_slice(&corners);
        polygon
    }

    /// Its corners.
    pub fn corners(&self) -> &[Point] {
        &self.corners[..self.n]
    }

    /// The part on one side of a plane, `keep` times the distance being at most zero; `None` for too many corners.
    fn half(&self, distances: &[f64; CORNERS_MAX], keep: f64) -> Option<Self> {
        let mut part = Self { n: 0, corners: [Point::ZERO; CORNERS_MAX] };
        let mut push = |p: Point| {
            if part.n == CORNERS_MAX {
                return false;
            }
            part.corners[part.n] = p;
            part.n += 1;
            true
        };
        for i in 0..self.n {
            let j = (i + 1) % self.n;
            let (x, y) = (keep * distances[i], keep * distances[j]);
            if x <= 0.0 && !push(self.corners[i]) {
                return None;
            }
            if (x < 0.0 && y > 0.0) || (x > 0.0 && y < 0.0) {
                let at = self.corners[i] + (self.corners[j] - self.corners[i]) * (x / (x - y));
                if !push(at) {
                    return None;
                }
            }
        }
        Some(part)
    }
}

/// A convex part of space: eight planes at most.
#[derive(Clone, Copy)]
pub struct Region {
    /// Outward normals and offsets; inside is `normal · x <= offset`.
    planes: [(Point, f64); 8],
}

/// How a polygon lies to a region.
pub enum Cut {
    /// Wholly inside.
    Inside,
    /// Without a common part.
    Outside,
    /// Partly inside; the parts outside.
    Parts(Vec<Polygon>),
    /// Too many corners to say.
    Unclear,
}

impl Region {
    /// The set inside the thickened triangle; `None` for a triangle without a plane.
    pub fn inner(t: [Point; 3], tolerance: f64) -> Option<Self> {
        Self::around(t, tolerance, MARGIN / SQRT_2, 1.0 - ROUNDING)
    }

    /// The set around the thickened triangle; a box for a triangle without a plane.
    pub fn outer(t: [Point; 3], tolerance: f64) -> Self {
        Self::around(t, tolerance, MARGIN, 1.0).unwrap_or_else(|| {
            let reach = Point::splat(tolerance);
            let low = t[0].min(t[1]).min(t[2]) - reach;
            let high = t[0].max(t[1]).max(t[2]) + reach;
            let mut planes = [(Point::ZERO, 0.0); 8];
            for (k, axis) in [Point::X, Point::Y, Point::Z].into_iter().enumerate() {
                planes[2 * k] = (axis, high[k]);
                planes[2 * k + 1] = (-axis, -low[k]);
            }
            Self { planes }
        })
    }

    fn around(t: [Point; 3], tolerance: f64, margin: f64, slab: f64) -> Option<Self> {
        let height = tolerance * (1.0 - MARGIN * MARGIN).sqrt() * slab;
        let margin = margin * tolerance;
        let edges = [0, 1, 2].map(|k| t[(k + 1) % 3] - t[k]);
        let units = edges.map(|e| e / e.length());
        let normal = edges[0].cross(edges[1]);
        let longest = edges.iter().map(|e| e.length()).fold(0.0, f64::max);
        let n = normal / normal.length();
        // Below this height the direction of the normal is rounding.
        if !n.is_finite() || normal.length() < 1e-7 * longest * longest {
            return None;
        }
        let at = n.dot(t[0]);
        let mut planes = [(n, at + height); 8];
        planes[1] = (-n, height - at);
        for k in 0..3 {
            let side = units[k].cross(n);
            planes[2 + k] = (side, side.dot(t[k]).max(side.dot(t[(k + 1) % 3])) + margin);
            let out = units[(k + 2) % 3] - units[k];
            let out = out / out.length();
            // A corner of nearly 180 degrees has no direction, and needs no plane.
            planes[5 + k] = match out.is_finite() {
                true => (out, out.dot(t[k]) + margin),
                false => planes[2 + k],
            };
        }
        Some(Self { planes })
    }

    /// The polygon's part inside; `None` if there is none. An unclear one is returned whole.
    pub fn part_of(&self, polygon: &Polygon) -> Option<Polygon> {
        let mut inside = *polygon;
        for plane in &self.planes {
            let distances = inside.distances(plane);
            if distances[..inside.n].iter().all(|&d| d <= 0.0) {
                continue;
            }
            if distances[..inside.n].iter().all(|&d| d > 0.0) {
                return None;
            }
            inside = inside.half(&distances, 1.0).unwrap_or(inside);
        }
        (inside.n > 0).then_some(inside)
    }

    /// Returns whether the whole polygon is inside.
    pub fn contains(&self, polygon: &Polygon) -> bool {
        self.planes.iter().all(|(n, d)| polygon.corners().iter().all(|p| n.dot(*p) <= *d))
    }

    /// The parts of a polygon outside.
    pub fn cut(&self, polygon: &Polygon) -> Cut {
        let mut rest = *polygon;
        let (mut crossing, mut n_crossing) = ([0; 8], 0);
        for (k, plane) in self.planes.iter().enumerate() {
            let distances = polygon.distances(plane);
            let of = &distances[..polygon.n];
            if of.iter().all(|&d| d >= 0.0) {
                return Cut::Outside;
            }
            if of.iter().any(|&d| d > 0.0) {
                crossing[n_crossing] = k;
                n_crossing += 1;
            }
        }
        if n_crossing == 0 {
            return Cut::Inside;
        }
        let mut parts = Vec::new();
        for &k in &crossing[..n_crossing] {
            let distances = rest.distances(&self.planes[k]);
            let of = &distances[..rest.n];
            if of.iter().all(|&d| d <= 0.0) {
                continue;
            }
            if of.iter().all(|&d| d >= 0.0) {
                return Cut::Outside;
            }
            let (Some(out), Some(inside)) =
                (rest.half(&distances, -1.0), rest.half(&distances, 1.0))
            else {
                return Cut::Unclear;
            };
            parts.push(out);
            rest = inside;
        }
        Cut::Parts(parts)
    }
}

impl Polygon {
    fn distances(&self, (normal, offset): &(Point, f64)) -> [f64; CORNERS_MAX] {
        let mut all = [0.0; CORNERS_MAX];
        for (d, p) in all.iter_mut().zip(self.corners()) {
            *d = normal.dot(*p) - offset;
        }
        all
    }
}

/// Pieces looked at before a polygon counts as not covered: hundreds are needed on fans of needles, thousands only gain seconds of waiting.
const PIECES_MAX: usize = 600;

/// Returns whether every point of a polygon lies in a region; some polygons that do are denied.
pub fn is_covered(polygon: &Polygon, regions: &[Region]) -> bool {
    if regions.iter().any(|r| r.contains(polygon)) {
        return true;
    }
    let middle = polygon.corners().iter().copied().sum::<Point>() / polygon.n as f64;
    let holds = |r: &Region| r.planes.iter().all(|(n, d)| n.dot(middle) <= *d);
    // The region around the middle first: it leaves the fewest pieces. Without one, the middle is not covered.
    let Some(first_of_all) = regions.iter().position(holds) else { return false };
    let order = |k: usize| match k {
        0 => &regions[first_of_all],
        k if k <= first_of_all => &regions[k - 1],
        k => &regions[k],
    };
    let mut stack = vec![(*polygon, 0)];
    let mut n_pieces = 0;
    while let Some((piece, first)) = stack.pop() {
        n_pieces += 1;
        if n_pieces > PIECES_MAX {
            return false;
        }
        if n_pieces > 1 && (first..regions.len()).any(|k| order(k).contains(&piece)) {
            continue;
        }
        let mut is_cut = false;
        for i in first..regions.len() {
            match order(i).cut(&piece) {
                Cut::Outside | Cut::Unclear => {}
                Cut::Inside => is_cut = true,
                Cut::Parts(parts) => {
                    stack.extend(parts.into_iter().map(|part| (part, i + 1)));
                    is_cut = true;
                }
            }
            if is_cut {
                break;
            }
        }
        if !is_cut {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::mix;

    fn random(k: u64) -> Point {
        let at = |i: u64| (mix(3 * k + i) >> 11) as f64 / (1u64 << 53) as f64;
        Point::new(at(0), at(1), at(2))
    }

    #[test]
    fn the_inner_set_is_within_the_tolerance_and_inside_the_outer_one() {
        for k in 0..2_000 {
            let t = [random(5 * k), random(5 * k + 1), random(5 * k + 2)];
            let tolerance = 0.3;
            let (inner, outer) =
                (Region::inner(t, tolerance).unwrap(), Region::outer(t, tolerance));
            let p = random(5 * k + 3) * 3.0 - Point::ONE;
            let dot = Polygon { n: 1, corners: [p; CORNERS_MAX] };
            let distance = p.distance(tetdb_base::surface::nearest_point(t, p));
            if inner.contains(&dot) {
                assert!(distance <= tolerance, "{t:?} {p:?}");
                assert!(outer.contains(&dot));
            }
            assert!(distance > 0.1 * tolerance || inner.contains(&dot), "{t:?} {p:?}");
        }
    }

    #[test]
    fn a_square_is_covered_by_its_halves_and_not_by_one_of_them() {
        let c = [Point::ZERO, Point::X, Point::new(1.0, 1.0, 0.0), Point::Y];
        let regions =
            [[c[0], c[1], c[2]], [c[0], c[2], c[3]]].map(|t| Region::inner(t, 0.01).unwrap());
        let across = Polygon::new([c[0], c[1], c[3]]);
        assert!(is_covered(&across, &regions));
        assert!(!is_covered(&across, &regions[..1]));
        let above = Polygon::new([c[0], c[1], c[3]].map(|p| p + Point::Z * 0.02));
        assert!(!is_covered(&above, &regions));
    }
}
