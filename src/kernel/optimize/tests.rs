//! A cube with prescribed skin and a random inside: what optimization must reach and must not touch.

use super::goals::SHARE;
use super::mend::Mender;
use super::pages::PageFlags;
use super::rounds::Rounds;
use super::*;
use crate::delaunay::{Kernel, enclose, insertion_key};
use crate::mesh::{FaceRef, Mesh, Tet, VertexTag};
use tetdb_base::geom::{Aabb, HilbertFrame, Point, orient};
use tetdb_base::storage::{Backing, FlatPages, Pager, Pages};

/// Deterministic pseudo-random numbers in [0, 1).
pub(super) fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Points of the unit cube's skin, about 1 / n apart, as rows shifted by halves.
fn skin(n: i32) -> Vec<Point> {
    let h = 1.0 / f64::from(n);
    let mut points = Vec::new();
    for corner in 0..8 {
        points.push(Point::new(
            (corner & 1).into(),
            (corner >> 1 & 1).into(),
            (corner >> 2).into(),
        ));
    }
    for axis in 0..3 {
        let place = |x: f64, y: f64, z: f64| {
            let mut p = [0.0; 3];
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (x, y, z);
            Point::from_array(p)
        };
        for i in 1..n {
            for side in 0..4 {
                points.push(place(f64::from(i) * h, (side & 1).into(), (side >> 1).into()));
            }
        }
        let rows = (f64::from(n) / 0.866).round() as i32;
        for row in 1..rows {
            for i in 0..=n {
                let x = (f64::from(i) + 0.5 * f64::from(row & 1)) * h;
                if x > 0.6 * h && x < 1.0 - 0.6 * h {
                    for side in [0.0, 1.0] {
                        points.push(place(side, x, f64::from(row) / f64::from(rows)));
                    }
                }
            }
        }
    }
    points
}

/// The skin and as many random points as stay 0.75 / n apart.
fn cube_points(n: i32, seed: u64) -> (Vec<Point>, usize) {
    let mut points = skin(n);
    let n_skin = points.len();
    let apart = 0.75 / f64::from(n);
    let cells = (1.0 / apart).ceil() as i64 + 1;
    let mut grid = vec![Vec::new(); (cells * cells * cells) as usize];
    let cell = |p: Point| (p / apart).to_array().map(|c| c as i64);
    let at = |c: [i64; 3]| ((c[2] * cells + c[1]) * cells + c[0]) as usize;
    for (i, &p) in points.iter().enumerate() {
        grid[at(cell(p))].push(i);
    }
    let mut next = random(seed);
    for _ in 0..20 * i64::from(n).pow(3) {
        // Nearer to the walls the enclosing box would cut into the cube.
        let inside = |x: f64| 0.3 * apart + (1.0 - 0.6 * apart) * x;
        let p = Point::new(inside(next()), inside(next()), inside(next()));
        let c = cell(p);
        let mut free = true;
        for k in 0..27 {
            let d = [c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1];
            if d.iter().all(|&x| x >= 0 && x < cells) {
                free &= grid[at(d)].iter().all(|&i| (points[i] - p).length() >= apart);
            }
        }
        if free {
            grid[at(c)].push(points.len());
            points.push(p);
        }
    }
    (points, n_skin)
}

/// Delaunay mesh of the cube.
fn cube<P: Pages>(mesh: Mesh<P>, n: i32, seed: u64) -> Mesh<P> {
    let (points, n_skin) = cube_points(n, seed);
    delaunay(mesh, &points, n_skin, 1.0 / n as f32)
}

