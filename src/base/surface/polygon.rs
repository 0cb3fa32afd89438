//! Polygons and facets as triangles: a fan where that is right, else a constrained Delaunay triangulation.
//!
//! Signs are exact, in the plane of two coordinates: the third, along which the polygon's area is largest, is dropped. So polygons
//! that are not quite plane are cut as seen from there.

use robust::{Coord, orient2d};
use spade::handles::{FixedFaceHandle, PossiblyOuterTag};
use spade::{ConstrainedDelaunayTriangulation, Point2, PositionInTriangulation, Triangulation};

use crate::geom::Point;
use tetdb_schema::code::Code;

/// Corners of triangles, as positions in a list of points.
type Triangles = Vec<[u32; 3]>;

/// The reason why there are no triangles of a polygon or facet.
pub(super) type Uncut = &'static str;

const REPEATED: Uncut = "has a corner twice";
const CROSSED: Uncut = "crosses or touches itself";
const FLAT: Uncut = "has no area";
const RANGE: Uncut = "has coordinates too different in size to be cut";
const HOLE: Uncut = "has a hole point that is not inside";

/// Twice the area over the square of the longest edge, below which corners are in line but for rounding: that makes some 1e-16, in files
/// of eight digits 1e-8. A larger one would change the fans of convex polygons with short edges.
const THIN: f64 = 1e-8;
/// Other triangles than such a fan must be that much better: those of a slat are as thin as its fan, which stays.
const BETTER: f64 = 100.0;

/// The word for a reason.
pub(super) fn code(reason: Uncut) -> Code {
    match reason {
        REPEATED | FLAT => Code::DegenerateTriangle,
        CROSSED => Code::SelfIntersection,
        RANGE => Code::CoordinateRange,
        _ => Code::UnexpectedText,
    }
}

/// Two coordinates of points, scaled by a power of two.
struct ProjectionPlane {
    axes: [usize; 2],
    scale: f64,
    /// The polygon that decided the plane runs clockwise in it.
    is_clockwise: bool,
}

impl ProjectionPlane {
    /// The plane in which a polygon has the largest area.
    fn new(polygon: impl Iterator<Item = Point> + Clone) -> Result<Self, Uncut> {
        let first = polygon.clone().next().unwrap_or_default();
        let size = polygon.clone().fold(0.0, |s: f64, p| s.max(p.abs().max_element()));
        let exponent = if size > 0.0 { size.log2().ceil() as i32 } else { 0 };
        let scale = 2f64.powi(-exponent);
        let next = polygon.clone().skip(1);
        let normal: Point =
            polygon.zip(next).map(|(a, b)| ((a - first) * scale).cross((b - first) * scale)).sum();
        let size = normal.abs();
        let axis = (0..3).fold(2, |best, k| if size[k] > size[best] { k } else { best });
        match size[axis] > 0.0 {
            true => Ok(Self {
                axes: [(axis + 1) % 3, (axis + 2) % 3],
                scale,
                is_clockwise: normal[axis] < 0.0,
            }),
            false => Err(FLAT),
        }
    }

    fn coord(&self, p: Point) -> Coord<f64> {
        Coord { x: p[self.axes[0]] * self.scale, y: p[self.axes[1]] * self.scale }
    }

    /// Returns whether all triangles from the first corner run like the polygon, in less than one full turn around that corner.
    fn is_fan(&self, corners: &[Point]) -> bool {
        let sign = if self.is_clockwise { -1.0 } else { 1.0 };
        let at = |k: usize| self.coord(corners[k]);
        let turn = |i: usize, k: usize| sign * orient2d(at(0), at(i), at(k));
        let mut is_beyond_half = false;
        for k in 2..corners.len() {
            let from_start = turn(1, k);
            is_beyond_half |= from_start < 0.0;
            if turn(k - 1, k) <= 0.0 || is_beyond_half && from_start >= 0.0 {
                return false;
            }
        }
        true
    }
}

