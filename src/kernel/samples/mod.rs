//! Seeded generators of closed surfaces: the paper's cases, and typical output of CAD programs.
//!
//! A sample is named by one word without characters special to a shell, such as `balls,count=1000,seed=1,h=0.02`. The
//! same word gives the same bits on every machine: only IEEE basic operations and square roots are used, and random
//! numbers come from `random`.
//!
//! Every surface but `broken`, except for its sheets, is closed and without duplicate points. Normals point out of the parts that an
//! odd number of shells separates from the outside, so that the signed volume is the volume that the parity rule fills.

mod balls;
mod boxes;
mod broken;
mod build;
mod caps;
mod error;
mod faults;
mod grains;
mod hull;
mod knot;
mod needles;
mod prism;
mod random;
mod sample;
mod shells;
mod spec;
mod sphere;
mod steps;
mod trig;
mod wells;

#[cfg(test)]
mod tests;

pub use error::SampleError;
pub use sample::Sample;
pub use spec::{PREFIX, SAMPLES, SampleKind, SampleSpec};