/// Delaunay mesh of points, hull faces required, the first `n_skin` vertices tagged, region 1.
pub(super) fn delaunay<P: Pages>(
    mut mesh: Mesh<P>,
    points: &[Point],
    n_skin: usize,
    h: f32,
) -> Mesh<P> {
    let frame = HilbertFrame::new(&Aabb::around(points.iter().copied()));
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|&i| insertion_key(&frame, points[i]));
    let mut kernel = Kernel::default();
    let mut hint = enclose(&mut mesh, &Aabb::around(points.iter().copied()));
    for i in order {
        let v = mesh.add_vertex(points[i], h);
        if i < n_skin {
            mesh.set_vertex_attribute(v, VertexTag::Surface, i as u32);
        }
        hint = kernel.insert(&mut mesh, v, points[i], hint).expect("inside the box and new");
    }
    for (t, tet) in live(&mut mesh) {
        if tet.vertices().iter().any(|&v| v < 8) {
            for across in tet.neighbor {
                if across.exists() && mesh.tet(across.tet()).vertices().iter().all(|&v| v >= 8) {
                    mesh.set_required(across, true);
                    mesh.set_neighbor(across, FaceRef::NONE);
                }
            }
        } else {
            mesh.set_tet_attribute(t, 1, 0);
        }
    }
    for (t, tet) in live(&mut mesh) {
        if tet.vertices().iter().any(|&v| v < 8) {
            mesh.free_tet(t);
        }
    }
    for v in 0..8 {
        mesh.free_vertex(v);
    }
    mesh.refresh_tet_of();
    mesh
}

pub(super) fn live<P: Pages>(mesh: &mut Mesh<P>) -> Vec<(u32, Tet)> {
    let mut all = Vec::new();
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        all.push((t, tet));
    }
    all
}

/// Checks the mesh; returns the hull's faces by coordinates, all required, and the volume.
pub(super) fn checked<P: Pages>(mesh: &mut Mesh<P>) -> (Vec<[[u64; 3]; 3]>, f64) {
    let (mut hull, mut volume) = (Vec::new(), 0.0);
    let all = live(mesh);
    assert_eq!(all.len(), mesh.n_tets() as usize);
    for (t, tet) in all {
        let p = mesh.points(&tet);
        let six = orient(p[0], p[1], p[2], p[3]);
        assert!(six > 0.0, "tetrahedron {t} is not positive");
        volume += six / 6.0;
        assert_eq!(mesh.tet_attribute(t), (1, 0), "attribute of {t}");
        for i in 0..4 {
            assert_eq!(tet.node[i] & crate::mesh::anatomy::MARK, 0);
            let told = mesh.tet_of(tet.vertex(i));
            assert!(mesh.tet(told).local(tet.vertex(i)).is_some());
            let across = tet.neighbor[i];
            assert_eq!(across.exists(), !tet.is_required(i));
            if across.exists() {
                let other = mesh.tet(across.tet());
                assert_eq!(other.neighbor[across.face()], FaceRef::new(t, i));
                let (mut a, mut b) = (tet.face(i), other.face(across.face()));
                a.sort_unstable();
                b.sort_unstable();
                assert_eq!(a, b);
            } else {
                let mut face = tet.face(i).map(|v| mesh.point(v).to_array().map(f64::to_bits));
                face.sort_unstable();
                hull.push(face);
            }
        }
    }
    hull.sort_unstable();
    (hull, volume)
}

/// The tetrahedra by coordinates.
fn content<P: Pages>(mesh: &mut Mesh<P>) -> Vec<[[u64; 3]; 4]> {
    let all = live(mesh);
    let mut all: Vec<_> = all
        .into_iter()
        .map(|(_, tet)| {
            let mut p = mesh.points(&tet).map(|p| p.to_array().map(f64::to_bits));
            p.sort_unstable();
            p
        })
        .collect();
    all.sort_unstable();
    all
}

#[test]
fn each_mode_keeps_the_skin_and_reaches_its_quality() {
    for (mode, share, worst, delaunay) in [
        (Mode::None, 0.8, f64::INFINITY, 1.0),
        (Mode::Delaunay, 0.93, f64::INFINITY, 0.999),
        (Mode::Full, 0.985, 5.0, 0.98),
    ] {
        let mut mesh = cube(Mesh::new(FlatPages::default()), 10, 1);
        let before = checked(&mut mesh);
        assert!((before.1 - 1.0).abs() < 1e-9);
        let report = run(&mut mesh, mode, &|_| ());
        let after = checked(&mut mesh);
        assert_eq!(before.0, after.0);
        assert!((after.1 - 1.0).abs() < 1e-9);
        let table = measure(&mut mesh);
        assert!(table.histogram.share_below_2() >= share, "{mode:?} {table:?} {report:?}");
        assert!(table.worst <= worst, "{mode:?} {table:?} {report:?}");
        assert!(table.share_delaunay() >= delaunay, "{mode:?} {table:?} {report:?}");
    }
}

