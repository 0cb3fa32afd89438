//! The flood: outside grows from afar through every face wide enough, and new vertices stop it at the offset of the input.
//!
//! A face is a gate where outside ends. It is wide if the smallest sphere through its vertices that holds no other vertex is larger than
//! the gap. Beyond the widest gate lies a cell. Where the segment between the centers of the spheres on both sides meets the offset, a
//! vertex is inserted there; else, where the cell meets the input, on the offset above the input point nearest to its center; else the
//! cell becomes part of the outside. New cells begin as inside, so the flood comes again to what it had reached.
//!
//! Only cells that surely share no point with the input become outside, so what is left encloses the input whatever the rounding.
//!
//! Source: C. Portaneri, M. Rouxel-Labbé, M. Hemmer, D. Cohen-Steiner and P. Alliez, "Alpha wrapping with an offset", ACM Transactions on
//! Graphics 41(4), 2022.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Lease, ScratchSpace, check_cancelled};

use super::apart::Cell;
use super::delaunay::{Delaunay, N_FAR, NONE, Tet, circumcircle, circumsphere};
use super::oracle::{Nearest, Oracle};
use super::settings::WrapError;

/// Vertices are sought at this share of the offset, within the tolerance: rounding never brings them beyond the offset.
const LEVEL: f64 = 0.999;
/// Vertices are this share of the offset off the level at most. A tenth takes two more steps of a march.
const TOLERANCE: f64 = 5e-4;
/// Vertices nearer to another than this share of gap and offset are refused, and their gate stays shut. The method keeps them at least as
/// far apart as the lesser of the two, up to rounding; the bound ends what rounding would make endless.
const SPACING: f64 = 1e-2;
/// Steps of a march at most. Those that graze the offset take tens.
const STEPS_MAX: u32 = 200;
/// Distances beyond this many offsets are lower bounds.
const EXACT: f64 = 4.0;
/// Farthest that the input can be, against the bound.
const FARTHER: f64 = 1.2;
/// Attempts to move a point from inside the offset onto it.
const PUSHES_MAX: u32 = 8;
/// Size of the first tetrahedron against the box diagonal: its faces are three and a half such lengths away.
const FAR: f64 = 6.0;
/// Gates between two looks at memory and cancellation.
const AT_ONCE: u64 = 1 << 10;
/// Bytes leased at once.
const LEASED: u64 = 8 << 20;

/// A face between outside and inside, by the inside.
#[derive(Clone, Copy, PartialEq)]
struct Gate {
    /// Radius of its smallest empty sphere; infinite at vertices of the first tetrahedron.
    radius: f64,
    tet: u32,
    face: u8,
    stamps: [u32; 2],
}

impl Eq for Gate {}

impl Ord for Gate {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_radius = self.radius.total_cmp(&other.radius);
        by_radius.then(other.tet.cmp(&self.tet)).then(other.face.cmp(&self.face))
    }
}

impl PartialOrd for Gate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The mesh, and which of its cells are outside.
pub struct Flood<'a> {
    /// The mesh.
    pub mesh: Delaunay,
    /// Whether each cell is outside.
    pub is_outside: Vec<bool>,
    /// Gates that stayed shut because no vertex could be placed.
    pub shut: u64,
    /// Distance of each outside cell's center from the input.
    reach: Vec<f64>,
    gates: BinaryHeap<Gate>,
    oracle: &'a Oracle,
    gap: f64,
    level: f64,
    tolerance: f64,
    spacing: f64,
    leases: Vec<Lease>,
}

impl<'a> Flood<'a> {
    /// One tetrahedron around `bounds`, all of it inside.
    pub fn new(oracle: &'a Oracle, bounds: Aabb, gap: f64, offset: f64) -> Self {
        let middle = (bounds.low + bounds.high) * 0.5;
        let reach = FAR * (bounds.diagonal() + 4.0 * offset);
        let corners = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
        let mut flood = Self {
            mesh: Delaunay::new(corners.map(|c| middle + Point::from(c) * reach)),
            is_outside: vec![false],
            shut: 0,
            reach: vec![0.0],
            gates: BinaryHeap::new(),
            oracle,
            gap,
            level: LEVEL * offset,
            tolerance: TOLERANCE * offset,
            spacing: SPACING * offset.min(gap),
            leases: Vec::new(),
        };
        flood.push_gates(0);
        flood
    }

