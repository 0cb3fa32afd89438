//! The report on a surface before it is meshed: defects, shapes, suggestions.

use std::path::Path;

use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::suggestions::{Suggestion, suggestions};
use super::surface_close::tried as tried_closing;
use super::surface_resolve::{ResolveReport, tried};
use super::{Bytes, CloseReport, Error, Settings, Surface, guarded, predict};
use crate::pipeline::{MeshOptions, Prepared, least_for};
use tetdb_base::geom::short;
use tetdb_base::shape::face_least;
use tetdb_base::storage::attempt;
use tetdb_base::surface::{
    self, BoundaryLoop, Closing, Defect, Fitness, Validation, boundary_loops, closing, fitness,
    repair_bytes, triangle_name, validate_with,
};
use tetdb_io::write;
use tetdb_repair::close::close_bytes;

/// Above this number of triangles, tetrahedra are estimated only on request. Computing sizes and their integral takes two to three times
/// as long as the rest of the report.
const ESTIMATED_MAX: usize = 100_000;
/// Up to this number of pairs of triangles that touch, resolving them is tried. More take seconds.
const RESOLVED_MAX: u64 = 20_000;
/// Above this share of forced tetrahedra, or of triangles with small angles, the report advises better triangles.
const POOR_SHARE: f64 = 0.01;
/// Above this ratio of edge lengths, the report mentions the short edges.
const POOR_RATIO: f64 = 1e5;

/// Defects, openness and triangle shapes of a surface, and suggestions for improving it.
///
/// Serialized, it is the answer of `tetdb check --json`; the guide lists the keys.
#[non_exhaustive]
pub struct SurfaceReport<'a> {
    surface: &'a surface::Surface,
    /// Number of triangles turned to be oriented like their neighbors.
    pub n_turned: usize,
    /// Defects, open edges and parts.
    pub validation: Validation,
    /// Boundary loops of the holes, the longest first.
    pub boundary_loops: Vec<BoundaryLoop>,
    /// Repairs tried on an open surface, with growing distance; empty for a closed one.
    pub closing: Vec<Closing>,
    /// What resolving the crossings would do; `None` where there are none, where it fails, and for a large surface.
    pub resolving: Option<ResolveReport>,
    /// What closing it by winding numbers would do, where resolving leaves defects; `None` where that fails, and for a large surface.
    pub enclosing: Option<CloseReport>,
    /// Shapes of the triangles.
    pub fitness: Fitness,
    /// Estimated number of tetrahedra with default sizes. `None` if the surface cannot be meshed, or if it is large and no estimate was
    /// requested.
    pub tets_expected: Option<f64>,
    /// Changes that would improve the mesh.
    pub suggestions: Vec<Suggestion>,
}

impl Surface {
    /// Reports on the surface.
    ///
    /// With `estimated`, the number of tetrahedra is also estimated for a large surface.
    ///
    /// # Errors
    /// `memory`. Defects are not an error.
    pub fn report(&self, settings: &Settings, estimated: bool) -> Result<SurfaceReport<'_>, Error> {
        guarded(settings, || SurfaceReport::new(&self.inner, self.turned, settings, estimated))
    }

    /// Writes the triangles with defects to a `.vtu` file and returns their number. Writes no file if there are none.
    ///
    /// # Errors
    /// `unknown-format`; the disk.
    pub fn write_defects(
        &self,
        report: &SurfaceReport,
        out: impl AsRef<Path>,
    ) -> Result<u64, Error> {
        match report.validation.defects.as_slice() {
            [] => Ok(0),
            defects => Ok(write::defects(&self.inner, defects, out.as_ref())?),
        }
    }
}

