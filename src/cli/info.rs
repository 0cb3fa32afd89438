//! `info`: what a store holds.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};

use super::args::InfoArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::tasks;
use super::words::{self, count};
use tetdb_base::geom::{Aabb, Point, short};
use tetdb_engine::api::Tasks;
use tetdb_engine::api::page::measure_excess;
use tetdb_engine::pipeline;
use tetdb_engine::view::Excess;
use tetdb_schema::catalog::{QualityRow, RegionRow, StoreState, SubdomainRow};
use tetdb_store::store::Catalog;

/// Regions listed for people.
const REGIONS_LISTED: usize = 12;
/// Bytes per tetrahedron are shown of meshes with so many.
const TETS_MEASURED: u64 = 10_000;
/// Sub-domains listed for people.
const SUBDOMAINS_LISTED: usize = 32;

pub fn run(args: &InfoArgs, console: &Console) -> Result<u8, Failure> {
    // The rows of a catalog are far less than the least cap.
    let memory = memory::asked(args.of.memory.as_deref())?;
    let path = &args.of.store;
    let excess =
        (args.excess).then(|| measure_excess(path, &console.settings(memory, None))).transpose()?;
    console.done();
    if console.is_json() {
        let mut all = object(path)?;
        if let Some(excess) = excess {
            all["excess"] = json!(excess);
        }
        console.answer(&all);
        return Ok(0);
    }
    print(path, console)?;
    if let Some(Excess { worst, above_two }) = excess {
        console.line(&format!(
            "excess (q over the least that the surface allows): {} at most; above 2: {}",
            short(worst),
            count(above_two, "tetrahedron").replace("tetrahedrons", "tetrahedra")
        ));
    }
    Ok(0)
}

/// Everything, for programs.
pub fn object(path: &Path) -> Result<Value, Failure> {
    let mut store = Catalog::open(path)?;
    let catalog = &mut store;
    let (state, job) = (catalog.state()?, catalog.job()?);
    let rows = catalog.subdomains()?;
    let topology = catalog.topology()?;
    let coarse = catalog.coarse_snapshots()?;
    let coarse_of = |rank| coarse.iter().find(|c| c.rank == rank).map(|c| c.bytes);
    let mut sizes = BTreeMap::new();
    for row in &rows {
        if let Some(text) = pipeline::asked(catalog, row.rank)? {
            sizes.insert(row.rank, serde_json::from_str(&text).unwrap_or(Value::Null));
        }
    }
    let subdomains: Vec<Value> = rows
        .iter()
        .map(|row| {
            let neighbors = topology.iter().find(|t| t.subdomain == row.rank);
            json!({
                "id": row.rank, "state": row.state, "tets": row.tets, "vertices": row.vertices, "facets": row.facets,
                "interface_faces": row.interface_faces, "digest": hex(row.digest), "interface_digest": hex(row.interface_digest),
                "neighbors": neighbors.map(|t| &t.neighbors), "quality": row.quality, "worst_q": row.quality.worst,
                "volume": row.volume, "bounds": row.bounds, "bytes": row.bytes, "coarse_bytes": coarse_of(row.rank), "sizes": sizes.get(&row.rank),
            })
        })
        .collect();
    let stages = catalog.stages()?.into_iter().map(
        |s| json!({ "cut": s.cut, "stage": s.stage, "tets": s.row.tets, "bytes": s.row.bytes }),
    );
    let stages: Vec<Value> = stages.collect();
    let planned = Tasks::of(path).status()?;
    Ok(json!({
        "schema": 1, "store": path.display().to_string(), "state": state, "finished": state.is_finished(),
        "surfaces": job.surfaces, "options": serde_json::from_str::<Value>(&job.options).unwrap_or(Value::Null),
        "tool_version": job.tool_version, "labels": catalog.labels()?, "wires": named_wires(catalog)?, "regions": named_regions(catalog)?,
        "tets": rows.iter().map(|r| r.tets).sum::<u64>(), "input_triangles": catalog.n_input_triangles()?,
        "vertices": rows.iter().map(|r| r.vertices).sum::<u64>(), "bounds": bounds(&rows),
        "bytes": rows.iter().map(|r| r.bytes).sum::<u64>(),
        "coarse_bytes": coarse.iter().map(|c| c.bytes).sum::<u64>(),
        "previous_bytes": catalog.previous()?.iter().map(|r| r.bytes).sum::<u64>(),
        "catalog_bytes": catalog.file_bytes()?, "digest": digest(&rows),
        "stages": stages, "subdomains": subdomains, "interfaces": catalog.interfaces()?,
        "tasks": planned.as_ref().map(tasks::object), "journal": catalog.journal()?,
    }))
}

