//! A finished working mesh becomes a sealed file; what sealed files sum up to.

pub(super) mod compact;
mod neighbors;
pub(super) mod totals;
