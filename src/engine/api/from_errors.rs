//! Conversions of the errors of lower modules into [`Error`].

use super::error::{Error, Remedy};
use super::preflight::no_room;
use crate::pipeline::PipelineError;
use tetdb_base::storage::StorageError;
use tetdb_base::surface::{SurfaceError, show};
use tetdb_io::read::ReadError;
use tetdb_io::write::WriteError;
use tetdb_kernel::boundary::BoundaryError;
use tetdb_kernel::samples::SampleError;
use tetdb_kernel::sizing::SizingError;
use tetdb_schema::code::Code;
use tetdb_store::query::QueryError;
use tetdb_store::sealed::SealedError;
use tetdb_store::store::StoreError;

impl From<ReadError> for Error {
    fn from(e: ReadError) -> Self {
        Self::new(e.code(), &e).at(e.place()).with_help(e.help())
    }
}

impl From<WriteError> for Error {
    fn from(e: WriteError) -> Self {
        if let WriteError::Elsewhere(failure) = e {
            return PipelineError::from(failure).into();
        }
        let error = Self::new(e.code(), &e).with_help(e.help());
        match e.place() {
            Some(path) => error.at(path.display()),
            None => error,
        }
    }
}

impl From<SurfaceError> for Error {
    fn from(e: SurfaceError) -> Self {
        let error = Self::new(e.code(), &e).with_help(e.help()).with_remedy(Remedy::General);
        match &e {
            SurfaceError::Invalid { defect, n_defects, files } => {
                let more = match n_defects.saturating_sub(1) {
                    0 => String::new(),
                    1 => " (and 1 more defect)".to_owned(),
                    n => format!(" (and {n} more defects)"),
                };
                error.at(defect.place(files) + &more)
            }
            SurfaceError::Embed(wire) => error.at(show(wire.at())),
            _ => error,
        }
    }
}

impl From<SampleError> for Error {
    fn from(e: SampleError) -> Self {
        if let SampleError::Memory { needed, .. } = e {
            return Self::new(Code::Memory, &e).with_remedy(Remedy::Memory(needed));
        }
        Self::new(Code::BadSample, e)
            .with_help("for example balls,count=100 or box,h=0.1")
            .with_remedy(Remedy::General)
    }
}

impl From<StorageError> for Error {
    fn from(e: StorageError) -> Self {
        let code = match &e {
            StorageError::Busy { .. } => Code::Busy,
            StorageError::Full { .. } => Code::DiskFull,
            StorageError::Damaged { .. }
            | StorageError::Page { .. }
            | StorageError::Missing { .. } => Code::Damaged,
            StorageError::Budget { .. }
            | StorageError::NoMemory { .. }
            | StorageError::TooMany { .. } => Code::Memory,
            StorageError::Cancelled => Code::Stopped,
            _ => Code::Io,
        };
        match e {
            StorageError::NoMemory { .. } => Self::new(code, &e).with_help(
                "end other programs, or raise the limit of this process; with a smaller memory cap more goes to the disk",
            ),
            StorageError::TooMany { .. } => Self::new(code, &e)
                .with_help("ask for longer edges, or divide the mesh into more sub-domains"),
            _ => with_general_help(code, &e),
        }
    }
}

impl From<SealedError> for Error {
    fn from(e: SealedError) -> Self {
        StoreError::from(e).into()
    }
}

impl From<StoreError> for Error {
    fn from(e: StoreError) -> Self {
        let code = match e {
            StoreError::Storage(inner) => return inner.into(),
            StoreError::Sealed(SealedError::Storage(inner)) => return inner.into(),
            StoreError::Busy { .. } => Code::Busy,
            StoreError::Changed { .. } => Code::StoreChanged,
            StoreError::NotFound { .. } => Code::NoSuchStore,
            StoreError::NoSubdomain { .. } | StoreError::NoVersion { .. } => Code::NoSuchPart,
            StoreError::NotOurs { reason, .. } if reason == StoreError::BARELY_BEGUN => {
                return Self::new(Code::NotAStore, &e)
                    .with_help("there is nothing to go on with; run it again from the start");
            }
            StoreError::NotOurs { .. } => Code::NotAStore,
            StoreError::Finished { .. } => Code::StoreExists,
            StoreError::Unfinished { .. } => Code::StoreUnfinished,
            StoreError::NoCoarseSnapshot { .. } => Code::NoCoarseLeaf,
            StoreError::Format { .. } => Code::StoreFormat,
            StoreError::Sealed(SealedError::NotSealed { .. }) => Code::StoreUnfinished,
            StoreError::Row { .. } | StoreError::Sealed(_) => Code::Damaged,
        };
        with_general_help(code, &e)
    }
}

impl From<QueryError> for Error {
    fn from(e: QueryError) -> Self {
        match e {
            QueryError::Store(e) => e.into(),
            other => with_general_help(Code::NoSuchPart, &other),
        }
    }
}

impl From<SizingError> for Error {
    fn from(e: SizingError) -> Self {
        let help = match &e {
            SizingError::BadValue { option: "hgrad", .. } => {
                "write a plain number, with a point and without a unit"
            }
            SizingError::BadValue {
                option: "size_box" | "size_sphere" | "size_cylinder", ..
            } => {
                "coordinates are numbers in the surface's own unit; radii and lengths of edges can also be shares, such as 1%"
            }
            SizingError::BadRegion { .. } | SizingError::BadValue { option: "size_region", .. } => {
                "name a region by its number or name, or by a label of triangles around it, then a comma and a length such as 0.5 or 1%"
            }
            SizingError::BadLabel { .. } | SizingError::BadValue { option: "size_label", .. } => {
                "name a label of triangles, then a comma and a length such as 0.5 or 1%; a second length says how far from the label the first holds"
            }
            SizingError::BadFormula { .. } | SizingError::NoSize { .. } => {
                "an expression in x, y and z that is a length everywhere in the surface's box, such as 0.05+0.1*abs(z)"
            }
            SizingError::SizeCount { .. } => {
                "write one size for each vertex of the surface, or give a mesh of tetrahedra with sizes at its vertices"
            }
            _ => {
                "a length is a number in the surface's own unit, such as 0.5, or a share of its box diagonal, such as 1%"
            }
        };
        Self::new(Code::BadSize, &e).with_help(help).with_option(e.option())
    }
}

