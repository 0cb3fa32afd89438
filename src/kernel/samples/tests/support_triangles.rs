//! Triangles that hold embedded edges.

use crate::samples::SampleSpec;
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::Surface;
use tetdb_base::surface::{fitness, validate};

fn wells(word: &str) -> Surface {
    let spec = SampleSpec::parse(word).expect("a sample");
    let mut surface = Surface::from(spec.make().expect("small enough"));
    surface.add_support_triangles(&ScratchSpace::boundless()).expect("room for fins");
    surface
}

#[test]
fn fins_touch_nothing_and_are_well_shaped() {
    for word in ["wells,count=30,cells=9,shift=0", "wells,count=40,cells=9,seed=5,shift=0.15"] {
        let surface = wells(word);
        let found = validate(&surface);
        assert!(found.is_valid(), "{:?}", found.defects.first());
        assert_eq!(
            surface.n_triangles() - surface.n_input_triangles(),
            surface.embedded.edges.len()
        );
        assert_eq!(fitness(&surface, &found.closedness).forcing_triangles, 0, "{word}");
        // Held once more they are the same, and without them it is the surface of before.
        let mut again = surface.clone();
        again.add_support_triangles(&ScratchSpace::boundless()).expect("as before");
        assert_eq!(again, surface);
        assert!(!surface.without_embedded().has_embedded());
    }
}

#[test]
fn edges_of_triangles_need_no_fin_and_points_there_no_size() {
    let mut surface = wells("wells,count=2,layers=2,points=1");
    let [a, b, _] = surface.triangles[0];
    surface.embedded.edges.push([a, b, 0]);
    surface.embedded.points.push([a, 0]);
    let n = surface.n_triangles();
    surface.add_support_triangles(&ScratchSpace::boundless()).expect("room for fins");
    assert_eq!(surface.n_triangles(), n);
    assert_eq!(surface.embedded.sizes[1], 0.0);
    assert!(surface.embedded.sizes[0] > 0.0 && surface.isolated_points().len() == 1);
}
