//! The words for errors, what they mean, and the exit code the program has for them.

/// One row of the table of errors.
#[derive(Clone, Copy, Debug)]
pub struct CodeRow {
    /// The word.
    pub code: &'static str,
    /// What the program's process ends with.
    pub exit: u8,
    /// What it means.
    pub meaning: &'static str,
}

const fn row(code: &'static str, exit: u8, meaning: &'static str) -> CodeRow {
    CodeRow { code, exit, meaning }
}

/// Every error word, its exit code, and what it means; the guide carries the same table.
pub const CODES: &[CodeRow] = &[
    row("internal", 1, "a bug: please report it with the command and the message"),
    row("usage", 2, "the command line makes no sense"),
    row("bad-size", 2, "a size option has no meaning, or contradicts another"),
    row("bad-config", 2, "a configuration file has a fault, or a key or word that is not known"),
    row("bad-query", 2, "a place, list, id or column of a query has no meaning"),
    row("bad-expression", 2, "an expression cannot be read"),
    row("bad-memory", 2, "a memory size has no unit or no meaning"),
    row("bad-sample", 2, "there is no such sample, or a key of it is wrong"),
    row("unreadable-file", 3, "an input file is missing or may not be read"),
    row("unknown-format", 3, "the format of a file does not follow from its name"),
    row("truncated-file", 3, "an input file ends too early"),
    row("unexpected-text", 3, "an input file has something else than its format asks for"),
    row("not-a-number", 3, "a coordinate is not a finite number"),
    row("index-out-of-range", 3, "a triangle names a vertex that is not there"),
    row("count-mismatch", 3, "a declared count cannot be right"),
    row(
        "coordinate-range",
        3,
        "a coordinate, or the whole surface, is too large or too small to compute with exactly",
    ),
    row("unsupported-content", 3, "a file has elements that do not make a triangle surface"),
    row("surface-too-large", 3, "more triangles or vertices than 32-bit numbers can name"),
    row("lossy-format", 3, "the chosen format would round coordinates"),
    row("format-limit", 3, "the mesh is larger than the chosen format can number"),
    row("empty-surface", 3, "there are no triangles"),
    row("degenerate-triangle", 3, "a triangle has no area"),
    row("duplicate-triangle", 3, "a triangle occurs twice"),
    row("open-surface", 3, "an edge has only one triangle"),
    row("self-intersection", 3, "triangles meet where they should not"),
    row(
        "unrecovered-triangles",
        3,
        "input triangles that could not be recovered as faces of the mesh",
    ),
    row(
        "contradicting-orientation",
        3,
        "filling by orientation, where triangles do not agree on what is inside",
    ),
    row("nothing-filled", 3, "the surface encloses no region to fill"),
    row(
        "bad-seed",
        3,
        "a region seed or a hole has no meaning, or contradicts the surface or another",
    ),
    row("sheet-outside", 3, "an embedded sheet lies where nothing is filled"),
    row("wire-outside", 3, "an embedded edge or point lies where nothing is filled"),
    row("degenerate-edge", 3, "both ends of an embedded edge are one vertex"),
    row("duplicate-wire", 3, "an embedded edge or point is given twice"),
    row(
        "wire-contact",
        3,
        "an embedded edge or point meets a triangle or an edge elsewhere than in common vertices",
    ),
    row(
        "wire-too-near",
        3,
        "an embedded edge or point is nearer to something else than can be meshed",
    ),
    row("no-such-store", 3, "there is no store at this path"),
    row(
        "no-such-part",
        3,
        "the store has no such tetrahedron, vertex, label, sub-domain, interface or stage",
    ),
    row("damaged", 4, "the store is not what was written"),
    row("store-recipe", 8, "the store was begun by a version whose recipe gives another mesh"),
    row("busy", 5, "another process writes the store"),
    row("store-changed", 5, "another process changed the store while it was read; ask again"),
    row("memory", 6, "the memory cap, or what the system grants, is too small for this work"),
    row("no-room", 6, "the disk has less room than the mesh is expected to need"),
    row("disk-full", 6, "the disk is full"),
    row("io", 6, "the system refused to read or write a file"),
    row("invalid-mesh", 7, "verification found the mesh invalid"),
    row("store-exists", 8, "a finished store is already there"),
    row("store-unfinished", 8, "the store is not finished"),
    row(
        "no-tasks",
        8,
        "nobody has planned tasks for the store, or the stage of a task has not come",
    ),
    row("tasks-left", 8, "some tasks of a stage have no usable receipt and have to be done again"),
    row("task-file", 4, "a file that tasks exchange is missing or damaged"),
    row("no-coarse-leaf", 8, "the coarse snapshot of the sub-domain was not kept"),
    row("nothing-to-undo", 8, "no previous version of a sub-domain is kept"),
    row("not-a-store", 8, "what is there is not a store"),
    row("store-format", 8, "the store has another format version"),
    row("surface-changed", 8, "the surface is not the one the store was begun with"),
    row(
        "size-field-changed",
        8,
        "the sizes of the size field are not those the store was begun with",
    ),
    row("stopped", 130, "stopped by a signal; `tetdb resume` goes on"),
];
