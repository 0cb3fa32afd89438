//! Surfaces: read, given as arrays, checked, repaired, refined.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use serde_json::json;
use tetdb::{
    CancelToken, CellArrays, DefectPlace, RepairKind, Seed, SeedKind, Settings, SurfaceRemesh,
    SurfaceWrap, Word as _,
};

use crate::failure::Failure;
use crate::sizes::{LengthWords, length};
use crate::watched::watched;

/// A surface; several may share its memory, and nobody changes it.
#[pyclass(frozen, module = "tetdb._native")]
pub struct Surface {
    pub inner: Arc<tetdb::Surface>,
}

fn made(
    py: Python<'_>,
    work: impl FnOnce() -> Result<tetdb::Surface, tetdb::Error> + Send,
) -> PyResult<Surface> {
    let surface = watched(py, &CancelToken::new(), None, || Ok(work()?))?;
    let inner = Arc::new(surface);
    Ok(Surface { inner })
}

#[pymethods]
impl Surface {
    #[staticmethod]
    fn read(py: Python<'_>, files: Vec<PathBuf>) -> PyResult<Self> {
        made(py, || tetdb::Surface::read(files))
    }

    #[staticmethod]
    fn boundary_of(py: Python<'_>, file: PathBuf) -> PyResult<Self> {
        made(py, || tetdb::Surface::boundary_of(file))
    }

    #[staticmethod]
    fn sample(py: Python<'_>, spec: String) -> PyResult<Self> {
        made(py, || tetdb::Surface::sample(&spec))
    }

    /// `codes` names for each triangle one of `names`. The arrays are copied while the interpreter's lock is held: nobody changes them meanwhile.
    #[staticmethod]
    fn of_arrays(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, u32>,
        labels: Option<(Vec<String>, PyReadonlyArray1<'_, i64>)>,
    ) -> PyResult<Self> {
        let points: Vec<[f64; 3]> = bytemuck::cast_slice(points.as_slice()?).to_vec();
        let triangles: Vec<[u32; 3]> = bytemuck::cast_slice(triangles.as_slice()?).to_vec();
        let labels = match labels {
            Some((names, codes)) => Some((names, codes.as_slice()?.to_vec())),
            None => None,
        };
        made(py, move || {
            let labels = labels.as_ref().map(|(names, codes)| named(names, codes));
            let surface = tetdb::Surface::from_arrays(&points, &triangles, labels.as_deref())?;
            grouped(surface)
        })
    }

    /// The same with polygons of `counts` corners, or of the boundary of volume cells; with notes on what the caller left out.
    #[staticmethod]
    fn of_cells(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        counts: PyReadonlyArray1<'_, u32>,
        corners: PyReadonlyArray1<'_, u32>,
        labels: Option<(Vec<String>, PyReadonlyArray1<'_, i64>)>,
        is_volume: bool,
        notes: Vec<String>,
    ) -> PyResult<Self> {
        let points: Vec<[f64; 3]> = bytemuck::cast_slice(points.as_slice()?).to_vec();
        let (counts, corners) = (counts.as_slice()?.to_vec(), corners.as_slice()?.to_vec());
        let labels = match labels {
            Some((names, codes)) => Some((names, codes.as_slice()?.to_vec())),
            None => None,
        };
        made(py, move || {
            let labels = labels.as_ref().map(|(names, codes)| named(names, codes));
            let cells = CellArrays { counts: &counts, corners: &corners, names: labels.as_deref() };
            let surface = match is_volume {
                true => tetdb::Surface::boundary_of_cells(&points, cells)?,
                false => grouped(tetdb::Surface::from_polygons(&points, cells)?)?,
            };
            Ok(notes.into_iter().fold(surface, tetdb::Surface::noted))
        })
    }

    /// What the arrays do not say: notes, and seeds as text, with whether each is a hole.
    fn extras(&self) -> (Vec<String>, Vec<(String, bool)>) {
        let seed = |seed: &Seed| (seed.to_string(), seed.kind == SeedKind::Hole);
        (self.inner.notes(), self.inner.seeds().iter().map(seed).collect())
    }

    fn with_extras(&self, notes: Vec<String>, seeds: Vec<(String, bool)>) -> Self {
        let seed = |(text, is_hole): (String, bool)| match is_hole {
            true => Seed::parse_hole(&text),
            false => Seed::parse_region(&text),
        };
        let seeds = seeds.into_iter().filter_map(seed).collect();
        let surface = tetdb::Surface::clone(&self.inner).with_notes_and_seeds(notes, seeds);
        Self { inner: Arc::new(surface) }
    }

    fn notes(&self) -> Vec<String> {
        self.inner.notes()
    }

    fn points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, bytemuck::cast_slice(self.inner.points()), 3)
    }

    fn triangles<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<u32>> {
        rows(py, bytemuck::cast_slice(self.inner.triangles()), 3)
    }

