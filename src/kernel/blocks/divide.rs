//! Division of a region: points are inserted until all tetrahedra due are examined.
//!
//! Rounds of candidates, sorted along the curve. Of candidates close together their mean is tried. What reaches beyond the region is put
//! off: its tetrahedron stays unexamined, for a neighbor that comes later.

use super::field::Field;
use super::insert::{Inserter, Refusal};
use super::partition::KdPartition;
use super::recent::Recent;
use super::region::Region;
use super::report::RefineReport;
use super::spawn::{Candidate, GOOD, Spawner, center, is_in};
use crate::mesh::Tet;
use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::anatomy::{FROZEN, MARK};
use tetdb_base::geom::{HilbertFrame, Point};
use tetdb_base::storage::check_cancelled;

/// Tetrahedra examined before the first of their points is inserted. The mesh depends on it.
const CHUNK: usize = 8_192;
/// Candidates nearer than this, in units of the wanted length, are replaced by their mean.
const MEAN_WITHIN: f64 = 0.6;
/// Candidates that follow along the curve and may be so near.
const MEAN_OF: usize = 16;
/// A round that inserts fewer points ends the rule that good layers grow from good ones.
const FRONT_MIN: u64 = 20;
/// Rounds at most.
const ROUNDS_MAX: u32 = 200;
/// Least height above a required face of the cavity, in units of h: a flatter tetrahedron on it could not be mended.
const HEIGHT: f64 = 0.25;

/// Scratch of division.
pub(super) struct Divider {
    inserter: Inserter,
    spawner: Spawner,
    recent: Recent,
    next: Vec<u32>,
    second: Vec<u32>,
    seen: Vec<bool>,
    means: Vec<(Point, u32)>,
}

impl Divider {
    pub fn new() -> Self {
        Self {
            inserter: Inserter::new(),
            spawner: Spawner::default(),
            recent: Recent::new(),
            next: Vec::new(),
            second: Vec::new(),
            seen: Vec::new(),
            means: Vec::new(),
        }
    }

    /// Divides the tetrahedra of the bricks for which `is_due` holds. `own` is the place of the brick for new vertices outside the region.
    pub fn divide(
        &mut self,
        region: &mut Region,
        partition: &KdPartition,
        field: &Field,
        is_due: &[bool],
        own: u32,
    ) -> RefineReport {
        let order = HilbertFrame::new(&field.bounds);
        let mut report = RefineReport::default();
        self.inserter.restart();
        let is_due = |region: &Region, tet: &Tet| is_in(region, tet, is_due);
        let is_new = |tet: &Tet| tet.is_live() && tet.node[EXAMINED] & MARK == 0;
        let mut list: Vec<u32> = (0u32..)
            .zip(&region.mesh.tets)
            .filter(|(_, tet)| is_new(tet) && is_due(region, tet))
            .map(|(t, _)| t)
            .collect();
        let mut front = true;
        self.second.clear();
        while !(list.is_empty() && self.second.is_empty()) && report.rounds < ROUNDS_MAX {
            report.rounds += 1;
            let before = report.inserted;
            self.next.clear();
            self.spawner.waiting.clear();
            let again = std::mem::take(&mut self.second);
            for chunk in list.chunks(CHUNK) {
                check_cancelled();
                self.spawner.examine(region, &is_due, chunk, field, &order, front);
                self.insert(region, partition, field, own, &mut report);
            }
            let n_refused = self.second.len();
            self.second_choices(region, again, field, &order);
            self.insert(region, partition, field, own, &mut report);
            // There is no third choice.
            self.second.truncate(n_refused);
            if report.inserted - before < FRONT_MIN {
                front = false;
            }
            self.next.append(&mut self.spawner.waiting);
            list.clear();
            self.seen.clear();
            self.seen.resize(region.mesh.tets.len(), false);
            for &t in &self.next {
                let is_first = !std::mem::replace(&mut self.seen[t as usize], true);
                if is_first && region.mesh.tet(t).is_live() {
                    list.push(t);
                }
            }
            list.sort_unstable();
        }
        report
    }

    /// The centers of tetrahedra whose first candidate found no place.
    fn second_choices(
        &mut self,
        region: &Region,
        again: Vec<u32>,
        field: &Field,
        order: &HilbertFrame,
    ) {
        self.spawner.found.clear();
        for t in again {
            let tet = region.mesh.tet(t);
            let is_tried = tet.node[EXAMINED] & MARK != 0 && tet.node[GOOD] & MARK == 0;
            if !tet.is_live() || !is_tried {
                continue;
            }
            let points = region.mesh.points(tet);
            if let Some(center) = center(points) {
                self.spawner.add(&region.mesh, t, points[0] + center, field, order);
            }
        }
    }