/// Triangles of a polygon; `None` for the fan from its first corner.
pub(super) fn cut_polygon(corners: &[Point]) -> Result<Option<Triangles>, Uncut> {
    let plane = ProjectionPlane::new(corners.iter().copied());
    if let Ok(plane) = &plane
        && plane.is_fan(corners)
    {
        let fan = (2..corners.len() as u32).map(|k| [0, k - 1, k]);
        let least = thinnest(corners, fan);
        if least > THIN {
            return Ok(None);
        }
        let all: Vec<u32> = (0..corners.len() as u32).collect();
        let better = cut(corners, &[&all], &[], plane, true).ok();
        return Ok(better.filter(|t| thinnest(corners, t.iter().copied()) > BETTER * least));
    }
    let mut sorted = corners.to_vec();
    sorted.sort_by(|a, b| crate::geom::lex_cmp(*a, *b));
    if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
        return Err(REPEATED);
    }
    let all: Vec<u32> = (0..corners.len() as u32).collect();
    let triangles = cut(corners, &[&all], &[], &plane?, true)?;
    Ok(Some(triangles))
}

/// Triangles of a facet: what its polygons enclose, without the parts around its hole points. Polygons of one or two corners are
/// vertices and edges in it. `points` are different.
pub(super) fn cut_facet(
    points: &[Point],
    polygons: &[&[u32]],
    holes: &[Point],
) -> Result<Triangles, Uncut> {
    let loops = polygons.iter().filter(|p| p.len() > 2);
    let mut planes =
        loops.filter_map(|p| ProjectionPlane::new(p.iter().map(|&v| points[v as usize])).ok());
    let plane = planes.next().ok_or(FLAT)?;
    cut(points, polygons, holes, &plane, false)
}

/// The least of twice the area over the square of the longest edge.
fn thinnest(points: &[Point], triangles: impl Iterator<Item = [u32; 3]>) -> f64 {
    let thin = |t: [u32; 3]| {
        let [a, b, c] = t.map(|v| points[v as usize]);
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        (b - a).cross(c - a).length() / longest
    };
    triangles.map(thin).fold(f64::INFINITY, f64::min)
}

fn cut(
    points: &[Point],
    polygons: &[&[u32]],
    holes: &[Point],
    plane: &ProjectionPlane,
    is_simple: bool,
) -> Result<Triangles, Uncut> {
    let at = |p: Point| {
        let Coord { x, y } = plane.coord(p);
        Point2::new(x, y)
    };
    let mut mesh = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut handles = Vec::with_capacity(points.len());
    for &p in points {
        let handle = match handles.last() {
            Some(&last) => mesh.insert_with_hint(at(p), last),
            None => mesh.insert(at(p)),
        };
        handles.push(handle.map_err(|_| RANGE)?);
    }
    if mesh.num_vertices() < points.len() {
        return Err(CROSSED);
    }
    for polygon in polygons {
        for (k, &v) in polygon.iter().enumerate().skip(usize::from(polygon.len() < 3)) {
            let before = polygon[if k == 0 { polygon.len() - 1 } else { k - 1 }];
            let ends = [before, v].map(|v| handles[v as usize]);
            if ends[0] == ends[1] {
                return Err(REPEATED);
            }
            if !mesh.can_add_constraint(ends[0], ends[1]) {
                return Err(CROSSED);
            }
            mesh.add_constraint(ends[0], ends[1]);
            if is_simple && !mesh.exists_constraint(ends[0], ends[1]) {
                return Err(CROSSED);
            }
        }
    }
    let is_out = outer_faces(&mesh, holes.iter().map(|p| at(*p)))?;
    let mut triangles: Triangles = (mesh.inner_faces())
        .filter(|face| !is_out[face.index()])
        .map(|face| {
            let [a, b, c] = face.vertices().map(|v| v.index() as u32);
            let [a, b, c] = if plane.is_clockwise { [a, c, b] } else { [a, b, c] };
            // The least corner first, so that the order depends on nothing but the corners.
            match a.min(b).min(c) {
                least if least == a => [a, b, c],
                least if least == b => [b, c, a],
                _ => [c, a, b],
            }
        })
        .collect();
    triangles.sort_unstable();
    match triangles.len() {
        0 => Err(FLAT),
        n if is_simple && n + 2 != points.len() => Err(CROSSED),
        _ => Ok(triangles),
    }
}

