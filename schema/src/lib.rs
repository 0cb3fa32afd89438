#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![doc = include_str!("../README.md")]

pub mod catalog;
pub mod chunk;
pub mod code;
pub mod digest;
pub mod ids;
pub mod leaf;
pub mod page;
pub mod record;
pub mod source;
pub mod word;
