//! Cuts by unusual planes, and by the plane of the paper.
//!
//! Why: a plane may be given by hand, and a chosen plane may lie anywhere. With any plane, no face of the input may be lost.
//! How: samples are meshed in two sub-domains with a given plane, and verified against the surface. The paper's plane is compared with
//! eigenvectors computed in another way.

use std::path::Path;

use tetdb_base::geom::{Point, mix};
use tetdb_base::storage::{Budget, FlatPages, ScratchSpace};
use tetdb_base::surface::Surface;
use tetdb_engine::pipeline::{
    self, MeshOptions, Options, PipelineError, RunOptions, Subdomains, silent,
};
use tetdb_kernel::bisect::{CutReport, Plane, PlaneChoice, choose_plane};
use tetdb_kernel::mesh::Mesh;
use tetdb_kernel::samples::SampleSpec;
use tetdb_schema::catalog::Job;
use tetdb_store::audit::{self, Level, Report, VerifyOptions};
use tetdb_store::store::Catalog;

fn sample(words: &str) -> Surface {
    let made = SampleSpec::parse(words).and_then(|spec| spec.make());
    made.expect("a sample").into()
}

/// Meshes `surface` in two sub-domains cut by `plane`, and inspects the store.
fn mesh_cut_by<T>(
    surface: &Surface,
    plane: Plane,
    look: impl FnOnce(&Path) -> T,
) -> Result<(CutReport, T), PipelineError> {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("two.tetdb");
    let plane = PlaneChoice::Given(plane);
    let options = Options {
        mesh: MeshOptions { subdomains: Subdomains::Exactly(2), ..MeshOptions::default() },
        run: RunOptions { plane, ..RunOptions::default() },
    };
    let budget = Budget::new(256 << 20);
    let mut catalog = Catalog::create(&path, &Job::default()).expect("an empty place");
    let summary = pipeline::mesh(&mut catalog, surface, &options, &budget, &silent)?;
    catalog.close().expect("room on the disk");
    assert_eq!(summary.subdomains, 2, "the sample is large enough for two");
    Ok((summary.cuts[0], look(&path)))
}

fn verified(path: &Path, surface: &Surface) -> Report {
    let mut store = Catalog::open(path).expect("what was just written");
    let verify = VerifyOptions::new(Level::Delaunay, 64 << 20, path.to_owned());
    audit::verify(&mut store, Some(surface), &verify).expect("a sound store")
}

fn is_whole(surface: &Surface, plane: Plane) -> CutReport {
    let done = mesh_cut_by(surface, plane, |path| verified(path, surface));
    let (cut, report) = done.expect("a mesh in two sub-domains");
    assert_eq!(cut.plane.plane, plane, "a plane given by hand is not moved");
    assert!(report.valid, "{plane:?}: {report:?}");
    assert_eq!(cut.interface.chosen.pinched, 0, "{plane:?}");
    cut
}

fn across_x(offset: f64) -> Plane {
    let normal = Point::X;
    Plane { normal, offset }
}

/// A cube with a hole in its middle: `shape`, about 1 long around the origin, scaled to `size`.
fn cube_with_hole(shape: &Surface, h: f64, size: Point) -> Surface {
    let mut surface = sample(&format!("box,h={h}"));
    let first = surface.points.len() as u32;
    let center = Point::splat(0.5);
    surface.points.extend(shape.points.iter().map(|&p| center + p * size));
    let corners = shape.triangles.iter().map(|t| t.map(|v| v + first));
    surface.triangles.extend(corners);
    surface.labels.extend(&shape.labels);
    surface
}

/// A cube of side 1 around the origin.
fn centered_cube(h: f64) -> Surface {
    let mut cube = sample(&format!("box,h={h}"));
    cube.points.iter_mut().for_each(|p| *p -= Point::splat(0.5));
    cube
}

#[test]
fn a_plane_half_a_length_from_a_curved_wall_loses_nothing() {
    let h = 0.047;
    let sphere = sample(&format!("sphere,radius=1,h={}", h / 0.2));
    let surface = cube_with_hole(&sphere, h, Point::splat(0.2));
    let cut = is_whole(&surface, across_x(0.7 + 0.5 * h));
    assert!(cut.interface.chosen.faces > 100);
}

#[test]
fn a_plane_in_a_flat_wall_or_grazing_it_loses_nothing() {
    let h = 0.047;
    let surface = cube_with_hole(&centered_cube(h / 0.4), h, Point::splat(0.4));
    for offset in [0.7, 0.7 + 1e-9, 0.7 - 0.3 * h] {
        is_whole(&surface, across_x(offset));
    }
}

#[test]
fn a_plane_that_leaves_nothing_on_one_side_is_refused() {
    let cube = sample("box,h=0.047");
    for offset in [0.0, 0.01, 2.0] {
        let error = mesh_cut_by(&cube, across_x(offset), |_| ()).expect_err("nothing below");
        assert!(matches!(error, PipelineError::EmptyPart { cut: 1 }), "{error}");
    }
}