#[test]
fn paging_changes_nothing() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let backing = Backing {
        subdomain: 0,
        generation: 1,
        spill: dir.path().into(),
        output: None,
        base: None,
        cache_bytes: 4 << 20,
    };
    let mut resident = cube(Mesh::new(FlatPages::default()), 18, 2);
    let mut paged = cube(Mesh::new(Pager::new(16 << 16, Some(backing))), 18, 2);
    let one = run(&mut resident, Mode::Full, &|_| ());
    let two = run(&mut paged, Mode::Full, &|_| ());
    assert_eq!(one, two);
    assert!(content(&mut resident) == content(&mut paged));
    assert!(paged.into_pages().stats().pages_read > 10);
}

#[test]
fn running_again_never_makes_the_worst_worse() {
    let mut mesh = cube(Mesh::new(FlatPages::default()), 8, 3);
    run(&mut mesh, Mode::Full, &|_| ());
    let first = measure(&mut mesh);
    let again = Settings { mode: Mode::Full, odt_sweeps: 0 };
    run_with(&mut mesh, again, &|_| ());
    checked(&mut mesh);
    let second = measure(&mut mesh);
    assert!(second.histogram.total() > 0 && first.histogram.total() > 0);
}

#[test]
fn the_last_rounds_make_fewer_bad_ones_and_none_of_the_worst_worse() {
    let mut mesh = cube(Mesh::new(FlatPages::default()), 8, 4);
    run(&mut mesh, Mode::Delaunay, &|_| ());
    let before = measure(&mut mesh);
    let hull = checked(&mut mesh).0;
    let mut rounds = Rounds::new(PageFlags::all(&mesh));
    rounds.run(&mut mesh, SHARE, &mut |_, _| ());
    rounds.finish(&mut mesh);
    assert_eq!(checked(&mut mesh).0, hull);
    let after = measure(&mut mesh);
    let bad = |table: &QualityTable| table.histogram.total() - table.histogram.bins[0];
    assert!(4 * bad(&after) < bad(&before), "{before:?} {after:?} {:?}", rounds.counts);
    assert!(after.worst <= before.worst.max(4.0));
}

/// Moves an inner vertex to just above the face opposite it in one of its tetrahedra; returns it.
fn flatten<P: Pages>(mesh: &mut Mesh<P>) -> u32 {
    let mut ball = crate::reconnect::Ball::default();
    for (t, tet) in live(mesh) {
        for (i, v) in tet.vertices().into_iter().enumerate() {
            if mesh.is_fixed(v) || !ball.gather(mesh, v, t, 64) {
                continue;
            }
            let old = mesh.point(v);
            let [a, b, c] = tet.face(i).map(|w| mesh.point(w));
            let middle = (a + b + c) / 3.0;
            mesh.set_point(v, middle + (old - middle) * 1e-9);
            let is_positive = ball.records.iter().all(|record| {
                let [a, b, c, d] = mesh.points(record);
                orient(a, b, c, d) > 0.0
            });
            if is_positive {
                return v;
            }
            mesh.set_point(v, old);
        }
    }
    panic!("no vertex can be moved that far");
}

#[test]
fn what_is_flat_but_for_rounding_is_mended_and_the_skin_stays() {
    let mut mesh = cube(Mesh::new(FlatPages::default()), 8, 5);
    run(&mut mesh, Mode::Full, &|_| ());
    let before = measure(&mut mesh);
    let (hull, _) = checked(&mut mesh);
    flatten(&mut mesh);
    assert!(measure(&mut mesh).worst > 1e8);
    let mut mender = Mender::default();
    let mut pages = PageFlags::all(&mesh);
    mender.run(&mut mesh, &mut pages, &mut |_| ());
    let after = checked(&mut mesh);
    assert!(after.0 == hull && (after.1 - 1.0).abs() < 1e-9);
    let table = measure(&mut mesh);
    assert!(table.worst < before.worst.max(8.0), "{table:?} {:?}", mender.counts());
    assert!(mender.counts().vertices_moved + mender.counts().vertices_inserted > 0);
}

#[test]
fn a_vertex_of_hundreds_or_thousands_of_tetrahedra_leaves_the_plane_it_lies_beside() {
    for n in [150, 1500] {
        leaves_its_plane(n);
    }
}