    /// Labels of triangles in several groups, and the labels of those.
    fn label_sets(&self) -> Vec<(u32, Vec<u32>)> {
        self.inner.label_sets().iter().map(|set| (set.label, set.members.clone())).collect()
    }

    /// Names, and for each triangle a position among them.
    fn labels<'py>(&self, py: Python<'py>) -> (Vec<String>, Bound<'py, PyArray1<u32>>) {
        let codes = PyArray1::from_slice(py, self.inner.labels_of_triangles());
        (self.inner.labels().to_vec(), codes)
    }

    fn n_points(&self) -> usize {
        self.inner.n_vertices()
    }

    fn n_triangles(&self) -> usize {
        self.inner.n_triangles()
    }

    fn bounds(&self) -> [[f64; 3]; 2] {
        self.inner.bounds()
    }

    /// The report as JSON, and of its defects codes, triangles (-1: none) and positions.
    #[expect(clippy::type_complexity, reason = "what Python takes apart at once")]
    fn check<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(String, Vec<&'static str>, Bound<'py, PyArray2<i64>>, Bound<'py, PyArray2<f64>>)>
    {
        let work = || Ok(self.inner.check()?);
        let report = watched(py, &CancelToken::new(), None, work)?;
        let words = json!({
            "n_defects": report.n_defects, "n_open_edges": report.n_open_edges,
            "n_small_angles": report.n_small_angles,
            "n_forcing_triangles": report.n_forcing_triangles,
            "edges": report.edges, "volume": report.volume,
            "messages": report.defects.iter().take(100).map(ToString::to_string).collect::<Vec<_>>(),
        });
        let triangles = |place: &DefectPlace| place.triangles.map(|t| t.map_or(-1, i64::from));
        let at = |place: &DefectPlace| place.at.unwrap_or([f64::NAN; 3]);
        let all: Vec<_> = report.places.iter().map(triangles).collect();
        let places: Vec<_> = report.places.iter().map(at).collect();
        Ok((
            words.to_string(),
            report.places.iter().map(|place| place.code.as_str()).collect(),
            rows(py, bytemuck::cast_slice(&all), 2),
            rows(py, bytemuck::cast_slice(&places), 3),
        ))
    }

    fn repaired(&self, py: Python<'_>, weld: Option<f64>) -> PyResult<Self> {
        made(py, || tetdb::Surface::clone(&self.inner).repaired(weld))
    }

    /// The surface repaired in this way, and what was done: a list of steps as JSON.
    fn repaired_by(&self, py: Python<'_>, how: &str) -> PyResult<(Self, String)> {
        let kind = RepairKind::from_word(how)
            .ok_or_else(|| Failure::internal("a repair is not known").raised(py))?;
        let token = CancelToken::new();
        let settings = Settings::new().cancel(&token);
        let work = || Ok(tetdb::Surface::clone(&self.inner).repaired_by(kind, &settings)?);
        let (surface, steps) = watched(py, &token, None, work)?;
        Ok((Self { inner: Arc::new(surface) }, json!(steps).to_string()))
    }

    /// A wrap with this gap and offset, and what was done as JSON.
    fn wrapped(
        &self,
        py: Python<'_>,
        gap: LengthWords,
        offset: LengthWords,
    ) -> PyResult<(Self, String)> {
        let how = SurfaceWrap { gap: length(gap), offset: length(offset) };
        let token = CancelToken::new();
        let settings = Settings::new().cancel(&token);
        let work = || Ok(self.inner.wrapped_with(&how, &settings)?);
        let (surface, report) = watched(py, &token, None, work)?;
        Ok((Self { inner: Arc::new(surface) }, json!(report).to_string()))
    }

    /// The surface remeshed within `tolerance`, and what was done as JSON. `lengths` are the least and the greatest.
    fn remeshed(
        &self,
        py: Python<'_>,
        tolerance: LengthWords,
        feature_angle: f64,
        lengths: [Option<LengthWords>; 2],
        hgrad: Option<f64>,
    ) -> PyResult<(Self, String)> {
        let mut how = SurfaceRemesh::default();
        how.tolerance = length(tolerance);
        how.feature_angle = feature_angle;
        [how.hmin, how.hmax] = lengths.map(|l| l.map(length));
        how.hgrad = hgrad;
        let token = CancelToken::new();
        let settings = Settings::new().cancel(&token);
        let work = || Ok(self.inner.remeshed_with(&how, &settings)?);
        let (surface, report) = watched(py, &token, None, work)?;
        Ok((Self { inner: Arc::new(surface) }, json!(report).to_string()))
    }

    fn refined(&self, py: Python<'_>, hsiz: (f64, bool)) -> PyResult<Self> {
        made(py, || tetdb::Surface::clone(&self.inner).refined(length(hsiz)))
    }

    fn embedded(&self, py: Python<'_>, sheet: &Surface, name: String) -> PyResult<Self> {
        made(py, || {
            let sheet = tetdb::Surface::clone(&sheet.inner);
            tetdb::Surface::clone(&self.inner).embedded(sheet, Some(&name))
        })
    }

    /// Edges of a file, or, with `points`, of arrays; if it `divides`, triangles are divided where ends lie on them, and ends nearer than
    /// `snap` are moved there.
    fn embedded_edges(
        &self,
        py: Python<'_>,
        edges: EdgesGiven<'_>,
        name: String,
        divides: bool,
        snap: Option<LengthWords>,
    ) -> PyResult<Self> {
        let given = match edges {
            EdgesGiven::File(file) => Err(file),
            EdgesGiven::Arrays(points, edges, labels) => Ok((
                bytemuck::cast_slice::<_, [f64; 3]>(points.as_slice()?).to_vec(),
                bytemuck::cast_slice::<_, [u32; 2]>(edges.as_slice()?).to_vec(),
                labels,
            )),
        };
        made(py, || {
            let surface = self.to_embed_in(divides, snap);
            match given {
                Err(file) => surface.embedded_edges(file, Some(&name)),
                Ok((points, edges, labels)) => {
                    let labels = labels.as_ref().map(|l| words(l));
                    surface.embedded_edges_of(&points, &edges, labels.as_deref(), &name)
                }
            }
        })
    }

    /// The same of points.
    fn embedded_points(
        &self,
        py: Python<'_>,
        points: PointsGiven<'_>,
        name: String,
        divides: bool,
        snap: Option<LengthWords>,
    ) -> PyResult<Self> {
        let given = match points {
            PointsGiven::File(file) => Err(file),
            PointsGiven::Arrays(points, labels) => {
                Ok((bytemuck::cast_slice::<_, [f64; 3]>(points.as_slice()?).to_vec(), labels))
            }
        };
        made(py, || {
            let surface = self.to_embed_in(divides, snap);
            match given {
                Err(file) => surface.embedded_points(file, Some(&name)),
                Ok((points, labels)) => {
                    let labels = labels.as_ref().map(|l| words(l));
                    surface.embedded_points_of(&points, labels.as_deref(), &name)
                }
            }
        })
    }

    /// Returns what the file does not keep: labels, numbers of embedded edges and points, and of seeds.
    fn write(&self, py: Python<'_>, out: PathBuf) -> PyResult<(bool, usize, usize)> {
        let n_inside = self.inner.n_embedded().iter().sum();
        let n_seeds = self.inner.seeds().len();
        let work = || Ok((!self.inner.write(out)?.labels_kept, n_inside, n_seeds));
        watched(py, &CancelToken::new(), None, work)
    }
}

