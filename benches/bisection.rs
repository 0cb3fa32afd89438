//! One cut, stage by stage: resident, and with a pool smaller than the mesh.
//!
//! `cargo bench --bench bisection -- [sample] [pool|balance]`; without arguments a smoke size and both of them. `pool` runs with frames for a
//! twentieth of the finished mesh, `balance [least length] [n]…` makes whole meshes of a box whose sizes are graded 20:1 in so many sub-domains.
//! Wall seconds of one thread; the coarse mesh is not counted.

use std::time::Instant;

use tetdb_base::geom::{Point, mix};
use tetdb_base::storage::{Backing, Budget, Pager, ScratchSpace, attempt};
use tetdb_base::surface::Surface;
use tetdb_engine::pipeline::{self, MeshOptions, Options, OptionsText, silent};
use tetdb_kernel::bisect::{self, CutPlan, CutReport, PlaneChoice, load_of};
use tetdb_kernel::mesh::{Mesh, Workspace, renumber};
use tetdb_kernel::optimize::{Mode, Settings};
use tetdb_kernel::samples::SampleSpec;
use tetdb_kernel::sizing::{SizeField, SizeOptions, TETS_PER_LOAD};
use tetdb_schema::catalog::Job;
use tetdb_store::store::Catalog;

/// Bytes of pages per tetrahedron of a finished mesh, its vertices included.
const BYTES_PER_TET: f64 = 42.0;

struct Bench {
    surface: Surface,
    field: SizeField,
    dir: tempfile::TempDir,
}

/// What one cut came to.
struct Cut {
    report: CutReport,
    seconds: f64,
    /// Of both children: a sum over their tetrahedra, whatever their order.
    digest: u64,
    tets: u64,
    pages: usize,
    pages_read: u64,
    pages_written: u64,
}

impl Bench {
    fn new(words: &str) -> Self {
        let made = SampleSpec::parse(words).and_then(|spec| spec.make());
        let surface: Surface = made.expect("a sample").into();
        let sizes = SizeOptions::default();
        let field = SizeField::build(&surface.points, &surface.triangles, &sizes);
        Self {
            field: field.expect("sizes"),
            surface,
            dir: tempfile::tempdir().expect("a temporary directory"),
        }
    }

    fn pool(&self, made: Option<&str>, bytes: u64) -> Mesh {
        let backing = Backing {
            subdomain: 0,
            generation: 1,
            spill: self.dir.path().into(),
            output: made.map(|name| self.dir.path().join(name).into()),
            base: None,
            cache_bytes: 16 << 20,
        };
        Mesh::new(Pager::new(bytes, Some(backing)))
    }

    /// Cuts the coarse mesh in halves with `bytes` of frames.
    fn cut(&self, plane: PlaneChoice, bytes: u64) -> Cut {
        let space = Workspace { dir: &self.dir.path().into(), memory: 64 << 20 };
        let bounds = self.surface.bounds();
        let mut host = self.pool(None, bytes / 2);
        let options = Options::default();
        pipeline::coarse_mesh(
            &mut host,
            &self.surface,
            &options,
            &ScratchSpace::boundless(),
            &silent,
        )
        .expect("a mesh");
        renumber(&mut host, &tetdb_base::geom::HilbertFrame::new(&bounds), &space).expect("room");
        let clock = Instant::now();
        let mut core = self.pool(None, bytes / 4);
        let plan = CutPlan {
            cut: 1,
            low: 0.5,
            plane,
            earlier: &[],
            h: &|p| self.field.h(p),
            bounds,
            optimize: Settings::of(Mode::Full),
        };
        let opened = {
            let refined = bisect::refine(&mut host, &plan, space.dir, &|_, _| {});
            bisect::choose(&mut host, &mut core, &plan, refined, None, &|_, _| {})
        };
        let (mut digest, mut tets, mut pages) = (0u64, 0, 0);
        for high in [false, true] {
            let name = format!("child-{high}.redb");
            let mut child = self.pool(Some(&name), bytes / 4);
            bisect::write_child(&mut host, &mut core, &mut child, &opened, high, &bounds, &space)
                .expect("room");
            digest = digest.wrapping_add(sum(&mut child, high));
            tets += u64::from(child.n_tets());
            pages += child.pages().extents().iter().map(|e| e[1] as usize).sum::<usize>();
            child.into_pages().finish();
            // A pool without a dirty page made no file.
            let _ = std::fs::remove_file(self.dir.path().join(name));
        }
        let stats = host.pages().stats();
        Cut {
            report: opened.report,
            seconds: clock.elapsed().as_secs_f64(),
            digest,
            tets,
            pages,
            pages_read: stats.pages_read,
            pages_written: stats.pages_written,
        }
    }
}

/// A sum of all tetrahedra of a child.
fn sum(mesh: &mut Mesh, high: bool) -> u64 {
    let (mut sum, mut from) = (0u64, 0);
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let corner = |p: Point| (p.to_array().into_iter()).fold(1, |s, x| mix(s ^ x.to_bits()));
        let corners = tet.vertices().map(|v| corner(mesh.point(v)));
        let all = corners.into_iter().fold(0, u64::wrapping_add);
        sum = sum.wrapping_add(mix(all ^ u64::from(high)));
    }
    sum
}

