//! Meshes a shape through the library in one of two ways, and classifies the outcome.
//!
//! [`whole`] does the same as the command line: a store on disk, all steps, and the audit against the surface. [`recovery`] only creates
//! the colored coarse mesh, in memory, and checks it with a model of its own. It is fast enough for a hundred thousand cases.

use std::collections::HashMap;
use std::time::Duration;

use tetdb_base::geom::{HilbertFrame, orient};
use tetdb_base::storage::{Budget, FlatPages};
use tetdb_base::surface::{Surface, orient_alike, validate};
use tetdb_engine::pipeline::{self, MeshOptions, Options, OptionsText, PipelineError};
use tetdb_kernel::boundary::{BoundaryError, RecoveryReport, RegionPolicy, fill_regions, recover};
use tetdb_kernel::delaunay::{Kernel, enclose, insertion_key};
use tetdb_kernel::mesh::{FaceRef, Mesh, MeshFacet, VertexTag};
use tetdb_schema::catalog::Job;
use tetdb_store::audit::{self, Level, VerifyOptions};
use tetdb_store::store::Catalog;

use super::shape::Shape;

/// Outcome of meshing a shape.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// A mesh that passed its check, with this number of tetrahedra.
    Meshed { tets: u64, recovery: Recovery },
    /// The validator refused it.
    Refused(String),
    /// Recovery gave up where triangles are nearer to each other than [`NEAR`]. Doubles may have no solution there.
    TooNear(String),
    /// Recovery gave up elsewhere.
    GaveUp(String),
    /// The check found the mesh wrong.
    Wrong(String),
}

/// The counts of recovery that are compared.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recovery {
    pub missing: u32,
    pub by_points: u32,
    pub steiner: u32,
    pub time: Duration,
}

impl From<&RecoveryReport> for Recovery {
    fn from(r: &RecoveryReport) -> Self {
        Self {
            missing: r.missing_facets,
            by_points: r.facets_by_points,
            steiner: r.steiner,
            time: r.map_time + r.flip_time + r.point_time,
        }
    }
}

/// Triangles nearer than this, in radians or relative to their size, may leave no double between them. The value is a few units in the
/// last place of coordinates about ten times their size.
const NEAR: f64 = 1e-13;

fn given_up(error: &BoundaryError) -> Outcome {
    match error {
        BoundaryError::NotRecovered { nearness: Some(nearness), .. } if nearness.value < NEAR => {
            Outcome::TooNear(error.to_string())
        }
        _ => Outcome::GaveUp(error.to_string()),
    }
}

/// Welds, orients and validates the shape.
fn valid(shape: &Shape) -> Result<Surface, String> {
    let mut surface = shape.surface();
    orient_alike(&mut surface);
    match validate(&surface).accept() {
        Ok(()) => Ok(surface),
        Err(error) => Err(error.to_string()),
    }
}

/// Runs all steps in a store, with the full audit against the surface.
pub fn whole(shape: &Shape, optimize: &str) -> Outcome {
    let surface = match valid(shape) {
        Ok(surface) => surface,
        Err(why) => return Outcome::Refused(why),
    };
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("case.tetdb");
    let job = Job { options: String::new(), surfaces: Vec::new(), tool_version: String::new() };
    let mut catalog = Catalog::create(&path, &job).expect("an empty folder");
    // Few tetrahedra, because the test is about the surface.
    let text = OptionsText {
        hsiz: Some("1000%".into()),
        hgrad: Some("10".into()),
        regions: Some("all".into()),
        optimize: Some(optimize.into()),
        ..OptionsText::default()
    };
    let options = Options::from(MeshOptions::try_from(text).expect("good options"));
    let budget = Budget::new(256 << 20);
    let made = pipeline::mesh(&mut catalog, &surface, &options, &budget, &pipeline::silent);
    let summary = match made {
        Ok(summary) => summary,
        Err(PipelineError::Boundary(error)) => return given_up(&error),
        Err(error) => return Outcome::GaveUp(error.to_string()),
    };
    catalog.close().expect("the store can be closed");
    let mut store = Catalog::open(&path).expect("the store was just made");
    let options = VerifyOptions::new(Level::Delaunay, 64 << 20, dir.path().to_owned());
    let report = audit::verify(&mut store, Some(&surface), &options).expect("the store is sound");
    let n = surface.n_triangles() as u64;
    if !report.valid || report.triangles_missing != 0 || report.triangles_present != n {
        return Outcome::Wrong(format!(
            "{:?}; {} of {n} triangles present, {} unfilled, {} missing; {:?}",
            report.findings,
            report.triangles_present,
            report.triangles_unfilled,
            report.triangles_missing,
            report.offenders.first()
        ));
    }
    let recovery = summary.coarse.map(|c| Recovery::from(&c.recovery));
    Outcome::Meshed { tets: report.tets, recovery: recovery.unwrap_or_default() }
}

