//! A page about a mesh, for a web browser.

use std::collections::BTreeMap;
use std::path::Path;
use tetdb_schema::code::Code;

use serde::Serialize;
use serde_json::{Value, json};

use super::store::open_finished;
use super::targets::{check_target, inputs_of};
use super::{ChunkCounts, Error, Settings, Store, guarded};

use crate::view;
use crate::view::page::{self, Page, Surface};
use crate::view::{Cross, Excess, Patch, SceneCut, Statistics};
use tetdb_base::storage::{Budget, attempt};
use tetdb_schema::catalog::{JournalRow, QUALITY_BINS};
use tetdb_store::query::QuerySession;
use tetdb_store::store::Catalog;

/// Qualities from this value on have the last color, as in pictures.
const QUALITY_MOST: f32 = 3.0;
/// Largest number of labels listed for a region.
const LABELS_NAMED: usize = 24;

/// Counts of a written page.
#[derive(Clone, Copy, Debug, Serialize)]
#[non_exhaustive]
pub struct Reported {
    /// Length of the file.
    pub bytes: u64,
    /// Triangles on the boundary.
    pub boundary: ShownTriangles,
    /// Triangles between sub-domains.
    pub interfaces: ShownTriangles,
    /// Chunks read for the page.
    pub chunks: ChunkCounts,
}

/// Number of triangles shown of a surface. Large surfaces are coarsened.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ShownTriangles {
    /// Triangles of the surface.
    pub of: u64,
    /// Triangles in the page.
    pub shown: u64,
}

impl ShownTriangles {
    fn from_scene(scene: &Value, name: &str) -> Self {
        let count = |key: &str| scene[name][key].as_u64().unwrap_or_default();
        Self { of: count("of"), shown: count("shown") }
    }
}

impl Store {
    /// Writes an `.html` page about the mesh for a web browser: numbers, charts, surfaces that can be turned, cuts.
    ///
    /// Errors: `unknown-format`; damage; the disk.
    pub fn report(&self, out: impl AsRef<Path>) -> Result<Reported, Error> {
        guarded(self.settings(), || {
            check_target(out.as_ref(), &inputs_of(self.path()))?;
            write_page(self.path(), out.as_ref(), self.settings())
        })
    }
}

/// Writes a page about the store at `path`.
fn write_page(path: &Path, out: &Path, settings: &Settings) -> Result<Reported, Error> {
    if !page::is_page(out) {
        let what = "a report is a page for a browser, and its name must say so";
        let error = Error::new(Code::UnknownFormat, what).at(out.display());
        return Err(error.with_help(format!("end the name with {}", page::ENDINGS)));
    }
    let cap = settings.cap()?;
    let mut store = open_finished(path, settings)?;
    let title = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut data = of_catalog(path, &mut store, &title)?;
    // The remaining memory is for text and tables of the page.
    let (mut session, budget) =
        (QuerySession::open(store, &Budget::new(cap / 2))?, Budget::new(cap / 8 * 3));
    attempt(|| -> Result<Reported, Error> {
        let statistics = view::statistics(&mut session, &budget, &|done, total| {
            settings.count("measure", done, total, "tetrahedra");
        })?;
        let mut page = Page::new(out, &title, session.bounds())?;
        data["scene"] =
            surfaces((&mut session, &budget), &mut page, &statistics, &|done, total| {
                settings.count("cut", done, total, "cuts")
            })?;
        data["statistics"] = json!(statistics);
        Ok(Reported {
            bytes: page.finish(&data)?,
            boundary: ShownTriangles::from_scene(&data["scene"], "boundary"),
            interfaces: ShownTriangles::from_scene(&data["scene"], "interfaces"),
            chunks: session.measures(),
        })
    })?
}

impl Store {
    /// Computes the excess of all tetrahedra: their quality over the least that the surface allows. Reads the whole mesh.
    ///
    /// # Errors
    /// Damage; too little memory.
    pub fn excess(&self) -> Result<Excess, Error> {
        let settings = self.settings();
        guarded(settings, || {
            let cap = settings.cap()?;
            let open = open_finished(self.path(), settings)?;
            let mut session = QuerySession::open(open, &Budget::new(cap / 2))?;
            let report = |done, total| settings.count("measure", done, total, "tetrahedra");
            Ok(view::statistics(&mut session, &Budget::new(cap / 8 * 3), &report)?.excess)
        })
    }
}

