//! What is bad in the eyes of a stage: pages are judged side by side.

use std::cmp::Reverse;
use std::sync::{Mutex, PoisonError};

use super::super::pages::PageFlags;
use super::super::smooth::is_free;
use super::face_bounds::FaceBounds;
use super::stages::{Judgment, Stage, judge};
use crate::mesh::{Mesh, Scan, scan_parts, tets_of_page};
use tetdb_base::geom::IdMap;
use tetdb_base::storage::Pages;

/// Pages judged at a time.
const PAGES: usize = 32;

/// Bounds known to those who judge; what they say does not depend on who has met which.
#[derive(Default)]
pub(super) struct Judges(Mutex<Vec<FaceBounds>>);

impl Judges {
    /// Whoever judges first has these.
    pub(super) fn lend(&mut self, bounds: &mut FaceBounds) {
        let all = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        all.push(std::mem::take(bounds));
    }

    /// Gives back what is known to one of them.
    pub(super) fn take_back(&mut self, bounds: &mut FaceBounds) {
        let all = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        *bounds = all.pop().unwrap_or_default();
    }

    /// Does `work` with bounds that nobody else has meanwhile.
    fn with<T>(&self, work: impl FnOnce(&mut FaceBounds) -> T) -> T {
        let all = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let bounds = all().pop();
        let mut bounds = bounds.unwrap_or_default();
        let done = work(&mut bounds);
        all().push(bounds);
        done
    }
}

/// What is bad, in a page or in all.
#[derive(Default)]
pub(super) struct Listed {
    /// Bits of the badness, which order like it, and the tetrahedron.
    pub(super) bad: Vec<(u64, u32)>,
    /// Whether anything is bad, be it for later.
    has_bad: bool,
    /// The worst badness.
    worst: f64,
    /// The worst q that the surface forces.
    pub(super) forced: f64,
}

/// Lists the worst tetrahedra of the flagged pages, worst first; pages with nothing bad lose their flags.
pub(super) fn list<P: Pages>(
    mesh: &mut Mesh<P>,
    pages: &mut PageFlags,
    stage: &Stage,
    judges: &Judges,
) -> Listed {
    let most = stage.tried_max(mesh.n_tets());
    let mut all = Listed::default();
    for some in pages.take_all().chunks(PAGES) {
        let worst = all.worst;
        for (&page, listed) in some.iter().zip(judged(mesh, some, stage, worst, judges)) {
            if listed.has_bad {
                pages.raise_page(page);
            }
            all.worst = all.worst.max(listed.worst);
            all.forced = all.forced.max(listed.forced);
            all.bad.extend(listed.bad);
        }
        if all.bad.len() >= 2 * most {
            keep_worst(&mut all.bad, most);
        }
    }
    keep_worst(&mut all.bad, most);
    all
}

/// The vertices that may move of all bad tetrahedra in the flagged pages, each with the worst it has, worst first and in the order of its corners.
pub(super) fn list_movable<P: Pages>(
    mesh: &mut Mesh<P>,
    pages: &PageFlags,
    stage: &Stage,
    judges: &Judges,
) -> Vec<(u32, u32)> {
    let mut worst: IdMap<u32, (u64, u32, Reverse<usize>)> = IdMap::default();
    for some in pages.clone().take_all().chunks(PAGES) {
        for listed in judged(mesh, some, stage, 0.0, judges) {
            for (bits, t) in listed.bad {
                for (i, v) in mesh.tet(t).vertices().into_iter().enumerate() {
                    if is_free(mesh, v) {
                        let this = (bits, t, Reverse(i));
                        let known = worst.entry(v).or_insert(this);
                        *known = this.max(*known);
                    }
                }
            }
        }
    }
    let mut list: Vec<_> = worst.into_iter().collect();
    list.sort_unstable_by_key(|&(_, worst)| Reverse(worst));
    list.into_iter().map(|(v, (_, t, _))| (v, t)).collect()
}

/// What is bad in each of some pages.
fn judged<P: Pages>(
    mesh: &mut Mesh<P>,
    pages: &[u32],
    stage: &Stage,
    worst: f64,
    judges: &Judges,
) -> Vec<Listed> {
    let listing = Listing { stage, worst, judges };
    scan_parts(mesh, pages, &listing)
}

fn keep_worst(bad: &mut Vec<(u64, u32)>, most: usize) {
    bad.sort_unstable_by(|a, b| b.cmp(a));
    bad.truncate(most);
}

/// Judges the tetrahedra of a page.
struct Listing<'a> {
    stage: &'a Stage,
    /// The worst found in earlier pages.
    worst: f64,
    judges: &'a Judges,
}

impl Scan for Listing<'_> {
    type Part = u32;
    type Output = Listed;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> Listed {
        let mut listed = Listed { worst: self.worst, ..Listed::default() };
        self.judges.with(|bounds| {
            tets_of_page(mesh, page, |mesh, t, tet| {
                if self.stage.is_for_later(mesh, &tet, listed.worst) {
                    listed.has_bad = true;
                    return;
                }
                match judge(mesh, &tet, self.stage, bounds) {
                    Judgment::Good => {}
                    // One without volume in doubles says nothing about others.
                    Judgment::Forced(q) if q.is_infinite() => {}
                    Judgment::Forced(q) => listed.forced = listed.forced.max(q),
                    Judgment::Bad(badness) => {
                        listed.bad.push((badness.to_bits(), t));
                        listed.has_bad = true;
                        listed.worst = listed.worst.max(badness);
                    }
                }
            });
        });
        listed
    }
}
