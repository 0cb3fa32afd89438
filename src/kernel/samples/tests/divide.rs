//! Triangles divided at embedded points and edges.

use crate::samples::SampleSpec;
use tetdb_base::geom::mix;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::EmbeddedSet;
use tetdb_base::surface::Surface;
use tetdb_base::surface::{orient_alike, validate};

fn set(points: &[[f64; 3]], edges: &[[u32; 2]]) -> EmbeddedSet {
    EmbeddedSet {
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
    let n = surface.divide_at(&mut set, 0.0, &scratch).expect("few triangles");
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
    let (middle, beside) = (bounds.low.midpoint(bounds.high), bounds.high.z.next_down());
    let mut set = set(&[[middle.x + 0.1, middle.y + 0.01, beside]], &[]);
    assert_eq!(surface.divide_at(&mut set, 0.0, &scratch).expect("nothing to do"), 0);
    let error = surface.embed_set(&set, "in", &scratch);
    let text = error.expect_err("too near").to_string();
    assert!(text.contains("can be meshed: 1.1e-16 from it"), "{text}");
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
    assert_eq!(surface.divide_at(&mut set, 0.0, &scratch).expect("few"), 3);
    surface.embed_set(&set, "in", &scratch).expect("vertices");
    let (fine, _) = tetdb_base::surface::split(&surface, &|_| 0.04, u64::MAX).expect("few");
    let fine = in_order(&fine);
    assert!(validate(&fine).is_valid() && fine.n_input_triangles() > 400);
    assert_eq!(fine.embedded.points.len(), 5);
    let own = |e: &[u32; 3]| fine.triangles.iter().any(|t| t.contains(&e[0]) && t.contains(&e[1]));
    assert!(fine.embedded.edges.len() == 4 && fine.embedded.edges.iter().all(own));
}
