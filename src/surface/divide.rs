//! Triangles divided where vertices of wires lie on them.
//!
//! A vertex exactly inside a triangle divides it in three, one exactly on an edge divides each triangle that has the edge in two: the
//! surface stays the same set of points. A vertex that is a rounding error beside would bend it, and divides nothing.

use std::collections::HashMap;

use super::broad::tree_of;
use super::split::swap_inside;
use super::weld::PointTable;
use super::wire_contact::{has_area, is_on_edge, point_at_triangle};
use super::{Surface, SurfaceError, WireSet};
use crate::geom::{Aabb, Point};
use crate::storage::ScratchSpace;

impl Surface {
    /// Divides triangles where vertices of `set` lie exactly on them; returns how many of these there are.
    ///
    /// Labels and sheets stay; what holds wires that are there goes, see [`Surface::hold_wires`]. Triangles stand where the one was that
    /// they are of. Memory: beside the tree some 200 bytes for each vertex.
    ///
    /// # Errors
    /// [`SurfaceError::TooLarge`].
    pub fn divide_at(&mut self, set: &WireSet, room: &ScratchSpace) -> Result<usize, SurfaceError> {
        self.drop_fins();
        let tree = tree_of(self, room, |t| has_area(&self.corners(t)));
        let mut table = PointTable::of(&self.points);
        let mut points = std::mem::take(&mut self.points);
        let mut pieces = Pieces::of(&self.triangles);
        let mut vertices = HashMap::new();
        let mut n = 0;
        let ends = set.edges.iter().flat_map(|&[a, b, _]| [a, b]);
        for v in ends.chain(set.marks.iter().map(|&[v, _]| v)) {
            let (p, n_before) = (set.points[v as usize] + Point::ZERO, points.len());
            let vertex = table.find_or_add(p, &mut points);
            vertices.insert(v, vertex);
            if points.len() == n_before {
                continue;
            }
            let mut at = Vec::new();
            tree.meeting(&Aabb::around([p]), |t| at.extend(pieces.at(t, p, &points)));
            at.iter().for_each(|&t| pieces.divide(t, vertex, &points));
            n += usize::from(!at.is_empty());
            SurfaceError::check_size("triangles", pieces.corners.len())?;
        }
        self.points = points;
        if n > 0 {
            // Edges that the wires have among the new ones are not swapped.
            let own = self.wires.edges.len();
            let edges = set.edges.iter();
            (self.wires.edges).extend(edges.map(|[a, b, _]| [vertices[a], vertices[b], 0]));
            self.take(&pieces);
            self.wires.edges.truncate(own);
        }
        Ok(n)
    }

    /// Puts the pieces in the place of what they are of.
    fn take(&mut self, pieces: &Pieces) {
        let n = self.triangles.len() as u32;
        let mut whole = std::mem::take(self);
        whole.triangles = Vec::with_capacity(pieces.corners.len());
        let labels = std::mem::take(&mut whole.labels);
        let sheets = std::mem::take(&mut whole.sheets);
        let mut parent = Vec::with_capacity(pieces.corners.len());
        for t in 0..n {
            for piece in pieces.leaves(t) {
                whole.triangles.push(pieces.corners[piece as usize]);
                whole.labels.push(labels[t as usize]);
                whole.sheets.extend(sheets.get(t as usize));
                parent.push(t);
            }
        }
        *self = swap_inside(whole, parent, |t| pieces.parts.contains_key(&t));
    }
}

/// Triangles, pieces of them and pieces of pieces.
struct Pieces {
    corners: Vec<[u32; 3]>,
    /// What a triangle was divided into: so many from this one on.
    parts: HashMap<u32, (u32, u32)>,
}

impl Pieces {
    fn of(triangles: &[[u32; 3]]) -> Self {
        Self { corners: triangles.to_vec(), parts: HashMap::new() }
    }

    /// The undivided ones in `t` that `p`, which is no corner, lies on.
    fn at(&self, t: u32, p: Point, points: &[Point]) -> Vec<u32> {
        let corners = |t: u32| self.corners[t as usize].map(|v| points[v as usize]);
        self.reached(t, |t| point_at_triangle(p, &corners(t)).is_some())
    }

    /// The undivided ones in `t`.
    fn leaves(&self, t: u32) -> Vec<u32> {
        self.reached(t, |_| true)
    }

    fn reached(&self, t: u32, is_meant: impl Fn(u32) -> bool) -> Vec<u32> {
        let (mut stack, mut found) = (vec![t], Vec::new());
        while let Some(t) = stack.pop() {
            match self.parts.get(&t) {
                _ if !is_meant(t) => {}
                Some(&(first, n)) => stack.extend((first..first + n).rev()),
                None => found.push(t),
            }
        }
        found
    }