/// Of each label of embedded edges and points its name, and how many of both it has.
fn named_wires(catalog: &mut Catalog) -> Result<Vec<Value>, Failure> {
    let (wires, labels) = (catalog.wires()?, catalog.labels()?);
    let mut counts = std::collections::BTreeMap::<u32, [u64; 2]>::new();
    for [.., label] in wires.edges {
        counts.entry(label).or_default()[0] += 1;
    }
    for [_, label] in wires.points {
        counts.entry(label).or_default()[1] += 1;
    }
    let named = |(label, [edges, points]): (u32, [u64; 2])| {
        let name = labels.get(label as usize);
        json!({ "name": name, "edges": edges, "points": points })
    };
    Ok(counts.into_iter().map(named).collect())
}

/// The regions' rows, each with its name or null.
fn named_regions(catalog: &mut Catalog) -> Result<Vec<Value>, Failure> {
    let (rows, names) = (catalog.regions()?, catalog.region_names()?);
    let named = |row: RegionRow| {
        let name = region_name(&row, &names);
        let mut value = json!(row);
        value["name"] = json!(name);
        value
    };
    Ok(rows.into_iter().map(named).collect())
}

/// What a region is called, of the names from region 1 on.
fn region_name<'a>(row: &RegionRow, names: &'a [String]) -> Option<&'a str> {
    let name = names.get((row.region as usize).checked_sub(1)?)?;
    (!name.is_empty()).then_some(name)
}

/// Low and high corner of the box around all of them.
fn bounds(rows: &[SubdomainRow]) -> [[f64; 3]; 2] {
    let each = (rows.iter()).map(|r| Aabb::around(r.bounds.map(Point::from_array)));
    let all = each.fold(Aabb::EMPTY, Aabb::union);
    [all.low, all.high].map(|p| p.to_array())
}

fn sum(digests: impl Iterator<Item = [u64; 2]>) -> [u64; 2] {
    digests.fold([0; 2], |s, d| [s[0].wrapping_add(d[0]), s[1].wrapping_add(d[1])])
}

/// The digest of the whole mesh.
pub fn digest(rows: &[SubdomainRow]) -> String {
    hex(sum(rows.iter().map(|r| r.digest)))
}

/// A digest as it is shown.
pub fn hex(digest: [u64; 2]) -> String {
    tetdb_schema::digest::Digest { lanes: digest }.to_string()
}

