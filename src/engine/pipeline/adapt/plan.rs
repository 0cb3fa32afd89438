//! The sub-domains that a field asks to mesh again, and the lengths there.

use std::collections::BTreeSet;

use super::arrays::MeshArrays;
use super::estimate::ErrorEstimate;
use super::sizes::{FoundSizes, SizeLimits, sizes_for};
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Options;
use crate::pipeline::remesh::{NewSizes, Values, room};
use tetdb_base::storage::{Budget, attempt};
use tetdb_schema::field::{FieldNumber, FieldRow};
use tetdb_store::store::Catalog;

/// A sub-domain is meshed again when more than this share of its load has other lengths. Meshing it takes as long for one changed
/// tetrahedron as for all; below a twentieth the error hardly changes.
const CHANGED_SHARE: f64 = 0.05;

/// A request to adapt a mesh: a field, a number of tetrahedra, limits of lengths.
#[derive(Clone, Debug)]
pub struct AdaptRequest {
    /// A field at vertices, of numbers that are no integers and are all finite.
    pub field: FieldRow,
    /// The component of it.
    pub component: u32,
    pub estimate: ErrorEstimate,
    /// Wanted number of tetrahedra.
    pub tets: f64,
    /// Least and greatest length.
    pub limits: [f64; 2],
    /// Slope with which lengths may grow.
    pub beta: f64,
    /// Ratio of two lengths above which they differ.
    pub change: f64,
    /// Text for the record.
    pub requested: String,
}

/// A sub-domain under the lengths that a field asks for.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct AdaptForecast {
    /// Rank of the sub-domain.
    pub id: u32,
    /// Number of its tetrahedra now.
    pub tets: u64,
    /// Predicted number afterwards.
    pub predicted_tets: f64,
    /// Share of its load where lengths change.
    pub changed_share: f64,
    /// True if it is meshed again.
    pub is_changed: bool,
}

/// Triangles that stay though they are longer than wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct LongFaces {
    /// Number of all triangles of the kind.
    pub triangles: u64,
    /// Those with an edge longer than the wanted length at their corners, by more than the ratio that counts as a change.
    pub too_long: u64,
    /// Largest ratio of edge and wanted length.
    pub greatest_ratio: f64,
}

/// The sub-domains that an adaptation meshes again, and the tetrahedra and lengths to expect.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct AdaptPlan {
    /// Number of tetrahedra now.
    pub tets: u64,
    /// Wanted number.
    pub wanted_tets: f64,
    /// Predicted number; the wanted one cannot always be had within limits of lengths, and beside a surface that stays.
    pub predicted_tets: f64,
    /// Least and greatest length at vertices.
    pub sizes: [f64; 2],
    /// All sub-domains, by rank.
    pub subdomains: Vec<AdaptForecast>,
    /// Triangles of the surface; those between two sub-domains count in both.
    pub surface: LongFaces,
    /// Faces of interfaces.
    pub interfaces: LongFaces,
}

impl AdaptPlan {
    /// Ranks of the sub-domains to mesh again.
    pub fn changed(&self) -> BTreeSet<u32> {
        self.subdomains.iter().filter(|s| s.is_changed).map(|s| s.id).collect()
    }
}

/// Finds the sub-domains to mesh again and the sizes for them; `None` where the field is linear but for rounding.
///
/// Half of the free memory is used at most. Errors: damage; the disk; too little memory.
pub fn plan_adaptation(
    catalog: &mut Catalog,
    options: &Options,
    request: &AdaptRequest,
    budget: &Budget,
) -> Result<Option<(AdaptPlan, NewSizes)>, PipelineError> {
    let _lease = budget.lease(budget.available() / 2, "estimating sizes")?;
    let scratch = room(catalog, budget)?;
    let memory = budget.available() / 4;
    attempt(|| {
        let field = (&request.field, request.component);
        let mut mesh = MeshArrays::read(catalog, options, field, &scratch, memory)?;
        let epsilon = match request.field.number {
            FieldNumber::F32 => f64::from(f32::EPSILON),
            _ => f64::EPSILON,
        };
        let relative = request.estimate.relative_sizes(&mut mesh, epsilon, &scratch)?;
        let Some(relative) = relative else {
            return Ok(None);
        };
        let limits = SizeLimits { range: request.limits, beta: request.beta };
        let mut found = sizes_for(&mut mesh, relative, limits, request.tets, &scratch);
        let plan = describe(catalog, &mut mesh, &mut found, request, memory)?;
        let mut lengths = scratch.builder();
        let ranks = plan.changed();
        for part in mesh.parts.iter().filter(|part| ranks.contains(&part.row.rank)) {
            for v in part.first_vertex..part.first_vertex + part.row.vertices as usize {
                lengths.push(found.h.get(mesh.nodes.get(v) as usize));
            }
        }
        let sizes = NewSizes {
            field: None,
            base: None,
            values: Some(Values::Nearest(lengths.finish().freeze())),
            factor: 1.0,
            limits: request.limits,
            beta: request.beta,
            requested: request.requested.clone(),
        };
        Ok(Some((plan, sizes)))
    })?
}

