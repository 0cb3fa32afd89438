//! A finished store: questions, files, pictures, sub-domains again.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use serde_json::json;
use tetdb::data::{Hit, Subdomain};
use tetdb::{
    CancelToken, ColorBy, ErrorEstimate, ExportOptions, FieldIds, FieldPlace, FieldSource,
    MotionKind, NewField, Order, PeriodicLabels, Snapshot, TransferMethod, VerifyLevel, Word,
};

use crate::arrow::ArrowStream;
use crate::failure::Failure;
use crate::field::{Field, FieldCallable};
use crate::part::Part;
use crate::run::SettingWords;
use crate::sizes::SizeWords;
use crate::watched::{Board, Listener, watched};

/// Words of a hit: id, 4 vertices, region and sub-domain in one, 12 coordinates, 3 of the centroid, 6 numbers.
const HIT_WORDS: usize = 27;

/// Where a store is and how it is worked with. What is asked goes through one session, question after question; everything else opens
/// the store for itself.
#[pyclass(frozen, module = "tetdb._native")]
pub struct Store {
    path: PathBuf,
    settings: SettingWords,
    token: CancelToken,
    session: Mutex<Option<tetdb::Store>>,
    /// Set while a callable gives values: it would wait for ever for the session.
    is_filled: AtomicBool,
    /// The process that opened it: threads and locks of a session are not there in a child.
    process: u32,
}

/// A question, as the Python half words it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct QueryWords {
    condition: Option<String>,
    box_: Option<[[f64; 3]; 2]>,
    sphere: Option<([f64; 3], f64)>,
    plane: Option<[[f64; 3]; 2]>,
    inside: bool,
    subdomains: Option<Vec<u32>>,
    regions: Option<Vec<u32>>,
    labels: Option<Vec<u32>>,
    touching_surface: bool,
    order_by: Option<(String, bool)>,
    limit: Option<usize>,
}

/// What of a mesh is written, and how.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ExportWords {
    subdomains: Vec<u32>,
    regions: Vec<u32>,
    is_second_order: bool,
    flags: Vec<String>,
}

/// A picture.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct PictureWords {
    kind: String,
    color: String,
    plane: Option<[[f64; 3]; 2]>,
    seen_from: Option<[f64; 3]>,
    condition: Option<String>,
    crinkle: bool,
    pixels: [u32; 2],
}

/// Sub-domains again.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct RemeshWords<'py> {
    ranks: Vec<u32>,
    sizes: Option<SizeWords<'py>>,
    lengths: Option<Vec<f64>>,
    scale: f64,
    repair: bool,
}

/// The arguments of `adapt`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct AdaptWords<'py> {
    field: String,
    tets: Option<u64>,
    factor: Option<f64>,
    estimate: String,
    sizes: SizeWords<'py>,
    change: f64,
    dry_run: bool,
}

impl Store {
    /// A store of its own for one piece of work.
    fn opened(&self, token: &CancelToken) -> Result<tetdb::Store, Failure> {
        let settings = self.settings.settings(token, None);
        Ok(tetdb::Store::open_with(&self.path, settings)?)
    }

    fn alone<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(tetdb::Store) -> Result<T, Failure> + Send,
    ) -> PyResult<T> {
        let token = CancelToken::new();
        watched(py, &token, None, || work(self.opened(&token)?))
    }

    /// The session, when no other question or change has it.
    fn session(&self) -> Result<MutexGuard<'_, Option<tetdb::Store>>, Failure> {
        match self.is_filled.load(Ordering::Acquire) {
            true => Err(Failure::busy()),
            false => Ok(self.session.lock().unwrap_or_else(PoisonError::into_inner)),
        }
    }

    fn in_session<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut tetdb::Store) -> Result<T, Failure> + Send,
    ) -> PyResult<T> {
        watched(py, &self.token, None, || {
            let mut session = self.session()?;
            if session.is_none() {
                *session = Some(self.opened(&self.token)?);
            }
            work(session.as_mut().expect("it was opened above"))
        })
    }

    /// Changes the store, with the session closed: it reads, and nobody may while the store is written.
    fn changed(
        &self,
        py: Python<'_>,
        callable: Option<&Py<PyAny>>,
        work: impl FnOnce(tetdb::Store) -> Result<(), Failure> + Send,
    ) -> PyResult<()> {
        let (token, board) = (CancelToken::new(), Arc::new(Board::default()));
        let listener = Listener { board: &board, callable };
        watched(py, &token, Some(&listener), || {
            let mut session = self.session()?;
            *session = None;
            let settings = self.settings.settings(&token, Some(&board));
            work(tetdb::Store::open_with(&self.path, settings)?)
        })
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        if self.process != std::process::id() {
            // Threads of the parent that would be waited for are not here.
            let session = self.session.get_mut();
            std::mem::forget(session.unwrap_or_else(PoisonError::into_inner).take());
        }
    }
}

