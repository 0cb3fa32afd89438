#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![doc = include_str!("../README.md")]

pub mod archive;
pub mod blob;
pub mod catalog;
pub mod chunk;
pub mod code;
pub mod digest;
pub mod field;
pub mod ids;
pub mod labels;
pub mod page;
pub mod periodic;
pub mod record;
pub mod row;
pub mod source;
pub mod topology;
pub mod totals;
pub mod tree;
pub mod unsealed;
pub mod word;
pub mod work;
