//! Made surfaces with known difficulties, and the real ones when they are at hand.

mod build;
mod flood;
mod oracle;
mod real;
mod shapes;