impl<'a> SurfaceReport<'a> {
    fn new(
        surface: &'a surface::Surface,
        n_turned: usize,
        settings: &Settings,
        estimated: bool,
    ) -> Result<Self, Error> {
        let cap = settings.cap()?;
        let scratch = settings.scratch_space(surface.bytes() as u64)?;
        let validation = attempt(|| validate_with(surface, &scratch))?;
        let n_crossings = validation.n_intersections;
        let is_tried = n_crossings <= RESOLVED_MAX
            && surface.n_triangles() <= ESTIMATED_MAX
            && !surface.has_sheets()
            && !surface.has_embedded();
        let resolving = (is_tried && n_crossings > 0 && cap >= 2 * repair_bytes(surface))
            .then(|| tried(surface, &scratch))
            .flatten();
        let is_unsolved =
            !validation.is_valid() && resolving.as_ref().is_none_or(|r| r.n_defects > 0);
        let enclosing = (is_tried && is_unsolved && cap >= 2 * close_bytes(surface))
            .then(|| tried_closing(surface, &scratch))
            .flatten();
        drop(scratch);
        let fitness = fitness(surface, &validation.closedness);
        let is_estimated =
            validation.is_valid() && (surface.n_triangles() <= ESTIMATED_MAX || estimated);
        let closing = match validation.closedness.is_closed() {
            true => Vec::new(),
            false if cap < repair_bytes(surface) => {
                settings.note(format!(
                    "note: what would close it was not tried, which takes {} of memory",
                    Bytes(repair_bytes(surface))
                ));
                Vec::new()
            }
            false => closing(surface),
        };
        let prepared = is_estimated.then(|| expected(surface, settings, cap)).flatten();
        let suggestions = match &prepared {
            Some(prepared) => suggestions(surface, &fitness, &prepared.field, settings)?,
            None => Vec::new(),
        };
        Ok(Self {
            surface,
            n_turned,
            boundary_loops: boundary_loops(surface, &validation.closedness),
            closing,
            resolving,
            enclosing,
            fitness,
            tets_expected: prepared.map(|prepared| prepared.estimate.tets()),
            suggestions,
            validation,
        })
    }

    /// Returns whether the surface can be meshed.
    pub fn is_valid(&self) -> bool {
        self.validation.is_valid()
    }

    /// The tried repair with the least distance that closes the surface.
    pub fn closes(&self) -> Option<&Closing> {
        self.closing.last().filter(|tried| tried.closes)
    }

    /// Least share of the estimated tetrahedra with poor quality: each forcing triangle forces at least one.
    pub fn forced_share(&self) -> Option<f64> {
        let n = self.fitness.forcing_triangles as f64;
        self.tets_expected.map(|tets| n / tets)
    }

    /// Whether many tetrahedra will be bad because of the shapes of the triangles.
    pub fn is_poorly_shaped(&self) -> bool {
        self.fitness.small_angle_share > POOR_SHARE
            || self.forced_share().is_some_and(|share| share > POOR_SHARE)
    }

    /// Best quality possible for a tetrahedron on the worst triangle, and the centroid of this triangle.
    pub fn least_quality(&self) -> (f64, [f64; 3]) {
        let corners = self.surface.corners(self.fitness.worst_triangle);
        let [a, b, c] = corners;
        (face_least(corners), ((a + b + c) / 3.0).to_array())
    }

    /// Advice on improving the mesh, in sentences.
    pub fn advice(&self) -> Vec<String> {
        let f = &self.fitness;
        let mut advice = Vec::new();
        if self.is_poorly_shaped() {
            let spoiled = match f.hopeless_triangles {
                0 => String::new(),
                n => format!(", {n} of them 10 or worse"),
            };
            advice.push(format!(
                "{} triangles make every tetrahedron on them quality 2 or worse{spoiled}; all input triangles stay, so remesh the \
                 surface first, with angles above 15 degrees",
                f.forcing_triangles
            ));
        }
        if let Some((n, step)) = self.rounded_crossings() {
            advice.push(format!(
                "all coordinates are 32-bit numbers, up to {} apart here, and {n} of the listed triangles that meet do so by no more than \
                 that; write the surface with 64-bit coordinates, or as text with all digits",
                short(step)
            ));
        }
        if f.edge_min > 0.0 && f.edge_max / f.edge_min > POOR_RATIO {
            advice.push(format!(
                "the shortest edge is {} of the longest; if such edges are no intended detail, remove them in the program the surface comes from",
                short(f.edge_min / f.edge_max)
            ));
        }
        advice
    }

    /// The number of a triangle; of several files, its number in its own and the name of that.
    pub fn triangle_name(&self, t: u32) -> String {
        triangle_name(&self.surface.files, t)
    }

    /// A defect in words.
    pub fn defect_in_words(&self, defect: &Defect) -> String {
        defect.in_words(&self.surface.files)
    }

