#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![doc = include_str!("README.md")]

#[doc(inline)]
pub use tetdb_engine::api::{
    AnswerColumn, AnswerFile, AnswerRow, AnswerValue, Answers, Bytes, CancelToken, CheckReport,
    ChunkCounts, Code, ColorBy, Condition, DefectPlace, Error, Event, Existing, ExportOptions,
    Exported, ExprError, GatherReport, Length, MESH_ENDINGS, MeshFormat, Mesher, Optimize, Order,
    Prediction, Query, Regions, Remesh, RemeshForecast, Remeshed, Reported, Seal, Settings, Share,
    ShownTriangles, SizeWarning, Sizes, Snapped, Snapshot, Store, Subdomains, Summary, Surface,
    TaskReport, TaskStage, TaskStatus, Tasks, TetId, VARIABLES, Verification, VerifyLevel,
    VertexId, Word, Writers, check_target, csv_head, inputs_of, short, task_ranges,
};

#[cfg(feature = "mpi")]
#[doc(inline)]
pub use tetdb_engine::api::mpi;

#[doc(inline)]
pub use tetdb_engine::data;

// Its text alone: nothing of it is in a program.
#[cfg(doc)]
pub mod guide;