/// Data of the page from the catalog.
pub(super) fn of_catalog(path: &Path, catalog: &mut Catalog, title: &str) -> Result<Value, Error> {
    let (state, job, labels) = (catalog.state()?, catalog.job()?, catalog.labels()?);
    let (rows, journal, topology) =
        (catalog.subdomains()?, catalog.journal()?, catalog.topology()?);
    let mut bins = [0u64; QUALITY_BINS];
    let mut dihedral = [f64::INFINITY, 0.0f64];
    for row in &rows {
        for (sum, n) in bins.iter_mut().zip(row.quality.bins) {
            *sum += n;
        }
        let [least, most] = row.quality.dihedral.map(f64::to_degrees);
        dihedral = [dihedral[0].min(least), dihedral[1].max(most)];
    }
    let predicted = predictions(&journal);
    let subdomains = rows.iter().map(|row| {
        let neighbors = topology.iter().find(|t| t.subdomain == row.rank);
        json!({
            "id": row.rank, "tets": row.tets, "vertices": row.vertices, "facets": row.facets,
            "faces": row.interface_faces, "worst": row.quality.worst, "bytes": row.bytes,
            "near": row.quality.bins[0] as f64 / row.tets.max(1) as f64,
            "neighbors": neighbors.map_or(0, |t| t.neighbors.len()), "predicted": predicted.get(&row.rank),
            "low": row.bounds[0], "high": row.bounds[1],
        })
    });
    let subdomains: Vec<Value> = subdomains.collect();
    let called = catalog.region_names()?;
    let regions = catalog.regions()?.into_iter().map(|r| {
        let names = r.labels.iter().take(LABELS_NAMED);
        let names: Vec<&str> = names
            .filter_map(|&l| labels.get(l as usize).map(String::as_str))
            .collect();
        let name = (r.region as usize).checked_sub(1).and_then(|n| called.get(n));
        json!({ "region": r.region, "name": name, "filled": r.filled, "tets": r.tets, "volume": r.volume, "labels": names })
    });
    let regions: Vec<Value> = regions.collect();
    let interfaces = catalog.interfaces()?.into_iter();
    let interfaces: Vec<Value> =
        interfaces.map(|i| json!([i.cut, i.low, i.high, i.faces])).collect();
    let sum = |part: &dyn Fn(&tetdb_schema::catalog::SubdomainRow) -> u64| {
        rows.iter().map(part).sum::<u64>()
    };
    Ok(json!({
        "title": title, "store": path.display().to_string(), "state": state, "version": job.tool_version,
        "surfaces": job.surfaces.iter().map(|s| s.path.as_str()).collect::<Vec<_>>(),
        "options": serde_json::from_str::<Value>(&job.options).unwrap_or(Value::Null),
        "digest": catalog.digest()?[0].to_string(),
        "counts": {
            "tets": sum(&|r| r.tets), "vertices": sum(&|r| r.vertices), "triangles": catalog.n_input_triangles()?,
            "subdomains": rows.len(), "bytes": sum(&|r| r.bytes), "volume": rows.iter().map(|r| r.volume).sum::<f64>(),
            "worst": rows.iter().map(|r| r.quality.worst).fold(0.0, f64::max), "dihedral": dihedral,
        },
        "bins": bins, "labels": labels, "regions": regions, "subdomains": subdomains, "interfaces": interfaces,
        "steps": steps(&journal),
    }))
}

/// Predicted tetrahedra of each sub-domain, by rank.
fn predictions(journal: &[JournalRow]) -> BTreeMap<u32, f64> {
    let mut predicted = BTreeMap::new();
    for row in journal.iter().filter(|r| r.step.contains("seal")) {
        let found = row.measures.iter().find(|m| m.name == "predicted_tets");
        if let (Some(rank), Some(measure)) = (row.subdomain, found) {
            predicted.insert(rank, measure.value);
        }
    }
    predicted
}

