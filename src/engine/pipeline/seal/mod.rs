//! Sealing: writes a finished working mesh as a sealed file, and sums the totals of sealed files.

pub(super) mod compact;
mod neighbors;
mod records;
pub(super) mod target;
pub(super) mod totals;