/// The same for people.
pub fn print(path: &Path, console: &Console) -> Result<(), Failure> {
    let mut store = Catalog::open(path)?;
    let catalog = &mut store;
    let (state, job) = (catalog.state()?, catalog.job()?);
    let surfaces: Vec<&str> = job.surfaces.iter().map(|s| s.path.as_str()).collect();
    console.line(&format!(
        "{}: {}, from {}",
        path.display(),
        state_words(state),
        surfaces.join(", ")
    ));
    if console.is_verbose() {
        let journal = catalog.journal()?;
        for row in &journal {
            let of = (row.subdomain).map_or(String::new(), |rank| format!(" (sub-domain {rank})"));
            let step = row.step.clone() + &of;
            console.line(&format!("  {step:<48} {:>9.2} s", row.seconds));
        }
        let seconds: f64 = journal.iter().map(|row| row.seconds).sum();
        console.line(&format!("  {:<48} {seconds:>9.2} s", "all steps"));
    }
    if let Some(planned) = Tasks::of(path).status()? {
        tasks::print(&planned, console);
        return Ok(());
    }
    if !state.is_finished() {
        console.line(&format!("`tetdb resume {}` goes on with it", path.display()));
        return Ok(());
    }
    let rows = catalog.subdomains()?;
    let tets: u64 = rows.iter().map(|r| r.tets).sum();
    let bytes = rows.iter().map(|r| r.bytes).sum::<u64>()
        + (catalog.coarse_snapshots()?.iter()).map(|c| c.bytes).sum::<u64>()
        + catalog.previous()?.iter().map(|r| r.bytes).sum::<u64>()
        + catalog.file_bytes()?;
    console.line(&format!(
        "{tets} tetrahedra, {} vertices, {} in {}; {} on disk",
        rows.iter().map(|r| r.vertices).sum::<u64>(),
        match catalog.n_input_triangles()? {
            Some(n) => count(n, "input triangle"),
            // Those between sub-domains are in both.
            None =>
                format!("at most {} input triangles", rows.iter().map(|r| r.facets).sum::<u64>()),
        },
        count(rows.len() as u64, "sub-domain"),
        memory::show(bytes),
    ));
    console.line(&format!("box {}", words::bounds(bounds(&rows))));
    let labels = catalog.labels()?;
    console.line(&format!("labels: {}", words::listed(&labels)));
    let wires = catalog.wires()?;
    if !wires.edges.is_empty() || !wires.points.is_empty() {
        let (edges, points) = (wires.edges.len() as u64, wires.points.len() as u64);
        let (edges, points) = (count(edges, "edge"), count(points, "point"));
        console.line(&format!("inside: {edges} and {points}"));
    }
    print_bytes(catalog, &rows, console)?;
    print_subdomains(catalog, &rows, console)?;
    let names = catalog.region_names()?;
    print_regions(&catalog.regions()?, &names, &labels, console);
    for line in quality_lines(&merged(rows.iter().map(|r| &r.quality))) {
        console.line(&line);
    }
    console.line(&format!("digest {}", digest(&rows)));
    Ok(())
}

/// What each part of the store takes.
fn print_bytes(
    catalog: &mut Catalog,
    rows: &[SubdomainRow],
    console: &Console,
) -> Result<(), Failure> {
    let before = catalog.previous()?;
    if !before.is_empty() {
        console.line(&format!(
            "previous version of {}, for `tetdb resaturate --undo`: {}",
            count(before.len() as u64, "sub-domain"),
            memory::show(before.iter().map(|r| r.bytes).sum())
        ));
    }
    if !console.is_verbose() {
        return Ok(());
    }
    let tets: u64 = rows.iter().map(|r| r.tets).sum();
    let coarse: u64 = catalog.coarse_snapshots()?.iter().map(|c| c.bytes).sum();
    for (what, bytes) in [
        ("sub-domains", rows.iter().map(|r| r.bytes).sum()),
        ("coarse snapshots, from which sub-domains can be meshed again", coarse),
        ("catalog, with the wanted sizes", catalog.file_bytes()?),
    ] {
        // Of a small mesh the least a file takes says nothing of a tetrahedron.
        let each = match tets >= TETS_MEASURED {
            true => format!(", {} bytes per tetrahedron", short(bytes as f64 / tets as f64)),
            false => String::new(),
        };
        console.line(&format!("{what}: {}{each}", memory::show(bytes)));
    }
    Ok(())
}

fn print_subdomains(
    catalog: &mut Catalog,
    rows: &[SubdomainRow],
    console: &Console,
) -> Result<(), Failure> {
    if rows.len() == 1 {
        return Ok(());
    }
    let topology = catalog.topology()?;
    for row in rows.iter().take(SUBDOMAINS_LISTED) {
        let neighbors = topology.iter().find(|t| t.subdomain == row.rank);
        let neighbors = neighbors.map_or(0, |t| t.neighbors.len());
        console.line(&format!(
            "  sub-domain {:>4}: {:>10} tetrahedra, {:>7} interface faces, {}, worst q {}",
            row.rank,
            row.tets,
            row.interface_faces,
            count(neighbors as u64, "neighbor"),
            worst(row.quality.worst)
        ));
    }
    if rows.len() > SUBDOMAINS_LISTED {
        console.line(&format!("  ... {} sub-domains in all", rows.len()));
    }
    Ok(())
}

