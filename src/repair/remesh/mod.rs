//! Surfaces remeshed within a tolerance.
//!
//! Edges are divided, collapsed and flipped, and vertices moved on the surface, until triangles are even and as large as curvature and
//! thickness allow (Botsch and Kobbelt, "A remeshing approach to multiresolution modeling", 2004). Each change is refused that leaves
//! the tolerance either way (`envelope`), folds the surface, lets triangles touch, or takes the last triangle of a label. Kept
//! curves (`chains`) stay within the tolerance of their own input; corners stay where they are.
//!
//! Reading order: `settings`, `region` (convex sets around a triangle), `envelope` (the distance bound), `octree`, `mesh`, `chains`, `sizes` and
//! `sources` (wanted lengths), `change` (one replacement and its checks), `history` (what failed before), `operations`, `passes`.
//!
//! Is not: repair. The input must be valid.

mod chains;
mod change;
mod envelope;
mod history;
mod mesh;
mod octree;
mod operations;
mod passes;
mod region;
mod settings;
mod sizes;
mod sources;

#[cfg(test)]
mod tests;

use tetdb_base::geom::{Aabb, IdMap, Point};
use tetdb_base::storage::{ScratchSpace, filled};
use tetdb_base::surface::{Surface, SurfaceError, predict_split};

use change::Remesher;
use envelope::Envelope;
use mesh::{EdgeKey, Mesh, area_normal, cosine, smallest_angle};
use octree::Octree;
pub use settings::{RemeshReport, RemeshSettings};
use sizes::Sizes;

/// Bytes held for a triangle there ever was, with its share of vertices, lists and trees.
const BYTES_TRIANGLE: u64 = 400;
/// A prediction below this share of the true number never refuses what would fit.
const PREDICTION_LEAST: f64 = 0.5;
/// Lengths are at least this many tolerances where nothing else is asked for; finer triangles would be finer than the surface is known.
const LEAST: f64 = 2.0;

/// Edges this many times longer than the triangles at them are wide are sides of facets, as of a cylinder. Those of an even mesh are no curves,
/// however they bend.
const FACET: f64 = 2.0;

/// Remeshes a valid surface without sheets or embedded parts.
///
/// Lengths are at most `most` of their place. The result is the same for any number of threads. Memory: `scratch` for the tree of the input, and about 400 bytes for each triangle
/// that there ever is. A cancelled run unwinds ([`attempt`](tetdb_base::storage::attempt)).
///
/// # Errors
/// [`SurfaceError::Memory`] if the input does not fit, [`SurfaceError::SplitMemory`] if lengths ask for more triangles than fit.
pub fn remesh(
    surface: &Surface,
    settings: &RemeshSettings,
    most: &(dyn Fn(Point) -> f64 + Sync),
    scratch: &ScratchSpace,
    progress: &dyn Fn(f64),
) -> Result<(Surface, RemeshReport), SurfaceError> {
    let bytes_max = scratch.available();
    let triangles_max = (bytes_max / BYTES_TRIANGLE).min(1 << 30) as usize;
    if triangles_max < 2 * surface.n_triangles() {
        return Err(SurfaceError::Memory {
            bytes_max,
            triangles: surface.n_triangles(),
            vertices: surface.n_vertices(),
        });
    }
    let mut plain = surface.clone();
    let backs = merge_two_sided(&mut plain);
    let diagonal = plain.bounds().diagonal();
    let mut settings = *settings;
    settings.hmax = settings.hmax.min(diagonal);
    settings.hmin = if settings.hmin > 0.0 { settings.hmin } else { LEAST * settings.tolerance };
    settings.hmin = settings.hmin.min(settings.hmax);
    let n = predict_split(&plain, &|_| settings.hmax);
    if PREDICTION_LEAST * n > triangles_max as f64 {
        return Err(too_many(n as u64, bytes_max));
    }
    let mut mesh = Mesh::new(plain.points.clone(), plain.triangles.clone(), plain.labels.clone());
    let kept = kept_edges(&mesh, &settings);
    let chains = chains::build(&mut mesh, &kept, settings.feature_cos);
    // A hair less than asked for: coordinates are rounded.
    let envelope = Envelope::new(&plain, settings.tolerance * (1.0 - 1e-6), scratch);
    let sources = sources::sources(&mesh, &chains, &envelope, &settings, scratch);
    let sizes = Sizes::new(sources, settings.growth, [settings.hmin, settings.hmax], most, scratch);
    let mut octree = Octree::new(plain.bounds());
    for t in 0..mesh.triangles.len() as u32 {
        octree.insert(t, Aabb::around(mesh.corners(t)));
    }
    let wanted = mesh.points.iter().map(|p| sizes.at(*p)).collect();
    let report = RemeshReport {
        triangles_before: surface.n_triangles() as u64,
        distance_bound: settings.tolerance,
        angle_before: least_angle(surface),
        curves: chains.len() as u64,
        corners: mesh.kinds.iter().filter(|k| **k == mesh::VertexKind::Corner).count() as u64,
        ..RemeshReport::default()
    };
    let mut remesher = Remesher {
        mesh,
        wanted,
        octree,
        envelope,
        chains,
        sizes,
        settings: &settings,
        report,
        history: history::History::default(),
    };
    if !remesher.run(triangles_max, progress) {
        return Err(too_many(triangles_max as u64, bytes_max));
    }
    let result = surface_of(&remesher.mesh, &plain, &backs);
    let mut report = remesher.report;
    report.triangles = result.n_triangles() as u64;
    report.angle = least_angle(&result);
    Ok((result, report))
}