/// For each face whether it is outside, or in a hole: reached from there without crossing an edge of a polygon.
fn outer_faces(
    mesh: &ConstrainedDelaunayTriangulation<Point2<f64>>,
    holes: impl Iterator<Item = Point2<f64>>,
) -> Result<Vec<bool>, Uncut> {
    let mut is_out = vec![false; mesh.num_all_faces()];
    let mut spread = |mut reached: Vec<FixedFaceHandle<PossiblyOuterTag>>| {
        reached.iter().for_each(|face| is_out[face.index()] = true);
        while let Some(face) = reached.pop() {
            let edges: Vec<_> = match mesh.face(face).as_inner() {
                Some(inner) => inner.adjacent_edges().to_vec(),
                None => mesh.convex_hull().map(|edge| edge.rev()).collect(),
            };
            for edge in edges.iter().filter(|e| !e.is_constraint_edge()) {
                for next in [edge.face(), edge.rev().face()] {
                    if !is_out[next.index()] {
                        is_out[next.index()] = true;
                        reached.push(next.fix());
                    }
                }
            }
        }
    };
    spread(vec![mesh.outer_face().fix()]);
    for hole in holes {
        let face = match mesh.locate(hole) {
            PositionInTriangulation::OnFace(face) => mesh.face(face).adjacent_edges()[0].face(),
            PositionInTriangulation::OnEdge(edge)
                if !mesh.is_constraint_edge(edge.as_undirected()) =>
            {
                mesh.directed_edge(edge).face()
            }
            _ => return Err(HOLE),
        };
        spread(vec![face.fix()]);
    }
    Ok(is_out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tilted(flat: &[[f64; 2]]) -> Vec<Point> {
        let (u, v) = (Point::new(0.6, 0.48, 0.64), Point::new(-0.8, 0.36, 0.48));
        flat.iter().map(|&[x, y]| u * x + v * y + Point::new(3.0, -2.0, 0.7)).collect()
    }

    fn area(points: &[Point], triangles: &[[u32; 3]]) -> Point {
        let corners = triangles.iter().map(|t| t.map(|v| points[v as usize]));
        corners.map(|[a, b, c]| (b - a).cross(c - a) * 0.5).sum()
    }

    fn least_area(points: &[Point], triangles: &[[u32; 3]]) -> f64 {
        triangles.iter().map(|t| area(points, &[*t]).length()).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn polygons_with_dents_and_corners_in_line_keep_their_area() {
        let l = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
        let with_middles: Vec<[f64; 2]> = (0..6)
            .flat_map(|k| {
                let (a, b) = (l[k], l[(k + 1) % 6]);
                [a, [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0]]
            })
            .collect();
        let comb: Vec<[f64; 2]> = (0..41)
            .map(|k| [f64::from(k), if k % 2 == 0 { 0.0 } else { 5.0 }])
            .chain([[40.0, -1.0], [0.0, -1.0]])
            .collect();
        let square = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        for (flat, whole) in [(&l[..], 4.0), (&with_middles, 4.0), (&comb, 140.0), (&square, 4.0)] {
            for shift in 0..flat.len() {
                let mut turned = flat.to_vec();
                turned.rotate_left(shift);
                for is_reversed in [false, true] {
                    if is_reversed {
                        turned.reverse();
                    }
                    let straight: Vec<Point> =
                        turned.iter().map(|&[x, y]| Point::new(1.0, x, y)).collect();
                    for points in [tilted(&turned), straight] {
                        let fan = || (2..points.len() as u32).map(|k| [0, k - 1, k]).collect();
                        let triangles = cut_polygon(&points).expect("a simple polygon");
                        let triangles: Triangles = triangles.unwrap_or_else(fan);
                        assert_eq!(triangles.len() + 2, points.len());
                        assert!((area(&points, &triangles).length() - whole).abs() < 1e-9);
                        assert!(least_area(&points, &triangles) > 0.01, "{points:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn convex_polygons_are_fans() {
        for n in 3..12 {
            let angle = |k: usize| k as f64 * std::f64::consts::TAU / n as f64;
            let round: Vec<[f64; 2]> = (0..n).map(|k| angle(k).sin_cos().into()).collect();
            assert_eq!(cut_polygon(&tilted(&round)), Ok(None));
        }
        let bent = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [1.0, 1.0, 0.0], [0.0, 1.0, 0.1]];
        assert_eq!(cut_polygon(&bent.map(Point::from_array)), Ok(None));
        let slat = [[0.0, 0.0], [0.0, 1e-10], [5.0, 1e-10], [5.0, 0.0]];
        assert_eq!(cut_polygon(&slat.map(|[x, y]| Point::new(x, y, 0.0))), Ok(None));
        // Bent and with a dent at the second corner.
        let dent = [[0.0, 0.0, 0.0], [-0.4, 0.5, 0.1], [0.0, 1.0, 0.0], [-1.0, 0.5, 0.0]];
        let cut = cut_polygon(&dent.map(Point::from_array));
        assert_eq!(cut, Ok(Some(vec![[0, 1, 3], [1, 2, 3]])));
    }

    #[test]
    fn what_has_no_cut_is_told() {
        for (flat, reason) in [
            (&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]][..], CROSSED),
            (&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [3.0, 0.0]], FLAT),
            (&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 0.0]], REPEATED),
            // A corner on another edge; a pentagram; twice round a square.
            (&[[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 0.0], [0.0, 2.0]], CROSSED),
            (&[[0.0, 3.0], [2.0, -3.0], [-3.0, 1.0], [3.0, 1.0], [-2.0, -3.0]], CROSSED),
            (
                &[
                    [0.0, 0.0],
                    [2.0, 0.0],
                    [2.0, 2.0],
                    [0.0, 2.0],
                    [0.5, 0.1],
                    [1.9, 0.1],
                    [1.9, 1.9],
                    [0.1, 1.9],
                ],
                CROSSED,
            ),
        ] {
            let points: Vec<Point> = flat.iter().map(|&[x, y]| Point::new(x, y, 0.5 * x)).collect();
            assert_eq!(cut_polygon(&points), Err(reason), "{flat:?}");
        }
    }

    #[test]
    fn facets_have_holes_edges_and_vertices() {
        let square = |low: f64, high: f64| [[low, low], [high, low], [high, high], [low, high]];
        let flat = [square(0.0, 4.0), square(1.0, 2.0)].concat();
        let mut points: Vec<Point> = flat.iter().map(|&[x, y]| Point::new(x, y, 2.0)).collect();
        let (outer, inner): (&[u32], &[u32]) = (&[0, 1, 2, 3], &[4, 5, 6, 7]);
        let hole = Point::new(1.5, 1.5, 2.0);
        let ring = cut_facet(&points, &[outer, inner], &[hole]).expect("a ring");
        assert_eq!((ring.len(), area(&points, &ring).z), (8, 15.0));
        let full = cut_facet(&points, &[outer, inner], &[]).expect("no hole point, no hole");
        assert_eq!(area(&points, &full).z, 16.0);
        points.push(Point::new(3.0, 3.0, 2.0));
        let split =
            cut_facet(&points, &[outer, &[6, 8], &[8], inner], &[hole]).expect("an edge in it");
        assert!(split.iter().any(|t| t.contains(&6) && t.contains(&8)));
        assert_eq!(cut_facet(&points, &[outer, &[4, 8], &[5, 7]], &[]), Err(CROSSED));
        assert_eq!(cut_facet(&points, &[outer], &[Point::splat(9.0)]), Err(HOLE));
        assert_eq!(cut_facet(&points[..2], &[&[0, 1]], &[]), Err(FLAT));
    }
}