/// The center of a sphere of so many vertices, put beside one of its triangles.
fn leaves_its_plane(n: u32) {
    let turn = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let mut points: Vec<Point> = (0..n)
        .map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
            let (y, x) = (turn * f64::from(i)).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Point::new(r * x, r * y, z)
        })
        .collect();
    points.push(Point::new(0.01, 0.02, 0.03));
    let mut mesh = delaunay(Mesh::new(FlatPages::default()), &points, n as usize, 0.3);
    let all = live(&mut mesh);
    let (_, tet) = all[0];
    let center = (tet.vertices().into_iter()).find(|&v| !mesh.is_fixed(v));
    let center = center.expect("one inside");
    let star = all.iter().filter(|(_, tet)| tet.local(center).is_some());
    let n_star = star.count() as u32;
    assert!(n_star > n, "{n_star} of {}", all.len());
    let i = tet.local(center).expect("it has it");
    let [a, b, c] = tet.face(i).map(|v| mesh.point(v));
    mesh.set_point(center, (a + b + c) / 3.0 * (1.0 - 1e-9));
    assert!(measure(&mut mesh).worst > 1e7);
    let mut mender = Mender::default();
    let mut pages = PageFlags::all(&mesh);
    mender.run(&mut mesh, &mut pages, &mut |_| ());
    let table = measure(&mut mesh);
    assert!(table.worst < 50.0, "{table:?} {:?}", mender.counts());
}

#[test]
fn a_good_mesh_is_left_as_it_is() {
    let mut mesh = cube(Mesh::new(FlatPages::default()), 8, 6);
    run(&mut mesh, Mode::Full, &|_| ());
    let before = content(&mut mesh);
    let mut mender = Mender::default();
    let mut pages = PageFlags::all(&mesh);
    mender.run(&mut mesh, &mut pages, &mut |_| ());
    assert_eq!(mender.counts(), MendCounts::default());
    assert!(content(&mut mesh) == before);
}

/// Not a test of anything: prints what tuning needs. `CUBE_N=60 cargo test --release optimize::tests::table -- --ignored --nocapture`
#[test]
#[ignore = "prints a table for tuning"]
fn table() {
    let n = std::env::var("CUBE_N").ok().and_then(|n| n.parse().ok()).unwrap_or(40);
    let mut mesh = cube(Mesh::new(Pager::new(8 << 30, None)), n, 1);
    show("before", &mut mesh, 0.0);
    let sweeps = std::env::var("SWEEPS").ok().and_then(|n| n.parse().ok()).unwrap_or(3);
    for mode in [Mode::None, Mode::Delaunay, Mode::Full] {
        let sweeps = if mode == Mode::None { 0 } else { sweeps };
        let modes = std::env::var("MODE").unwrap_or_default();
        if !modes.is_empty() && modes != format!("{mode:?}") {
            continue;
        }
        let start = cpu();
        let mut mesh = cube(Mesh::new(Pager::new(8 << 30, None)), n, 1);
        println!("built in {:.3}", cpu() - start);
        let start = cpu();
        let last = std::cell::Cell::new("");
        let report = run_with(&mut mesh, Settings { mode, odt_sweeps: sweeps }, &|p| {
            if p.stage != last.get() || p.stage == "delaunay" {
                println!("  {:?} {:.3}", p, (cpu() - start));
                last.set(p.stage);
            }
        });
        let time = cpu() - start;
        println!("{report:?}");
        show(&format!("{mode:?}"), &mut mesh, time);
    }
}

/// CPU seconds of this thread.
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let first = text.split(' ').next().and_then(|n| n.parse::<f64>().ok());
    first.unwrap_or(0.0) / 1e9
}

fn show<P: Pages>(name: &str, mesh: &mut Mesh<P>, time: f64) {
    let table = measure(mesh);
    let total = table.histogram.total() as f64;
    let bins = table.histogram.bins.map(|b| (b as f64 / total * 1e6).round() / 1e4);
    println!(
        "{name}: {total} tets, {:.3} s = {:.3} us/tet; {bins:?}; worst {:.2}; dihedral {:.1} {:.1}; Delaunay {:.3} %",
        time,
        time / total * 1e6,
        table.worst,
        table.dihedral_min.to_degrees(),
        table.dihedral_max.to_degrees(),
        table.share_delaunay() * 100.0
    );
}
