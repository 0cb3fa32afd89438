//! Meshes of one sub-domain and of two that are saturated in blocks.
//!
//! Why: threads work on parts of the mesh at the same time, and parts leave memory. Neither may show in the mesh, and no face of the
//! input may be lost where a part ends.
//! How: samples with several regions, sheets, edges and thin parts are meshed with one thread and three, and with so little memory that
//! bricks leave it. All must have one digest, and be verified against the surface. Bounds on qualities are a little wider than what
//! was measured.

use std::collections::BTreeMap;

use tetdb_base::geom::{HilbertFrame, Point, orient};
use tetdb_base::storage::{Budget, CancelToken, DiskPath, FlatPages, RunContext, ScratchSpace};
use tetdb_base::surface::Surface;
use tetdb_engine::pipeline::{
    self, MeshOptions, Options, OptionsText, Plan, RunOptions, Subdomains, Summary, Trial, silent,
};
use tetdb_kernel::blocks::{
    Everywhere, Field, FinishedTet, FinishedVertex, PlacementRule, saturate, saturate_to_seal,
};
use tetdb_kernel::mesh::{FaceRef, Mesh, Tet};
use tetdb_kernel::optimize::{Mode, mend};
use tetdb_kernel::samples::SampleSpec;
use tetdb_schema::catalog::Job;
use tetdb_store::audit::{self, Level, Report, VerifyOptions};
use tetdb_store::store::Catalog;

/// A finished mesh.
struct Made {
    /// Result of its verification.
    report: Report,
    /// Tetrahedra with q of 2 and more.
    bad: u64,
    /// Greatest q.
    worst: f64,
}

fn made(surface: &Surface, mesh: &MeshOptions, plan: Option<Plan>) -> Made {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("one.tetdb");
    let trial = Trial { plan, ..Trial::default() };
    let options =
        Options { mesh: mesh.clone(), run: RunOptions { trial, ..RunOptions::default() } };
    let budget = Budget::new(256 << 20);
    let mut catalog = Catalog::create(&path, &Job::default()).expect("an empty place");
    let summary = pipeline::mesh(&mut catalog, surface, &options, &budget, &silent);
    let Summary { fine, cuts, subdomains, .. } = summary.expect("a sample meshes");
    assert_eq!(mesh.subdomains, Subdomains::Exactly(subdomains));
    assert!(fine.values().all(|fine| fine.refine.unexamined == 0), "{fine:?}");
    assert!(cuts.iter().all(|cut| cut.refine.unexamined == 0), "{cuts:?}");
    catalog.close().expect("room on the disk");
    let mut store = Catalog::open(&path).expect("what was just written");
    let rows = store.subdomains().expect("sealed rows");
    let verify = VerifyOptions::new(Level::Delaunay, 64 << 20, path.clone());
    let report = audit::verify(&mut store, Some(surface), &verify).expect("a sound store");
    assert!(report.valid, "{report:?}");
    let bad = rows.iter().flat_map(|row| &row.quality.bins[1..]).sum();
    Made { report, bad, worst: rows.iter().map(|row| row.quality.worst).fold(0.0, f64::max) }
}

fn options(regions: Option<&str>, subdomains: u32) -> MeshOptions {
    let text = OptionsText {
        subdomains: Some(subdomains.to_string()),
        regions: regions.map(str::to_owned),
        ..OptionsText::default()
    };
    text.try_into().expect("words of options")
}

#[test]
fn neither_threads_nor_memory_show() {
    // Frames for 16 pages: everything leaves memory again and again.
    let narrow = Plan { frames: 1 << 20, redb: 1 << 20, buffers: 2 << 20 };
    for (words, regions, subdomains, bad_max, worst_max) in [
        ("knot,h=0.06", None, 1, 1e-4, 2.5),
        ("balls,count=20", Some("all"), 1, 1e-4, 2.8),
        ("faults,cells=16", None, 1, 1e-3, 3.0),
        ("wells,cells=14,count=40", None, 1, 6e-3, 4.0),
        ("needles,count=300", None, 1, 0.98, 500.0),
        ("balls,count=20", None, 2, 1e-4, 2.8),
        ("faults,cells=20", None, 2, 1e-3, 3.0),
    ] {
        let spec = SampleSpec::parse(words).and_then(|spec| spec.make());
        let mut surface: Surface = spec.expect("a sample").into();
        surface.add_support_triangles(&ScratchSpace::boundless()).expect("edges apart");
        let options = options(regions, subdomains);
        let run = |threads, plan| {
            let run = RunContext::new(threads, CancelToken::new());
            run.enter(|| made(&surface, &options, plan))
        };
        let one = run(1, None);
        for other in [run(3, None), run(2, Some(narrow))] {
            assert_eq!(one.report.digest, other.report.digest, "{words}");
        }
        let bad = one.bad as f64 / one.report.tets as f64;
        assert!(bad <= bad_max && one.worst <= worst_max, "{words}: {bad} bad, {}", one.worst);
    }
}

