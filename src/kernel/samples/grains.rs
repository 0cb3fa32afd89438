//! A unit cube full of disjoint convex polyhedral grains: the paper's case 6.
//!
//! The cube is divided at random, again and again, until each box has one grain. So sizes and shapes vary, no grain
//! meets another, and each is built independently. A grain is the hull of points on an ellipsoid turned at random.

use super::SampleError;
use super::boxes::{box_triangles, push_box};
use super::build::Builder;
use super::build::triangles_checked;
use super::hull::convex_hull;
use super::random::{Random, cube_root};
use super::sample::Sample;
use tetdb_base::geom::{Aabb, Point};

/// Points of a grain: 42.5 on average, which makes 81 triangles.
const POINTS_LEAST: u64 = 37;
const POINTS_MOST: u64 = 48;
/// Shortest axis of an ellipsoid by its longest.
const AXIS_LEAST: f64 = 0.5;
/// Least distance of two points on the unit sphere. An axis shortens it to half of that at most: an edge is never shorter than 0.075
/// of its grain's longest diameter.
const APART: f64 = 0.3;
/// Margin of a grain in its box, so that grains do not touch.
const REACH: f64 = 0.92;
/// Edges of the walls, by the mean distance of two grains.
const WALL_EDGE: f64 = 0.3;

/// Parameters of `grains,count=…,seed=…,h=…`.
#[derive(Clone, Debug, PartialEq)]
pub struct Grains {
    pub count: usize,
    pub seed: u64,
    /// Edge length on the walls of the cube.
    pub h: f64,
}

impl Grains {
    /// The edge length of the walls when none is given.
    pub(super) fn h_default(count: usize) -> f64 {
        WALL_EDGE / cube_root(count as f64)
    }

    /// Makes the surface: labels `walls` and `grains`.
    pub(super) fn make(&self, bytes_max: u64) -> Result<Sample, SampleError> {
        let bounds = Aabb { low: Point::ZERO, high: Point::ONE };
        let each = (POINTS_LEAST + POINTS_MOST - 4) as f64;
        let n_triangles = each * self.count as f64 + box_triangles(&bounds, self.h);
        triangles_checked("grains", n_triangles, bytes_max)?;
        let mut build = Builder::default();
        let walls = build.label("walls");
        let label = build.label("grains");
        push_box(&mut build, &bounds, self.h, false, [walls; 6]);
        let mut random = Random::new(self.seed);
        // The high half of each division waits; as many wait as the divisions are deep.
        let mut waiting = vec![(bounds, self.count)];
        while let Some((room, count)) = waiting.pop() {
            if count == 1 {
                push_grain(&mut build, &room, &mut random, label);
                continue;
            }
            let [low, high] = halves(&room, count, &mut random);
            waiting.extend([high, low]);
        }
        Ok(build.finish())
    }
}

/// Divides a box for `count` grains across its longest side.
fn halves(room: &Aabb, count: usize, random: &mut Random) -> [(Aabb, usize); 2] {
    let below = (count as f64 * (0.3 + 0.4 * random.unit())) as usize;
    let below = below.clamp(1, count - 1);
    // Not in proportion: so grains come in different sizes.
    let share = below as f64 / count as f64 * (0.7 + 0.6 * random.unit());
    let sides = room.high - room.low;
    let mut axis = 0;
    for other in 1..3 {
        if sides[other] > sides[axis] {
            axis = other;
        }
    }
    let at = room.low[axis] + sides[axis] * share.clamp(0.2, 0.8);
    let (mut low, mut high) = (*room, *room);
    low.high[axis] = at;
    high.low[axis] = at;
    [(low, below), (high, count - below)]
}

fn push_grain(build: &mut Builder, room: &Aabb, random: &mut Random, label: u32) {
    let turn = random.rotation();
    let mut axis = || AXIS_LEAST + (1.0 - AXIS_LEAST) * random.unit();
    let axes = [1.0, axis(), axis()];
    let columns = [0, 1, 2].map(|i| turn[i] * axes[i]);
    // Extent of the ellipsoid along each coordinate.
    let square = columns.iter().fold(Point::ZERO, |sum, &c| sum + c * c);
    let extent = Point::from(square.to_array().map(f64::sqrt));
    let half = (room.high - room.low) * (0.5 * REACH);
    let size = (half / extent).min_element();
    let play = half - extent * size;
    let center = (room.low + room.high) * 0.5 + play * (random.in_cube() * 2.0 - Point::ONE);
    let n = POINTS_LEAST + (random.unit() * (POINTS_MOST - POINTS_LEAST + 1) as f64) as u64;
    let points: Vec<Point> = apart_on_sphere(n as usize, random)
        .into_iter()
        .map(|p| center + (columns[0] * p.x + columns[1] * p.y + columns[2] * p.z) * size)
        .collect();
    let ids: Vec<u32> = points.iter().map(|&p| build.point(p)).collect();
    for t in convex_hull(&points) {
        build.triangle(t.map(|v| ids[v as usize]), true, label);
    }
}

/// Random points of the unit sphere, none nearer to another than [`APART`].
fn apart_on_sphere(n: usize, random: &mut Random) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::with_capacity(n);
    // Forty-eight such caps cover a quarter of the sphere, so a free place always exists.
    while points.len() < n {
        let p = random.in_cube() * 2.0 - Point::ONE;
        let square = p.length_squared();
        if !(0.01..=1.0).contains(&square) {
            continue;
        }
        let p = p / square.sqrt();
        if points.iter().all(|q| q.distance_squared(p) >= APART * APART) {
            points.push(p);
        }
    }
    points
}