fn describe(
    catalog: &mut Catalog,
    mesh: &mut MeshArrays,
    found: &mut FoundSizes,
    request: &AdaptRequest,
    memory: u64,
) -> Result<AdaptPlan, PipelineError> {
    let mut plan = AdaptPlan {
        tets: mesh.parts.iter().map(|part| part.row.tets).sum(),
        wanted_tets: request.tets,
        predicted_tets: 0.0,
        sizes: [f64::INFINITY, 0.0],
        subdomains: Vec::new(),
        surface: LongFaces::default(),
        interfaces: LongFaces::default(),
    };
    for part in 0..mesh.parts.len() {
        let (rank, tets) = (mesh.parts[part].row.rank, mesh.parts[part].row.tets);
        let changed_share = changed_share(mesh, part, found, request.change);
        let is_changed = changed_share > CHANGED_SHARE;
        let predicted_tets = if is_changed { found.tets[part].round() } else { tets as f64 };
        plan.predicted_tets += predicted_tets;
        let forecast = AdaptForecast { id: rank, tets, predicted_tets, changed_share, is_changed };
        plan.subdomains.push(forecast);
        let first = mesh.parts[part].first_vertex;
        let mut see = |faces: &mut LongFaces, vertices: [u32; 3]| {
            let nodes = vertices.map(|v| mesh.nodes.get(first + v as usize));
            let [a, b, c] = mesh.corners(nodes);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let wanted: f64 = nodes.map(|v| found.wanted(v as usize)).iter().sum();
            let ratio = 3.0 * longest / wanted;
            faces.triangles += 1;
            faces.too_long += u64::from(ratio > request.change);
            faces.greatest_ratio = faces.greatest_ratio.max(ratio);
        };
        let mut open = catalog.open_subdomain(rank, memory as usize)?;
        for facet in open.facets() {
            see(&mut plan.surface, facet?.vertices);
        }
        for face in open.interfaces() {
            let face = face?;
            // Both sub-domains have it.
            if face.other > rank {
                see(&mut plan.interfaces, face.vertices);
            }
        }
    }
    for v in 0..mesh.n_nodes() {
        if mesh.present.get(v) == 0.0 {
            continue;
        }
        let h = found.h.get(v);
        plan.sizes = [plan.sizes[0].min(h), plan.sizes[1].max(h)];
    }
    Ok(plan)
}

/// The share of a sub-domain's load where lengths change, with the shorter of both lengths in each tetrahedron.
fn changed_share(mesh: &mut MeshArrays, part: usize, found: &mut FoundSizes, change: f64) -> f64 {
    let first = mesh.parts[part].first_tet;
    let [mut all, mut changed] = [0.0; 2];
    for t in first..first + mesh.parts[part].row.tets as usize {
        let tet = mesh.tet(t);
        let [a, b, c, d] = mesh.corners(tet);
        let volume = (b - a).dot((c - a).cross(d - a)) / 6.0;
        let present: f64 = tet.map(|v| mesh.present.get(v as usize)).iter().sum();
        let new: f64 = tet.map(|v| found.h.get(v as usize)).iter().sum();
        let load = volume / present.min(new).powi(3);
        all += load;
        if new > present * change || present > new * change {
            changed += load;
        }
    }
    changed / f64::max(all, f64::MIN_POSITIVE)
}
