//! Mesh files in and out, streamed. Only this module and the command line know formats.

pub mod read;
pub mod write;