impl Surface {
    fn to_embed_in(&self, divides: bool, snap: Option<LengthWords>) -> tetdb::Surface {
        let mut surface = tetdb::Surface::clone(&self.inner);
        if divides {
            surface = surface.dividing();
        }
        match snap {
            Some(within) => surface.snapping(length(within)),
            None => surface,
        }
    }
}

/// A file, or points, edges and a label for each.
#[derive(FromPyObject)]
pub enum EdgesGiven<'py> {
    File(PathBuf),
    Arrays(PyReadonlyArray2<'py, f64>, PyReadonlyArray2<'py, u32>, Option<Vec<String>>),
}

/// A file, or points and a label for each.
#[derive(FromPyObject)]
pub enum PointsGiven<'py> {
    File(PathBuf),
    Arrays(PyReadonlyArray2<'py, f64>, Option<Vec<String>>),
}

/// Stands between the names of the groups of a triangle that is in several.
const TOGETHER: char = '\u{1f}';

/// The surface with triangles in all groups that their labels name.
fn grouped(surface: tetdb::Surface) -> Result<tetdb::Surface, tetdb::Error> {
    let names: Vec<String> =
        surface.labels().iter().filter(|name| name.contains(TOGETHER)).cloned().collect();
    let groups: Vec<(&str, Vec<&str>)> =
        names.iter().map(|name| (name.as_str(), name.split(TOGETHER).collect())).collect();
    let groups: Vec<(&str, &[&str])> =
        groups.iter().map(|(name, groups)| (*name, groups.as_slice())).collect();
    surface.with_groups(&groups)
}

fn named<'a>(names: &'a [String], codes: &[i64]) -> Vec<&'a str> {
    codes.iter().map(|&code| names[code as usize].as_str()).collect()
}

fn words(all: &[String]) -> Vec<&str> {
    all.iter().map(String::as_str).collect()
}

/// A matrix of `width` columns.
fn rows<'py, T: numpy::Element + Copy>(
    py: Python<'py>,
    all: &[T],
    width: usize,
) -> Bound<'py, PyArray2<T>> {
    let array = PyArray1::from_slice(py, all);
    let rows = array.reshape([all.len() / width, width]);
    rows.expect("all rows are whole")
}
