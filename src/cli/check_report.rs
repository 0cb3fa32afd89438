//! What `check` found, for people and for programs.

use serde_json::{Value, json};

use super::console::Console;
use super::cures::{Cure, cures};
use super::failure::Failure;
use super::input::Space;
use super::memory;
use super::words::{self, count};
use tetdb_base::geom::Point;
use tetdb_base::geom::short;
use tetdb_base::shape::face_least;
use tetdb_base::storage::attempt;
use tetdb_base::surface::{
    BoundaryLoop, Closing, Defect, Fitness, Surface, Validation, boundary_loops, closing, fitness,
    repair_bytes, show, validate_with,
};
use tetdb_engine::api::predict;
use tetdb_engine::pipeline::{Options, Prepared, least_for};

/// Defects of one kind, holes and junctions listed for people.
const LISTED: usize = 8;
/// Of more triangles only `estimate` says how many tetrahedra they make, and `check -v`: sizes and their sum take two to three times what all the
/// rest of a check does.
const ESTIMATED_MAX: usize = 100_000;
/// Above this share of forced tetrahedra, or of triangles with small angles, better triangles are advised.
const POOR_SHARE: f64 = 0.01;
/// Above this ratio of edge lengths short edges are pointed at.
const POOR_RATIO: f64 = 1e5;

/// Everything that is known of a surface.
pub struct Findings<'a> {
    surface: &'a Surface,
    turned: usize,
    pub validation: Validation,
    boundary_loops: Vec<BoundaryLoop>,
    closing: Vec<Closing>,
    fitness: Fitness,
    /// Tetrahedra with default sizes, as they are estimated before a mesh; none of a surface that cannot be meshed.
    tets_expected: Option<f64>,
    cures: Vec<Cure>,
}

impl<'a> Findings<'a> {
    /// Looks at all of it; `turned` triangles were turned while reading. Errors: too little memory.
    pub fn of(
        surface: &'a Surface,
        turned: usize,
        space: Space,
        console: &Console,
    ) -> Result<Self, Failure> {
        let scratch = space.scratch(surface)?;
        let validation = attempt(|| validate_with(surface, &scratch))?;
        drop(scratch);
        let is_closed = validation.closedness.is_closed();
        let fitness = fitness(surface, &validation.closedness);
        let is_estimated = validation.is_valid()
            && (surface.n_triangles() <= ESTIMATED_MAX || console.is_verbose());
        let closing = match is_closed {
            true => Vec::new(),
            false if space.cap < repair_bytes(surface) => {
                console.note(&format!(
                    "note: what would close it was not tried, which takes {} of memory",
                    memory::show(repair_bytes(surface))
                ));
                Vec::new()
            }
            false => closing(surface),
        };
        let prepared = is_estimated.then(|| expected(surface, space)).flatten();
        Ok(Self {
            cures: (prepared.as_ref())
                .map_or_else(Vec::new, |prepared| cures(surface, &fitness, &prepared.field, space)),
            surface,
            turned,
            boundary_loops: boundary_loops(surface, &validation.closedness),
            closing,
            fitness,
            tets_expected: prepared.map(|prepared| prepared.estimate.tets()),
            validation,
        })
    }

    fn bounds(&self) -> [[f64; 3]; 2] {
        let bounds = self.surface.bounds();
        [bounds.low, bounds.high].map(|p| p.to_array())
    }

    pub fn is_valid(&self) -> bool {
        self.validation.is_valid()
    }

    /// The least distance that closes the surface.
    fn closes(&self) -> Option<&Closing> {
        self.closing.last().filter(|tried| tried.closes)
    }

    /// Share of the expected tetrahedra that cannot be good: at least one stands on each triangle.
    fn forced_share(&self) -> Option<f64> {
        let n = self.fitness.forcing_triangles as f64;
        self.tets_expected.map(|tets| n / tets)
    }