/// Points go to a ball alone.
struct InBall {
    center: Point,
    radius: f64,
}

impl InBall {
    fn distance(&self, p: Point) -> f64 {
        (p - self.center).length() - self.radius
    }
}

impl PlacementRule for InBall {
    fn is_partial(&self) -> bool {
        true
    }

    fn reaches(&self, points: &[Point; 4], sizes: &[f32; 4]) -> bool {
        let low = points.iter().copied().reduce(Point::min).expect("four corners");
        let high = points.iter().copied().reduce(Point::max).expect("four corners");
        let nearest = self.center.clamp(low, high);
        self.distance(nearest) < f64::from(sizes[0])
    }

    fn admits(&self, p: Point, _: f64) -> bool {
        self.distance(p) < 0.0
    }

    fn forbids(&self, _: Point, _: f64) -> bool {
        false
    }
}

/// Records of all tetrahedra, after checks of signs and neighbors; with the volume.
fn sound(mesh: &mut Mesh<FlatPages>) -> (BTreeMap<u32, Tet>, f64) {
    let (mut tets, mut volume, mut from) = (BTreeMap::new(), 0.0, 0);
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let [a, b, c, d] = mesh.points(&tet);
        let six = orient(a, b, c, d);
        assert!(six > 0.0, "tetrahedron {t}");
        volume += six / 6.0;
        for (i, across) in tet.neighbor.into_iter().enumerate() {
            assert!(across.exists() || tet.is_required(i), "face {i} of {t} is open");
            if across.exists() {
                let other = mesh.tet(across.tet());
                assert!(other.is_live() && other.neighbor[across.face()] == FaceRef::new(t, i));
                let faces = [tet.face(i), other.face(across.face())].map(|mut face| {
                    face.sort_unstable();
                    face
                });
                assert_eq!(faces[0], faces[1]);
            }
        }
        tets.insert(t, tet);
    }
    assert_eq!(tets.len(), mesh.n_tets() as usize);
    (tets, volume)
}

/// Where points go to a part of space alone, the tetrahedra far from it keep their ids and records, and the part is divided as wanted.
#[test]
fn what_lies_far_from_a_part_stays_as_it_is() {
    let h = 0.03;
    let (mut mesh, surface) = coarse("box,x=5,h=0.1", h);
    let (before, volume) = sound(&mut mesh);
    let bounds = surface.bounds();
    // Wall to wall at one end, and a ball that touches no wall.
    for (center, radius) in [(Point::new(0.2, 0.5, 0.5), 0.3), (Point::new(1.0, 0.5, 0.5), 0.2)] {
        let ball = InBall { center, radius };
        let dir = tempfile::tempdir().expect("a temporary directory");
        let dir = DiskPath::from(dir.path());
        let field = Field { h: &|_| h, place: &ball, bounds };
        let inserted =
            saturate(&mut mesh, &field, Mode::None, &dir, &mut |_, _| ()).refine.inserted;
        assert!(inserted > 300, "{inserted} points");
        let (after, now) = sound(&mut mesh);
        assert!((now - volume).abs() < 1e-9 * volume);
        let mut inside = 0;
        for tet in after.values() {
            let points = mesh.points(tet);
            if points.iter().all(|&p| ball.distance(p) < -2.0 * h) {
                inside += 1;
                let longest = (0..4).flat_map(|i| (0..i).map(move |j| (i, j)));
                let longest = longest.map(|(i, j)| (points[i] - points[j]).length());
                assert!(longest.fold(0.0, f64::max) < 4.0 * h, "{points:?}");
            }
        }
        assert!(inside > 1_000, "{inside} tetrahedra in the ball");
    }
    let (after, _) = sound(&mut mesh);
    let far: Vec<u32> = before
        .iter()
        .filter(|(_, tet)| mesh.points(tet).iter().all(|p| p.x > 4.5))
        .map(|(&t, _)| t)
        .collect();
    assert!(far.len() > 100, "{} tetrahedra at the far end", far.len());
    let changed = far.iter().filter(|&t| before[t] != after[t]).count();
    assert_eq!(changed, 0, "of {}", far.len());
}

