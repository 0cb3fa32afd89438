//! Bench drivers, an independent auditor and example readers for tetdb.
#![forbid(unsafe_code)]

pub mod sim;
pub mod soak;