/// The coarse mesh in memory, checked by [`wrong`].
pub fn recovery(shape: &Shape) -> Outcome {
    let surface = match valid(shape) {
        Ok(surface) => surface,
        Err(why) => return Outcome::Refused(why),
    };
    let mut mesh = delaunay(&surface);
    let report = match recover(&mut mesh) {
        Ok(report) => report,
        Err(error) => {
            // When recovery gives up, it must still leave a valid mesh.
            return match wrong(&mut mesh, None) {
                None => given_up(&error),
                Some(what) => Outcome::Wrong(format!("{what}, after: {error}")),
            };
        }
    };
    if let Err(error) = fill_regions(&mut mesh, &RegionPolicy::All.into()) {
        return Outcome::Wrong(error.to_string());
    }
    match wrong(&mut mesh, Some(&surface)) {
        None => {
            Outcome::Meshed { tets: u64::from(mesh.n_tets()), recovery: Recovery::from(&report) }
        }
        Some(what) => Outcome::Wrong(what),
    }
}

/// The Delaunay mesh of the surface's points, with its triangles as facets.
pub fn delaunay(surface: &Surface) -> Mesh<FlatPages> {
    let mut mesh = Mesh::new(FlatPages::default());
    let bounds = surface.bounds();
    let mut hint = enclose(&mut mesh, &bounds);
    let frame = HilbertFrame::new(&bounds);
    let mut order: Vec<u32> = (0..surface.points.len() as u32).collect();
    order.sort_by_key(|&i| (insertion_key(&frame, surface.points[i as usize]), i));
    let mut kernel = Kernel::default();
    let mut id = vec![0; surface.points.len()];
    for i in order {
        let p = surface.points[i as usize];
        let v = mesh.add_vertex(p, 0.0);
        mesh.set_vertex_attribute(v, VertexTag::Surface, i);
        hint = kernel.insert(&mut mesh, v, p, hint).expect("inside the box and new");
        id[i as usize] = v;
    }
    for (n, t) in surface.triangles.iter().enumerate() {
        mesh.add_facet(MeshFacet {
            vertices: t.map(|i| id[i as usize]),
            label: 0,
            input: n as u64,
            regions: [0; 2],
        });
    }
    mesh.refresh_tet_of();
    mesh
}

/// The first defect of a mesh, if any.
///
/// Checks that volumes are positive and neighbors mutual. With a surface, also checks that required faces are its triangles, that open
/// faces are required, and that no vertices were added on the surface.
fn wrong(mesh: &mut Mesh<FlatPages>, surface: Option<&Surface>) -> Option<String> {
    let sorted = |mut f: [u32; 3]| {
        f.sort_unstable();
        f
    };
    let mut seen: HashMap<[u32; 3], u32> = HashMap::new();
    for n in 0..mesh.n_facets() {
        seen.insert(sorted(mesh.facet(n).vertices), 0);
    }
    let (mut n, mut from) = (0, 0);
    while let Some((t, tet)) = mesh.next_tet(from) {
        (n, from) = (n + 1, t + 1);
        let [a, b, c, d] = mesh.points(&tet);
        if orient(a, b, c, d) <= 0.0 {
            return Some(format!("tetrahedron {t} is not positive"));
        }
        for i in 0..4 {
            let face = sorted(tet.face(i));
            if tet.is_required(i) {
                match seen.get_mut(&face) {
                    Some(times) => *times += 1,
                    None => return Some(format!("face {face:?} is required and no facet")),
                }
            }
            let across = tet.neighbor[i];
            if !across.exists() {
                if surface.is_some() && !tet.is_required(i) {
                    return Some(format!("face {face:?} is open"));
                }
                continue;
            }
            let other = mesh.tet(across.tet());
            if other.neighbor[across.face()] != FaceRef::new(t, i)
                || sorted(other.face(across.face())) != face
                || other.is_required(across.face()) != tet.is_required(i)
            {
                return Some(format!("the sides of face {face:?} differ"));
            }
        }
    }
    if n != mesh.n_tets() {
        return Some(format!("{n} tetrahedra and not {}", mesh.n_tets()));
    }
    let surface = surface?;
    for n in 0..mesh.n_facets() {
        let facet = mesh.facet(n);
        if seen[&sorted(facet.vertices)] == 0 {
            return Some(format!("triangle {} is no face", facet.input));
        }
        let input = surface.triangles[facet.input as usize];
        for (v, i) in facet.vertices.into_iter().zip(input) {
            if mesh.vertex_attribute(v) != (VertexTag::Surface, i)
                || mesh.point(v) != surface.points[i as usize]
            {
                return Some(format!("vertex {v} is not the input's {i}"));
            }
        }
    }
    None
}
