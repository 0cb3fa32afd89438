//! Mesh files in and out, streamed. Only this room and the command line know formats.

pub mod read;
pub mod write;
