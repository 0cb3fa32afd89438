//! Open parts of a surface.

use crate::samples::SampleSpec;
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::Surface;
use tetdb_base::surface::{EnclosedVolumes, Seeker, validate};

fn sample(word: &str) -> Surface {
    let spec = SampleSpec::parse(word).expect("a sample");
    spec.make().expect("small enough").into()
}

#[test]
fn a_large_surface_with_sheets_embedded_is_the_sample_it_was_taken_from() {
    let whole = sample("faults,count=4,cells=20");
    let mut again = whole.part(false);
    assert!(again.points.len() > 1024 && validate(&again).is_valid());
    again.embed(&whole.part(true), "in it").expect("small enough");
    assert_eq!(again.points, whole.points);
    assert_eq!(again.triangles, whole.triangles);
    assert_eq!(again.sheets, whole.sheets);
    assert!(again.label_names[1].starts_with("in it:fault-"));
    let found = validate(&again);
    assert!(found.is_valid() && found.closedness.n_free > 0);
    // Sheets part nothing.
    assert_eq!(EnclosedVolumes::new(&Seeker::new(&again)).n_volumes, 2);
}

#[test]
fn open_parts_are_found_to_their_last_triangle_and_closed_ones_are_left() {
    let whole = sample("faults,count=3,cells=6,seed=2");
    let mut open = whole.clone();
    open.sheets = Vec::new();
    assert!(!validate(&open).is_valid());
    let n = open.open_parts_to_sheets(&ScratchSpace::boundless());
    assert_eq!((n, &open.sheets), (whole.n_sheet_triangles(), &whole.sheets));
    let mut closed = whole.part(false);
    assert_eq!(closed.open_parts_to_sheets(&ScratchSpace::boundless()), 0);
}