/// Few regions one by one, many as a whole.
fn print_regions(regions: &[RegionRow], names: &[String], labels: &[String], console: &Console) {
    if regions.len() > REGIONS_LISTED {
        let (filled, empty): (Vec<_>, Vec<_>) = regions.iter().partition(|r| r.filled);
        let volume = |list: &[&RegionRow]| short(list.iter().map(|r| r.volume).sum());
        console.line(&format!(
            "{} filled, volume {} in all; {} empty, volume {}; --json lists them",
            count(filled.len() as u64, "region"),
            volume(&filled),
            empty.len(),
            volume(&empty)
        ));
        return;
    }
    for region in regions {
        let (name, what) = match region.filled {
            true => (
                region.region.to_string(),
                count(region.tets, "tetrahedron").replace("tetrahedrons", "tetrahedra"),
            ),
            false => ("-".to_owned(), "empty".to_owned()),
        };
        let around = region.labels.iter();
        let around = around.filter_map(|&label| labels.get(label as usize));
        let around: Vec<&String> = around.collect();
        let called = region_name(region, names).map_or(String::new(), |name| format!(" ({name})"));
        console.line(&format!(
            "  region {name:>4}{called}: volume {}, {what}, within {}",
            short(region.volume),
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

fn merged<'a>(rows: impl Iterator<Item = &'a QualityRow>) -> QualityRow {
    let mut all = QualityRow {
        bins: Default::default(),
        worst: 0.0,
        worst_tet: 0,
        dihedral: [f64::INFINITY, 0.0],
    };
    for row in rows {
        for (sum, n) in all.bins.iter_mut().zip(row.bins) {
            *sum += n;
        }
        all.worst = all.worst.max(row.worst);
        all.dihedral = [all.dihedral[0].min(row.dihedral[0]), all.dihedral[1].max(row.dihedral[1])];
    }
    all
}

/// Percent of tetrahedra with a quality below 2.
pub fn share_below_two(q: &QualityRow) -> f64 {
    100.0 * q.bins[0] as f64 / q.bins.iter().sum::<u64>().max(1) as f64
}

/// The paper's table: share and number of tetrahedra by quality.
fn quality_lines(q: &QualityRow) -> Vec<String> {
    let total: u64 = q.bins.iter().sum();
    let mut lines = vec!["quality q (1 is regular, larger is worse):".to_owned()];
    for (i, &n) in q.bins.iter().enumerate().filter(|(_, n)| **n > 0) {
        let to = if i + 1 == q.bins.len() { "inf".to_owned() } else { (i + 2).to_string() };
        lines.push(format!("  [{:>2}, {to:>3}[ {:>9} %  {n:>12}", i + 1, share(n, total)));
    }
    lines.push(format!(
        "  worst {}; dihedral angles {} to {} degrees",
        worst(q.worst),
        short(q.dihedral[0].to_degrees()),
        short(q.dihedral[1].to_degrees())
    ));
    lines
}

/// A share in percent, in at most four digits, but never 100 % when it is not all.
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

/// A quality in four digits, or as many as keep it in its row of the table.
fn worst(q: f64) -> String {
    let text = short(q);
    let is_in_its_row = text.parse::<f64>().is_ok_and(|shown| shown.floor() == q.floor());
    match is_in_its_row || q >= 10.0 {
        true => text,
        false => (4..16)
            .map(|digits| format!("{q:.digits$}"))
            .find(|text| text.parse::<f64>().is_ok_and(|shown| shown.floor() == q.floor()))
            .unwrap_or(text),
    }
}
