//! Delaunay meshes of random points: the kernel through resident cursors, on flat arrays, and with
//! frame pools smaller than the mesh. One thread; CPU seconds of the thread.
//!
//! `cargo bench --bench delaunay -- [points] [runs] [all|flat|resident|balls|slab]`; without arguments a smoke size.
//! `slab` puts the points into a slab a million times wider than thick, in a mesh of a fiftieth as many, and beside it all over the cube: what the
//! band around a cut could come to at worst. `balls` takes the vertices of a balls surface instead of random points; pools then read the points from disk too.

use std::path::Path;

use tetdb_base::geom::{Aabb, HilbertFrame, Point, orient_sign};
use tetdb_base::storage::{Backing, FlatPages, Pager, Pages, Sorter};
use tetdb_kernel::delaunay::{Kernel, enclose, insertion_key};
use tetdb_kernel::mesh::Mesh;
use tetdb_kernel::samples::SampleSpec;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let numbers: Vec<usize> = words.iter().filter_map(|a| a.parse().ok()).collect();
    let n = numbers.first().copied().unwrap_or(20_000);
    let runs = numbers.get(1).copied().unwrap_or(1);
    let only = words.iter().find(|w| w.parse::<usize>().is_err()).map_or("all", String::as_str);
    if only == "slab" {
        return slab(n);
    }
    let points = if only == "balls" { ball_points(n) } else { random_points(n) };
    println!("{} points ({only})", points.len());
    let mut cases: Vec<(String, Vec<f64>)> = Vec::new();
    let mut frames = 0;
    let dir = tempfile::tempdir().expect("a temporary directory");
    // The cases take turns, so that a noisy machine disturbs them alike.
    for run in 0..runs {
        let mut k = 0;
        let mut keep = |name: String, rate: f64| {
            if run == 0 {
                cases.push((name, Vec::new()));
            }
            cases[k].1.push(rate);
            k += 1;
        };
        if matches!(only, "all" | "flat") {
            let (rate, _) = mesh_points(Mesh::new(FlatPages::default()), &points);
            keep("flat arrays".to_owned(), rate);
        }
        if only != "flat" {
            let (rate, mesh) = mesh_points(Mesh::new(Pager::new(8 << 30, None)), &points);
            frames = mesh.pages().frames_used();
            keep("resident cursors".to_owned(), rate);
        }
        if matches!(only, "all" | "balls") {
            for percent in [25, 5] {
                let backing = Backing {
                    subdomain: 0,
                    generation: 1,
                    spill: dir.path().into(),
                    output: None,
                    base: None,
                    cache_bytes: 16 << 20,
                };
                let bytes = (frames * percent / 100 * 65_536) as u64;
                let mesh = Mesh::new(Pager::new(bytes, Some(backing)));
                let (rate, mesh) = match only {
                    "balls" => mesh_sorted(mesh, &points, dir.path(), bytes),
                    _ => mesh_points(mesh, &points),
                };
                let stats = mesh.pages().stats();
                let per_point = stats.pages_read as f64 / points.len() as f64;
                eprintln!("  {stats:?}, {per_point:.4} page reads per point");
                keep(format!("pool of {percent} %"), rate);
            }
        }
    }
    println!("{frames} pages");
    for (name, rates) in &mut cases {
        report(name, rates);
    }
    for pair in [
        ("resident cursors", "flat arrays"),
        ("pool of 25 %", "resident cursors"),
        ("pool of 5 %", "resident cursors"),
    ] {
        let find = |name: &str| cases.iter().find(|(n, _)| n == name).map(|(_, r)| r[r.len() / 2]);
        if let (Some(a), Some(b)) = (find(pair.0), find(pair.1)) {
            println!("{} / {}: {:.3}", pair.0, pair.1, a / b);
        }
    }
}

/// Vertices of a balls sample of about `n` vertices: cospherical groups and empty space, as a mesher meets them.
fn ball_points(n: usize) -> Vec<Point> {
    let h = 0.0093 * (341_000.0 / n as f64).sqrt();
    let count = if n > 100_000 { 1000 } else { 50 };
    let spec = SampleSpec::parse(&format!("balls,count={count},h={h}")).expect("a sample");
    spec.make().expect("balls fit").points
}

fn report(name: &str, rates: &mut [f64]) {
    rates.sort_by(f64::total_cmp);
    let n = rates.len();
    println!(
        "{name}: {:.3} M tetrahedra per CPU second (least {:.3}, most {:.3}, {n} runs)",
        rates[n / 2] / 1e6,
        rates[0] / 1e6,
        rates[n - 1] / 1e6
    );
}

/// Uniform in the unit cube; the same for every run.
fn random_points(n: usize) -> Vec<Point> {
    let mut state = 1u64;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let points = (0..n).map(|_| Point::new(next(), next(), next()));
    points.collect()
}