fn tell(name: &str, cut: &Cut) {
    let (interface, seconds) = (cut.report.interface, cut.report.seconds);
    println!(
        "{name:<22} {:.2} s: plane {:.2}, zone {:.2} ({} vertices), core {:.2}, interface {:.2}",
        cut.seconds,
        seconds.plane,
        seconds.zone,
        cut.report.refine.inserted,
        seconds.core,
        seconds.interface,
    );
    println!(
        "{:22} {} free tetrahedra, {:.1} bytes each; final layers at the interface at least {:?}; {} of {} spheres in the zone",
        "",
        interface.free_tets,
        interface.bytes as f64 / interface.free_tets.max(1) as f64,
        cut.report.layers_least,
        cut.report.z_enclosed,
        cut.report.z_tets,
    );
    for (what, m) in [
        ("natural", interface.natural),
        ("minimum cut", interface.minimum),
        ("chosen", interface.chosen),
    ] {
        println!(
            "{:22} {what:<12} {} faces ({:+.1} %), quality {:.3}, {} tetrahedra with several, {} pinched vertices",
            "",
            m.faces,
            100.0 * (m.faces as f64 / interface.natural.faces as f64 - 1.0),
            m.quality_mean(),
            m.over_constrained,
            m.pinched,
        );
    }
}

/// Shares of `n` sub-domains of a box, finest along one wall and twenty times as coarse away from it.
fn balance(least: f64, n: u32) {
    let coarse = 20.0 * least;
    let surface: Surface = SampleSpec::parse(&format!("box,h={coarse}"))
        .and_then(|spec| spec.make())
        .expect("a sample")
        .into();
    let dir = tempfile::tempdir().expect("a temporary directory");
    let mut catalog =
        Catalog::create(dir.path().join("b.tetdb"), &Job::default()).expect("an empty place");
    let text = OptionsText {
        size_expr: Some(format!("min({coarse}, {least} + 0.26 * x)")),
        subdomains: Some(n.to_string()),
        optimize: Some("none".to_owned()),
        ..OptionsText::default()
    };
    let options = Options::from(MeshOptions::try_from(text).expect("good options"));
    let budget = Budget::new(4 << 30);
    pipeline::mesh(&mut catalog, &surface, &options, &budget, &silent).expect("a mesh");
    let tets = catalog.subdomains().expect("rows").into_iter();
    let tets: Vec<f64> = tets.map(|row| row.tets as f64).collect();
    let journal = catalog.journal().expect("rows");
    let told = journal.iter().flat_map(|row| &row.measures);
    let told: Vec<f64> = told.filter(|m| m.name == "predicted_tets").map(|m| m.value).collect();
    // The first is that of the whole.
    let predicted = &told[told.len() - tets.len()..];
    println!(
        "balance: {} sub-domains, {} tetrahedra: most over mean of what was shared {:.3}, of tetrahedra {:.3}",
        tets.len(),
        tets.iter().sum::<f64>(),
        most_over_mean(predicted),
        most_over_mean(&tets),
    );
}

fn most_over_mean(numbers: &[f64]) -> f64 {
    let most = numbers.iter().fold(0.0, |m: f64, &x| m.max(x));
    most * numbers.len() as f64 / numbers.iter().sum::<f64>()
}

fn main() {
    let mut words = std::env::args().skip(1).filter(|a| !a.starts_with("--"));
    let sample = words.next().unwrap_or_else(|| "box,h=0.1".to_owned());
    let only = words.next();
    let asked = |name: &str| only.as_deref().is_none_or(|o| o == name);
    let bench = Bench::new(&sample);
    let plenty = 4 << 30;
    let whole = bench.cut(PlaneChoice::default(), plenty);
    println!("{sample}: {} triangles", bench.surface.n_triangles());
    tell("as it is", &whole);
    if asked("balance") {
        let least = words.next().map_or(0.02, |w| w.parse().expect("a length"));
        let mut counts: Vec<u32> = words.map(|w| w.parse().expect("a number")).collect();
        if counts.is_empty() {
            counts.push(2);
        }
        for n in counts {
            balance(least, n);
        }
    }
    let mut mesh = Mesh::new(Pager::new(plenty, None));
    pipeline::coarse_mesh(
        &mut mesh,
        &bench.surface,
        &Options::default(),
        &ScratchSpace::boundless(),
        &silent,
    )
    .expect("a mesh");
    for v in mesh.vertex_ids() {
        let p = mesh.point(v);
        mesh.set_size(v, bench.field.h(p) as f32);
    }
    let load = load_of(&mut mesh, &|p| bench.field.h(p));
    let predicted = TETS_PER_LOAD * load;
    println!("the finished mesh will have about {predicted:.0} tetrahedra");
    if asked("pool") {
        let bytes = (BYTES_PER_TET * predicted / 20.0) as u64;
        let pool = attempt(|| bench.cut(PlaneChoice::default(), bytes)).expect("room");
        tell("frames for 5 %", &pool);
        println!(
            "{:22} {} tetrahedra, {} pages, {} frames, {} read, {} written; {:.2} times the time; {}",
            "",
            pool.tets,
            pool.pages,
            bytes >> 16,
            pool.pages_read,
            pool.pages_written,
            pool.seconds / whole.seconds,
            if pool.digest == whole.digest { "the same children" } else { "OTHER CHILDREN" },
        );
    }
}
