//! Codes of errors: one table with the word, the exit code of the program and the meaning.

use std::fmt;
use std::str::FromStr;

macro_rules! codes {
    ($($name:ident $word:literal $exit:literal $meaning:literal;)*) => {
        /// The kind of an error. The word, the exit code and the meaning stand in one table; the guide carries the same.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum Code {
            $(#[doc = $meaning] $name,)*
        }

        impl Code {
            /// Every code, in the order of exit codes as the guide lists them.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// The word that stands for the code in messages, JSON and exceptions.
            pub const fn as_str(self) -> &'static str {
                match self {
                    $(Self::$name => $word,)*
                }
            }

            /// The exit code of the program.
            pub const fn exit(self) -> u8 {
                match self {
                    $(Self::$name => $exit,)*
                }
            }

            /// One sentence about the code, without a period.
            pub const fn meaning(self) -> &'static str {
                match self {
                    $(Self::$name => $meaning,)*
                }
            }
        }
    };
}

codes! {
    Internal "internal" 1 "a bug: please report it with the command and the message";
    Usage "usage" 2 "the command line makes no sense";
    BadSize "bad-size" 2 "a size option has no meaning, or contradicts another";
    BadConfig "bad-config" 2 "a configuration file has a fault, or a key or word that is not known";
    BadQuery "bad-query" 2 "a place, list, id or column of a query has no meaning";
    BadExpression "bad-expression" 2 "an expression cannot be read";
    BadMemory "bad-memory" 2 "a memory size has no unit or no meaning";
    BadSample "bad-sample" 2 "there is no such sample, or a key of it is wrong";
    UnreadableFile "unreadable-file" 3 "an input file is missing or may not be read";
    UnknownFormat "unknown-format" 3 "the name of a file does not say its format";
    TruncatedFile "truncated-file" 3 "an input file ends too early";
    UnexpectedText "unexpected-text" 3 "an input file has text that its format does not allow";
    NotANumber "not-a-number" 3 "a coordinate is not a finite number";
    IndexOutOfRange "index-out-of-range" 3 "a triangle names a vertex that is not there";
    CountMismatch "count-mismatch" 3 "a declared count cannot be right";
    CoordinateRange "coordinate-range" 3 "a coordinate, or the whole surface, is too large or too small to compute with exactly";
    UnsupportedContent "unsupported-content" 3 "a file has elements that do not make a triangle surface";
    SurfaceTooLarge "surface-too-large" 3 "more triangles or vertices than 32-bit numbers can name";
    LossyFormat "lossy-format" 3 "the chosen format would round coordinates";
    FormatLimit "format-limit" 3 "the mesh is larger than the chosen format can number";
    EmptySurface "empty-surface" 3 "there are no triangles";
    DegenerateTriangle "degenerate-triangle" 3 "a triangle has no area";
    DuplicateTriangle "duplicate-triangle" 3 "a triangle occurs twice";
    OpenSurface "open-surface" 3 "an edge has only one triangle";
    SelfIntersection "self-intersection" 3 "triangles meet where they should not";
    UnrecoveredTriangles "unrecovered-triangles" 3 "input triangles that could not be recovered as faces of the mesh";
    ContradictingOrientation "contradicting-orientation" 3 "filling by orientation, where triangles do not agree on what is inside";
    NothingFilled "nothing-filled" 3 "the surface encloses no region to fill";
    BadSeed "bad-seed" 3 "a region seed or a hole has no meaning, or contradicts the surface or another";
    SheetOutside "sheet-outside" 3 "an embedded sheet lies where nothing is filled";
    WireOutside "wire-outside" 3 "an embedded edge or point lies where nothing is filled";
    DegenerateEdge "degenerate-edge" 3 "both ends of an embedded edge are one vertex";
    DuplicateWire "duplicate-wire" 3 "an embedded edge or point is given twice";
    WireContact "wire-contact" 3 "an embedded edge or point meets a triangle or an edge elsewhere than in common vertices";
    WireTooNear "wire-too-near" 3 "an embedded edge or point is nearer to something else than can be meshed";
    BadField "bad-field" 3 "the name, type or values of a field do not fit the store";
    NotPeriodic "not-periodic" 3 "two labels of a periodic pair have not the same triangles, or cannot be a pair";
    BadVersion "bad-version" 3 "the name of a version is no name or is taken, or a version would be changed";
    BadMesh "bad-mesh" 3 "a mesh to import is not one of positive tetrahedra that share whole faces";
    NoSuchStore "no-such-store" 3 "there is no store at this path";
    NoSuchPart "no-such-part" 3 "the store has no such tetrahedron, vertex, edge, label, region, sub-domain, interface, stage or version";
    Damaged "damaged" 4 "the store is not what was written";
    StoreRecipe "store-recipe" 8 "the store was begun by a version whose recipe gives another mesh";
    Busy "busy" 5 "another process writes the store";
    StoreChanged "store-changed" 5 "another process changed the store while it was read; ask again";
    Memory "memory" 6 "the memory cap, or what the system grants, is too small for this work";
    NoRoom "no-room" 6 "the disk has less room than the mesh is expected to need";
    DiskFull "disk-full" 6 "the disk is full";
    Io "io" 6 "the system refused to read or write a file";
    InvalidMesh "invalid-mesh" 7 "verification found the mesh invalid";
    StoreExists "store-exists" 8 "a finished store is already there";
    StoreUnfinished "store-unfinished" 8 "the store is not finished";
    NoTasks "no-tasks" 8 "the store has no plan of tasks, or the task's stage has not begun";
    TasksLeft "tasks-left" 8 "some tasks of a stage have no usable receipt and have to be done again";
    TaskFile "task-file" 4 "a file that tasks exchange is missing or damaged";
    NoCoarseLeaf "no-coarse-leaf" 8 "the coarse snapshot of the sub-domain was not kept";
    NothingToUndo "nothing-to-undo" 8 "no previous version of a sub-domain is kept";
    NotAStore "not-a-store" 8 "what is there is not a store";
    StoreFormat "store-format" 8 "the store has another format version";
    SurfaceChanged "surface-changed" 8 "the surface is not the one the store was begun with";
    SizeFieldChanged "size-field-changed" 8 "the sizes of the size field are not those the store was begun with";
    Stopped "stopped" 130 "stopped by a signal; `tetdb resume` continues";
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl FromStr for Code {
    type Err = ();

    fn from_str(word: &str) -> Result<Self, ()> {
        Self::ALL.iter().find(|code| code.as_str() == word).copied().ok_or(())
    }
}

impl PartialEq<&str> for Code {
    fn eq(&self, word: &&str) -> bool {
        self.as_str() == *word
    }
}

impl serde::Serialize for Code {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.as_str())
    }
}
