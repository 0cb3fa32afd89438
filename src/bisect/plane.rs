//! The plane of a cut: across the longest axis of inertia, where the load to come is shared as wanted.
//!
//! The paper takes the axis of inertia of the centroids of the coarse mesh. Here every piece weighs its load, so that
//! the axis is that of the mesh to come; the two other axes and those of the coordinates are candidates as well, and the one whose
//! plane promises the fewest interface faces wins: for a cube, whose axes of inertia are arbitrary, that is a plane along its sides.
//!
//! Source: the paper, section 1.1, "Defining the cutting plane".

use super::load::{SizeAt, tally};
use super::surface::{CuttingSurface, Plane};
use crate::geom::{Aabb, Point};
use crate::mesh::Mesh;
use crate::store::Pages;

/// Bins of a histogram along an axis.
const BINS: usize = 4096;
/// Positions tried on each side of the balanced one, and their distance in units of h: a plane that grazes a flat wall cuts
/// its tetrahedra to slices.
const SHIFTS: i32 = 6;
const SHIFT: f64 = 0.2;
/// A fixed vertex nearer to the plane than this, in units of its h, counts as grazed.
const GRAZED: f64 = 0.35;
/// Largest share of the load a shift may bring to the other side: over a dozen cuts it stays within the balance wanted.
const TOLERANCE: f64 = 0.003;
/// Lengths along the diagonal where volume stands for load: pieces of some lengths are then as fine as a histogram needs.
const VOLUME_STEPS: f64 = 200.0;
/// Least gain in grazed vertices that a shift away from the balanced position must bring, as a share.
const GAIN: f64 = 0.1;

/// How the plane is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PlaneChoice {
    /// As the head of this module says.
    #[default]
    Load,
    /// As the paper says: centroids of the mesh, unweighted; the axis of the largest moment; placed by load.
    Centroids,
    /// As `Load`, but shared by volume: what becomes of the balance when sizes do not count.
    Volume,
    /// This one, as it is.
    Given(Plane),
}

/// A chosen plane, and what it promises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChosenPlane {
    pub plane: Plane,
    /// Load below the plane and in all.
    pub load: [f64; 2],
    /// Area in units of h²: ∫ h⁻² over the section.
    pub area: f64,
}

/// Sums of first and second moments.
#[derive(Clone, Copy, Default)]
struct Moments {
    weight: f64,
    first: Point,
    /// xx, yy, zz, xy, xz, yz.
    second: [f64; 6],
}

impl Moments {
    fn add(&mut self, p: Point, weight: f64) {
        self.weight += weight;
        self.first += p * weight;
        let products = [
            p.x * p.x,
            p.y * p.y,
            p.z * p.z,
            p.x * p.y,
            p.x * p.z,
            p.y * p.z,
        ];
        for (sum, product) in self.second.iter_mut().zip(products) {
            *sum += weight * product;
        }
    }

    /// The matrix of central moments.
    fn matrix(&self) -> [[f64; 3]; 3] {
        let g = self.first / self.weight;
        let s = self.second.map(|s| s / self.weight);
        let (xy, xz, yz) = (s[3] - g.x * g.y, s[4] - g.x * g.z, s[5] - g.y * g.z);
        [
            [s[0] - g.x * g.x, xy, xz],
            [xy, s[1] - g.y * g.y, yz],
            [xz, yz, s[2] - g.z * g.z],
        ]
    }
}