#[test]
fn a_plane_through_a_needle_thin_gap_loses_nothing() {
    // A flattened octahedron: nowhere thicker than a five-thousandth of an edge, and without short edges that would require small sizes.
    let corners = [(0, 1e-4), (1, 0.3), (2, 0.3)].into_iter();
    let triangles =
        [[0, 2, 4], [1, 4, 2], [0, 4, 3], [1, 3, 4], [0, 5, 2], [1, 2, 5], [0, 3, 5], [1, 5, 3]];
    let lens = Surface {
        points: corners.flat_map(|(axis, x)| [x, -x].map(|x| Point::AXES[axis] * x)).collect(),
        labels: vec![0; triangles.len()],
        triangles: triangles.to_vec(),
        ..Surface::default()
    };
    let surface = cube_with_hole(&lens, 0.047, Point::ONE);
    is_whole(&surface, across_x(0.5));
    is_whole(&surface, across_x(0.5 + 0.5e-4));
}

/// Rotates a point around two axes.
fn turned(p: Point, a: f64, b: f64) -> Point {
    let (x, y) = (a.cos() * p.x - a.sin() * p.y, a.sin() * p.x + a.cos() * p.y);
    Point::new(b.cos() * x - b.sin() * p.z, y, b.sin() * x + b.cos() * p.z)
}

/// Direction of the largest spread of the centroids, by powers of their moment matrix.
fn spread(mesh: &mut Mesh<FlatPages>) -> Point {
    let mut middles = Vec::new();
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let corners = tet.vertices().map(|v| mesh.point(v));
        middles.push(corners.into_iter().sum::<Point>() * 0.25);
    }
    let mean = middles.iter().sum::<Point>() / middles.len() as f64;
    let mut axis = Point::new(0.6, 0.5, 0.4);
    for _ in 0..2000 {
        let image: Point = (middles.iter().map(|&m| (m - mean) * (m - mean).dot(axis))).sum();
        axis = image.normalize();
    }
    axis
}

/// The plane that divides the coarse mesh of a surface, with the wanted length `h` everywhere.
fn plane_of(surface: &Surface, h: f64, choice: PlaneChoice) -> (Mesh<FlatPages>, Plane) {
    let mut mesh = Mesh::new(FlatPages::default());
    pipeline::coarse_mesh(
        &mut mesh,
        surface,
        &Options::default(),
        &ScratchSpace::boundless(),
        &silent,
    )
    .expect("a mesh");
    for v in mesh.vertex_ids() {
        mesh.set_size(v, h as f32);
    }
    let origin = surface.bounds().low;
    let chosen = choose_plane(&mut mesh, &|_| h, origin, 0.5, choice);
    (mesh, chosen.plane)
}

#[test]
fn a_long_body_is_cut_across_however_coarse_it_is_and_however_it_lies() {
    for h in ["0.3", "0.1", "0.05", "0.0333", "0.025"] {
        for (length, turn) in [("1.25", 0.0), ("1.6", 0.0), ("1.6", 0.7), ("3", 0.2), ("3", 1.1)] {
            let mut surface = sample(&format!("box,x={length},h={h}"));
            let along = turned(Point::X, turn, 2.0 * turn);
            surface.points.iter_mut().for_each(|p| *p = turned(*p, turn, 2.0 * turn));
            let h: f64 = h.parse().expect("a number");
            let (_, plane) = plane_of(&surface, h, PlaneChoice::Load);
            let angle = plane.normal.cross(along).length();
            assert!(angle < 0.15, "h = {h}, {length} long, turned by {turn}: {plane:?}");
        }
    }
}

#[test]
fn the_papers_plane_is_across_the_axis_of_inertia_and_turns_with_the_mesh() {
    // Round shapes, where nothing needs recovery: recovery depends on the order of coordinates.
    let base = ["0.5", "0.6", "0.7"].map(|h| sample(&format!("sphere,h={h}")));
    for k in 0..50u32 {
        let f = f64::from(k);
        let mut surface = base[k as usize % 3].clone();
        let stretch = Point::new(1.0, 1.5 + 0.03 * f, 2.5 + 0.05 * f);
        // No five points on a sphere and no four in a plane, so that rounding cannot change the mesh.
        for (i, p) in (0u64..).zip(&mut surface.points) {
            let noise =
                |axis| (mix(3 * i + axis + 1000 * u64::from(k)) >> 11) as f64 / (1u64 << 53) as f64;
            let noise = Point::new(noise(0), noise(1), noise(2));
            *p = turned((*p + noise * 0.01) * stretch, 0.37 * f, 0.81 * f);
        }
        let (mut mesh, plane) = plane_of(&surface, 1.0, PlaneChoice::Centroids);
        let angle = plane.normal.cross(spread(&mut mesh)).length();
        assert!(angle < 1e-6, "mesh {k}: {angle}");
        let mut other = surface.clone();
        other.points.iter_mut().for_each(|p| *p = turned(*p, 0.5, -0.3));
        let (_, again) = plane_of(&other, 1.0, PlaneChoice::Centroids);
        let expected = turned(plane.normal, 0.5, -0.3);
        let angle = again.normal.cross(expected).length();
        assert!(angle < 1e-6, "mesh {k} turned: {angle}");
    }
}