fn coarse(words: &str, h: f64) -> (Mesh<FlatPages>, Surface) {
    let spec = SampleSpec::parse(words).and_then(|spec| spec.make());
    let surface: Surface = spec.expect("a sample").into();
    let mut mesh = Mesh::new(FlatPages::default());
    let room = ScratchSpace::boundless();
    pipeline::coarse_mesh(&mut mesh, &surface, &Options::default(), &room, &silent)
        .expect("a sample meshes");
    for v in mesh.vertex_ids() {
        mesh.set_size(v, h as f32);
    }
    (mesh, surface)
}

/// A tetrahedron whatever its numbers: its corners in order, and the required faces by the corner across.
fn by_places(points: [Point; 4], required: u8) -> [([u64; 3], bool); 4] {
    let corner = |i: usize| (points[i].to_array().map(f64::to_bits), required >> i & 1 != 0);
    let mut corners = [0, 1, 2, 3].map(corner);
    corners.sort_unstable();
    corners
}

/// Bricks give the same tetrahedra as pages, sorted as in a sealed file. A mesh that is to be mended is returned in pages.
#[test]
fn a_mesh_in_bricks_is_that_in_pages() {
    for (words, h) in [("knot,h=0.06", 0.06), ("balls,count=20", 0.08)] {
        let (mut in_pages, surface) = coarse(words, h);
        let dir = tempfile::tempdir().expect("a temporary directory");
        let dir = DiskPath::from(dir.path());
        let field = Field { h: &|_| h, place: &Everywhere, bounds: surface.bounds() };
        saturate(&mut in_pages, &field, Mode::Full, &dir, &mut |_, _| ());
        mend(&mut in_pages, &|_| ());
        let (tets, _) = sound(&mut in_pages);
        let place = |tet: &Tet| by_places(in_pages.points(tet), tet.required_faces());
        let mut expected: Vec<_> = tets.values().map(place).collect();
        expected.sort_unstable();

        let (mut rest, _) = coarse(words, h);
        let mut shares = vec![(0, 1)];
        let mut progress = |done, total| shares.push((done, total));
        let (_, finished) = saturate_to_seal(&mut rest, &field, Mode::Full, &dir, &mut progress);
        assert!(shares.is_sorted() && shares.len() > 2, "{shares:?}");
        assert!(shares.last().is_some_and(|&(done, total)| done + 100 > total), "{shares:?}");
        let finished = finished.expect("nothing is to be mended");
        assert_eq!((rest.n_tets(), finished.n_tets()), (0, tets.len() as u64));
        let mut points = Vec::new();
        let mut add = |some: &[_]| {
            points.extend(some.iter().map(|v: &FinishedVertex| v.point));
            Ok::<_, ()>(())
        };
        let frame = HilbertFrame::new(&surface.bounds());
        finished.number(&mut rest, &frame, 1_000, &mut add).expect("nothing fails");
        let sealed: Vec<_> = finished.tets().collect();
        assert!(sealed.is_sorted_by_key(|found| found.tet.nodes));
        assert!(sealed.iter().all(|found| found.tet == found.tet.rotated()));
        let place = |found: &FinishedTet| {
            by_places(found.tet.nodes.map(|v| points[v as usize]), found.required)
        };
        let mut found: Vec<_> = sealed.iter().map(place).collect();
        found.sort_unstable();
        assert!(found == expected, "{words}");
    }
    let (mut needles, surface) = coarse("needles,count=300", 0.3);
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = DiskPath::from(dir.path());
    let field = Field { h: &|_| 0.3, place: &Everywhere, bounds: surface.bounds() };
    let (_, finished) = saturate_to_seal(&mut needles, &field, Mode::Full, &dir, &mut |_, _| ());
    assert!(finished.is_none() && sound(&mut needles).0.len() > 100);
}
