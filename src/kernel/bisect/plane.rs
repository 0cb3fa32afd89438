//! The plane of a cut: across the longest axis of inertia, where it divides the predicted load as wanted.
//!
//! The paper takes the axis of inertia of the centroids of the coarse mesh. Here every piece weighs its load, so that the axis is that of
//! the mesh to come. Candidates are the axes of the coordinates, and those of inertia along which the load spreads farther. The one whose
//! plane promises the fewest interface faces wins: for a cube, whose axes of inertia are arbitrary, that is a plane along its sides.
//!
//! Source: the paper, section 1.1, "Defining the cutting plane".

use super::axes::{Moments, principal_axes};
use super::load::SizeFn;
use super::load_profile::{ChosenPlane, LoadProfile, gather_profiles};
use super::surface::{CuttingSurface, Plane};
use crate::mesh::Mesh;
use tetdb_base::geom::Point;
use tetdb_base::storage::Pages;

/// Positions tried on each side of the balanced one, and their distance in units of h: a plane that grazes a flat wall cuts
/// its tetrahedra to slices.
const SHIFTS: i32 = 6;
const SHIFT: f64 = 0.2;
/// A fixed vertex nearer to the plane than this, in units of its h, counts as grazed.
const GRAZED: f64 = 0.35;
/// Largest share of the load a shift may bring to the other side: over a dozen cuts it stays within the balance wanted.
const TOLERANCE: f64 = 0.003;
/// Least gain in grazed vertices that a shift away from the balanced position must bring, as a share.
const GAIN: f64 = 0.1;
/// A plane across a coordinate is preferred where it costs a hundredth more at most. An axis of inertia along which the load spreads
/// little farther than along a coordinate is no candidate at all: sections of equal loads are the smaller the longer the body is.
const PREFERRED: f64 = 0.99;

/// Choices of the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PlaneChoice {
    /// As described at the head of this module.
    #[default]
    Load,
    /// As in the paper: centroids of the mesh, unweighted; the axis of the largest moment; placed by load.
    Centroids,
    /// The given plane.
    Given(Plane),
}

/// Chooses the plane that leaves the share `low` of the load on its low side.
///
/// Sizes must be set at all vertices. `origin` is a point near the mesh: moments are taken about it, so that digits are kept.
pub fn choose<P: Pages>(
    mesh: &mut Mesh<P>,
    h: &SizeFn,
    origin: Point,
    low: f64,
    choice: PlaneChoice,
) -> ChosenPlane {
    let along = |mesh: &mut Mesh<P>, axis| gather_profiles(mesh, h, &[axis], origin).0.remove(0);
    let spread = match choice {
        PlaneChoice::Given(plane) => return along(mesh, plane.normal).at(plane.offset),
        PlaneChoice::Centroids => {
            let axis = principal_axes(&centroid_moments(mesh, origin))[0];
            along(mesh, axis)
        }
        PlaneChoice::Load => best_profile(mesh, h, origin, low),
    };
    let chosen = spread.at(spread.quantile(low));
    shift(mesh, chosen, &spread)
}

/// The profile along the axis whose plane promises the fewest interface faces.
fn best_profile<P: Pages>(mesh: &mut Mesh<P>, h: &SizeFn, origin: Point, low: f64) -> LoadProfile {
    let (mut profiles, moments) = gather_profiles(mesh, h, &[Point::X, Point::Y, Point::Z], origin);
    let matrix = moments.matrix();
    let along_coordinates = (0..3).map(|k| matrix[k][k]).fold(0.0, f64::max);
    let mut oblique = principal_axes(&matrix).to_vec();
    oblique.retain(|&axis| moments.spread(axis) * PREFERRED > along_coordinates.sqrt());
    if !oblique.is_empty() {
        profiles.extend(gather_profiles(mesh, h, &oblique, origin).0);
    }
    let score = |(k, profile): (usize, &LoadProfile)| {
        let area = profile.at(profile.quantile(low)).area;
        if k < 3 { area } else { area / PREFERRED }
    };
    let scores: Vec<f64> = profiles.iter().enumerate().map(score).collect();
    let best = (0..scores.len()).min_by(|&a, &b| scores[a].total_cmp(&scores[b]));
    profiles.swap_remove(best.expect("there are axes"))
}

/// Sets the size of every vertex.
pub(super) fn set_sizes<P: Pages>(mesh: &mut Mesh<P>, h: &SizeFn) {
    for v in mesh.vertex_ids() {
        let p = mesh.point(v);
        mesh.set_size(v, h(p) as f32);
    }
}

fn centroid_moments<P: Pages>(mesh: &mut Mesh<P>, origin: Point) -> [[f64; 3]; 3] {
    let mut moments = Moments::default();
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let middle = mesh.points(&tet).iter().sum::<Point>() * 0.25;
        moments.add(middle - origin, 1.0);
    }
    moments.matrix()
}

/// Moves the plane a little where it would graze fixed vertices.
fn shift<P: Pages>(mesh: &mut Mesh<P>, chosen: ChosenPlane, spread: &LoadProfile) -> ChosenPlane {
    let plane = chosen.plane;
    let share = chosen.load[0] / chosen.load[1];
    let reach = [-TOLERANCE, TOLERANCE].map(|t| (spread.quantile(share + t) - plane.offset).abs());
    let reach = reach[0].min(reach[1]) / f64::from(SHIFTS);
    // Position −SHIFTS..=SHIFTS: grazed vertices. Each vertex counts at the positions it is near to.
    let mut grazed = vec![0u64; 2 * SHIFTS as usize + 1];
    let (mut sizes, mut n_near) = (0.0, 0u64);
    for v in mesh.vertex_ids() {
        if !mesh.is_fixed(v) {
            continue;
        }
        let (p, size) = mesh.point_and_size(v);
        let size = f64::from(size);
        let s = plane.distance(p) / size;
        let step = SHIFT.min(reach / size);
        if s.abs() > GRAZED + step * f64::from(SHIFTS) {
            continue;
        }
        (sizes, n_near) = (sizes + size, n_near + 1);
        for (k, count) in grazed.iter_mut().enumerate() {
            let at = step * (k as f64 - f64::from(SHIFTS));
            *count += u64::from((s - at).abs() < GRAZED);
        }
    }
    if n_near == 0 {
        return chosen;
    }
    let middle = SHIFTS as usize;
    let mut best = middle;
    for distance in 1..=middle {
        for k in [middle - distance, middle + distance] {
            let gain = grazed[best].saturating_sub(grazed[k]) as f64;
            if gain > GAIN * grazed[middle] as f64 + 1.0 {
                best = k;
            }
        }
    }
    if best == middle {
        return chosen;
    }
    let mean = sizes / n_near as f64;
    let step = SHIFT.min(reach / mean) * mean * (best as f64 - f64::from(SHIFTS));
    spread.at(plane.offset + step)
}
