//! A round column whose flat ends have many corners and a bad triangulation.
//!
//! Corners lie on a circle, far and near by turns; ears are cut off in an order drawn for each end. Four corners of such an end often bound a
//! needle, and all of them lie in one plane.

use super::build::Builder;
use super::build::triangles_checked;
use super::prism::{Flat, Prism, pieces};
use super::random::{Random, power};
use super::trig::sin_cos_turns;
use super::{Sample, SampleError};
use tetdb_base::geom::Point;

/// The column's height; its radius is 1.
const HEIGHT: f64 = 0.5;
/// The widest gap between two corners over the narrowest.
const GAPS: f64 = 300.0;

/// `caps,count=60,seed=1`: corners of each end.
#[derive(Clone, Debug, PartialEq)]
pub struct Caps {
    pub count: usize,
    pub seed: u64,
}

impl Caps {
    pub(super) fn make(&self, bytes_max: u64) -> Result<Sample, SampleError> {
        triangles_checked("caps", 4.0 * self.count as f64, bytes_max)?;
        let mut random = Random::new(self.seed);
        let mut turn = 0.0;
        let gaps = pieces(self.count, || power(GAPS, random.unit()));
        let points = gaps.iter().map(|gap| {
            let (sin, cos) = sin_cos_turns(turn);
            turn += gap;
            [cos, sin]
        });
        let points = points.collect();
        let [triangles, upper] = [(); 2].map(|()| cut(self.count, &mut random));
        let lower = Flat { points, triangles };
        let mut build = Builder::default();
        let labels = ["low", "high", "around"].map(|name| build.label(name));
        let prism = Prism { at: &Point::new, heights: [0.0, HEIGHT], labels };
        prism.push(&mut build, &lower, &upper);
        Ok(build.finish())
    }
}

/// A convex polygon's corners in triangles: ears in any order.
fn cut(n: usize, random: &mut Random) -> Vec<[u32; 3]> {
    let mut ring: Vec<u32> = (0..n as u32).collect();
    let mut triangles = Vec::with_capacity(n - 2);
    while ring.len() > 3 {
        let m = ring.len();
        let ear = ((random.unit() * m as f64) as usize).min(m - 1);
        triangles.push([ring[(ear + m - 1) % m], ring[ear], ring[(ear + 1) % m]]);
        ring.remove(ear);
    }
    triangles.push([ring[0], ring[1], ring[2]]);
    triangles
}
