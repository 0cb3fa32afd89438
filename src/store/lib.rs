//! Finished stores: the catalog, sealed sub-domains, questions about them, and their verification.
//!
//! | module | subject |
//! |---|---|
//! | [`sealed`] | compressed sub-domains, read chunk by chunk |
//! | [`store`] | the catalog of job, steps and sub-domains; one commit a step |
//! | [`query`] | locate, select, order |
//! | [`transfer`] | fields of one mesh evaluated on another |
//! | [`audit`] | verification, digest, comparison |
//!
//! This crate does no meshing. Programs use the crate `tetdb`; the items that are public here may change at any time.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod audit;
pub mod query;
pub mod sealed;
pub mod store;
pub mod transfer;