    /// The answer for programs.
    pub fn json(&self) -> Value {
        let (surface, found, edges) = (self.surface, &self.validation, &self.validation.closedness);
        let point = |v: u32| surface.points[v as usize].to_array();
        let open_loops: Vec<Value> = self
            .boundary_loops
            .iter()
            .map(|rim| {
                json!({ "edges": rim.n_edges, "length": rim.length, "triangle": rim.triangle, "at": rim.at.to_array() })
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
            // Infinite without area: then it is null.
            fitness["least_quality"] = json!(least);
            fitness["least_quality_at"] = json!(at.to_array());
        }
        json!({
            "schema": 1, "triangles": surface.n_triangles(), "vertices": surface.n_vertices(),
            "labels": surface.label_names, "bounds": self.bounds(), "turned_triangles": self.turned,
            "edges": edges.n_edges, "parts": edges.n_components, "open_edges": edges.open.len(),
            "nonmanifold_edges": edges.n_nonmanifold, "two_sided_triangles": edges.two_sided.len(),
            "valid": self.is_valid(), "n_defects": found.n_defects,
            "defects": found.defects.iter().map(defect_json).collect::<Vec<_>>(),
            "open_loops": open_loops, "t_junctions": junctions,
            "closing": { "tried": self.closing, "smallest": self.closes().map(|c| c.share) },
            "fitness": fitness, "advice": self.advice(), "cures": self.cures.iter().map(Cure::json).collect::<Vec<_>>(),
        })
    }

    /// The same for people; `surfaces` are the words of the command line.
    pub fn print(&self, surfaces: &[String], is_repaired: bool, console: &Console) {
        let edges = &self.validation.closedness;
        console.line(&format!(
            "{} triangles, {} vertices, {} edges, {}",
            self.surface.n_triangles(),
            self.surface.n_vertices(),
            edges.n_edges,
            count(edges.n_components as u64, "part")
        ));
        if self.surface.n_triangles() > 0 {
            console.line(&format!("box {}", words::bounds(self.bounds())));
            console.line(&format!("labels: {}", words::listed(&self.surface.label_names)));
        }
        if !edges.two_sided.is_empty() {
            console.line(&format!(
                "{} triangles are given from both sides: each pair is one facet between two regions",
                2 * edges.two_sided.len()
            ));
        }
        self.print_defects(console);
        if !edges.is_closed() {
            self.print_openness(surfaces, console);
        }
        self.print_fitness(console);
        for advice in self.advice() {
            console.line(&format!("advice: {advice}"));
        }
        for cure in &self.cures {
            console.line(&format!("cure: {}", cure.sentence(&surfaces.join(" "))));
        }
        if self.is_valid() {
            console.line("closed and free of defects: it can be meshed");
        } else {
            self.print_help(surfaces, is_repaired, console);
        }
    }

    /// Kind by kind, some of each.
    fn print_defects(&self, console: &Console) {
        let same_kind = |a: &Defect, b: &Defect| a.code() == b.code();
        for kind in self.validation.defects.chunk_by(same_kind) {
            let code = kind[0].code();
            // Open edges are told hole by hole.
            if code == "open-surface" {
                continue;
            }
            let n = match &kind[0] {
                Defect::SelfIntersection { .. } => self.validation.n_intersections,
                _ => kind.len() as u64,
            };
            console.line(&format!("{code}: {n}"));
            for defect in kind.iter().take(LISTED) {
                let at = defect.at().map_or(String::new(), |p| format!(", near {}", show(p)));
                console.line(&format!("  {defect}{at}"));
            }
            tell_rest(n, console);
        }
    }

    fn print_openness(&self, surfaces: &[String], console: &Console) {
        let open = &self.validation.closedness.open;
        console.line(&format!(
            "{} around {}:",
            count(open.len() as u64, "open edge"),
            count(self.boundary_loops.len() as u64, "hole")
        ));
        for rim in self.boundary_loops.iter().take(LISTED) {
            console.line(&format!(
                "  {} edges, length {}, at triangle {} near {}",
                rim.n_edges,
                short(rim.length),
                rim.triangle,
                show(rim.at)
            ));
        }
        tell_rest(self.boundary_loops.len() as u64, console);
        let junctions = &self.validation.t_junctions;
        if !junctions.is_empty() {
            console.line(&format!("{}:", count(junctions.len() as u64, "T-junction")));
        }
        for junction in junctions.iter().take(LISTED) {
            let how = match junction.distance {
                0.0 => "exactly".to_owned(),
                distance => format!("but for {}", short(distance)),
            };
            console.line(&format!(
                "  a vertex at {} lies on an open edge of triangle {}, {how}",
                show(junction.at),
                junction.triangle
            ));
        }
        tell_rest(junctions.len() as u64, console);
        self.print_closing(surfaces, console);
    }

    fn print_closing(&self, surfaces: &[String], console: &Console) {
        let Some(last) = self.closing.last() else {
            return;
        };
        let Some(closes) = self.closes() else {
            console.line(&format!(
                "no repair closes it: {} edges stay open even when points nearer than {:e} of the box diagonal are joined",
                last.open_edges, last.share
            ));
            return;
        };
        let surfaces = surfaces.join(" ");
        let left = match closes.defects_left {
            Some(0) | None => "and no defect is left".to_owned(),
            Some(n) => format!("and {n} other defects are left"),
        };
        console.line(&if closes.share > 0.0 {
            format!(
                "all close if points nearer than {:e} of the box diagonal ({}) are joined, {left}: `tetdb check {surfaces} --repair --weld {:e} --write OUT`",
                closes.share, short(closes.distance), closes.share
            )
        } else {
            format!("all close by a repair that joins no points, {left}: `tetdb check {surfaces} --repair --write OUT`")
        });
    }

    fn print_fitness(&self, console: &Console) {
        let f = &self.fitness;
        if self.surface.n_triangles() == 0 {
            return;
        }
        console.line(&format!(
            "shapes: {} % of the triangles have an angle below 5 degrees (least {}); edges {} to {}, median {}",
            short(100.0 * f.small_angle_share),
            short(f.angle_least_degrees),
            short(f.edge_min),
            short(f.edge_max),
            short(f.edge_median)
        ));
        if let (Some(tets), Some(share)) = (self.tets_expected, self.forced_share()) {
            let forced = match f.forcing_triangles {
                0 => "no triangle forces a quality of 2 or worse".to_owned(),
                n => format!(
                    "at least {} % of them stand on one of {n} triangles whose shape alone makes quality 2 or worse",
                    short(100.0 * share)
                ),
            };
            console.line(&format!(
                "mesh: about {} tetrahedra with default sizes; {forced}",
                rounded(tets)
            ));
        } else if self.is_valid() {
            console.line(&format!(
                "mesh: `tetdb estimate` says what to expect; {} of the triangles make quality 2 or worse on them",
                f.forcing_triangles
            ));
        }
        if self.is_valid() {
            let (least, at) = self.least_quality();
            if f.forcing_triangles > 0 && least.is_finite() {
                console.line(&format!(
                    "worst: no tetrahedron on triangle {} at ({}, {}, {}) can have a quality below {}",
                    f.worst_triangle,
                    short(at.x),
                    short(at.y),
                    short(at.z),
                    short(least)
                ));
            }
        }
    }

    /// The least quality that a tetrahedron on the worst triangle can have, and the triangle's centroid.
    fn least_quality(&self) -> (f64, Point) {
        let corners = self.surface.corners(self.fitness.worst_triangle);
        let [a, b, c] = corners;
        (face_least(corners), (a + b + c) / 3.0)
    }

    /// What would make a better mesh.
    fn advice(&self) -> Vec<String> {
        let f = &self.fitness;
        let mut advice = Vec::new();
        if f.small_angle_share > POOR_SHARE || self.forced_share().is_some_and(|s| s > POOR_SHARE) {
            let hopeless = match f.hopeless_triangles {
                0 => String::new(),
                n => format!(", {n} of them 10 or worse"),
            };
            advice.push(format!(
                "{} triangles make every tetrahedron on them quality 2 or worse{hopeless}; all input triangles stay, so remesh the \
                 surface first, with angles above 15 degrees",
                f.forcing_triangles
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

    fn print_help(&self, surfaces: &[String], is_repaired: bool, console: &Console) {
        let Some(first) = self.validation.defects.first() else {
            return;
        };
        // How to close it was told with the holes.
        if matches!(first, Defect::OpenEdge { .. }) && self.closes().is_some() {
            return;
        }
        let is_dropped = matches!(first, Defect::Degenerate { .. } | Defect::Duplicate { .. });
        let help = if is_dropped && !is_repaired {
            format!(
                "`tetdb check {} --repair --write OUT` drops such triangles",
                surfaces.join(" ")
            )
        } else if matches!(first, Defect::OpenEdge { .. }) {
            // That no repair does was told with the holes.
            "close it where the surface was made".to_owned()
        } else {
            first.help().to_owned()
        };
        console.line(&format!("help: {help}"));
    }
}

/// Default sizes and what they make; none where no size makes sense.
fn expected(surface: &Surface, space: Space) -> Option<Prepared> {
    if space.cap < least_for(surface) {
        return None;
    }
    predict(surface, &Options::default(), space.cap, space.beside).ok()
}

fn defect_json(defect: &Defect) -> Value {
    let mut value = json!({
        "code": defect.code(), "triangles": defect.triangles(), "at": defect.at().map(|p| p.to_array()),
        "message": defect.to_string(), "help": defect.help(),
    });
    if let Defect::SelfIntersection { kind, .. } = defect {
        value["kind"] = json!(kind.word());
    }
    value
}

fn tell_rest(n: u64, console: &Console) {
    if n > LISTED as u64 {
        console.line(&format!("  ... {n} in all; --json lists them"));
    }
}

/// Two digits are all an estimate has.
fn rounded(x: f64) -> String {
    let unit = 10f64.powf(x.log10().floor() - 1.0).max(1.0);
    format!("{:.0}", (x / unit).round() * unit)
}
