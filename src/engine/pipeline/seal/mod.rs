//! A finished working mesh becomes a sealed file; what sealed files sum up to.

pub(super) mod compact;
mod neighbors;
mod records;
pub(super) mod target;
pub(super) mod totals;
