//! The plane of a cut: across the longest axis of inertia, where the load to come is shared as wanted.
//!
//! The paper takes the axis of inertia of the centroids of the coarse mesh. Here every piece weighs its load, so that
//! the axis is that of the mesh to come; the two other axes and those of the coordinates are candidates as well, and the one whose
//! plane promises the fewest interface faces wins: for a cube, whose axes of inertia are arbitrary, that is a plane along its sides.
//!
//! Source: the paper, section 1.1, "Defining the cutting plane".

use super::load::{Piece, for_each_piece};
use super::surface::{CuttingSurface, Plane};
use crate::geom::Point;
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
const TOLERANCE: f64 = 0.006;
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
    h: &dyn Fn(Point) -> f64,
    origin: Point,
    low: f64,
    choice: PlaneChoice,
) -> ChosenPlane {
    let axes = match choice {
        PlaneChoice::Given(plane) => {
            let spread = Spread::gather(mesh, h, &[plane.normal]);
            return spread[0].at(plane.offset);
        }
        PlaneChoice::Centroids => vec![principal_axes(&centroid_moments(mesh, origin))[0]],
        PlaneChoice::Load => {
            let mut moments = Moments::default();
            for_each_piece(mesh, h, |piece| {
                // A uniform piece has the moments of its corners, a fifth of the weight, and its centroid, four fifths.
                let middle = piece.points.iter().sum::<Point>() * 0.25 - origin;
                moments.add(middle, 0.8 * piece.load);
                for p in piece.points {
                    moments.add(p - origin, 0.05 * piece.load);
                }
            });
            let mut axes = principal_axes(&moments.matrix()).to_vec();
            axes.extend([Point::X, Point::Y, Point::Z]);
            axes
        }
    };
    let spreads = Spread::gather(mesh, h, &axes);
    let planes = spreads.iter().map(|s| s.at(s.quantile(low)));
    // Fewest faces; of equals the first, but an axis along a coordinate is preferred where it costs a hundredth at most.
    let mut best = None::<(f64, ChosenPlane)>;
    for (k, plane) in planes.enumerate() {
        let score = if k < 3 && axes.len() > 3 { 1.01 } else { 1.0 } * plane.area;
        if best.is_none_or(|(least, _)| score < least) {
            best = Some((score, plane));
        }
    }
    let (_, chosen) = best.expect("there is an axis");
    shift(mesh, h, chosen, &spreads)
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

impl Spread {
    fn gather<P: Pages>(mesh: &mut Mesh<P>, h: &dyn Fn(Point) -> f64, axes: &[Point]) -> Vec<Self> {
        let mut ends = vec![[f64::INFINITY, f64::NEG_INFINITY]; axes.len()];
        let mut from = 0;
        while let Some((t, tet)) = mesh.next_tet(from) {
            from = t + 1;
            for p in mesh.points(&tet) {
                for (axis, [low, high]) in axes.iter().zip(&mut ends) {
                    let s = axis.dot(p);
                    (*low, *high) = (low.min(s), high.max(s));
                }
            }
        }
        let mut spreads: Vec<Self> = axes
            .iter()
            .zip(ends)
            .map(|(&axis, [low, high])| Self {
                axis,
                low,
                width: (high - low) / BINS as f64,
                load: vec![0.0; BINS],
                section: vec![0.0; BINS],
            })
            .collect();
        for_each_piece(mesh, h, |piece| {
            for spread in &mut spreads {
                spread.add(piece);
            }
        });
        spreads
    }

    /// Spreads a piece over the bins between its ends as a body that is widest in its middle.
    fn add(&mut self, piece: &Piece) {
        let at = piece
            .points
            .map(|p| (self.axis.dot(p) - self.low) / self.width);
        let low = at.iter().fold(f64::INFINITY, |m, &x| m.min(x)).max(0.0);
        let high = at.iter().fold(0.0, |m: f64, &x| m.max(x)).min(BINS as f64);
        let (first, last) = (low as usize, (high as usize).min(BINS - 1));
        let per_bin = 1.0 / (high - low).max(1e-9);
        for bin in first..=last.max(first) {
            let from = low.max(bin as f64);
            let to = high.min(bin as f64 + 1.0);
            let share = if first == last {
                1.0
            } else {
                (to - from).max(0.0) * per_bin
            };
            self.load[bin] += share * piece.load;
            self.section[bin] += share * piece.load * piece.h;
        }
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
fn shift<P: Pages>(
    mesh: &mut Mesh<P>,
    h: &dyn Fn(Point) -> f64,
    chosen: ChosenPlane,
    spreads: &[Spread],
) -> ChosenPlane {
    let plane = chosen.plane;
    let spread = (spreads.iter())
        .find(|s| s.axis == plane.normal)
        .expect("the axis was spread");
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
        let p = mesh.point(v);
        let size = h(p);
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