fn too_many(triangles: u64, bytes_max: u64) -> SurfaceError {
    SurfaceError::SplitMemory { bytes_max, bytes: triangles * BYTES_TRIANGLE, triangles }
}

/// Smallest angle in degrees.
fn least_angle(surface: &Surface) -> f64 {
    let all = (0..surface.n_triangles() as u32).map(|t| smallest_angle(surface.corners(t)));
    all.fold(f64::INFINITY, f64::min).to_degrees()
}

/// Leaves one of each pair of triangles with the same vertices, under a label of the pair; returns the labels of the pairs: front and back.
fn merge_two_sided(surface: &mut Surface) -> IdMap<u32, [u32; 2]> {
    let mut first: IdMap<[u32; 3], u32> = IdMap::default();
    let mut pairs: IdMap<[u32; 2], u32> = IdMap::default();
    let mut is_back = filled(surface.n_triangles(), false);
    let mut n_labels = surface.label_names.len() as u32;
    for t in 0..surface.n_triangles() as u32 {
        let mut key = surface.triangles[t as usize];
        key.sort_unstable();
        let &mut front = first.entry(key).or_insert(t);
        if front != t {
            is_back[t as usize] = true;
            let labels = [front, t].map(|t| surface.labels[t as usize]);
            let label = *pairs.entry(labels).or_insert_with(|| {
                n_labels += 1;
                n_labels - 1
            });
            surface.labels[front as usize] = label;
        }
    }
    let mut fronts = is_back.iter().map(|b| !b);
    surface.triangles.retain(|_| fronts.next() == Some(true));
    let mut fronts = is_back.iter().map(|b| !b);
    surface.labels.retain(|_| fronts.next() == Some(true));
    pairs.into_iter().map(|(labels, pair)| (pair, labels)).collect()
}

/// Edges that are kept as curves: where labels or normals differ, those without exactly two triangles that run on, and those of long
/// facets that no triangle can cross within the tolerance.
fn kept_edges(mesh: &Mesh, settings: &RemeshSettings) -> Vec<EdgeKey> {
    let mut edges = mesh.edges();
    edges.retain(|&(a, b)| {
        let [s, t] = mesh.at_edge(a, b)[..] else { return true };
        let runs = |t: u32| {
            let [x, y, z] = mesh.triangles[t as usize];
            [(x, y), (y, z), (z, x)].contains(&(a, b))
        };
        let normals = [s, t].map(|t| area_normal(mesh.corners(t)));
        let cos = cosine(normals[0], normals[1]);
        let length = mesh.points[a as usize].distance(mesh.points[b as usize]);
        let width = normals[0].length().min(normals[1].length()) / length;
        let chord = cos.clamp(-1.0, 1.0).acos() * width / 8.0;
        mesh.labels[s as usize] != mesh.labels[t as usize]
            || runs(s) == runs(t)
            || cos < settings.feature_cos
            || (length > FACET * width && chord > sources::CHORD * settings.tolerance)
    });
    edges
}

/// The triangles that are left, and the vertices they use, in order.
fn surface_of(mesh: &Mesh, input: &Surface, backs: &IdMap<u32, [u32; 2]>) -> Surface {
    let mut number: IdMap<u32, u32> = IdMap::default();
    let mut result = Surface {
        label_names: input.label_names.clone(),
        label_sets: input.label_sets.clone(),
        seeds: input.seeds.clone(),
        fills_rest: input.fills_rest,
        region_sizes: input.region_sizes.clone(),
        ..Surface::default()
    };
    for t in mesh.alive() {
        let triangle = mesh.triangles[t as usize].map(|v| {
            *number.entry(v).or_insert_with(|| {
                result.points.push(mesh.points[v as usize] + Point::ZERO);
                result.points.len() as u32 - 1
            })
        });
        let label = mesh.labels[t as usize];
        match backs.get(&label) {
            None => {
                result.triangles.push(triangle);
                result.labels.push(label);
            }
            Some(&[front, back]) => {
                let [a, b, c] = triangle;
                result.triangles.extend([triangle, [a, c, b]]);
                result.labels.extend([front, back]);
            }
        }
    }
    result
}