#[pymethods]
impl Store {
    #[new]
    fn new(py: Python<'_>, path: PathBuf, settings: SettingWords) -> PyResult<Self> {
        let store = Self {
            path,
            settings,
            token: CancelToken::new(),
            session: Mutex::new(None),
            is_filled: AtomicBool::new(false),
            process: std::process::id(),
        };
        store.in_session(py, |_| Ok(()))?;
        Ok(store)
    }

    /// Closes the session; the next question opens another.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        let closed = py.detach(|| {
            *self.session()? = None;
            Ok(())
        });
        closed.map_err(|failure: Failure| failure.raised(py))
    }

    /// What the store holds, as JSON.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        self.alone(py, |store| {
            let s = store.summary();
            let words = json!({
                "n_tets": s.n_tets, "n_vertices": s.n_vertices, "bytes": s.bytes,
                "digest": s.digest, "input_triangles": s.input_triangles, "is_verified": s.is_verified,
                "worst_quality": s.worst_quality, "labels": s.labels, "label_sets": s.label_sets, "regions": s.regions,
                "subdomains": s.subdomains, "interfaces": s.interfaces,
            });
            Ok(words.to_string())
        })
    }

    fn part(&self, py: Python<'_>, rank: u32) -> PyResult<Part> {
        self.alone(py, |store| Ok(Part::new(store.subdomain(rank)?)))
    }

    /// Rows of [`HIT_WORDS`] words.
    fn query<'py>(
        &self,
        py: Python<'py>,
        words: QueryWords,
    ) -> PyResult<Bound<'py, PyArray2<u64>>> {
        let all = self.in_session(py, |store| {
            let mut query = store.query();
            if let Some([low, high]) = words.box_ {
                query = query.in_box(low, high);
            }
            if let Some((center, radius)) = words.sphere {
                query = query.in_sphere(center, radius);
            }
            if let Some([point, normal]) = words.plane {
                query = query.at_plane(point, normal);
            }
            if words.inside {
                query = query.inside();
            }
            if let Some(ranks) = &words.subdomains {
                query = query.in_subdomains(ranks);
            }
            if let Some(regions) = &words.regions {
                query = query.in_regions(regions);
            }
            if let Some(labels) = &words.labels {
                query = query.on_labels(labels);
            }
            if words.touching_surface {
                query = query.touching_surface();
            }
            if let Some(condition) = &words.condition {
                query = query.where_(condition)?;
            }
            if let Some((variable, falls)) = &words.order_by {
                let order = match falls {
                    true => Order::Falling,
                    false => Order::Rising,
                };
                query = query.order_by(variable, order)?;
            }
            if let Some(n) = words.limit {
                query = query.limit(n);
            }
            let mut all = Vec::new();
            for hit in query.answers()? {
                all.extend(words_of(&hit?));
            }
            Ok(all)
        })?;
        let n = all.len() / HIT_WORDS;
        PyArray1::from_vec(py, all).reshape([n, HIT_WORDS])
    }

    /// A table as a stream.
    fn arrow(
        &self,
        py: Python<'_>,
        table: &str,
        condition: Option<String>,
        columns: Option<Vec<String>>,
    ) -> PyResult<ArrowStream> {
        let (path, settings) = (self.path.clone(), self.settings.clone());
        self.in_session(py, |store| {
            ArrowStream::new(path, settings, store, (table, condition, columns))
        })
    }

    /// Ids, -1 outside, and barycentric coordinates.
    #[expect(clippy::type_complexity, reason = "what Python takes apart at once")]
    fn locate<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<(Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>)> {
        let points: Vec<[f64; 3]> = bytemuck::cast_slice(points.as_slice()?).to_vec();
        let located = self.in_session(py, |store| Ok(store.locate_barycentric(&points)?))?;
        let id = |found: &Option<(Hit, _)>| {
            found.as_ref().map_or(-1, |(hit, _)| hit.id.number().cast_signed())
        };
        let ids = PyArray1::from_vec(py, located.iter().map(id).collect());
        let none = [f64::NAN; 4];
        let shares = located.iter().flat_map(|found| found.map_or(none, |(_, shares)| shares));
        let shares = PyArray1::from_vec(py, shares.collect());
        Ok((ids, shares.reshape([located.len(), 4])?))
    }

    /// Writes the mesh for another program; returns files with their lengths.
    fn export(
        &self,
        py: Python<'_>,
        out: PathBuf,
        words: ExportWords,
    ) -> PyResult<Vec<(PathBuf, u64)>> {
        self.alone(py, |store| {
            let mut options =
                ExportOptions::new().subdomains(&words.subdomains).regions(&words.regions);
            if words.is_second_order {
                options = options.second_order();
            }
            for flag in &words.flags {
                options = match flag.as_str() {
                    "boundary" => options.boundary(),
                    "interfaces" => options.interfaces(),
                    "pieces" => options.pieces(),
                    "ascii" => options.ascii(),
                    "ghosts" => options.ghosts(),
                    "split_sheets" => options.split_sheets(),
                    "one_partition" => options.one_partition(),
                    _ => options,
                };
            }
            Ok(store.export(out, &options)?.files)
        })
    }

    fn snapshot(&self, py: Python<'_>, out: PathBuf, words: PictureWords) -> PyResult<()> {
        self.alone(py, |store| {
            let mut picture = match words.kind.as_str() {
                "surface" => Snapshot::surface(),
                _ => Snapshot::cut(),
            };
            picture = match words.color.as_str() {
                "subdomain" => picture.color(ColorBy::Subdomain),
                "region" => picture.color(ColorBy::Region),
                "quality" => picture.color(ColorBy::Quality),
                "size" => picture.color(ColorBy::Size),
                "label" => picture.color(ColorBy::Label),
                field => picture.color_field(field),
            };
            if let Some([point, normal]) = words.plane {
                picture = picture.plane(point, normal);
            }
            if let Some(direction) = words.seen_from {
                picture = picture.seen_from(direction);
            }
            if let Some(condition) = &words.condition {
                picture = picture.where_(condition)?;
            }
            if words.crinkle {
                picture = picture.crinkle();
            }
            let [width, height] = words.pixels;
            store.snapshot(out, &picture.pixels(width, height))?;
            Ok(())
        })
    }

    fn report(&self, py: Python<'_>, out: PathBuf) -> PyResult<u64> {
        self.alone(py, |store| Ok(store.report(out)?.bytes))
    }

    /// Tetrahedra checked, and findings with how often each occurs.
    fn verify(&self, py: Python<'_>, full: bool) -> PyResult<(u64, Vec<(String, u64)>)> {
        self.alone(py, |store| {
            let level = match full {
                true => VerifyLevel::Delaunay,
                false => VerifyLevel::Geometry,
            };
            let found = store.verify(level)?;
            Ok((found.n_tets(), found.findings()))
        })
    }

    fn resaturate(
        &self,
        py: Python<'_>,
        words: RemeshWords<'_>,
        callable: Option<Py<PyAny>>,
    ) -> PyResult<()> {
        let sizes = match &words.sizes {
            Some(sizes) => Some(sizes.sizes(py)?),
            None => None,
        };
        let (ranks, lengths) = (words.ranks, words.lengths);
        let (scale, repair) = (words.scale, words.repair);
        self.changed(py, callable.as_ref(), move |store| {
            let mut remesh = store.remesh().subdomains(&ranks);
            if scale != 1.0 {
                remesh = remesh.scaled(scale);
            }
            if let Some(sizes) = sizes {
                remesh = remesh.sizes(sizes);
            }
            if let Some(lengths) = lengths {
                remesh = remesh.lengths_of_tets(lengths);
            }
            if repair {
                remesh = remesh.repair();
            }
            remesh.run()?;
            Ok(())
        })
    }

    /// Adapts the mesh; the plan, as JSON.
    fn adapt(
        &self,
        py: Python<'_>,
        words: AdaptWords<'_>,
        callable: Option<Py<PyAny>>,
    ) -> PyResult<String> {
        let sizes = words.sizes.sizes(py)?;
        let AdaptWords { field, tets, factor, estimate, change, dry_run, .. } = words;
        let estimate = ErrorEstimate::from_word(&estimate).unwrap_or_default();
        let mut plan = String::new();
        self.changed(py, callable.as_ref(), |store| {
            let adapt = store.adapt(&field).estimate(estimate).sizes(sizes).change(change);
            let adapt = match (tets, factor) {
                (Some(n), _) => adapt.tets(n),
                (None, factor) => adapt.factor(factor.unwrap_or(1.0)),
            };
            let found = if dry_run { adapt.plan()? } else { adapt.run()?.plan };
            plan = json!(found).to_string();
            Ok(())
        })?;
        Ok(plan)
    }

    /// The fields, as JSON.
    fn fields(&self, py: Python<'_>) -> PyResult<String> {
        self.alone(py, |store| Ok(json!(store.fields()?).to_string()))
    }

    fn field(&self, py: Python<'_>, name: &str, rank: u32) -> PyResult<Field> {
        self.alone(py, |store| Ok(Field::new(store.field(name, rank)?)))
    }

    /// Adds a field from a file, or from an expression.
    fn add_field(
        &self,
        py: Python<'_>,
        name: &str,
        at: &str,
        source: &str,
        is_file: bool,
        ids: Option<PathBuf>,
    ) -> PyResult<()> {
        let place = FieldPlace::from_word(at).unwrap_or(FieldPlace::Tets);
        let ids = ids.map_or(FieldIds::AsFound, FieldIds::File);
        let source = match is_file {
            true => FieldSource::File(source.into(), ids),
            false => FieldSource::Expression(source.to_owned()),
        };
        let new = NewField::new(name, place);
        self.changed(py, None, move |mut store| {
            Ok(store.add_field_from(&new, &source).map(drop)?)
        })
    }

    /// Adds a field with the values that a callable gives for each chunk; what that raises is raised here.
    fn fill_field(
        &self,
        py: Python<'_>,
        name: &str,
        at: &str,
        callable: Py<PyAny>,
    ) -> PyResult<()> {
        let place = FieldPlace::from_word(at).unwrap_or(FieldPlace::Vertices);
        let mut callable = FieldCallable { callable, raised: None };
        let done = self.changed(py, None, |mut store| {
            self.is_filled.store(true, Ordering::Release);
            let fill = |mesh: &mut Subdomain, chunk| callable.values(mesh, chunk, place);
            let added = store.add_field(&NewField::new(name, place), fill);
            self.is_filled.store(false, Ordering::Release);
            Ok(added.map(drop)?)
        });
        callable.raised.map_or(done, Err)
    }

    fn drop_field(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.changed(py, None, |mut store| Ok(store.drop_field(name)?))
    }

    /// Adds fields of the store at `path`; says how they were evaluated, as JSON.
    fn transfer(
        &self,
        py: Python<'_>,
        path: PathBuf,
        version: Option<&str>,
        names: Vec<String>,
        method: Option<&str>,
    ) -> PyResult<String> {
        let method = method.and_then(TransferMethod::from_word);
        let mut said = String::new();
        self.changed(py, None, |mut store| {
            let from = match version {
                Some(name) => tetdb::Store::open_version(&path, name)?,
                None => tetdb::Store::open(&path)?,
            };
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            said = json!(store.transfer_from(&from, &names, method)?).to_string();
            Ok(())
        })?;
        Ok(said)
    }

    /// The versions, as JSON.
    fn versions(&self, py: Python<'_>) -> PyResult<String> {
        self.alone(py, |store| Ok(json!(store.versions()?).to_string()))
    }

    fn save_version(
        &self,
        py: Python<'_>,
        name: &str,
        note: &str,
        keep: Option<usize>,
    ) -> PyResult<Vec<String>> {
        let mut dropped = Vec::new();
        self.changed(py, None, |mut store| {
            dropped = store.save_version(name, note, keep)?;
            Ok(())
        })?;
        Ok(dropped)
    }

    fn restore_version(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.changed(py, None, |store| Ok(store.restore_version(name, true).map(drop)?))
    }

    fn drop_version(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.changed(py, None, |mut store| Ok(store.drop_version(name).map(drop)?))
    }

    /// Two versions compared, as JSON.
    fn diff_versions(&self, py: Python<'_>, first: &str, second: &str) -> PyResult<String> {
        self.alone(py, |store| Ok(json!(store.diff_versions(first, second)?).to_string()))
    }

    /// The periodic pairs, as JSON.
    fn periodic(&self, py: Python<'_>) -> PyResult<String> {
        self.alone(py, |store| Ok(json!(store.periodic()?).to_string()))
    }

    /// Lasting ids of the vertices of the periodic pair at a place in the list; shape (pairs, 2).
    fn periodic_vertices<'py>(
        &self,
        py: Python<'py>,
        place: usize,
    ) -> PyResult<Bound<'py, PyArray2<i64>>> {
        let pairs = self.alone(py, |store| {
            let all = store.periodic()?;
            let pair = all.get(place).map(|pair| store.periodic_vertices(pair)).transpose()?;
            Ok(pair.unwrap_or_default())
        })?;
        let array = PyArray2::zeros(py, [pairs.len(), 2], false);
        let mut rows = array.try_readwrite()?;
        for (number, id) in rows.as_slice_mut()?.iter_mut().zip(pairs.iter().flatten()) {
            *number = id.number().cast_signed();
        }
        drop(rows);
        Ok(array)
    }

    fn add_periodic(
        &self,
        py: Python<'_>,
        labels: [String; 2],
        kind: Option<&str>,
        tolerance: Option<f64>,
    ) -> PyResult<()> {
        let [first, second] = labels;
        let mut labels = PeriodicLabels::new(first, second);
        if let Some(kind) = kind {
            let turns = kind == "rotate";
            labels =
                labels.kind(if turns { MotionKind::Rotation } else { MotionKind::Translation });
        }
        if let Some(tolerance) = tolerance {
            labels = labels.tolerance(tolerance);
        }
        self.changed(py, None, |mut store| Ok(store.add_periodic(&labels).map(drop)?))
    }

    fn undo(&self, py: Python<'_>) -> PyResult<()> {
        self.changed(py, None, |store| Ok(store.undo().map(drop)?))
    }

    fn forget_previous(&self, py: Python<'_>) -> PyResult<()> {
        self.changed(py, None, |mut store| Ok(store.forget_previous().map(drop)?))
    }
}

fn words_of(hit: &Hit) -> [u64; HIT_WORDS] {
    let [quality, _, _, volume, x, y, z, rest @ ..] = hit.values();
    let mut words = [0; HIT_WORDS];
    words[0] = hit.id.number();
    words[1..5].copy_from_slice(&hit.vertices);
    let rank = u64::from(hit.id.subdomain().rank());
    // Two integers of four bytes, the first one in the low half.
    words[5] = u64::from(hit.region) | rank << 32;
    let corners = hit.corners.into_iter().flat_map(|corner| corner.to_array());
    let numbers = corners.chain([x, y, z, quality, volume]).chain(rest);
    for (word, number) in words[6..].iter_mut().zip(numbers) {
        *word = number.to_bits();
    }
    words
}
