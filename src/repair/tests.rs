//! Surfaces made for tests.

use tetdb_base::geom::Point;
use tetdb_base::surface::{Surface, SurfaceBuilder};

/// The label of a triangle, and its corners.
pub type Named = (&'static str, [Point; 3]);

pub fn p(x: f64, y: f64, z: f64) -> Point {
    Point::new(x, y, z)
}

pub fn surface(triangles: &[Named]) -> Surface {
    let mut builder = SurfaceBuilder::new();
    builder.begin_file("made");
    for (name, corners) in triangles {
        let label = builder.label(name);
        builder.triangle_at(*corners, label).expect("finite corners");
    }
    builder.end_file().expect("triangles");
    builder.finish()
}
