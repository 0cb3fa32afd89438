//! Mesh files in and out, streamed. Only this crate and those that use it know formats.
//!
//! Programs use the crate `tetdb`; the items that are public here may change at any time.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod read;
pub mod write;
