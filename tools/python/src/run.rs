//! New meshes.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use serde_json::json;
use tetdb::{
    Bytes, CancelToken, EmbedOutside, Existing, Import, Mesher, Optimize, Regions, Settings, Store,
    Subdomains,
};

use crate::failure::Failure;
use crate::sizes::SizeWords;
use crate::surface::Surface;
use crate::watched::{Board, Listener, watched};

/// What shapes a mesh, as the Python half words it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct JobWords<'py> {
    sizes: SizeWords<'py>,
    regions: Option<String>,
    seeds: Vec<([f64; 3], Option<String>)>,
    holes: Vec<[f64; 3]>,
    refine_surface: bool,
    skips_outside: bool,
    optimize: String,
    subdomains: Option<u32>,
    keep_coarse: bool,
}

/// How it is done.
#[derive(FromPyObject, Clone, Default)]
#[pyo3(from_item_all)]
pub struct SettingWords {
    pub memory: Option<u64>,
    pub threads: Option<usize>,
    /// The version of stores to read.
    pub version: Option<String>,
}

impl SettingWords {
    pub fn settings(&self, token: &CancelToken, board: Option<&Arc<Board>>) -> Settings {
        let mut settings = Settings::new().cancel(token);
        if let Some(bytes) = self.memory {
            settings = settings.memory(Bytes(bytes));
        }
        if let Some(n) = self.threads {
            settings = settings.threads(n);
        }
        if let Some(name) = &self.version {
            settings = settings.at_version(name);
        }
        match board {
            Some(board) => settings.progress(board.listener()),
            None => settings,
        }
    }
}

fn mesher(py: Python<'_>, surface: &Surface, job: &JobWords<'_>) -> PyResult<Mesher> {
    let unknown = || Failure::internal("a word of an option is not known").raised(py);
    let regions = match job.regions.as_deref() {
        None => None,
        Some("parity") => Some(Regions::Parity),
        Some("all") => Some(Regions::All),
        Some("outer") => Some(Regions::Outer),
        Some("by-orientation") => Some(Regions::ByOrientation),
        Some("seeds") => Some(Regions::Seeds),
        Some("all-but-holes") => Some(Regions::AllButHoles),
        Some(_) => return Err(unknown()),
    };
    let optimize = match job.optimize.as_str() {
        "none" => Optimize::None,
        "delaunay" => Optimize::Delaunay,
        "full" => Optimize::Full,
        _ => return Err(unknown()),
    };
    let subdomains = job.subdomains.map_or(Subdomains::Auto, Subdomains::Exactly);
    let mut mesher = Mesher::new(tetdb::Surface::clone(&surface.inner))
        .sizes(job.sizes.sizes(py)?)
        .optimize(optimize)
        .subdomains(subdomains)
        .keep_coarse(job.keep_coarse)
        .refine_surface(job.refine_surface)
        .embed_outside(match job.skips_outside {
            true => EmbedOutside::Skip,
            false => EmbedOutside::Error,
        });
    if let Some(regions) = regions {
        mesher = mesher.regions(regions);
    }
    for (point, name) in &job.seeds {
        mesher = mesher.region_seed(*point, name.as_deref());
    }
    for point in &job.holes {
        mesher = mesher.hole(*point);
    }
    Ok(mesher)
}

/// Meshes into a new store, or begins one. Whether the finished mesh of the same job is returned, or any other replaced, `replace` says.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "called by the Python half alone")]
pub fn mesh(
    py: Python<'_>,
    surface: &Surface,
    path: PathBuf,
    job: JobWords<'_>,
    settings: SettingWords,
    replace: bool,
    verify: bool,
    coarse_only: bool,
    callable: Option<Py<PyAny>>,
) -> PyResult<()> {
    let (token, board) = (CancelToken::new(), Arc::new(Board::default()));
    let existing = match replace {
        true => Existing::Replace,
        false => Existing::Keep,
    };
    let mesher = mesher(py, surface, &job)?
        .settings(settings.settings(&token, Some(&board)))
        .existing(existing)
        .verify(verify)
        .coarse_only(coarse_only);
    let listener = Listener { board: &board, callable: callable.as_ref() };
    let work = || mesher.create_unfinished(path).map_err(Failure::from);
    watched(py, &token, Some(&listener), work)
}

/// Imports a mesh file into a new store. `how`: number of sub-domains, array of parts, array of regions, whether values become fields.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "called by the Python half alone")]
pub fn import_mesh(
    py: Python<'_>,
    file: PathBuf,
    path: PathBuf,
    how: (Option<u32>, Option<String>, Option<String>, bool),
    settings: SettingWords,
    replace: bool,
    verify: bool,
    callable: Option<Py<PyAny>>,
) -> PyResult<()> {
    let (token, board) = (CancelToken::new(), Arc::new(Board::default()));
    let (subdomains, parts, regions, fields) = how;
    let mut import = Import::new(file)
        .subdomains(subdomains.map_or(Subdomains::Auto, Subdomains::Exactly))
        .settings(settings.settings(&token, Some(&board)))
        .existing(if replace { Existing::Replace } else { Existing::Keep })
        .fields(fields)
        .verify(verify);
    if let Some(name) = parts {
        import = import.part_field(name);
    }
    if let Some(name) = regions {
        import = import.region_field(name);
    }
    let listener = Listener { board: &board, callable: callable.as_ref() };
    let work = || import.create_reported(&path).map_err(Failure::from);
    watched(py, &token, Some(&listener), work)
}

/// Goes on with an interrupted run.
#[pyfunction]
pub fn resume(
    py: Python<'_>,
    path: PathBuf,
    settings: SettingWords,
    callable: Option<Py<PyAny>>,
) -> PyResult<()> {
    let (token, board) = (CancelToken::new(), Arc::new(Board::default()));
    let settings = settings.settings(&token, Some(&board));
    let listener = Listener { board: &board, callable: callable.as_ref() };
    let work = || Store::resume(path, settings).map(drop).map_err(Failure::from);
    watched(py, &token, Some(&listener), work)
}

/// What to expect of a mesh, as JSON.
#[pyfunction]
pub fn predict(
    py: Python<'_>,
    surface: &Surface,
    job: JobWords<'_>,
    settings: SettingWords,
) -> PyResult<String> {
    let token = CancelToken::new();
    let mesher = mesher(py, surface, &job)?.settings(settings.settings(&token, None));
    let said = watched(py, &token, None, || Ok(mesher.predict()?))?;
    let words = json!({
        "tets": said.tets.round() as u64, "vertices": said.vertices.round() as u64, "subdomains": said.subdomains,
        "store_bytes": said.store.0, "disk_peak_bytes": said.disk_peak.0,
        "memory_least_bytes": said.memory_least.0, "seconds": said.seconds,
    });
    Ok(words.to_string())
}