    /// Floods until no gate is wide.
    ///
    /// # Errors
    /// [`WrapError::Memory`] beyond `scratch`. A cancelled run unwinds.
    pub fn run(&mut self, scratch: &ScratchSpace, progress: &dyn Fn(f64)) -> Result<(), WrapError> {
        let (mut n, mut widest) = (0u64, 0.0f64);
        while let Some(gate) = self.gates.pop() {
            if n % AT_ONCE == 0 {
                check_cancelled();
                self.lease(scratch)?;
                if gate.radius.is_finite() {
                    widest = widest.max(gate.radius);
                    progress(((widest / gate.radius).ln() / (widest / self.gap).ln()).min(1.0));
                }
            }
            n += 1;
            if self.is_current(&gate) {
                self.open(gate);
            }
        }
        self.gates = BinaryHeap::new();
        Ok(())
    }

    fn lease(&mut self, scratch: &ScratchSpace) -> Result<(), WrapError> {
        let bytes = self.mesh.bytes()
            + (self.gates.capacity() * size_of::<Gate>()) as u64
            + 9 * self.reach.capacity() as u64;
        while self.leases.len() as u64 * LEASED < bytes {
            if scratch.available() < LEASED {
                return Err(WrapError::Memory { bytes_max: scratch.cap(), bytes });
            }
            self.leases.extend(scratch.lease(LEASED as usize));
        }
        Ok(())
    }

    fn is_current(&self, gate: &Gate) -> bool {
        let t = gate.tet as usize;
        if self.mesh.stamps[t] != gate.stamps[0] || self.is_outside[t] {
            return false;
        }
        let across = self.mesh.tets[t].across[usize::from(gate.face)];
        across == NONE
            || self.mesh.stamps[across as usize >> 2] == gate.stamps[1]
                && self.is_outside[across as usize >> 2]
    }

    /// Looks at the cell behind a gate.
    fn open(&mut self, gate: Gate) {
        let t = gate.tet;
        let corners = self.mesh.corners(t);
        let (mut center, radius) = circumsphere(corners);
        if !center.is_finite() {
            center = corners.iter().sum::<Point>() * 0.25;
        }
        let across = self.mesh.tets[t as usize].across[usize::from(gate.face)];
        let nearest = self.about(center, self.within(across, center));
        if across != NONE
            && let Some(p) = self.on_segment(across >> 2, center, nearest.least)
            && self.insert(p, gate)
        {
            return;
        }
        let is_free =
            nearest.least > radius * (1.0 + 1e-9) || !self.oracle.may_meet(&Cell::new(corners));
        if is_free {
            self.is_outside[t as usize] = true;
            self.reach[t as usize] = nearest.least;
            self.push_gates(t);
            return;
        }
        let face = self.mesh.face(t, usize::from(gate.face)).map(|v| self.mesh.points[v as usize]);
        let [a, b, c] = face;
        let within = nearest.distance * (1.0 + 1e-9);
        for (from, within) in [(center, within), ((a + b + c) / 3.0, f64::INFINITY)] {
            let nearest = self.oracle.nearest(from, within);
            let outward = (b - a).cross(c - a).normalize_or_zero();
            if let Some(p) = self.above(from, nearest, outward)
                && self.insert(p, gate)
            {
                return;
            }
        }
        self.shut += 1;
    }

    /// The first point on the way from the center of an outside cell to `to` that is on the offset.
    fn on_segment(&self, outside: u32, to: Point, distance: f64) -> Option<Point> {
        let from = circumsphere(self.mesh.corners(outside)).0;
        if !from.is_finite() {
            return None;
        }
        let beyond = (distance - self.level).abs();
        if beyond <= self.tolerance {
            return Some(to);
        }
        let length = from.distance(to);
        // The ball around the end that holds no point of the offset is not marched through; its border is.
        let (direction, end) = ((to - from) / length, length - beyond + self.tolerance);
        let mut at = (self.reach[outside as usize] - self.level).abs();
        let mut within = FARTHER * self.reach[outside as usize] + at;
        for _ in 0..STEPS_MAX {
            if at >= end {
                return None;
            }
            let p = from + direction * at;
            let nearest = self.about(p, within * (1.0 + 1e-9));
            let step = (nearest.least - self.level).abs();
            if step <= self.tolerance {
                return Some(p);
            }
            at += step;
            within = nearest.distance + step;
        }
        None
    }

