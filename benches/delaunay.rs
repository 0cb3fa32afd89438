//! Delaunay meshes of random points: the kernel through resident cursors, on flat arrays, and with
//! frame pools smaller than the mesh. One thread; CPU seconds of the thread.
//!
//! `cargo bench --bench delaunay -- [points] [runs]`; without arguments a smoke size.

use tetdb::delaunay::{Kernel, enclose, insertion_key};
use tetdb::geom::{Aabb, HilbertFrame, Point};
use tetdb::mesh::Mesh;
use tetdb::store::{Backing, FlatPages, Pager, Pages};

fn main() {
    let args: Vec<usize> = std::env::args()
        .skip(1)
        .filter_map(|a| a.parse().ok())
        .collect();
    let n = args.first().copied().unwrap_or(20_000);
    let runs = args.get(1).copied().unwrap_or(1);
    let points = random_points(n);
    let mut flat = Vec::new();
    let mut resident = Vec::new();
    let mut frames = 0;
    for _ in 0..runs {
        let (rate, _) = mesh_points(Mesh::new(FlatPages::default()), &points);
        flat.push(rate);
        let (rate, mesh) = mesh_points(Mesh::new(Pager::new(8 << 30, None)), &points);
        resident.push(rate);
        frames = mesh.pages().frames_used();
    }
    println!("{n} points, {frames} pages");
    report("flat arrays", &mut flat);
    report("resident cursors", &mut resident);
    println!("cursor overhead {:.3}", flat[runs / 2] / resident[runs / 2]);
    let dir = tempfile::tempdir().expect("a temporary directory");
    for percent in [25, 10, 5] {
        let mut rates = Vec::new();
        let mut stats = Default::default();
        for run in 0..runs {
            let backing = Backing {
                subdomain: 0,
                generation: 1,
                work_path: dir.path().join(format!("{percent}-{run}.redb")),
                base: None,
                cache_bytes: 16 << 20,
            };
            let bytes = (frames * percent / 100 * 65_536) as u64;
            let (rate, mesh) = mesh_points(Mesh::new(Pager::new(bytes, Some(backing))), &points);
            stats = mesh.pages().stats();
            rates.push(rate);
        }
        report(&format!("pool of {percent} %"), &mut rates);
        println!(
            "  ratio to resident {:.3}, {stats:?}",
            rates[runs / 2] / resident[runs / 2]
        );
    }
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

fn random_points(n: usize) -> Vec<Point> {
    let mut state = 1u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let points = (0..n).map(|_| Point::new(next(), next(), next()));
    points.collect()
}

fn mesh_points<P: Pages>(mut mesh: Mesh<P>, points: &[Point]) -> (f64, Mesh<P>) {
    let started = cpu_seconds();
    let bounds = Aabb::around(points.iter().copied());
    let frame = HilbertFrame::new(&bounds);
    let mut order: Vec<(u64, u32)> = points
        .iter()
        .enumerate()
        .map(|(i, &p)| (insertion_key(&frame, p), i as u32))
        .collect();
    order.sort_unstable();
    let mut kernel = Kernel::default();
    let mut hint = enclose(&mut mesh, &bounds);
    for (_, i) in order {
        let p = points[i as usize];
        let v = mesh.add_vertex(p, 0.0);
        hint = kernel
            .insert(&mut mesh, v, p, hint)
            .expect("random points are distinct");
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

/// CPU time of this thread where the system tells it, else wall time.
fn cpu_seconds() -> f64 {
    use std::time::{SystemTime, UNIX_EPOCH};
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanos = told.and_then(|s| s.split_whitespace().next()?.parse::<f64>().ok());
    let wall = || {
        SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0.0, |d| d.as_secs_f64())
    };
    nanos.map_or_else(wall, |n| n * 1e-9)
}
