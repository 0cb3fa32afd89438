//! From a surface to a sealed store, stage by stage, through the library: resident, in one sub-domain.
//!
//! `cargo bench --bench pipeline -- [sample|file [none|delaunay|full]]`; without arguments a smoke size. Seconds are those the main thread was on a processor where the system tells them, else those that passed.

use std::cell::RefCell;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};
use std::path::Path;
use std::time::Instant;

use tetdb_base::geom::Point;
use tetdb_base::storage::Budget;
use tetdb_base::surface::Surface;
use tetdb_engine::pipeline::{self, Event, Options, OptionsText, RunOptions};
use tetdb_kernel::samples::SampleSpec;
use tetdb_schema::catalog::Job;
use tetdb_schema::record::{SealedVertex, tag};
use tetdb_store::store::Catalog;

/// Seconds per stage; what passes between two words of the watcher belongs to the stage of the first.
struct Stages {
    list: Vec<(String, f64)>,
    last: f64,
    begun: Instant,
}

impl Stages {
    /// Seconds this thread has run.
    fn now(&self) -> f64 {
        let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
        let nanoseconds = told.and_then(|t| t.split(' ').next()?.parse::<f64>().ok());
        nanoseconds.map_or_else(|| self.begun.elapsed().as_secs_f64(), |ns| ns * 1e-9)
    }

    fn enter(&mut self, stage: &str) {
        let now = self.now();
        if let Some((_, seconds)) = self.list.last_mut() {
            *seconds += now - self.last;
        }
        self.last = now;
        if self.list.last().is_none_or(|(name, _)| name != stage) {
            self.list.push((stage.to_owned(), 0.0));
        }
    }
}

/// Share of edges of about the wanted length, among those a layer away from the surface.
fn share_of_unit_edges(store: &Path) -> f64 {
    let mut store = Catalog::open(store).expect("what was just written");
    let mut subdomain = store.open_subdomain(0, 16 << 20).expect("the only one");
    let vertices: Vec<SealedVertex> = subdomain.vertices().map(|v| v.expect("sound")).collect();
    let tets: Vec<[u32; 4]> = (subdomain.tets().map(|t| t.expect("sound").1.nodes)).collect();
    let mut near: Vec<bool> = vertices.iter().map(|v| v.tag == tag::SURFACE).collect();
    let on_surface = near.clone();
    for nodes in &tets {
        if nodes.iter().any(|&v| on_surface[v as usize]) {
            nodes.iter().for_each(|&v| near[v as usize] = true);
        }
    }
    let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    let mut edges: Vec<(u32, u32)> = tets
        .iter()
        .flat_map(|nodes| pairs.map(|(i, j)| (nodes[i].min(nodes[j]), nodes[i].max(nodes[j]))))
        .filter(|&(a, b)| !near[a as usize] && !near[b as usize])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let unit = edges.iter().filter(|&&(a, b)| {
        let (a, b) = (vertices[a as usize], vertices[b as usize]);
        let length = Point::from_array(a.point).distance(Point::from_array(b.point));
        let metric = 2.0 * length / f64::from(a.h + b.h);
        (FRAC_1_SQRT_2..=SQRT_2).contains(&metric)
    });
    unit.count() as f64 / edges.len().max(1) as f64
}

fn main() {
    let mut words = std::env::args().skip(1).filter(|a| !a.starts_with("--"));
    let word = words.next().unwrap_or_else(|| "balls,count=4".to_owned());
    let optimize = words.next();
    let text = OptionsText { optimize, subdomains: Some("1".to_owned()), ..OptionsText::default() };
    let options = Options {
        mesh: text.try_into().expect("a word of --optimize"),
        run: RunOptions::default(),
    };
    let surface: Surface = match Path::new(&word) {
        file if file.is_file() => {
            tetdb_io::read::read_surface(&[file.to_owned()], 8 << 30).expect("a surface")
        }
        _ => SampleSpec::parse(&word).and_then(|spec| spec.make()).expect("a sample").into(),
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let job = Job::default();
    let path = dir.path().join("bench.tetdb");
    let mut catalog = Catalog::create(&path, &job).expect("an empty place");
    let budget = Budget::new(8 << 30);
    let stages = RefCell::new(Stages { list: Vec::new(), last: 0.0, begun: Instant::now() });
    stages.borrow_mut().enter("sizes");
    let watch = |event: Event| stages.borrow_mut().enter(event.stage);
    let summary =
        pipeline::mesh(&mut catalog, &surface, &options, &budget, &watch).expect("a sample meshes");
    stages.borrow_mut().enter("end");
    let stages = stages.into_inner();
    let seconds: f64 = stages.list.iter().map(|(_, s)| s).sum();
    let rows = catalog.subdomains().expect("sealed rows");
    let tets: u64 = rows.iter().map(|r| r.tets).sum();
    let bytes: u64 = rows.iter().map(|r| r.bytes).sum();
    for (stage, part) in &stages.list {
        println!("{stage:<28} {part:8.2} s {:5.1} %", 100.0 * part / seconds);
    }
    catalog.close().expect("room on the disk");
    println!(
        "{:.3} % of the edges whose ends have no neighbor on the surface are within [1/√2, √2] of the wanted length",
        100.0 * share_of_unit_edges(&path)
    );
    for fine in summary.fine.values() {
        println!("{:?}\n{:?}", fine.refine, fine.optimize);
    }
    println!(
        "{word}: {} triangles, {} tetrahedra, {:.0} per second, {:.2} bytes each on disk",
        surface.n_triangles(),
        tets,
        tets as f64 / seconds,
        bytes as f64 / tets as f64
    );
}
