#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![doc = include_str!("README.md")]

#[doc(inline)]
pub use tetdb_engine::api::{
    Adapt, AdaptForecast, AdaptPlan, Adapted, AnswerColumn, AnswerFile, AnswerRow, AnswerValue,
    Answers, BOUNDARY_PREFIX, Bytes, CancelToken, CellArrays, CheckReport, ChunkCounts,
    ChunkedQuery, CloseReport, ClosedHole, Code, ColorBy, Comparison, Condition, Defect,
    DefectPlace, DrawnTriangles, EmbedOutside, EmbeddedInfo, EmbeddedKind, Error, ErrorEstimate,
    Event, Existing, ExportOptions, Exported, ExprError, Field, FieldIds, FieldNumber, FieldPlace,
    FieldRange, FieldReader, FieldSource, FieldValues, GatherReport, Guard, Import, LabelSet,
    Length, LongFaces, MESH_ENDINGS, MeshFormat, MeshOptions, Mesher, MotionKind, NewField,
    Optimize, OptionsText, Order, Periodic, PeriodicLabels, PickedTet, Population, Prediction,
    Qualities, Query, RegionInfo, Regions, Remesh, RemeshForecast, Remeshed, RepairKind,
    RepairReport, RepairStep, Reported, ResolveReport, Resolved, SAMPLE_PREFIX, Scalar, Seal, Seed,
    SeedKind, Settings, Share, ShownTriangles, SizeWarning, Sizes, Snapped, Snapshot, SplitReport,
    StageInfo, Store, StoreInfo, SubdomainDiff, SubdomainInfo, Subdomains, Suggestion, Summary,
    Surface, SurfaceRemesh, SurfaceRemeshReport, SurfaceReport, SurfaceWrap, SurfaceWritten,
    TaskReport, TaskStage, TaskStatus, Tasks, TetChunk, TetId, TransferMethod, TransferredField,
    VARIABLES, Verification, VerifyLevel, Version, VersionDiff, VertexId, Viewer, WELD_SHARE_MAX,
    Word, WorkersPrediction, WrapReport, Writers, check_target, csv_head, inputs_of, peak_bytes,
    short, task_ranges, typed,
};

#[cfg(feature = "mpi")]
#[doc(inline)]
pub use tetdb_engine::api::mpi;

#[doc(inline)]
pub use tetdb_engine::data;

// Its text alone: nothing of it is in a program.
#[cfg(doc)]
pub mod guide;
