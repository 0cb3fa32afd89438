//! Forecast of the wall time of threads, and of many workers on many machines, from predicted counts alone.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::estimate::{Estimate, SECONDS_TET, SECONDS_TRIANGLE, SECONDS_VERIFY};
use tetdb_kernel::blocks::block_tets;

/// CPU seconds of a cut: per triangle of the subtree's surface, and per tetrahedron near the cutting plane. The number of the
/// latter is taken as the number of all tetrahedra of the subtree to the power 2/3.
///
/// Fitted to the cuts of two meshes on an idle EPYC at 2.6 GHz. With 211 million tetrahedra the first cut took 34.9 s and all 99
/// cuts 408 s; the fit gives 33.4 and 396. With 20 million they took 7.7 and 28.0 s; the fit gives 7.0 and 29.2.
const CUT_TRIANGLE: f64 = 1.4e-6;
const CUT_PLANE: f64 = 6.5e-5;
/// CPU seconds per tetrahedron of a sub-domain; measured on the same two meshes: 2.65 and 2.82 microseconds.
const SUBDOMAIN_TET: f64 = 2.75e-6;

/// Shares of the CPU seconds of a triangle and of a tetrahedron that one thread has alone: boundary recovery; scaffold, numbering, sealing.
/// Share of those of a tetrahedron that visits of blocks take. The rest has no order.
///
/// From the journals of ellipsoids of 3.0 and 4.4 million with one thread. With 1, 2, 4, 8 and 16 threads on 16 cores the larger one took
/// 17.3, 11.5, 7.1, 5.4 and 4.9 s; the forecast is 20.0, 12.3, 8.5, 6.5 and 5.6 without verification. Of no other kind of surface
/// was the curve measured.
const TRIANGLE_ALONE: f64 = 0.43;
const TET_ALONE: f64 = 0.10;
const TET_VISITS: f64 = 0.77;
/// The longest chain of visits is as long as those of so many blocks, whatever the mesh: it follows from the number of colors.
const CHAIN_BLOCKS: f64 = 18.0;

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
    /// Predicted wall time with verification. Unit: seconds.
    ///
    /// Of the visits of blocks, the longest chain counts in full and the rest is shared: a list schedule takes no longer.
    pub fn seconds(&self, threads: usize) -> f64 {
        let (at_once, n) = (self.at_once(threads), f64::from(self.subdomains));
        let threads = threads.max(1) as f64;
        // A thread without a sub-domain of its own helps with those of others.
        surface_seconds(self.triangles as f64, threads)
            + self.cuts_seconds(threads as u32)
            + subdomain_seconds(self.tets() / n, threads / at_once) * n / at_once
            + SECONDS_VERIFY * self.tets() / threads
    }

    /// Wall seconds of all cuts.
    fn cuts_seconds(&self, workers: u32) -> f64 {
        tree_seconds(self.subdomains, workers, |count| {
            let share = f64::from(count) / f64::from(self.subdomains);
            let plane = (share * self.tets()).powf(2.0 / 3.0);
            CUT_TRIANGLE * share * self.triangles as f64 + CUT_PLANE * plane
        })
    }

    /// Forecasts the wall time of `workers` workers on any number of machines; 0 counts as 1.
    pub fn forecast(&self, workers: u32) -> Forecast {
        let (workers, n) = (workers.max(1), self.subdomains);
        let per_subdomain = SUBDOMAIN_TET * self.tets() / f64::from(n);
        Forecast {
            serial_s: SECONDS_TRIANGLE * self.triangles as f64 + SECONDS_VERIFY * self.tets(),
            cuts_s: self.cuts_seconds(workers),
            subdomains_s: per_subdomain * f64::from(n.div_ceil(workers)),
        }
    }
}

/// Wall seconds of all that is done with triangles alone.
fn surface_seconds(triangles: f64, threads: f64) -> f64 {
    SECONDS_TRIANGLE * triangles * (TRIANGLE_ALONE + (1.0 - TRIANGLE_ALONE) / threads)
}

/// Wall seconds of a sub-domain of so many tetrahedra.
fn subdomain_seconds(tets: f64, threads: f64) -> f64 {
    let chain = (CHAIN_BLOCKS * block_tets(tets) / tets.max(1.0)).min(1.0);
    let alone = TET_ALONE + TET_VISITS * chain;
    SECONDS_TET * tets * (alone + (1.0 - alone) / threads)
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
    fn threads_are_forecast_as_they_were_measured() {
        let seconds = |tets, threads| {
            surface_seconds(0.046 * tets, threads) + subdomain_seconds(tets, threads)
        };
        // Ellipsoids on 16 cores.
        let one = seconds(4.4e6, 1.0);
        for (threads, measured) in [(2.0, 11.5), (4.0, 7.1), (8.0, 5.4), (16.0, 4.9)] {
            let ratio = seconds(4.4e6, threads) / one / (measured / 17.3);
            assert!((ratio - 1.0).abs() < 0.1, "{threads} threads: {ratio} of what was measured");
        }
        // A mesh of few blocks is done block by block, a large one by all.
        assert!(seconds(2e4, 1.0) < 1.5 * seconds(2e4, 16.0));
        assert!(seconds(2e8, 1.0) > 5.0 * seconds(2e8, 16.0));
    }

    #[test]
    fn cuts_wait_for_those_above_them_and_for_free_workers() {
        let equal = |n, workers| tree_seconds(n, workers, |_| 1.0).round();
        assert_eq!([1, 2, 8].map(|n| equal(n, 1)), [0.0, 1.0, 7.0]);
        assert_eq!([1, 2, 4, 100].map(|w| equal(8, w)), [7.0, 4.0, 3.0, 3.0]);
        let halved = |workers| tree_seconds(8, workers, f64::from).round();
        assert_eq!([1, 2, 4].map(halved), [24.0, 16.0, 14.0]);
    }
}