    /// A distance from `p` at which the input surely is, by that from the center of an outside cell.
    fn within(&self, across: u32, p: Point) -> f64 {
        if across == NONE {
            return f64::INFINITY;
        }
        let from = circumsphere(self.mesh.corners(across >> 2)).0;
        let within = FARTHER * self.reach[across as usize >> 2] + from.distance(p);
        // Infinite also where a center is not a number.
        if within > 0.0 { within } else { f64::INFINITY }
    }

    fn about(&self, p: Point, within: f64) -> Nearest {
        self.oracle.about_nearest(p, within, EXACT * self.level)
    }

    /// A point on the offset above the input point nearest to `p`.
    fn above(&self, p: Point, nearest: Nearest, outward: Point) -> Option<Point> {
        let mut direction = (p - nearest.at).try_normalize().unwrap_or(outward);
        let mut x = nearest.at + direction * self.level;
        if nearest.distance > self.level {
            return Some(x);
        }
        // From inside the offset the way out may lead to other parts of the input.
        for _ in 0..PUSHES_MAX {
            let now = self.oracle.nearest(x, 2.0 * self.level);
            if (now.distance - self.level).abs() <= self.tolerance {
                return Some(x);
            }
            direction = (x - now.at).try_normalize().unwrap_or(direction);
            x = now.at + direction * self.level;
        }
        let now = self.oracle.nearest(x, 2.0 * self.level).distance;
        (now > 0.5 * self.level && now <= self.level + self.tolerance).then_some(x)
    }

    /// Inserts a vertex before a gate; false if another is too near.
    fn insert(&mut self, p: Point, gate: Gate) -> bool {
        if !self.mesh.insert(p, gate.tet, self.spacing) {
            return false;
        }
        self.is_outside.resize(self.mesh.tets.len(), false);
        self.reach.resize(self.mesh.tets.len(), 0.0);
        let new = self.mesh.new_tets().to_vec();
        for &t in &new {
            self.is_outside[t as usize] = false;
        }
        for t in new {
            for i in 0..4 {
                self.push_gate(t, i);
            }
        }
        // With rounding, the vertex may be in neither cell of the gate, which is there still.
        if self.mesh.stamps[gate.tet as usize] == gate.stamps[0] {
            self.push_gate(gate.tet, usize::from(gate.face));
        }
        true
    }

    /// Gates around a cell that became outside, or at the hull.
    fn push_gates(&mut self, t: u32) {
        let Tet { across, .. } = self.mesh.tets[t as usize];
        for (i, across) in across.into_iter().enumerate() {
            match across == NONE {
                true => self.push_gate(t, i),
                false => self.push_gate(across >> 2, across as usize & 3),
            }
        }
    }

    /// Adds the face of a cell if it is a wide gate.
    fn push_gate(&mut self, t: u32, i: usize) {
        let across = self.mesh.tets[t as usize].across[i];
        let beyond = across as usize >> 2;
        if self.is_outside[t as usize] || across != NONE && !self.is_outside[beyond] {
            return;
        }
        let radius = self.radius(t, i, across);
        if radius >= self.gap {
            let stamp = if across == NONE { 0 } else { self.mesh.stamps[beyond] };
            let stamps = [self.mesh.stamps[t as usize], stamp];
            self.gates.push(Gate { radius, tet: t, face: i as u8, stamps });
        }
    }

    /// Radius of the smallest sphere through a face that holds no vertex.
    fn radius(&self, t: u32, i: usize, across: u32) -> f64 {
        let face = self.mesh.face(t, i);
        if across == NONE || face.iter().any(|v| *v < N_FAR) {
            return f64::INFINITY;
        }
        let (other, point) = (across >> 2, |v: u32| self.mesh.points[v as usize]);
        let (center, radius) = circumcircle(face.map(point));
        let apexes = [
            self.mesh.tets[t as usize].vertices[i],
            self.mesh.tets[other as usize].vertices[across as usize & 3],
        ];
        match apexes.iter().all(|v| point(*v).distance(center) >= radius) {
            true => radius,
            false => {
                let [own, beyond] = [t, other].map(|t| circumsphere(self.mesh.corners(t)).1);
                own.min(beyond)
            }
        }
    }
}