    /// Number of listed crossings that the steps of 32-bit coordinates explain, and the largest step. `None` where there are none, or
    /// where a coordinate has more digits.
    ///
    /// A crossing is explained if a corner of one triangle is off the plane of the other, by two steps at most.
    fn rounded_crossings(&self) -> Option<(usize, f64)> {
        let mut most = 0f64;
        for x in self.surface.points.iter().flat_map(|p| p.to_array()) {
            if f64::from(x as f32) != x {
                return None;
            }
            most = most.max(x.abs());
        }
        let step = f64::from((most as f32).next_up()) - most;
        let is_near = |a: u32, b: u32| {
            let [p, q, r] = self.surface.corners(a);
            let normal = (q - p).cross(r - p).normalize_or_zero();
            let off = self.surface.corners(b).map(|corner| normal.dot(corner - p).abs());
            off.into_iter().any(|distance| distance > 0.0 && distance <= 2.0 * step)
        };
        let is_explained = |defect: &&Defect| match defect {
            Defect::SelfIntersection { triangles: [a, b], .. } => {
                is_near(*a, *b) || is_near(*b, *a)
            }
            _ => false,
        };
        let n = self.validation.defects.iter().filter(is_explained).count();
        (n > 0).then_some((n, step))
    }

    fn json(&self) -> Value {
        let (surface, found, edges) = (self.surface, &self.validation, &self.validation.closedness);
        let bounds = [surface.bounds().low, surface.bounds().high].map(|p| p.to_array());
        let point = |v: u32| surface.points[v as usize].to_array();
        let open_loops: Vec<Value> = self
            .boundary_loops
            .iter()
            .map(|edge_loop| {
                json!({ "edges": edge_loop.n_edges, "length": edge_loop.length, "triangle": edge_loop.triangle, "at": edge_loop.at.to_array() })
            })
            .collect();
        let junctions: Vec<Value> = found
            .t_junctions
            .iter()
            .map(|j| {
                json!({ "at": j.at.to_array(), "triangle": j.triangle, "edge": j.edge.map(point), "distance": j.distance })
            })
            .collect();
        let mut fitness = json!(self.fitness);
        fitness["tets_expected"] = json!(self.tets_expected);
        fitness["forced_share"] = json!(self.forced_share());
        if surface.n_triangles() > 0 {
            let (least, at) = self.least_quality();
            // Infinite for a triangle without area; JSON then has null.
            fitness["least_quality"] = json!(least);
            fitness["least_quality_at"] = json!(at);
        }
        json!({
            "triangles": surface.n_triangles(), "vertices": surface.n_vertices(),
            "labels": surface.label_names, "label_sets": surface.label_sets, "bounds": bounds, "turned_triangles": self.n_turned,
            "edges": edges.n_edges, "parts": edges.n_components, "open_edges": edges.open.len(),
            "nonmanifold_edges": edges.n_nonmanifold, "two_sided_triangles": edges.two_sided.len(),
            "valid": self.is_valid(), "n_defects": found.n_defects,
            "defects": found.defects.iter().map(|defect| defect_json(defect, surface)).collect::<Vec<_>>(),
            "open_loops": open_loops, "t_junctions": junctions,
            "closing": { "tried": self.closing, "smallest": self.closes().map(|c| c.share) },
            "resolving": self.resolving, "enclosing": self.enclosing, "fitness": fitness, "advice": self.advice(), "cures": self.suggestions,
        })
    }
}

impl Serialize for SurfaceReport<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        self.json().serialize(to)
    }
}

/// Predicts the mesh with default sizes. Returns `None` if `cap` is too small or the prediction fails.
fn expected(surface: &surface::Surface, settings: &Settings, cap: u64) -> Option<Prepared> {
    if cap < least_for(surface) {
        return None;
    }
    let beside = settings.scratch_dir().join("check");
    predict(surface, &MeshOptions::default().into(), cap, &beside).ok()
}

fn defect_json(defect: &Defect, surface: &surface::Surface) -> Value {
    let mut value = json!({
        "code": defect.code(), "triangles": defect.triangles(), "at": defect.at().map(|p| p.to_array()),
        "message": defect.in_words(&surface.files), "help": defect.help(),
    });
    if surface.files.len() > 1 {
        let sources = defect.triangles().iter().filter_map(|&t| surface.source(t));
        let sources = sources.map(|(file, triangle)| json!({ "file": file, "triangle": triangle }));
        value["sources"] = sources.collect();
    }
    if let Defect::SelfIntersection { kind, .. } = defect {
        value["kind"] = json!(kind.word());
    }
    value
}
