//! Load and section along an axis, and their values for a plane across it.

use super::axes::Moments;
use super::load::{SizeFn, tally};
use super::surface::Plane;
use crate::mesh::Mesh;
use tetdb_base::geom::Point;
use tetdb_base::storage::Pages;

/// Bins of a histogram along an axis.
const BINS: usize = 4096;

/// A chosen plane, with its predicted load and area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChosenPlane {
    /// The cutting plane.
    pub plane: Plane,
    /// Load below the plane and in all.
    pub load: [f64; 2],
    /// Area in units of h²: ∫ h⁻² over the section.
    pub area: f64,
}

/// Ends of no position.
const NO_POSITION: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// Load and section along one axis, by bins between the ends of the mesh.
pub(super) struct LoadProfile {
    axis: Point,
    low: f64,
    width: f64,
    load: Vec<f64>,
    /// ∫ h⁻² dV in the bin: over its width, the section in units of h².
    section: Vec<f64>,
}

/// A [`LoadProfile`] in the making: load and section of each bin less those of the bin before, so that a body changes four entries however
/// many bins it covers.
pub(super) struct ProfileBuilder {
    axis: Point,
    low: f64,
    width: f64,
    steps: Vec<[f64; 2]>,
}

impl ProfileBuilder {
    pub fn new(axis: Point, [low, high]: [f64; 2]) -> Self {
        Self { axis, low, width: (high - low) / BINS as f64, steps: vec![[0.0; 2]; BINS + 2] }
    }

    /// Spreads a body evenly over the bins between its ends.
    pub fn add(&mut self, low: f64, high: f64, load: f64, section: f64) {
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

    pub fn add_all(&mut self, other: &Self) {
        for (step, more) in self.steps.iter_mut().zip(&other.steps) {
            *step = [step[0] + more[0], step[1] + more[1]];
        }
    }

    pub fn sum_up(self) -> LoadProfile {
        let (mut load, mut section) = (Vec::with_capacity(BINS), Vec::with_capacity(BINS));
        let mut sum = [0.0; 2];
        for step in &self.steps[..BINS] {
            sum = [sum[0] + step[0], sum[1] + step[1]];
            // Rounding leaves a little of either sign where there is nothing.
            load.push(f64::max(sum[0], 0.0));
            section.push(f64::max(sum[1], 0.0));
        }
        LoadProfile { axis: self.axis, low: self.low, width: self.width, load, section }
    }
}

/// Load and section along each of the axes, and the moments of the load about `origin`.
///
/// `origin` is a point near the mesh, so that digits are kept.
pub(super) fn gather_profiles<P: Pages>(
    mesh: &mut Mesh<P>,
    h: &SizeFn,
    axes: &[Point],
    origin: Point,
) -> (Vec<LoadProfile>, Moments) {
    let mut ends = vec![NO_POSITION; axes.len()];
    for v in mesh.vertex_ids() {
        widen(&mut ends, axes, mesh.point(v));
    }
    // Nearly always those of the tetrahedra: few vertices have none.
    let (gathered, ends_of_tets) = gather_between(mesh, h, axes, &ends, origin);
    if ends_of_tets == ends {
        return gathered;
    }
    gather_between(mesh, h, axes, &ends_of_tets, origin).0
}

fn widen(ends: &mut [[f64; 2]], axes: &[Point], p: Point) {
    for ([low, high], axis) in ends.iter_mut().zip(axes) {
        let s = axis.dot(p);
        (*low, *high) = (low.min(s), high.max(s));
    }
}

/// Gathers between the ends, which should be those of the corners of all tetrahedra; returns these too.
fn gather_between<P: Pages>(
    mesh: &mut Mesh<P>,
    h: &SizeFn,
    axes: &[Point],
    ends: &[[f64; 2]],
    origin: Point,
) -> ((Vec<LoadProfile>, Moments), Vec<[f64; 2]>) {
    let mut ends_of_tets = vec![NO_POSITION; axes.len()];
    let empty = || {
        let builders = axes.iter().zip(ends).map(|(&axis, &ends)| ProfileBuilder::new(axis, ends));
        (builders.collect::<Vec<_>>(), Moments::default())
    };
    let visit_corner = &mut |p| widen(&mut ends_of_tets, axes, p);
    let [(mut profiles, mut moments), others @ ..] =
        tally(mesh, h, empty, visit_corner, |(profiles, moments), piece| {
            for ramps in profiles {
                let [a, b, c, d] = piece.points.map(|p| ramps.axis.dot(p));
                let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
                ramps.add(low, high, piece.load, piece.load * piece.h);
            }
            moments.add_tet(piece.points.map(|p| p - origin), piece.load);
        });
    for (more_profiles, more_moments) in &others {
        profiles.iter_mut().zip(more_profiles).for_each(|(ramps, more)| ramps.add_all(more));
        moments.add_all(more_moments);
    }
    ((profiles.into_iter().map(ProfileBuilder::sum_up).collect(), moments), ends_of_tets)
}

impl LoadProfile {
    /// Position below which the share `low` of the load lies.
    pub fn quantile(&self, low: f64) -> f64 {
        let wanted = low * self.load.iter().sum::<f64>();
        let mut sum = 0.0;
        for (bin, &load) in self.load.iter().enumerate() {
            if sum + load >= wanted {
                let part = if load > 0.0 { (wanted - sum) / load } else { 0.0 };
                return self.low + (bin as f64 + part) * self.width;
            }
            sum += load;
        }
        self.low + BINS as f64 * self.width
    }

    /// The plane at `offset`, with its predicted load and area.
    pub fn at(&self, offset: f64) -> ChosenPlane {
        let place = ((offset - self.low) / self.width).clamp(0.0, BINS as f64 - 1.0);
        let bin = place as usize;
        let below: f64 =
            self.load[..bin].iter().sum::<f64>() + self.load[bin] * (place - bin as f64);
        // Pieces are coarse: the section is taken over a fiftieth of the length.
        let half = BINS / 100;
        let window = &self.section[bin.saturating_sub(half)..(bin + half).min(BINS)];
        ChosenPlane {
            plane: Plane { normal: self.axis, offset },
            load: [below, self.load.iter().sum()],
            area: window.iter().sum::<f64>() / (window.len() as f64 * self.width),
        }
    }
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
        let mut ramps = ProfileBuilder::new(Point::X, ends);
        let mut other = ProfileBuilder::new(Point::X, ends);
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
}
