//! Mesh files in and out, streamed. Only this crate and those that use it know formats.
//!
//! Programs use the crate `tetdb`; no promise is made of what is public here.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod read;
pub mod write;