impl From<BoundaryError> for Error {
    fn from(e: BoundaryError) -> Self {
        if matches!(e, BoundaryError::Orientation { .. }) {
            return Self::new(Code::ContradictingOrientation, &e)
                .with_help("fill all regions, which needs no orientation, or give each shared wall from both sides")
                .with_remedy(Remedy::General);
        }
        if let BoundaryError::Seed { point, .. } = &e {
            return Self::new(Code::BadSeed, &e)
                .at(show(*point))
                .with_help("a seed lies inside the region that it fills or names, off its triangles; one for each region");
        }
        if let BoundaryError::NoSeed = &e {
            return Self::new(Code::BadSeed, &e)
                .with_help("give a point inside each region to fill, or inside each hole");
        }
        Self::new(Code::UnrecoveredTriangles, &e)
            .with_help("look at these triangles; a finer or better shaped surface there helps")
            .with_remedy(Remedy::General)
    }
}

impl From<PipelineError> for Error {
    fn from(e: PipelineError) -> Self {
        match e {
            PipelineError::Surface(e) => e.into(),
            PipelineError::Boundary(e) => e.into(),
            PipelineError::BadMesh(e) => {
                Self::new(Code::BadMesh, &e).at(e.places.join("; ")).with_help(e.help)
            }
            PipelineError::Sizing(e) => e.into(),
            PipelineError::Store(e) => e.into(),
            PipelineError::Storage(e) => e.into(),
            PipelineError::Query(e) => e.into(),
            PipelineError::NoRoom { tets, needed, free } => no_room(tets, needed, free),
            PipelineError::LaterFields { .. } => Self::new(Code::BadField, &e)
                .with_help("drop these fields first, and add them again afterwards"),
            PipelineError::NothingFilled { .. } => Self::new(Code::NothingFilled, &e)
                .with_help("fill all regions, and look at the surface")
                .with_remedy(Remedy::General),
            PipelineError::NothingToUndo { .. } => Self::new(Code::NothingToUndo, &e)
                .with_help("only the last change can be undone, once, and not after its old version was dropped; versions with a name stay")
                .with_remedy(Remedy::General),
            PipelineError::SheetOutside { ref at, .. } => Self::new(Code::SheetOutside, &e)
                .at(show(*at))
                .with_help("cut sheets off where they leave the filled regions, or fill the region they lie in")
                .with_remedy(Remedy::General),
            PipelineError::WireOutside { ref at, .. } => Self::new(Code::WireOutside, &e)
                .at(show(*at))
                .with_help("leave out what is outside the filled regions, or fill the region it lies in")
                .with_remedy(Remedy::General),
            PipelineError::BadSeed { option, .. } => Self::new(Code::BadSeed, &e).with_option(Some(option)).with_help(match option {
                "hole" => "such as 0.5,0.5,0.2",
                _ => "such as 0.5,0.5,0.2,rock",
            }),
            PipelineError::SizeCount { .. } => Self::new(Code::CountMismatch, &e)
                .with_help("give one length for each, in the order of the exported arrays")
                .with_remedy(Remedy::General),
            PipelineError::Helper(failure) => {
                with_general_help(failure.code, &failure.message)
            }
            PipelineError::NoPlan { .. } => Self::new(Code::NoTasks, &e)
                .with_help("the store's summary says how far it is; the stage before a task has to be gathered first")
                .with_remedy(Remedy::General),
            PipelineError::TaskFile { .. } => Self::new(Code::TaskFile, &e)
                .with_help("gather again, which writes orders anew, then do the task again")
                .with_remedy(Remedy::General),
            PipelineError::Option { option: "subdomains", .. } => {
                let help = "give 1 or more; without it the number follows from the expected mesh";
                Self::new(Code::Usage, &e).with_option(Some("subdomains")).with_help(help)
            }
            PipelineError::Option { option: "task", .. } => {
                let help = "the store's summary has the numbers of its tasks";
                Self::new(Code::Usage, &e).with_option(Some("task")).with_help(help)
            }
            other => Self::new(Code::Usage, &other).with_option(other.option()),
        }
    }
}

fn with_general_help(code: Code, e: &impl ToString) -> Error {
    let help = match code {
        Code::Busy => "wait for the other process, or stop it",
        Code::StoreChanged => "ask again: the answer is then of the store as it is now",
        Code::DiskFull => "free some space, then resume",
        Code::Damaged => {
            "verify the store to see what is damaged; damaged sub-domains can be meshed again"
        }
        Code::Memory => "allow more memory, or mesh a coarser surface",
        Code::Stopped => "resume goes on from the last finished step",
        Code::NoSuchStore => "check the path",
        Code::NotAStore => "choose another path; what is there was not written by tetdb",
        Code::StoreExists => "choose another path, or allow it to be replaced",
        Code::NoCoarseLeaf => "mesh the surface again and keep the coarse snapshots",
        Code::StoreUnfinished => "resume goes on with it",
        Code::StoreFormat => "use the version of tetdb that wrote the store, or mesh again",
        Code::NoSuchPart => "the store's summary lists its parts",
        _ => "check the path and its permissions",
    };
    Error::new(code, e.to_string()).with_help(help).with_remedy(Remedy::General)
}
