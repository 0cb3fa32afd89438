//! Surfaces made fit for meshing: crossing triangles divided along their intersections, holes closed, surfaces remeshed within a tolerance.
//!
//! | module | subject |
//! |---|---|
//! | [`resolve`] | crossing triangles are divided where they cross |
//! | [`close`] | holes are closed where winding numbers say what is inside |
//! | [`remesh`] | needles vanish, and every point stays within a tolerance |
//! | [`wrap`] | a closed surface around anything, at an offset |
//!
//! A surface goes in and a surface comes out, with a report of what was changed. Nothing here reads or writes files. Programs use the
//! crate `tetdb`; the items here may change at any time.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod close;
pub mod remesh;
pub mod resolve;
#[cfg(test)]
mod tests;
pub mod wrap;
