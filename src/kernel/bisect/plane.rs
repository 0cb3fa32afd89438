//! The plane of a cut: across the longest axis of inertia, where it divides the predicted load as wanted.
//!
//! The paper takes the axis of inertia of the centroids of the coarse mesh. Here every piece weighs its load, so that
//! the axis is that of the mesh to come; the two other axes and those of the coordinates are candidates as well, and the one whose
//! plane promises the fewest interface faces wins: for a cube, whose axes of inertia are arbitrary, that is a plane along its sides.
//!
//! Source: the paper, section 1.1, "Defining the cutting plane".

use super::axes::{Moments, principal_axes};
use super::load::{SizeFn, tally};
use super::load_profile::{ChosenPlane, LoadProfile, ProfileBuilder};
use super::surface::{CuttingSurface, Plane};
use crate::mesh::Mesh;
use tetdb_base::geom::{Aabb, Point};
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
    let spread = match choice {
        PlaneChoice::Given(plane) => {
            return LoadProfile::gather(mesh, h, plane.normal).at(plane.offset);
        }
        PlaneChoice::Centroids => {
            let axis = principal_axes(&centroid_moments(mesh, origin))[0];
            LoadProfile::gather(mesh, h, axis)
        }
        PlaneChoice::Load => {
            let (grid, mut profiles) = Grid::gather(mesh, h);
            let mut axes = principal_axes(&grid.moments().matrix()).to_vec();
            axes.extend(COORDINATES);
            // Fewest faces; of equals the first, but an axis along a coordinate is preferred where it costs a hundredth at most.
            let areas = axes.iter().map(|&axis| {
                let spread = grid.spread(axis);
                spread.at(spread.quantile(low)).area
            });
            let scores = (0..).zip(areas).map(|(k, a)| if k < 3 { 1.01 * a } else { a });
            let best = scores.zip(0..).min_by(|a, b| a.0.total_cmp(&b.0));
            let best: usize = best.expect("there are axes").1;
            match best.checked_sub(3) {
                Some(coordinate) => profiles.swap_remove(coordinate),
                None => LoadProfile::gather(mesh, h, axes[best]),
            }
        }
    };
    let chosen = spread.at(spread.quantile(low));
    shift(mesh, chosen, &spread)
}

/// Sets the size of every vertex.
pub(super) fn set_sizes<P: Pages>(mesh: &mut Mesh<P>, h: &SizeFn) {
    for v in mesh.vertex_ids() {
        let p = mesh.point(v);
        mesh.set_size(v, h(p) as f32);
    }
}

/// Axes whose spreads are gathered with the grid: one of them is chosen more often than not, and dividing the mesh into pieces a second
/// time costs more than three sums in place of one.
const COORDINATES: [Point; 3] = [Point::X, Point::Y, Point::Z];

/// Cells of the grid along each axis.
const CELLS: usize = 48;

/// The load on a coarse grid: enough to compare directions.
struct Grid {
    low: Point,
    width: Point,
    /// Load and ∫ h⁻² of each cell.
    cells: Vec<[f64; 2]>,
}

impl Grid {
    /// The grid, and the spreads along [`COORDINATES`].
    fn gather<P: Pages>(mesh: &mut Mesh<P>, h: &SizeFn) -> (Self, Vec<LoadProfile>) {
        // Nearly always that of the tetrahedra: few vertices have none.
        let around_all = bounds_of_vertices(mesh);
        let (gathered, around_tets) = Self::gather_in(mesh, h, around_all);
        if around_tets == around_all {
            return gathered;
        }
        Self::gather_in(mesh, h, around_tets).0
    }

    /// Gathers in a box, which should be that of the corners of all tetrahedra; returns that too.
    fn gather_in<P: Pages>(
        mesh: &mut Mesh<P>,
        h: &SizeFn,
        bounds: Aabb,
    ) -> ((Self, Vec<LoadProfile>), Aabb) {
        let mut bounds_of_tets = Aabb::EMPTY;
        let width = (bounds.high - bounds.low) / CELLS as f64;
        let (low, high) = (bounds.low.to_array(), bounds.high.to_array());
        let empty = || {
            let profiles =
                [0, 1, 2].map(|k| ProfileBuilder::new(COORDINATES[k], [low[k], high[k]]));
            (vec![[0.0; 2]; CELLS * CELLS * CELLS], profiles)
        };
        let visit_corner = &mut |p| bounds_of_tets = bounds_of_tets.with(p);
        let [(mut cells, mut profiles), others @ ..] =
            tally(mesh, h, empty, visit_corner, |(cells, profiles), piece| {
                let [a, b, c, d] = piece.points;
                let middle = (a + b + c + d) * 0.25;
                let section = piece.load * piece.h;
                let at = (middle - bounds.low) / width;
                let number = |c: f64| (c as usize).min(CELLS - 1);
                let cell = (number(at.z) * CELLS + number(at.y)) * CELLS + number(at.x);
                let cell = &mut cells[cell];
                *cell = [cell[0] + piece.load, cell[1] + section];
                let from = a.min(b).min(c.min(d)).to_array();
                let to = a.max(b).max(c.max(d)).to_array();
                for (k, ramps) in profiles.iter_mut().enumerate() {
                    ramps.add(from[k], to[k], piece.load, section);
                }
            });
        for (more_cells, more_profiles) in &others {
            for (cell, more) in cells.iter_mut().zip(more_cells) {
                *cell = [cell[0] + more[0], cell[1] + more[1]];
            }
            (profiles.iter_mut().zip(more_profiles)).for_each(|(ramps, more)| ramps.add_all(more));
        }
        let grid = Self { low: bounds.low, width, cells };
        let profiles = profiles.into_iter().map(ProfileBuilder::sum_up).collect();
        ((grid, profiles), bounds_of_tets)
    }

    /// Middles of the cells with something in them.
    fn filled(&self) -> impl Iterator<Item = (Point, [f64; 2])> + '_ {
        let filled = self.cells.iter().enumerate().filter(|(_, c)| c[0] > 0.0);
        filled.map(|(n, &cell)| {
            let at = [n % CELLS, n / CELLS % CELLS, n / (CELLS * CELLS)];
            let at = Point::from_array(at.map(|c| c as f64 + 0.5));
            (self.low + at * self.width, cell)
        })
    }

    fn moments(&self) -> Moments {
        let mut moments = Moments::default();
        for (middle, cell) in self.filled() {
            moments.add(middle - self.low, cell[0]);
        }
        moments
    }

    fn spread(&self, axis: Point) -> LoadProfile {
        let half = (self.width * 0.5).abs().dot(axis.abs());
        let ends = self.filled().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], (p, _)| {
            let s = axis.dot(p);
            [l.min(s - half), h.max(s + half)]
        });
        let mut ramps = ProfileBuilder::new(axis, ends);
        for (middle, [load, section]) in self.filled() {
            let s = axis.dot(middle);
            ramps.add(s - half, s + half, load, section);
        }
        ramps.sum_up()
    }
}

fn bounds_of_vertices<P: Pages>(mesh: &mut Mesh<P>) -> Aabb {
    let vertices = mesh.vertex_ids();
    vertices.fold(Aabb::EMPTY, |bounds, v| bounds.with(mesh.point(v)))
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
