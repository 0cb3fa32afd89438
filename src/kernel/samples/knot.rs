//! A tube along a trefoil knot: one solid of genus 1, curved everywhere, with its parts near each other.
//!
//! The center line runs twice around the axis of a torus (radii 1 and 0.45) and three times around
//! its ring. The frame across it is the torus's own normal, which closes up without a twist to undo.

use super::SampleError;
use super::build::Builder;
use super::build::triangles_checked;
use super::sample::Sample;
use super::trig::sin_cos_turns;
use std::f64::consts::TAU;
use tetdb_base::geom::Point;

const RADIUS_RING: f64 = 1.0;
const RADIUS_TUBE_OF_TORUS: f64 = 0.45;
const TURNS_AXIS: f64 = 2.0;
const TURNS_RING: f64 = 3.0;
/// Pieces of the table that turns arc length into a parameter.
const TABLE: usize = 6000;

/// A knot `knot,tube=R,h=H`.
pub(super) fn make_knot(tube: f64, h: f64, bytes_max: u64) -> Result<Sample, SampleError> {
    let table = arc_table();
    let length = table[TABLE];
    let around = (TAU * tube / h + 0.5).floor().max(5.0);
    // Rows stand 0.87 h apart for near-equilateral triangles; even, since every second is shifted.
    let rings = 2.0 * (length / (h * 0.75f64.sqrt()) / 2.0 + 0.5).floor().max(12.0);
    triangles_checked("knot", 2.0 * around * rings, bytes_max)?;
    let (m, n) = (around as u32, rings as u32);
    let mut build = Builder::default();
    let label = build.label("knot");
    for ring in 0..n {
        let t = parameter(&table, length * f64::from(ring) / rings);
        let (center, across, up) = frame(t);
        for k in 0..m {
            let turn = (f64::from(k) + 0.5 * f64::from(ring % 2)) / around;
            let (s, c) = sin_cos_turns(turn);
            build.point(center + (across * c + up * s) * tube);
        }
    }
    let id = |ring: u32, k: u32| (ring % n) * m + k % m;
    for ring in 0..n {
        for k in 0..m {
            let shift = ring % 2;
            let [a, b] = [id(ring, k), id(ring, k + 1)];
            let [c, d] = [id(ring + 1, k), id(ring + 1, k + 1)];
            // The point of the next ring between a and b: d from a shifted ring, else c.
            let apex = if shift == 1 { d } else { c };
            build.triangle([a, b, apex], false, label);
            let second = if shift == 1 { [a, d, c] } else { [b, d, c] };
            build.triangle(second, false, label);
        }
    }
    Ok(build.finish())
}

/// Center, outward normal of the torus, and the third direction so that tangent, normal and it
/// are right-handed.
fn frame(t: f64) -> (Point, Point, Point) {
    let (s_axis, c_axis) = sin_cos_turns(TURNS_AXIS * t);
    let (s_ring, c_ring) = sin_cos_turns(TURNS_RING * t);
    let radial = Point::new(c_axis, s_axis, 0.0);
    let normal = radial * c_ring + Point::Z * s_ring;
    let center = radial * RADIUS_RING + normal * RADIUS_TUBE_OF_TORUS;
    let along_axis = Point::new(-s_axis, c_axis, 0.0) * (TURNS_AXIS * distance_to_axis(c_ring));
    let along_ring = (Point::Z * c_ring - radial * s_ring) * (TURNS_RING * RADIUS_TUBE_OF_TORUS);
    let tangent = along_axis + along_ring;
    (center, normal, tangent.cross(normal) / tangent.length())
}

fn distance_to_axis(c_ring: f64) -> f64 {
    RADIUS_RING + RADIUS_TUBE_OF_TORUS * c_ring
}

/// Arc length up to each of the `TABLE + 1` equally spaced parameters, by the midpoint rule.
fn arc_table() -> Vec<f64> {
    let mut table = vec![0.0];
    let mut sum = 0.0;
    for i in 0..TABLE {
        let (_, c_ring) = sin_cos_turns(TURNS_RING * (i as f64 + 0.5) / TABLE as f64);
        let axis = TURNS_AXIS * distance_to_axis(c_ring);
        let ring = TURNS_RING * RADIUS_TUBE_OF_TORUS;
        sum += TAU * (axis * axis + ring * ring).sqrt() / TABLE as f64;
        table.push(sum);
    }
    table
}

/// Parameter at an arc length.
fn parameter(table: &[f64], arc: f64) -> f64 {
    let i = table.partition_point(|&s| s <= arc).clamp(1, TABLE) - 1;
    (i as f64 + (arc - table[i]) / (table[i + 1] - table[i])) / TABLE as f64
}
