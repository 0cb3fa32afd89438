//! Generated surfaces with known difficulties, and real ones if they are available.

mod build;
mod flood;
mod oracle;
mod real;
mod shapes;
mod tidy;