    /// Inserts what was found.
    fn insert(
        &mut self,
        region: &mut Region,
        partition: &KdPartition,
        field: &Field,
        own: u32,
        report: &mut RefineReport,
    ) {
        let mut found = std::mem::take(&mut self.spawner.found);
        found.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.tet.cmp(&b.1.tet)));
        self.take_means(&found);
        self.recent.clear();
        for (k, &(_, mut candidate)) in found.iter().enumerate() {
            let (sum, n) = self.means[k];
            match n {
                // Part of an earlier one.
                0 => continue,
                1 => {}
                _ => {
                    candidate.point = sum / f64::from(n);
                    let h = (field.h)(candidate.point);
                    if !field.place.admits(candidate.point, h) {
                        continue;
                    }
                    candidate.h = h as f32;
                }
            }
            report.candidates += 1;
            match self.try_insert(region, partition, field, &candidate, own) {
                Ok(()) => {
                    report.inserted += 1;
                    self.next.extend_from_slice(self.inserter.new_tets());
                }
                Err(Refusal::PutOff) => {
                    report.put_off += 1;
                    if region.mesh.tet(candidate.tet).is_live() {
                        region.mesh.clear_mark(candidate.tet, EXAMINED);
                    }
                }
                Err(refusal) => {
                    let count = match refusal {
                        Refusal::Near => &mut report.near,
                        Refusal::OutOfPlace => &mut report.out_of_place,
                        Refusal::Frozen => &mut report.frozen_hits,
                        _ => &mut report.blocked,
                    };
                    *count += 1;
                    self.second.push(candidate.tet);
                }
            }
        }
        found.clear();
        self.spawner.found = found;
    }

    /// Per candidate the sum of those near it and their number, which is 0 for those that are part of an earlier sum.
    fn take_means(&mut self, found: &[(u64, Candidate)]) {
        self.means.clear();
        self.means.extend(found.iter().map(|c| (c.1.point, 1)));
        for i in 0..found.len() {
            if self.means[i].1 == 0 {
                continue;
            }
            let first = &found[i].1;
            let within = MEAN_WITHIN * f64::from(first.h);
            let (firsts, others) = self.means.split_at_mut(i + 1);
            for (mean, (_, other)) in others.iter_mut().zip(&found[i + 1..]).take(MEAN_OF) {
                let is_near = (other.point - first.point).length_squared() < within * within;
                if mean.1 == 1 && is_near {
                    mean.1 = 0;
                    firsts[i].0 += other.point;
                    firsts[i].1 += 1;
                }
            }
        }
    }

    fn try_insert(
        &mut self,
        region: &mut Region,
        partition: &KdPartition,
        field: &Field,
        c: &Candidate,
        own: u32,
    ) -> Result<(), Refusal> {
        let hint = (self.recent)
            .hint(c.point, c.h, c.tet, |square, h| c.refuses(square, h))
            .ok_or(Refusal::Near)?;
        let mesh = &mut region.mesh;
        let inserter = &mut self.inserter;
        let mut start = Err(Refusal::Blocked);
        for hint in [Some(hint), Some(c.tet), self.recent.last()].into_iter().flatten() {
            match inserter.locate(mesh, c.point, hint) {
                Err(Refusal::PutOff) => start = Err(Refusal::PutOff),
                Err(_) => {}
                Ok(place) => {
                    start = Ok(place);
                    break;
                }
            }
        }
        let start = start?;
        let corners = mesh.corners(&start.record);
        if corners.iter().any(|v| c.refuses((v.point - c.point).length_squared(), v.h())) {
            return Err(Refusal::Near);
        }
        let is_near = |mesh: &super::flat::FlatMesh, v: u32, square: f64| {
            c.refuses(square, mesh.vertices[v as usize].h())
        };
        inserter.gather(mesh, c.point, &start, is_near)?;
        let height = |vertices: [u32; 3]| {
            let [p, q, r] = vertices.map(|v| mesh.point(v));
            let normal = (q - p).cross(r - p);
            (c.point - p).dot(normal).abs() / normal.length()
        };
        let flat = HEIGHT * f64::from(c.h);
        let is_flat = inserter.faces().iter().any(|f| f.required && height(f.vertices) < flat);
        let is_frozen = |&t: &u32| mesh.attributes[t as usize].1 & FROZEN != 0;
        let refusal = if is_flat {
            Some(Refusal::Near)
        } else if field.place.forbids(c.point, f64::from(c.h)) {
            Some(Refusal::OutOfPlace)
        } else {
            inserter.cavity().iter().any(is_frozen).then_some(Refusal::Frozen)
        };
        if let Some(refusal) = refusal {
            inserter.discard(mesh);
            return Err(refusal);
        }
        let brick = region.bricks.binary_search(&partition.find(c.point));
        let v = region.add_vertex(c.point, c.h, brick.map_or(own, |place| place as u32));
        inserter.fill(&mut region.mesh, v);
        self.recent.push(c.point, c.h, inserter.new_tets()[0]);
        Ok(())
    }
}