/// Chooses the plane that leaves the share `low` of the load on its low side.
///
/// Sizes must be set at all vertices. `origin` is a point near the mesh: moments are taken about it, so that digits are kept.
pub fn choose<P: Pages>(
    mesh: &mut Mesh<P>,
    h: &SizeAt,
    origin: Point,
    low: f64,
    choice: PlaneChoice,
) -> ChosenPlane {
    if choice == PlaneChoice::Volume {
        let everywhere = bounds(mesh).diagonal() / VOLUME_STEPS;
        set_sizes(mesh, &|_| everywhere);
        let chosen = choose(mesh, &|_| everywhere, origin, low, PlaneChoice::Load);
        set_sizes(mesh, h);
        return chosen;
    }
    let spread = match choice {
        PlaneChoice::Given(plane) => {
            return Spread::gather(mesh, h, plane.normal).at(plane.offset);
        }
        PlaneChoice::Centroids => {
            let axis = principal_axes(&centroid_moments(mesh, origin))[0];
            Spread::gather(mesh, h, axis)
        }
        PlaneChoice::Load | PlaneChoice::Volume => {
            let (grid, mut along) = Grid::gather(mesh, h);
            let mut axes = principal_axes(&grid.moments().matrix()).to_vec();
            axes.extend(COORDINATES);
            // Fewest faces; of equals the first, but an axis along a coordinate is preferred where it costs a hundredth at most.
            let areas = axes.iter().map(|&axis| {
                let spread = grid.spread(axis);
                spread.at(spread.quantile(low)).area
            });
            let scores = (0..)
                .zip(areas)
                .map(|(k, a)| if k < 3 { 1.01 * a } else { a });
            let best = scores.zip(0..).min_by(|a, b| a.0.total_cmp(&b.0));
            let best: usize = best.expect("there are axes").1;
            match best.checked_sub(3) {
                Some(coordinate) => along.swap_remove(coordinate),
                None => Spread::gather(mesh, h, axes[best]),
            }
        }
    };
    let chosen = spread.at(spread.quantile(low));
    shift(mesh, chosen, &spread)
}

/// Sets the size of every vertex.
pub(super) fn set_sizes<P: Pages>(mesh: &mut Mesh<P>, h: &SizeAt) {
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
    fn gather<P: Pages>(mesh: &mut Mesh<P>, h: &SizeAt) -> (Self, Vec<Spread>) {
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
        h: &SizeAt,
        bounds: Aabb,
    ) -> ((Self, Vec<Spread>), Aabb) {
        let mut seen = Aabb::EMPTY;
        let width = (bounds.high - bounds.low) / CELLS as f64;
        let (low, high) = (bounds.low.to_array(), bounds.high.to_array());
        let empty = || {
            let along = [0, 1, 2].map(|k| Ramps::new(COORDINATES[k], [low[k], high[k]]));
            (vec![[0.0; 2]; CELLS * CELLS * CELLS], along)
        };
        let see = &mut |p| seen = seen.with(p);
        let [(mut cells, mut along), others @ ..] =
            tally(mesh, h, empty, see, |(cells, along), piece| {
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
                for (k, ramps) in along.iter_mut().enumerate() {
                    ramps.add(from[k], to[k], piece.load, section);
                }
            });
        for (more_cells, more_along) in &others {
            for (cell, more) in cells.iter_mut().zip(more_cells) {
                *cell = [cell[0] + more[0], cell[1] + more[1]];
            }
            (along.iter_mut().zip(more_along)).for_each(|(ramps, more)| ramps.add_all(more));
        }
        let grid = Self {
            low: bounds.low,
            width,
            cells,
        };
        let along = along.into_iter().map(Ramps::sum_up).collect();
        ((grid, along), seen)
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

    fn spread(&self, axis: Point) -> Spread {
        let half = (self.width * 0.5).abs().dot(axis.abs());
        let ends = self
            .filled()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], (p, _)| {
                let s = axis.dot(p);
                [l.min(s - half), h.max(s + half)]
            });
        let mut ramps = Ramps::new(axis, ends);
        for (middle, [load, section]) in self.filled() {
            let s = axis.dot(middle);
            ramps.add(s - half, s + half, load, section);
        }
        ramps.sum_up()
    }
}

/// Ends of no position.
const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

#[inline]
fn with([low, high]: [f64; 2], s: f64) -> [f64; 2] {
    [low.min(s), high.max(s)]
}

fn bounds_of_vertices<P: Pages>(mesh: &mut Mesh<P>) -> Aabb {
    let vertices = mesh.vertex_ids();
    vertices.fold(Aabb::EMPTY, |bounds, v| bounds.with(mesh.point(v)))
}

fn bounds<P: Pages>(mesh: &mut Mesh<P>) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        for p in mesh.points(&tet) {
            bounds = bounds.with(p);
        }
    }
    bounds
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

