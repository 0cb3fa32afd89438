//! Triangles divided at embedded points and edges.

use crate::samples::SampleSpec;
use tetdb_base::geom::mix;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::Surface;
use tetdb_base::surface::{Divided, EmbeddedSet};
use tetdb_base::surface::{orient_alike, validate};

fn set(points: &[[f64; 3]], edges: &[[u32; 2]]) -> EmbeddedSet {
    EmbeddedSet {
        points: points.iter().map(|&p| Point::from_array(p)).collect(),
        edges: edges.iter().map(|&[a, b]| [a, b, 0]).collect(),
        marks: (0..points.len() as u32).map(|v| [v, 0]).collect(),
        mark_lines: Vec::new(),
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
    let set = surface.embedded_set();
    let mut plain = surface.without_embedded();
    plain.sheets_last();
    plain.embed_named(&set, &ScratchSpace::boundless()).expect("as before");
    plain
}

#[test]
fn vertices_on_triangles_become_theirs_and_the_surface_stays() {
    let scratch = ScratchSpace::boundless();
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
    let mut set = set(&points, &[]);
    let done = surface.divide_at(&mut set, 0.0, &scratch).expect("few triangles");
    let n = done.divided;
    assert_eq!(done.moved, 0);
    assert!(n > 200 && surface.n_vertices() == whole.n_vertices() + n);
    surface.embed_set(&set, "in", &scratch).expect("each is a vertex");
    assert!(surface.isolated_points().is_empty());
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
    // What lies there exactly stays, also where points may move.
    let mut again = set.clone();
    whole.clone().divide_at(&mut again, 1e-9, &scratch).expect("few triangles");
    assert_eq!(again, set);
    assert!((area(&surface) - area(&whole)).abs() < 1e-12 * area(&whole));
    let names = |s: &Surface| s.label_names[..whole.label_names.len()].to_vec();
    assert_eq!(names(&surface), names(&whole));
    assert!(orient_alike(&mut surface.clone()).flipped.is_empty());
    // A surface read again from a store is identical.
    let again = in_order(&surface);
    assert_eq!(in_order(&again), again);
    assert_eq!(again.embedded.points.len(), points.len());
}

#[test]
fn a_vertex_beside_a_triangle_divides_nothing_and_is_refused_with_its_distance() {
    let scratch = ScratchSpace::boundless();
    let mut surface = unit_box();
    let bounds = surface.bounds();
    let (middle, beside) = (bounds.low.midpoint(bounds.high), bounds.high.z - 1e-13);
    let mut set = set(&[[middle.x + 0.1, middle.y + 0.01, beside]], &[]);
    assert_eq!(
        surface.divide_at(&mut set, 0.0, &scratch).expect("nothing to do"),
        Divided::default()
    );
    let error = surface.embed_set(&set, "in", &scratch);
    let text = error.expect_err("too near").to_string();
    assert!(text.contains("can be meshed: 1.0e-13 from it"), "{text}");
}

#[test]
fn edges_along_edges_of_triangles_are_divided_with_them() {
    let scratch = ScratchSpace::boundless();
    let mut surface = unit_box();
    let Aabb { low, high } = surface.bounds();
    let at = |share: [f64; 3]| (low + (high - low) * Point::from_array(share)).to_array();
    // From vertices on the top into the box, and from a corner along its edge.
    let mut set = set(
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
    assert_eq!(surface.divide_at(&mut set, 0.0, &scratch).expect("few").divided, 3);
    surface.embed_set(&set, "in", &scratch).expect("vertices");
    let (fine, _) = tetdb_base::surface::split(&surface, &|_| 0.04, u64::MAX).expect("few");
    let fine = in_order(&fine);
    assert!(validate(&fine).is_valid() && fine.n_input_triangles() > 400);
    assert_eq!(fine.embedded.points.len(), 5);
    let own = |e: &[u32; 3]| fine.triangles.iter().any(|t| t.contains(&e[0]) && t.contains(&e[1]));
    assert!(fine.embedded.edges.len() == 4 && fine.embedded.edges.iter().all(own));
}

/// Turns `k` of `p`: about a tilted axis, scaled, and moved away from the origin.
fn turned(k: u64, p: Point) -> Point {
    let of = |i: u64| (mix(k << 8 | i) >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
    let axis = Point::new(of(0), of(1), of(2)).normalize();
    let (sin, cos) = (6.0 * of(3)).sin_cos();
    let about = p * cos + axis.cross(p) * sin + axis * (axis.dot(p) * (1.0 - cos));
    (about + Point::new(of(4), of(5), of(6)) * 3.0) * 10f64.powi(k as i32 % 7 - 3)
}

/// A turned unit box with a square sheet in its middle.
fn turned_box(k: u64) -> Surface {
    let mut surface = unit_box();
    let (low, size) = (surface.bounds().low, surface.bounds().high - surface.bounds().low);
    let corners = [[0.2, 0.2], [0.8, 0.2], [0.8, 0.8], [0.2, 0.8]];
    let mut sheet = Surface {
        points: corners.map(|[x, y]| Point::new(x, y, 0.5)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        labels: vec![0; 2],
        label_names: vec!["sheet".to_owned()],
        ..Surface::default()
    };
    surface.points.iter_mut().for_each(|p| *p = turned(k, (*p - low) / size));
    sheet.points.iter_mut().for_each(|p| *p = turned(k, *p));
    surface.embed(&sheet, "sheet").expect("few triangles");
    surface
}

/// Inside a triangle, on the diagonal of a side, on an edge of the box, on the sheet and on its diagonal.
const ON: [[f64; 3]; 6] = [
    [0.3, 0.45, 0.0],
    [1.0, 0.7, 0.4],
    [0.4, 0.4, 1.0],
    [0.31, 0.0, 1.0],
    [0.6, 0.37, 0.5],
    [0.55, 0.55, 0.5],
];

#[test]
fn points_on_turned_triangles_lie_there_but_for_rounding() {
    let scratch = ScratchSpace::boundless();
    for k in 0..200 {
        let mut surface = turned_box(k);
        let size = surface.bounds().diagonal();
        let on = ON.map(|p| turned(k, Point::from_array(p)).to_array());
        let mut set = set(&on, &[[0, 4], [3, 5]]);
        let done = surface.divide_at(&mut set, 0.0, &scratch).expect("few");
        assert_eq!(done.divided, ON.len(), "seed {k}");
        assert!(done.farthest < 1e-14 * size, "seed {k}: {done:?}");
        surface.embed_set(&set, "in", &scratch).expect("each is a vertex");
        let found = validate(&surface);
        assert!(found.is_valid(), "seed {k}: {:?}", found.defects.first());
        assert!(surface.isolated_points().is_empty(), "seed {k}");
    }
}

#[test]
fn points_near_triangles_edges_and_vertices_are_moved_onto_them() {
    let scratch = ScratchSpace::boundless();
    for k in 0..200 {
        let mut surface = turned_box(k);
        let (n, size) = (surface.n_vertices(), surface.bounds().diagonal());
        let of = |i: u64| (mix(k << 16 | i) >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        // Three more beside vertices, of which two share one, and one too far away.
        let more = [[1.0, 1.0, 1.0], [0.0, 0.0, 0.0], [0.003, 0.001, 0.0], [0.5, 0.5, 0.75]];
        let near = ON.iter().chain(&more).zip(0..).map(|(p, i)| {
            let p = [0, 1, 2].map(|axis| p[axis as usize] + 1e-3 * of(3 * i + axis));
            turned(k, Point::from_array(p)).to_array()
        });
        let near: Vec<[f64; 3]> = near.collect();
        let mut moved = set(&near, &[]);
        let within = 0.01 * size;
        let done = surface.divide_at(&mut moved, within, &scratch).expect("few");
        // One of the two at the same vertex has it.
        assert_eq!((done.moved, done.divided), (9, ON.len() + 1), "seed {k}");
        assert!(done.farthest < within, "seed {k}");
        assert_eq!(surface.n_vertices(), n + ON.len() + 1 + 1, "seed {k}: with the one inside");
        surface.embed_set(&moved, "in", &scratch).expect("each is a vertex");
        let found = validate(&surface);
        assert!(found.is_valid(), "seed {k}: {:?}", found.defects.first());
        assert_eq!(surface.isolated_points().len(), 1, "seed {k}");
        // Nothing is near enough.
        let mut far = set(&near, &[]);
        let done = turned_box(k).divide_at(&mut far, 1e-9 * size, &scratch).expect("few");
        assert_eq!((done.divided, far), (0, set(&near, &[])), "seed {k}");
    }
}

#[test]
fn equal_points_stay_one_and_many_on_one_triangle_divide_it() {
    let scratch = ScratchSpace::boundless();
    for k in 0..3 {
        let mut surface = turned_box(k);
        let at = |i: u64| (mix(k << 32 | i) % 1000) as f64 / 1000.0;
        let near = |i: u64| Point::new(at(3 * i), at(3 * i + 1), 1e-4 * at(3 * i + 2));
        let mut points: Vec<[f64; 3]> = (0..300).map(|i| turned(k, near(i)).to_array()).collect();
        points.push(points[7]);
        let mut all = set(&points, &[[3, 300]]);
        all.marks.pop();
        surface.divide_at(&mut all, 1e-3 * surface.bounds().diagonal(), &scratch).expect("few");
        assert_eq!(all.points[7], all.points[300]);
        all.edges.clear();
        surface.embed_set(&all, "in", &scratch).expect("each is a vertex of its own");
        let found = validate(&surface);
        assert!(found.is_valid(), "seed {k}: {:?}", found.defects.first());
        assert!(surface.isolated_points().is_empty(), "seed {k}");
    }
}
