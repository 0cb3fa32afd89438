//! The command `info`: the contents of a store.

use std::path::Path;

use serde_json::{Value, json};

use super::args::InfoArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::tasks;
use super::words::{self, count, quality_range, quoted, worst};
use tetdb_engine::api::{
    Excess, QualityRow, RegionInfo, Settings, Store, StoreInfo, StoreState, Tasks, short,
};

/// The recorded name of a surface that is kept in the store.
const COPY: &str = "store:surface.obj";
/// Largest number of regions listed one by one.
const REGIONS_LISTED: usize = 12;
/// Least number of tetrahedra for which bytes per tetrahedron are shown.
const TETS_MEASURED: u64 = 10_000;
/// Largest number of neighbors listed of each.
const NEIGHBORS_LISTED: usize = 8;
/// Largest number of sub-domains listed.
const SUBDOMAINS_LISTED: usize = 32;

pub fn run(args: &InfoArgs, console: &Console) -> Result<u8, Failure> {
    // The rows of a catalog take far less than the smallest cap.
    let memory = memory::requested(args.of.memory.as_deref())?;
    let settings = args.of.at.of(console.settings(memory, None));
    let path = &args.of.store;
    let excess =
        (args.excess).then(|| Store::open_with(path, settings.clone())?.excess()).transpose()?;
    console.done();
    if console.is_json() {
        let mut all = object_at(path, &settings)?;
        if let Some(excess) = excess {
            all["excess"] = json!(excess);
        }
        console.answer(&all);
        return Ok(0);
    }
    print_at(path, &settings, console)?;
    if let Some(Excess { worst, above_two }) = excess {
        console.line(&format!(
            "excess (q over the least that the surface allows): {} at most; above 2: {}",
            short(worst),
            count(above_two, "tetrahedron")
        ));
    }
    Ok(0)
}

/// The whole record, for programs.
pub fn object(path: &Path) -> Result<Value, Failure> {
    object_at(path, &Settings::new())
}

fn object_at(path: &Path, settings: &Settings) -> Result<Value, Failure> {
    let mut all = json!(StoreInfo::read_with(path, settings)?);
    all["schema"] = json!(1);
    all["tasks"] = json!(Tasks::of(path).status()?.as_ref().map(tasks::object));
    Ok(all)
}

/// A digest as text.
pub fn hex(digest: [u64; 2]) -> String {
    tetdb_engine::data::schema::digest::Digest { lanes: digest }.to_string()
}

/// Prints the record for people.
pub fn print(path: &Path, console: &Console) -> Result<(), Failure> {
    print_at(path, &Settings::new(), console)
}

fn print_at(path: &Path, settings: &Settings, console: &Console) -> Result<(), Failure> {
    let info = StoreInfo::read_with(path, settings)?;
    let surfaces = info.surfaces.iter().map(|s| match (s.path.as_str(), s.path.split_once(':')) {
        (COPY, _) => "a copy in the store of its surface".to_owned(),
        (_, Some(("resolved", what))) => format!("crossings resolved ({what})"),
        (_, Some(("closed", what))) => format!("closed by winding numbers ({what})"),
        (_, Some(("welded", what))) => format!("near points joined ({what})"),
        (_, Some(("wrapped", what))) => format!("wrapped ({what})"),
        (_, Some(("remeshed", what))) => format!("remeshed ({what})"),
        (path, _) => path.to_owned(),
    });
    let surfaces: Vec<String> = surfaces.collect();
    let state = state_words(info.state);
    console.line(&format!("{}: {state}, from {}", path.display(), surfaces.join(", ")));
    if console.is_verbose() {
        for row in &info.journal {
            let of = (row.subdomain).map_or(String::new(), |rank| format!(" (sub-domain {rank})"));
            let step = row.step.clone() + &of;
            console.line(&format!("  {step:<48} {:>9.2} s", row.seconds));
        }
        let seconds: f64 = info.journal.iter().map(|row| row.seconds).sum();
        console.line(&format!("  {:<48} {seconds:>9.2} s", "all steps"));
    }
    if let Some(planned) = Tasks::of(path).status()? {
        tasks::print(&planned, console);
        return Ok(());
    }
    if !info.finished {
        console.line(&format!("`tetdb resume {}` continues it", quoted(path)));
        return Ok(());
    }
    console.line(&format!(
        "{}, {}, {} in {}; {} on disk",
        count(info.tets, "tetrahedron"),
        count(info.vertices, "vertex"),
        match info.input_triangles {
            Some(n) => count(n, "input triangle"),
            // Faces between sub-domains count in both of them.
            None => {
                let n: u64 = info.subdomains.iter().map(|part| part.facets).sum();
                format!("at most {}", count(n, "input triangle"))
            }
        },
        count(info.subdomains.len() as u64, "sub-domain"),
        memory::show(info.bytes_on_disk()),
    ));
    console.line(&format!("box {}", words::bounds(info.bounds)));
    console.line(&format!("labels: {}", words::listed(&info.labels)));
    if !info.wires.is_empty() {
        let edges = count(info.wires.iter().map(|label| label.edges).sum::<u64>(), "edge");
        let points = count(info.wires.iter().map(|label| label.points).sum::<u64>(), "point");
        console.line(&format!("inside: {edges} and {points}"));
    }
    print_bytes(&info, console);
    print_subdomains(&info, console);
    print_regions(&info.regions, &info.labels, console);
    for pair in &info.periodic {
        console.line(&format!("periodic {pair}"));
    }
    for field in &info.fields {
        console.line(&format!("field {}", super::field::line(field)));
    }
    for line in quality_lines(&info.quality()) {
        console.line(&line);
    }
    console.line(&format!("digest {}", info.digest));
    Ok(())
}

