#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![doc = include_str!("README.md")]

#[doc(inline)]
pub use tetdb_engine::api::{
    Answers, Bytes, CancelToken, CheckReport, Code, ColorBy, DefectPlace, Error, Event, Existing,
    ExportOptions, Exported, Length, MeshFormat, Mesher, Optimize, Order, Prediction, Query,
    Regions, Remesh, Remeshed, Seal, Settings, SizeWarning, Sizes, Snapped, Snapshot, Store,
    StoreInfo, Subdomains, Summary, Surface, Tasks, Verification, VerifyLevel,
};

#[doc(inline)]
pub use tetdb_engine::data;

// Its text alone: nothing of it is in a program.
#[cfg(doc)]
pub mod guide;