fn mesh_points<P: Pages>(mesh: Mesh<P>, points: &[Point]) -> (f64, Mesh<P>) {
    let started = cpu_seconds();
    let bounds = Aabb::around(points.iter().copied());
    let frame = HilbertFrame::new(&bounds);
    let mut order: Vec<(u64, u32)> =
        points.iter().enumerate().map(|(i, &p)| (insertion_key(&frame, p), i as u32)).collect();
    order.sort_unstable();
    let ordered = order.into_iter().map(|(_, i)| points[i as usize]);
    insert_all(mesh, &bounds, ordered, started)
}

/// The same with the points sorted on disk, in an eighth of the pool's memory.
fn mesh_sorted(mesh: Mesh, points: &[Point], dir: &Path, pool: u64) -> (f64, Mesh) {
    let started = cpu_seconds();
    let bounds = Aabb::around(points.iter().copied());
    let frame = HilbertFrame::new(&bounds);
    let mut sorter = Sorter::<[u8; 32]>::new(dir, pool / 8);
    for &p in points {
        let mut record = [0; 32];
        record[..8].copy_from_slice(&insertion_key(&frame, p).to_be_bytes());
        for (place, x) in record[8..].chunks_exact_mut(8).zip(p.to_array()) {
            place.copy_from_slice(&x.to_be_bytes());
        }
        sorter.push(record).expect("the disk has room");
    }
    let sorted = sorter.finish().expect("the disk has room");
    let ordered = sorted.map(|record| {
        let record = record.expect("runs can be read");
        let x = |i: usize| f64::from_be_bytes(record[i..i + 8].try_into().expect("eight bytes"));
        Point::new(x(8), x(16), x(24))
    });
    insert_all(mesh, &bounds, ordered, started)
}

fn insert_all<P: Pages>(
    mut mesh: Mesh<P>,
    bounds: &Aabb,
    points: impl Iterator<Item = Point>,
    started: f64,
) -> (f64, Mesh<P>) {
    let mut kernel = Kernel::default();
    let mut hint = enclose(&mut mesh, bounds);
    for p in points {
        let v = mesh.add_vertex(p, 0.0);
        hint = kernel.insert(&mut mesh, v, p, hint).expect("the points are distinct");
    }
    let seconds = cpu_seconds() - started;
    let s = kernel.stats;
    let per = |n: u64| n as f64 / s.inserted as f64;
    eprintln!(
        "  {} tetrahedra in {seconds:.2} s; per point: {:.2} walk steps, {:.2} cavity, {:.2} sphere tests",
        mesh.n_tets(),
        per(s.walk_steps),
        per(s.cavity_tets),
        per(s.sphere_tests)
    );
    (f64::from(mesh.n_tets()) / seconds, mesh)
}

/// Ends with an error when a tetrahedron is inverted or the slab costs more than three times as much as the cube.
fn slab(n: usize) {
    let points = random_points(n + n / 50);
    let (coarse, points) = points.split_at(n / 50);
    let everywhere = insert_into("all over the cube", coarse, points.to_vec());
    let flat = |p: &Point| Point::new(p.x, p.y, 0.5 + 1e-6 * (p.z - 0.5));
    let thin = insert_into("in the slab", coarse, points.iter().map(flat).collect());
    println!("slab / cube: {:.2}", thin / everywhere);
    assert!(thin < 3.0 * everywhere, "the slab costs too much");
}

/// Inserts `points` into a mesh of `coarse`; returns CPU seconds per point.
fn insert_into(name: &str, coarse: &[Point], mut points: Vec<Point>) -> f64 {
    let mut mesh = Mesh::new(FlatPages::default());
    let mut kernel = Kernel::default();
    let mut hint = enclose(&mut mesh, &Aabb::around(coarse.iter().chain(&points).copied()));
    let mut put = |p: &Point| {
        let v = mesh.add_vertex(*p, 0.0);
        let before = kernel.stats.walk_steps;
        let inserted = kernel.insert(&mut mesh, v, *p, hint);
        hint = inserted.expect("the points are distinct");
        kernel.stats.walk_steps - before
    };
    coarse.iter().for_each(|p| _ = put(p));
    let started = cpu_seconds();
    let frame = HilbertFrame::new(&Aabb::around(points.iter().copied()));
    points.sort_by_cached_key(|&p| insertion_key(&frame, p));
    let longest = points.iter().map(&mut put).max();
    let seconds = (cpu_seconds() - started) / points.len() as f64;
    println!(
        "{name}: {:.2} microseconds per point; longest walk {longest:?}, largest cavity {}",
        1e6 * seconds,
        kernel.stats.cavity_largest
    );
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let [a, b, c, d] = tet.vertices().map(|v| mesh.point(v));
        assert!(orient_sign(a, b, c, d).is_gt(), "tetrahedron {t} is inverted");
    }
    seconds
}

/// CPU time of this thread where the system tells it, else wall time.
fn cpu_seconds() -> f64 {
    use std::time::{SystemTime, UNIX_EPOCH};
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanos = told.and_then(|s| s.split_whitespace().next()?.parse::<f64>().ok());
    let wall = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
    nanos.map_or_else(wall, |n| n * 1e-9)
}
