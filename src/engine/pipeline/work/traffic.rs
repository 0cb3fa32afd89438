//! The traffic of a pager as receipts have it.

use tetdb_base::storage::PagerStats;
use tetdb_schema::work::Traffic;

/// The traffic of one order, and the most frames in use.
pub fn traffic_of(pages: PagerStats, frames_used: usize) -> Traffic {
    let PagerStats { pages_read, pages_written, commits } = pages;
    Traffic { pages_read, pages_written, commits, frames_used: frames_used as u64 }
}

/// The pages of a receipt.
pub fn pages_of(traffic: Traffic) -> PagerStats {
    let Traffic { pages_read, pages_written, commits, .. } = traffic;
    PagerStats { pages_read, pages_written, commits }
}
