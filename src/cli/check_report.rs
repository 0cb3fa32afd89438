//! The report on a surface, printed for people.

use super::console::Console;
use super::words::{self, count};
use tetdb_engine::api::{Code, Defect, ResolveReport, Surface, SurfaceReport, short, show_point};

/// Largest number of defects of one kind, of holes and of junctions that are listed.
const LISTED: usize = 8;

/// A report to print. `surfaces` are the surfaces as typed on the command line.
pub struct Printed<'a> {
    pub surface: &'a Surface,
    pub report: &'a SurfaceReport<'a>,
    pub surfaces: &'a str,
    pub is_repaired: bool,
}

impl Printed<'_> {
    pub fn print(&self, console: &Console) {
        let edges = &self.report.validation.closedness;
        console.line(&format!(
            "{} triangles, {} vertices, {} edges, {}",
            self.surface.n_triangles(),
            self.surface.n_vertices(),
            edges.n_edges,
            count(edges.n_components as u64, "part")
        ));
        if self.surface.n_triangles() > 0 {
            console.line(&format!("box {}", words::bounds(self.surface.bounds())));
            console.line(&format!("labels: {}", words::listed(self.surface.labels())));
        }
        if !edges.two_sided.is_empty() {
            console.line(&format!(
                "{} triangles are given from both sides: each pair is one facet between two regions",
                2 * edges.two_sided.len()
            ));
        }
        self.print_defects(console);
        if !edges.is_closed() {
            self.print_openness(console);
        }
        self.print_fitness(console);
        for advice in self.report.advice() {
            console.line(&format!("advice: {advice}"));
        }
        if self.report.is_poorly_shaped() {
            let how = "puts even triangles within 0.05% of the box diagonal in their place";
            let line = match self.report.is_valid() {
                true => format!("cure: `tetdb mesh {} --remesh-surface` {how}", self.surfaces),
                false => format!("cure: --remesh-surface, added to the command below, {how}"),
            };
            console.line(&line);
        }
        for suggestion in &self.report.suggestions {
            let surfaces = self.surfaces;
            let way = match suggestion.weld {
                None => {
                    format!("`tetdb mesh {surfaces} --refine-surface` divides long triangles first")
                }
                Some(share) => format!(
                    "`tetdb check {surfaces} --repair --weld {share:e} --write OUT` joins points nearer than {share:e} of the box diagonal"
                ),
            };
            console.line(&format!("cure: {way}: {}", suggestion.effect));
        }
        if self.report.is_valid() {
            console.line("closed and free of defects: it can be meshed");
        } else {
            self.print_help(console);
        }
    }

    fn print_defects(&self, console: &Console) {
        let same_kind = |a: &Defect, b: &Defect| a.code() == b.code();
        for kind in self.report.validation.defects.chunk_by(same_kind) {
            let code = kind[0].code();
            // Open edges are listed by hole.
            if code == Code::OpenSurface {
                continue;
            }
            let n = match &kind[0] {
                Defect::SelfIntersection { .. } => self.report.validation.n_intersections,
                _ => kind.len() as u64,
            };
            console.line(&format!("{code}: {n}"));
            for defect in kind.iter().take(LISTED) {
                let at = defect.at().map_or(String::new(), |p| format!(", near {}", show_point(p)));
                console.line(&format!("  {}{at}", self.report.defect_in_words(defect)));
            }
            print_rest(n, console);
        }
    }

    fn print_openness(&self, console: &Console) {
        let open = &self.report.validation.closedness.open;
        console.line(&format!(
            "{} around {}:",
            count(open.len() as u64, "open edge"),
            count(self.report.boundary_loops.len() as u64, "hole")
        ));
        for edge_loop in self.report.boundary_loops.iter().take(LISTED) {
            console.line(&format!(
                "  {} edges, length {}, at triangle {} near {}",
                edge_loop.n_edges,
                short(edge_loop.length),
                self.report.triangle_name(edge_loop.triangle),
                show_point(edge_loop.at)
            ));
        }
        print_rest(self.report.boundary_loops.len() as u64, console);
        let junctions = &self.report.validation.t_junctions;
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
                show_point(junction.at),
                self.report.triangle_name(junction.triangle)
            ));
        }
        print_rest(junctions.len() as u64, console);
        self.print_closing(console);
    }

    fn print_closing(&self, console: &Console) {
        let Some(last) = self.report.closing.last() else {
            return;
        };
        let Some(closes) = self.report.closes() else {
            console.line(&format!(
                "joining points does not close it: {} edges stay open even when points nearer than {:e} of the box diagonal are joined",
                last.open_edges, last.share
            ));
            return;
        };
        let surfaces = self.surfaces;
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
        let f = &self.report.fitness;
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
        if let (Some(tets), Some(share)) = (self.report.tets_expected, self.report.forced_share()) {
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
        } else if self.report.is_valid() {
            console.line(&format!(
                "mesh: `tetdb estimate` says what to expect; {} of the triangles make quality 2 or worse on them",
                f.forcing_triangles
            ));
        }
        if self.report.is_valid() {
            let (least, [x, y, z]) = self.report.least_quality();
            if f.forcing_triangles > 0 && least.is_finite() {
                console.line(&format!(
                    "worst: no tetrahedron on triangle {} at ({}, {}, {}) can have a quality below {}",
                    self.report.triangle_name(f.worst_triangle),
                    short(x),
                    short(y),
                    short(z),
                    short(least)
                ));
            }
        }
    }

    fn print_help(&self, console: &Console) {
        let Some(first) = self.report.validation.defects.first() else {
            return;
        };
        // The list of holes already says how to close them.
        if matches!(first, Defect::OpenEdge { .. }) && self.report.closes().is_some() {
            return;
        }
        let is_dropped =
            |d: &Defect| matches!(d, Defect::Degenerate { .. } | Defect::Duplicate { .. });
        let all_dropped =
            self.report.validation.defects.iter().all(is_dropped) && !self.is_repaired;
        if let Some(done) = self.report.enclosing.as_ref().filter(|_| !all_dropped) {
            console.line(&format!(
                "help: `tetdb mesh {} --repair winding` closes it first: {}",
                self.surfaces,
                done.in_words()
            ));
            return;
        }
        if let Some(ResolveReport { done, n_defects, regions, .. }) = &self.report.resolving {
            let rest = match *n_defects {
                0 => String::new(),
                n => format!("; {} left", words::count(n, "other defect")),
            };
            // The rule that fills what the parts fill together.
            let regions = regions.first().map_or(String::new(), |r| format!(" --regions {r}"));
            console.line(&format!(
                "help: `tetdb mesh {} --repair resolve{regions}` divides crossing triangles first: {} triangles divided, {} vertices added, none farther than {} from its exact place{rest}",
                self.surfaces, done.divided, done.points_added, short(done.moved_most)
            ));
            if *n_defects > 0 {
                self.print_wrap(console);
            }
            return;
        }
        let help = if is_dropped(first) && !self.is_repaired {
            format!("`tetdb check {} --repair --write OUT` drops such triangles", self.surfaces)
        } else if matches!(first, Defect::OpenEdge { .. }) {
            // The list of holes already says that no repair closes them.
            "close it where the surface was made".to_owned()
        } else {
            first.help().to_owned()
        };
        console.line(&format!("help: {help}"));
        if !all_dropped {
            self.print_wrap(console);
        }
    }

    /// Offers what works where nothing cheaper does.
    fn print_wrap(&self, console: &Console) {
        if self.surface.n_triangles() > 0 {
            console.line(&format!(
                "help: `tetdb mesh {} --repair wrap` puts a closed surface around all of it, at an offset; that was not tried",
                self.surfaces
            ));
        }
    }
}

fn print_rest(n: u64, console: &Console) {
    if n > LISTED as u64 {
        console.line(&format!("  ... {n} in all; --json lists them"));
    }
}

/// Rounds an estimate to its two significant digits.
fn rounded(x: f64) -> String {
    let unit = 10f64.powf(x.log10().floor() - 1.0).max(1.0);
    format!("{:.0}", (x / unit).round() * unit)
}
