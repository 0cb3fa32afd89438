//! How long workers on many machines take together, from predicted numbers alone.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::estimate::{Estimate, SECONDS_TRIANGLE, SECONDS_VERIFY};

/// CPU seconds of a cut: for each triangle of the part's surface, and for each tetrahedron at a plane, of which the part has as many as the power 2/3 of all.
/// Fitted to the cuts of two meshes on an idle EPYC at 2.6 GHz: of 211 million (34.9 s for the first, 408 s for all 99; these say 33.4 and 396) and of 20
/// million (7.7 and 28.0; 7.0 and 29.2).
const CUT_TRIANGLE: f64 = 1.4e-6;
const CUT_PLANE: f64 = 6.5e-5;
/// CPU seconds of a sub-domain for each of its tetrahedra, of the same meshes: 2.65 and 2.82.
const SUBDOMAIN_TET: f64 = 2.75e-6;

/// Wall seconds of workers with a thread each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Before the cuts and after the sub-domains, in one process: surface, sizes, coarse mesh, verification.
    pub serial_s: f64,
    /// The tree of cuts.
    pub cuts_s: f64,
    /// Sub-domains, each by whoever is free.
    pub subdomains_s: f64,
}

impl Forecast {
    /// All of it.
    pub fn wall_s(self) -> f64 {
        self.serial_s + self.cuts_s + self.subdomains_s
    }
}

impl Estimate {
    /// What `workers` take, of any number of machines; 0 counts as 1.
    pub fn forecast(&self, workers: u32) -> Forecast {
        let (workers, n) = (workers.max(1), self.subdomains);
        let per_subdomain = SUBDOMAIN_TET * self.tets() / f64::from(n);
        Forecast {
            serial_s: SECONDS_TRIANGLE * self.triangles as f64 + SECONDS_VERIFY * self.tets(),
            cuts_s: tree_seconds(n, workers, |count| {
                let share = f64::from(count) / f64::from(n);
                let plane = (share * self.tets()).powf(2.0 / 3.0);
                CUT_TRIANGLE * share * self.triangles as f64 + CUT_PLANE * plane
            }),
            subdomains_s: per_subdomain * f64::from(n.div_ceil(workers)),
        }
    }
}

/// Seconds of all cuts of `n` sub-domains, each of so many of them: a cut begins when the one above it is done, the widest first.
fn tree_seconds(n: u32, workers: u32, seconds: impl Fn(u32) -> f64) -> f64 {
    let is_wide = |&count: &u32| count > 1;
    let mut ready = BinaryHeap::from_iter([n].into_iter().filter(is_wide));
    // Ends in nanoseconds, which have an order.
    let mut running = BinaryHeap::new();
    let mut now = 0;
    loop {
        while running.len() < workers as usize
            && let Some(count) = ready.pop()
        {
            running.push(Reverse((now + (1e9 * seconds(count)) as u64, count)));
        }
        let Some(Reverse((end, count))) = running.pop() else {
            return now as f64 / 1e9;
        };
        now = end;
        ready.extend([count / 2, count - count / 2].into_iter().filter(is_wide));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_wait_for_those_above_them_and_for_free_workers() {
        let equal = |n, workers| tree_seconds(n, workers, |_| 1.0).round();
        assert_eq!([1, 2, 8].map(|n| equal(n, 1)), [0.0, 1.0, 7.0]);
        assert_eq!([1, 2, 4, 100].map(|w| equal(8, w)), [7.0, 4.0, 3.0, 3.0]);
        let halved = |workers| tree_seconds(8, workers, f64::from).round();
        assert_eq!([1, 2, 4].map(halved), [24.0, 16.0, 14.0]);
    }
}