/// Unit eigenvectors of a symmetric matrix, the largest eigenvalue first, by Jacobi's rotations.
///
/// Their sign is such that the largest component (the first of equals) is positive.
pub fn principal_axes(matrix: &[[f64; 3]; 3]) -> [Point; 3] {
    let mut a = *matrix;
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..60 {
        let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
        if off <= 1e-300 {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let t = if theta == 0.0 { 1.0 } else { t };
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                let (x, y) = (row[p], row[q]);
                (row[p], row[q]) = (c * x - s * y, s * x + c * y);
            }
            let (x, y) = (a[p], a[q]);
            a[p] = std::array::from_fn(|k| c * x[k] - s * y[k]);
            a[q] = std::array::from_fn(|k| s * x[k] + c * y[k]);
            for row in &mut v {
                let (x, y) = (row[p], row[q]);
                (row[p], row[q]) = (c * x - s * y, s * x + c * y);
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
    order.map(|k| {
        let axis = Point::new(v[0][k], v[1][k], v[2][k]).normalize();
        let largest =
            axis.to_array().into_iter().fold(
                0.0,
                |m: f64, x| {
                    if x.abs() > m.abs() + 1e-9 { x } else { m }
                },
            );
        if largest < 0.0 { -axis } else { axis }
    })
}

/// Load and section along one axis, by bins between the ends of the mesh.
struct Spread {
    axis: Point,
    low: f64,
    width: f64,
    load: Vec<f64>,
    /// ∫ h⁻² dV in the bin: over its width, the section in units of h².
    section: Vec<f64>,
}

/// A [`Spread`] in the making: load and section of each bin less those of the bin before, so that a body changes four entries however
/// many bins it covers.
struct Ramps {
    axis: Point,
    low: f64,
    width: f64,
    steps: Vec<[f64; 2]>,
}

impl Ramps {
    fn new(axis: Point, [low, high]: [f64; 2]) -> Self {
        Self {
            axis,
            low,
            width: (high - low) / BINS as f64,
            steps: vec![[0.0; 2]; BINS + 2],
        }
    }

    /// Spreads a body evenly over the bins between its ends.
    fn add(&mut self, low: f64, high: f64, load: f64, section: f64) {
        let low = ((low - self.low) / self.width).max(0.0);
        let high = ((high - self.low) / self.width).min(BINS as f64);
        let first = (low as usize).min(BINS - 1);
        let last = (high as usize).min(BINS - 1).max(first);
        let rate = 1.0 / (high - low).max(1e-9);
        let mut step = |bin: usize, share: f64| {
            let [a, b] = &mut self.steps[bin];
            (*a, *b) = (*a + share * load, *b + share * section);
        };
        if first == last {
            step(first, 1.0);
            step(first + 1, -1.0);
            return;
        }
        let (head, tail) = (first as f64 + 1.0 - low, high - last as f64);
        step(first, rate * head);
        step(first + 1, rate * (1.0 - head));
        step(last, rate * (tail - 1.0));
        step(last + 1, -rate * tail);
    }

    fn add_all(&mut self, other: &Self) {
        for (step, more) in self.steps.iter_mut().zip(&other.steps) {
            *step = [step[0] + more[0], step[1] + more[1]];
        }
    }

    fn sum_up(self) -> Spread {
        let (mut load, mut section) = (Vec::with_capacity(BINS), Vec::with_capacity(BINS));
        let mut sum = [0.0; 2];
        for step in &self.steps[..BINS] {
            sum = [sum[0] + step[0], sum[1] + step[1]];
            // Rounding leaves a little of either sign where there is nothing.
            load.push(f64::max(sum[0], 0.0));
            section.push(f64::max(sum[1], 0.0));
        }
        Spread {
            axis: self.axis,
            low: self.low,
            width: self.width,
            load,
            section,
        }
    }
}

impl Spread {
    fn gather<P: Pages>(mesh: &mut Mesh<P>, h: &SizeAt, axis: Point) -> Self {
        let mut of_all = NOTHING;
        for v in mesh.vertex_ids() {
            of_all = with(of_all, axis.dot(mesh.point(v)));
        }
        let (spread, of_tets) = Self::gather_between(mesh, h, axis, of_all);
        if of_tets == of_all {
            return spread;
        }
        Self::gather_between(mesh, h, axis, of_tets).0
    }

    /// Gathers between the ends, which should be those of the corners of all tetrahedra; returns these too.
    fn gather_between<P: Pages>(
        mesh: &mut Mesh<P>,
        h: &SizeAt,
        axis: Point,
        ends: [f64; 2],
    ) -> (Self, [f64; 2]) {
        let mut seen = NOTHING;
        let empty = || Ramps::new(axis, ends);
        let see = &mut |p| seen = with(seen, axis.dot(p));
        let [mut ramps, others @ ..] = tally(mesh, h, empty, see, |ramps, piece| {
            let [a, b, c, d] = piece.points;
            let at = [axis.dot(a), axis.dot(b), axis.dot(c), axis.dot(d)];
            let low = at[0].min(at[1]).min(at[2].min(at[3]));
            let high = at[0].max(at[1]).max(at[2].max(at[3]));
            ramps.add(low, high, piece.load, piece.load * piece.h);
        });
        others.iter().for_each(|other| ramps.add_all(other));
        (ramps.sum_up(), seen)
    }

    /// Position below which the share `low` of the load lies.
    fn quantile(&self, low: f64) -> f64 {
        let wanted = low * self.load.iter().sum::<f64>();
        let mut sum = 0.0;
        for (bin, &load) in self.load.iter().enumerate() {
            if sum + load >= wanted {
                let part = if load > 0.0 {
                    (wanted - sum) / load
                } else {
                    0.0
                };
                return self.low + (bin as f64 + part) * self.width;
            }
            sum += load;
        }
        self.low + BINS as f64 * self.width
    }

    /// The plane at `offset`, and what it promises.
    fn at(&self, offset: f64) -> ChosenPlane {
        let place = ((offset - self.low) / self.width).clamp(0.0, BINS as f64 - 1.0);
        let bin = place as usize;
        let below: f64 =
            self.load[..bin].iter().sum::<f64>() + self.load[bin] * (place - bin as f64);
        // Pieces are coarse: the section is taken over a fiftieth of the length.
        let half = BINS / 100;
        let window = &self.section[bin.saturating_sub(half)..(bin + half).min(BINS)];
        ChosenPlane {
            plane: Plane {
                normal: self.axis,
                offset,
            },
            load: [below, self.load.iter().sum()],
            area: window.iter().sum::<f64>() / (window.len() as f64 * self.width),
        }
    }
}

/// Moves the plane a little where it would graze fixed vertices.
fn shift<P: Pages>(mesh: &mut Mesh<P>, chosen: ChosenPlane, spread: &Spread) -> ChosenPlane {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_spread_over_the_bins_they_cover() {
        let ends = [-1.0, BINS as f64 - 1.0];
        let bodies = [
            (-1.0, 2.5, 7.0),
            (4.25, 4.75, 1.0),
            (6.5, 9.0, 5.0),
            (0.0, BINS as f64 - 1.0, 4095.0),
        ];
        let mut ramps = Ramps::new(Point::X, ends);
        let mut other = Ramps::new(Point::X, ends);
        for (k, &(low, high, load)) in bodies.iter().enumerate() {
            let to = if k % 2 == 0 { &mut ramps } else { &mut other };
            to.add(low, high, load, 2.0 * load);
        }
        ramps.add_all(&other);
        let spread = ramps.sum_up();
        for bin in 0..BINS {
            let (from, to) = (bin as f64 - 1.0, bin as f64);
            let parts = bodies.iter().map(|&(low, high, load)| {
                (high.min(to) - low.max(from)).max(0.0) / (high - low) * load
            });
            let wanted: f64 = parts.sum();
            assert!((spread.load[bin] - wanted).abs() < 1e-12, "bin {bin}");
            assert!((spread.section[bin] - 2.0 * wanted).abs() < 1e-12);
        }
    }

    #[test]
    fn principal_axes_are_eigenvectors() {
        let mut seed = 7u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        for _ in 0..200 {
            let [a, b, c, d, e, f] = std::array::from_fn(|_| next());
            let m = [[a, d, e], [d, b, f], [e, f, c]];
            let mut before = f64::INFINITY;
            for axis in principal_axes(&m) {
                let x = axis.to_array();
                let y: [f64; 3] = std::array::from_fn(|i| (0..3).map(|j| m[i][j] * x[j]).sum());
                let value: f64 = (0..3).map(|i| x[i] * y[i]).sum();
                let error: f64 = (0..3).map(|i| (y[i] - value * x[i]).abs()).sum();
                assert!(error < 1e-12, "{m:?} {axis} {error}");
                assert!(value <= before + 1e-12);
                before = value;
            }
        }
    }
}