/// Prints the bytes of each part of the store.
fn print_bytes(info: &StoreInfo, console: &Console) {
    if info.n_previous > 0 || info.previous_bytes > 0 {
        console.line(&format!(
            "previous version of {}, for `tetdb resaturate --undo`: {}",
            count(info.n_previous as u64, "sub-domain"),
            memory::show(info.previous_bytes)
        ));
    }
    if !info.versions.is_empty() {
        console.line(&format!(
            "{}, of files that nothing else needs: {}",
            count(info.versions.len() as u64, "version"),
            memory::show(info.version_bytes)
        ));
    }
    if !console.is_verbose() {
        return;
    }
    for (what, bytes) in [
        ("sub-domains", info.bytes),
        ("coarse snapshots, from which sub-domains can be meshed again", info.coarse_bytes),
        ("catalog, with the wanted sizes", info.catalog_bytes),
    ] {
        // In a small mesh, the minimum size of a file hides the bytes per tetrahedron.
        let each = match info.tets >= TETS_MEASURED {
            true => format!(", {} bytes per tetrahedron", short(bytes as f64 / info.tets as f64)),
            false => String::new(),
        };
        console.line(&format!("{what}: {}{each}", memory::show(bytes)));
    }
}

fn print_subdomains(info: &StoreInfo, console: &Console) {
    if info.subdomains.len() == 1 {
        return;
    }
    for part in info.subdomains.iter().take(SUBDOMAINS_LISTED) {
        console.line(&format!(
            "  sub-domain {:>4}: {:>10} tetrahedra, {:>7} interface faces, {}, worst q {}",
            part.id,
            part.tets,
            part.interface_faces,
            neighbors(part.neighbors.as_deref().unwrap_or_default()),
            worst(part.worst_q)
        ));
    }
    if info.subdomains.len() > SUBDOMAINS_LISTED {
        console.line(&format!("  ... {} sub-domains in all", info.subdomains.len()));
    }
}

/// The numbers of a sub-domain's neighbors; of many, only the first.
fn neighbors(list: &[tetdb_engine::data::schema::catalog::NeighborRow]) -> String {
    let shown: Vec<String> =
        list.iter().take(NEIGHBORS_LISTED).map(|n| n.subdomain.to_string()).collect();
    let rest = if list.len() > NEIGHBORS_LISTED { ", …" } else { "" };
    match shown.is_empty() {
        true => "no neighbor".to_owned(),
        false => format!(
            "{} {}{rest}",
            if list.len() == 1 { "neighbor" } else { "neighbors" },
            shown.join(", ")
        ),
    }
}

/// Prints few regions one by one, many as a summary.
fn print_regions(regions: &[RegionInfo], labels: &[String], console: &Console) {
    if regions.len() > REGIONS_LISTED {
        let (filled, empty): (Vec<_>, Vec<_>) = regions.iter().partition(|r| r.row.filled);
        let volume = |list: &[&RegionInfo]| short(list.iter().map(|r| r.row.volume).sum());
        console.line(&format!(
            "{} filled, volume {} in all; {} empty, volume {}; --json lists them",
            count(filled.len() as u64, "region"),
            volume(&filled),
            empty.len(),
            volume(&empty)
        ));
        return;
    }
    for RegionInfo { row, name, .. } in regions {
        let (number, what) = match row.filled {
            true => (row.region.to_string(), count(row.tets, "tetrahedron")),
            false => ("-".to_owned(), "empty".to_owned()),
        };
        let around = row.labels.iter().filter_map(|&label| labels.get(label as usize));
        let around: Vec<&String> = around.collect();
        let called = name.as_ref().map_or(String::new(), |name| format!(" ({name})"));
        console.line(&format!(
            "  region {number:>4}{called}: volume {}, {what}, within {}",
            short(row.volume),
            words::listed(&around)
        ));
    }
}

fn state_words(state: StoreState) -> &'static str {
    match state {
        StoreState::Verified => "finished and verified",
        StoreState::Sealed => "finished, not verified",
        StoreState::New => "unfinished (nothing imported yet)",
        StoreState::Imported => "unfinished (surface imported)",
        StoreState::Coarse => "unfinished (coarse mesh done)",
        StoreState::Bisected => "unfinished (cut into sub-domains)",
    }
}

/// Percentage of tetrahedra with a quality below 2.
pub fn share_below_two(q: &QualityRow) -> f64 {
    100.0 * q.bins[0] as f64 / q.bins.iter().sum::<u64>().max(1) as f64
}

/// The table of the paper: share and number of tetrahedra by quality.
fn quality_lines(q: &QualityRow) -> Vec<String> {
    let total: u64 = q.bins.iter().sum();
    let mut lines = vec!["quality q (1 is regular, larger is worse):".to_owned()];
    for (i, &n) in q.bins.iter().enumerate().filter(|(_, n)| **n > 0) {
        let range = quality_range(i, q.bins.len());
        lines.push(format!("  {range:<11} {:>9} %  {n:>12}", share(n, total)));
    }
    lines.push(format!(
        "  worst {}; dihedral angles {} to {} degrees",
        worst(q.worst),
        short(q.dihedral[0].to_degrees()),
        short(q.dihedral[1].to_degrees())
    ));
    lines
}

/// A share in percent, in at most four digits. Never rounded up to 100 %.
fn share(n: u64, total: u64) -> String {
    let percent = 100.0 * n as f64 / total.max(1) as f64;
    if n < total && percent >= 99.995 {
        return (2..12)
            .map(|digits| format!("{percent:.digits$}"))
            .find(|text| !text.starts_with("100"))
            .unwrap_or_else(|| "99.9999999".to_owned());
    }
    short(percent)
}
