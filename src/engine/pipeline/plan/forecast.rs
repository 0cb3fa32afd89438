//! Forecast of the wall time of many workers on many machines, from predicted counts alone.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::estimate::{Estimate, SECONDS_TRIANGLE, SECONDS_VERIFY};

/// CPU seconds of a cut: per triangle of the subtree's surface, and per tetrahedron near the cutting plane. The number of the
/// latter is taken as the number of all tetrahedra of the subtree to the power 2/3.
///
/// Fitted to the cuts of two meshes on an idle EPYC at 2.6 GHz. With 211 million tetrahedra the first cut took 34.9 s and all 99
/// cuts 408 s; the fit gives 33.4 and 396. With 20 million they took 7.7 and 28.0 s; the fit gives 7.0 and 29.2.
const CUT_TRIANGLE: f64 = 1.4e-6;
const CUT_PLANE: f64 = 6.5e-5;
/// CPU seconds per tetrahedron of a sub-domain; measured on the same two meshes: 2.65 and 2.82 microseconds.
const SUBDOMAIN_TET: f64 = 2.75e-6;

/// Wall seconds with any number of workers of one thread each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Work of one process before the cuts and after the sub-domains: surface, sizes, coarse mesh, verification.
    pub serial_s: f64,
    /// All cuts.
    pub cuts_s: f64,
    /// All sub-domains, each meshed by the next free worker.
    pub subdomains_s: f64,
}

impl Forecast {
    /// Sum of the three.
    pub fn wall_s(self) -> f64 {
        self.serial_s + self.cuts_s + self.subdomains_s
    }
}

impl Estimate {
    /// Forecasts the wall time of `workers` workers on any number of machines; 0 counts as 1.
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

/// Wall seconds of all cuts of a mesh with `n` sub-domains. `seconds` gives the time of a cut from the number of sub-domains
/// below it. A cut begins after the one above it; among those ready, the widest begins first.
fn tree_seconds(n: u32, workers: u32, seconds: impl Fn(u32) -> f64) -> f64 {
    let is_wide = |&count: &u32| count > 1;
    let mut ready = BinaryHeap::from_iter([n].into_iter().filter(is_wide));
    // End times in nanoseconds: unlike floats, integers are ordered.
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