    /// Divides `t` at a vertex that lies on it.
    fn divide(&mut self, t: u32, v: u32, points: &[Point]) {
        let corners = self.corners[t as usize];
        let first = self.corners.len() as u32;
        let turned = |k: usize| [0, 1, 2].map(|i| corners[(k + i) % 3]);
        let p = points[v as usize];
        let edge = [0, 1, 2].into_iter().find(|&k| {
            let [a, b, _] = turned(k).map(|v| points[v as usize]);
            is_on_edge(p, [a, b])
        });
        match edge.map(turned) {
            Some([a, b, c]) => self.corners.extend([[a, v, c], [v, b, c]]),
            None => (self.corners).extend([0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3], v])),
        }
        self.parts.insert(t, (first, self.corners.len() as u32 - first));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::mix;
    use crate::samples::SampleSpec;
    use crate::surface::{orient_alike, validate};

    fn set(points: &[[f64; 3]], edges: &[[u32; 2]]) -> WireSet {
        WireSet {
            points: points.iter().map(|&p| Point::from_array(p)).collect(),
            edges: edges.iter().map(|&[a, b]| [a, b, 0]).collect(),
            marks: (0..points.len() as u32).map(|v| [v, 0]).collect(),
            label_names: vec!["in".to_owned()],
        }
    }

    /// The unit box of twelve triangles.
    fn unit_box() -> Surface {
        let spec = SampleSpec::parse("box,h=1").expect("a sample");
        spec.make().expect("small enough").into()
    }

    /// As a store has it.
    fn in_order(surface: &Surface) -> Surface {
        let set = surface.wire_set();
        let mut plain = surface.without_wires();
        plain.sheets_last();
        plain.embed_named(&set, &ScratchSpace::boundless()).expect("as before");
        plain
    }

    #[test]
    fn vertices_on_triangles_become_theirs_and_the_surface_stays() {
        let room = ScratchSpace::boundless();
        let mut surface = unit_box();
        let whole = surface.clone();
        let [low, high] = [whole.bounds().low, whole.bounds().high];
        let mut points = Vec::new();
        for k in 0..300u64 {
            let at = |i: u64| mix(k << 8 | i) % 17;
            let mut p = [0, 1, 2].map(|i| low[i] + (high[i] - low[i]) * at(i as u64) as f64 / 16.0);
            let side = (at(5) % 3) as usize;
            p[side] = if at(6) > 8 { high[side] } else { low[side] };
            points.push(p);
        }
        points.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
        points.dedup();
        let set = set(&points, &[]);
        let n = surface.divide_at(&set, &room).expect("few triangles");
        assert!(n > 200 && surface.n_vertices() == whole.n_vertices() + n);
        surface.embed_wires(&set, "in", &room).expect("each is a vertex");
        assert!(surface.lone_points().is_empty());
        let found = validate(&surface);
        assert!(found.is_valid(), "{:?}", found.defects.first());
        let area = |s: &Surface| -> f64 {
            (0..s.n_triangles() as u32)
                .map(|t| {
                    let [a, b, c] = s.corners(t);
                    (b - a).cross(c - a).length()
                })
                .sum()
        };
        assert!((area(&surface) - area(&whole)).abs() < 1e-12 * area(&whole));
        let names = |s: &Surface| s.label_names[..whole.label_names.len()].to_vec();
        assert_eq!(names(&surface), names(&whole));
        assert!(orient_alike(&mut surface.clone()).flipped.is_empty());
        // What is read again from a store is the same to the last number.
        let again = in_order(&surface);
        assert_eq!(in_order(&again), again);
        assert_eq!(again.wires.points.len(), points.len());
    }

    #[test]
    fn a_vertex_beside_a_triangle_divides_nothing_and_is_refused_with_its_distance() {
        let room = ScratchSpace::boundless();
        let mut surface = unit_box();
        let bounds = surface.bounds();
        let (middle, beside) = (bounds.low.midpoint(bounds.high), bounds.high.z.next_down());
        let set = set(&[[middle.x + 0.1, middle.y + 0.01, beside]], &[]);
        assert_eq!(surface.divide_at(&set, &room).expect("nothing to do"), 0);
        let error = surface.embed_wires(&set, "in", &room);
        let text = error.expect_err("too near").to_string();
        assert!(text.contains("can be meshed: 1.1e-16 from it"), "{text}");
    }

    #[test]
    fn edges_along_edges_of_triangles_are_divided_with_them() {
        let room = ScratchSpace::boundless();
        let mut surface = unit_box();
        let Aabb { low, high } = surface.bounds();
        let at = |share: [f64; 3]| (low + (high - low) * Point::from_array(share)).to_array();
        // From vertices on the top into the box, and from a corner along its edge.
        let set = set(
            &[
                [0.3125, 0.4375, 1.0],
                [0.6875, 0.5625, 1.0],
                [0.5, 0.5, 0.25],
                [0.0, 0.0, 1.0],
                [0.0625, 0.0, 1.0],
            ]
            .map(at),
            &[[0, 2], [2, 1], [3, 4]],
        );
        assert_eq!(surface.divide_at(&set, &room).expect("few"), 3);
        surface.embed_wires(&set, "in", &room).expect("vertices");
        let (fine, _) = crate::surface::split(&surface, &|_| 0.04, u64::MAX).expect("few");
        let fine = in_order(&fine);
        assert!(validate(&fine).is_valid() && fine.n_own_triangles() > 400);
        assert_eq!(fine.wires.points.len(), 5);
        let own =
            |e: &[u32; 3]| fine.triangles.iter().any(|t| t.contains(&e[0]) && t.contains(&e[1]));
        assert!(fine.wires.edges.len() == 4 && fine.wires.edges.iter().all(own));
    }
}
