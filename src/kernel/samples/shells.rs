//! Nested shells: closed surfaces one inside the other, filled and empty in turn.

use super::SampleError;
use super::boxes::{box_triangles, push_box};
use super::build::Builder;
use super::build::triangles_checked;
use super::sample::Sample;
use super::sphere::{Ball, Spheres, sphere_pieces, sphere_triangles};
use tetdb_base::geom::{Aabb, Point};

/// Shape of the nested bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShellKind {
    Spheres,
    Boxes,
}

/// `count` concentric shells of radius (half side) 1, 1 − 1/count, …, 1/count; labels `shell-1` …
/// from the outside.
pub(super) fn make_shells(
    count: usize,
    kind: ShellKind,
    h: f64,
    bytes_max: u64,
) -> Result<Sample, SampleError> {
    let radii: Vec<f64> = (0..count).map(|i| (count - i) as f64 / count as f64).collect();
    let n_triangles = radii.iter().map(|&r| match kind {
        ShellKind::Spheres => sphere_triangles(sphere_pieces(r, h)),
        ShellKind::Boxes => box_triangles(&cube(r), h),
    });
    triangles_checked("shells", n_triangles.sum(), bytes_max)?;
    let mut build = Builder::default();
    let mut spheres = Spheres::default();
    for (i, &radius) in radii.iter().enumerate() {
        let label = build.label(format!("shell-{}", i + 1));
        let inward = i % 2 == 1;
        match kind {
            ShellKind::Spheres => {
                spheres.push(&mut build, &Ball::unturned(radius), h, inward, label);
            }
            ShellKind::Boxes => push_box(&mut build, &cube(radius), h, inward, [label; 6]),
        }
    }
    Ok(build.finish())
}

fn cube(radius: f64) -> Aabb {
    Aabb { low: Point::splat(-radius), high: Point::splat(radius) }
}
