//! Page traffic in the form that receipts store.

use tetdb_base::storage::PagerStats;
use tetdb_schema::work::Traffic;

/// Returns the traffic of one order, with its largest number of frames.
pub fn traffic_of(pages: PagerStats, frames_used: usize) -> Traffic {
    let PagerStats { pages_read, pages_written, commits } = pages;
    Traffic { pages_read, pages_written, commits, frames_used: frames_used as u64 }
}

/// Returns the page counts of a receipt.
pub fn pages_of(traffic: Traffic) -> PagerStats {
    let Traffic { pages_read, pages_written, commits, .. } = traffic;
    PagerStats { pages_read, pages_written, commits }
}
