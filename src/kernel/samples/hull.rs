//! Convex hull of a few dozen points, decided by exact signs.

use tetdb_base::geom::{Point, orient};

/// Triangles of the convex hull, outward; empty when all points lie in one plane.
///
/// Each point is tested against every triangle so far: meant for tens of points. A point that lies in or on the hull of the earlier
/// ones gets no triangle.
pub(super) fn convex_hull(points: &[Point]) -> Vec<[u32; 3]> {
    let Some(first) = first_tetrahedron(points) else {
        return Vec::new();
    };
    let [a, b, c, d] = first;
    let mut hull = vec![[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
    let mut seen: Vec<[u32; 3]> = Vec::new();
    for p in (0..points.len() as u32).filter(|p| !first.contains(p)) {
        let at = |v: u32| points[v as usize];
        seen.clear();
        hull.retain(|&[a, b, c]| {
            let hidden = orient(at(a), at(b), at(c), at(p)) <= 0.0;
            if !hidden {
                seen.push([a, b, c]);
            }
            hidden
        });
        let edges = || seen.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        for (a, b) in edges() {
            if !edges().any(|other| other == (b, a)) {
                hull.push([a, b, p]);
            }
        }
    }
    hull
}

/// Four points of positive volume, with the first point among them.
fn first_tetrahedron(points: &[Point]) -> Option<[u32; 4]> {
    let n = points.len();
    for (b, c) in (1..n).flat_map(|b| (b + 1..n).map(move |c| (b, c))) {
        for d in c + 1..n {
            let volume = orient(points[0], points[b], points[c], points[d]);
            let [b, c, d] = [b, c, d].map(|v| v as u32);
            if volume > 0.0 {
                return Some([0, b, c, d]);
            }
            if volume < 0.0 {
                return Some([0, c, b, d]);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_with_a_point_inside_has_twelve_triangles() {
        let mut points = vec![Point::splat(0.5)];
        for i in 0..8 {
            let bit = |b: u32| f64::from(i >> b & 1);
            points.push(Point::new(bit(0), bit(1), bit(2)));
        }
        let hull = convex_hull(&points);
        assert_eq!(hull.len(), 12);
        let mut six = 0.0;
        for t in &hull {
            let [a, b, c] = t.map(|v| points[v as usize]);
            assert!(!t.contains(&0));
            assert!(points.iter().all(|&p| orient(a, b, c, p) <= 0.0));
            six += a.dot(b.cross(c));
        }
        assert_eq!(six, 6.0);
    }

    #[test]
    fn a_plane_has_none() {
        let flat = |i: u32| Point::new(f64::from(i % 3), f64::from(i / 3), 2.0);
        assert!(convex_hull(&(0..9).map(flat).collect::<Vec<_>>()).is_empty());
        assert!(convex_hull(&[]).is_empty());
    }
}