/// Groups the steps by kind, so that names are written once. Each step has its position, its seconds and its measures.
fn steps(journal: &[JournalRow]) -> Value {
    let mut kinds: Vec<(&str, Vec<&str>)> = Vec::new();
    for row in journal {
        let at = kinds.iter().position(|(step, _)| *step == row.step);
        let at = at.unwrap_or_else(|| {
            kinds.push((&row.step, Vec::new()));
            kinds.len() - 1
        });
        let names = &mut kinds[at].1;
        for measure in &row.measures {
            if !names.contains(&measure.name.as_str()) {
                names.push(&measure.name);
            }
        }
    }
    let kinds = kinds.into_iter().map(|(step, names)| {
        let rows = journal.iter().enumerate().filter(|(_, row)| row.step == step);
        let rows = rows.map(|(place, row)| {
            let value =
                |name: &&str| row.measures.iter().find(|m| m.name == **name).map(|m| m.value);
            let mut cells = vec![json!(place), json!(row.seconds), json!(row.subdomain)];
            cells.extend(names.iter().map(|name| json!(value(name))));
            Value::Array(cells)
        });
        let rows: Vec<Value> = rows.collect();
        let names: Vec<&str> = std::iter::once("subdomain").chain(names).collect();
        json!({ "step": step, "names": names, "rows": rows })
    });
    kinds.collect()
}

/// Adds all surfaces to the page. Returns their description for the page.
fn surfaces(
    (session, budget): (&mut QuerySession, &Budget),
    page: &mut Page,
    statistics: &Statistics,
    progress: &dyn Fn(u64, u64),
) -> Result<Value, Error> {
    let bounds = session.bounds();
    let mut scene = view::scene(std::slice::from_mut(session), budget);
    let boundary = scene.boundary([0, 1])?;
    let channels = [
        column(&boundary, |s| s.subdomain),
        column(&boundary, |s| s.region),
        column(&boundary, |s| s.label),
    ];
    page.surface("boundary", &surface(&boundary, &channels))?;
    let boundary = shown(&boundary);
    let interfaces = scene.interfaces([0, 1])?;
    let channels = [column(&interfaces, |ranks| ranks[0]), column(&interfaces, |ranks| ranks[1])];
    page.surface("interfaces", &surface(&interfaces, &channels))?;
    let interfaces = shown(&interfaces);
    let places = scene.places();
    let (total, mut cuts) = (places.len() as u64, Vec::new());
    for (done, place) in (1..).zip(places.iter().copied()) {
        let cut = scene.cut(place)?;
        let number = cuts.len() % (places.len() / 3);
        let name = format!("cut-{}-{number}", ["x", "y", "z"][cut.axis as usize]);
        page.surface(&name, &surface(&cut.patch, &of_cut(&cut, statistics)))?;
        let SceneCut { axis, at, patch } = cut;
        cuts.push(json!({ "axis": axis, "place": number, "at": at, "of": patch.of, "shown": patch.triangles.len(), "joined": patch.cell }));
        progress(done, total);
    }
    let extent = bounds.high - bounds.low;
    let least = extent.to_array().into_iter().enumerate();
    // The first cut shown is across the shortest side, because it shows most. Along y it is seen from the low side.
    let axis = least.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(1, |(axis, _)| axis);
    Ok(json!({
        "low": bounds.low.to_array(), "high": bounds.high.to_array(), "axis": axis, "quality": [1.0, QUALITY_MOST],
        "size": statistics.size, "boundary": boundary, "interfaces": interfaces, "cuts": cuts,
    }))
}

pub(super) fn column<T>(patch: &Patch<T>, of: impl Fn(&T) -> u32) -> Vec<u32> {
    patch.tags.iter().map(of).collect()
}

fn surface<'a, T>(patch: &'a Patch<T>, channels: &'a [Vec<u32>]) -> Surface<'a> {
    Surface { points: &patch.points, triangles: &patch.triangles, channels }
}

fn shown<T>(patch: &Patch<T>) -> Value {
    json!({ "of": patch.of, "shown": patch.triangles.len(), "joined": patch.cell })
}

/// One bit for each drawn edge.
pub(super) fn edge_bits(cross: &Cross) -> u32 {
    (0..3).map(|k| u32::from(cross.edges[k]) << k).sum()
}

/// Values for each triangle of a cut: sub-domain, region, quality and size as one byte each, and one bit for each drawn edge.
fn of_cut(cut: &SceneCut, statistics: &Statistics) -> [Vec<u32>; 5] {
    let byte = |x: f64, [least, most]: [f64; 2]| {
        let share = (x - least) / (most - least).max(f64::MIN_POSITIVE);
        (share.clamp(0.0, 1.0) * 255.0).round() as u32
    };
    let quality = [1.0, f64::from(QUALITY_MOST)];
    [
        column(&cut.patch, |c| c.subdomain),
        column(&cut.patch, |c| c.region),
        column(&cut.patch, |c| byte(f64::from(c.quality), quality)),
        column(&cut.patch, |c| byte(f64::from(c.size), statistics.size)),
        column(&cut.patch, edge_bits),
    ]
}
