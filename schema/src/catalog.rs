//! Rows of the catalog, archived with `rkyv`.

use rkyv::{Archive, Deserialize, Serialize};

/// Bins of the quality table: [1,2[, [2,3[ .. [9,10[, [10,inf[.
pub const QUALITY_BINS: usize = 10;

/// The state of a store.
#[derive(
    Archive,
    Serialize,
    Deserialize,
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    serde::Serialize,
)]
#[serde(rename_all = "snake_case")]
pub enum StoreState {
    /// The job is on record, nothing is imported.
    New,
    /// The surface is in the store.
    Imported,
    /// The coarse mesh contains the surface.
    Coarse,
    /// The coarse mesh is cut into sub-domains.
    Bisected,
    /// All sub-domains are sealed.
    Sealed,
    /// The certificate was checked.
    Verified,
}

impl StoreState {
    /// True if the mesh is complete.
    pub fn is_finished(self) -> bool {
        self >= Self::Sealed
    }
}

/// The state of a sub-domain.
#[derive(
    Archive,
    Serialize,
    Deserialize,
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    serde::Serialize,
)]
#[serde(rename_all = "snake_case")]
pub enum SubdomainState {
    /// Its coarse mesh exists.
    Coarse,
    /// No edge is left to divide.
    Saturated,
    /// Finished, and kept as working pages.
    Optimized,
    /// Finished, and packed into chunks.
    Sealed,
}

/// The job of a store, written by the first commit.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, Default, serde::Serialize)]
pub struct Job {
    /// All options as one JSON object.
    pub options: String,
    /// The sources of the surface, in order.
    pub surfaces: Vec<SurfaceSource>,
    /// Version of the program that created the store.
    pub tool_version: String,
}

/// A file the surface was read from, or the sample that generated it.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, Default, serde::Serialize)]
pub struct SurfaceSource {
    /// Where it came from, as text; [`Source`](crate::source::Source) reads it.
    pub path: String,
    /// Length of the content in bytes.
    pub bytes: u64,
    /// xxh3-128 of the content, low half first.
    pub hash: [u64; 2],
}

/// A region of the volume.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, serde::Serialize)]
pub struct RegionRow {
    /// Its number.
    pub region: u32,
    /// In cubed input units.
    pub volume: f64,
    /// Its tetrahedra in all sub-domains.
    pub tets: u64,
    /// True if it is meshed; otherwise it is empty space.
    pub filled: bool,
    /// Labels of the facets around it, ascending.
    pub labels: Vec<u32>,
}

/// Edges and points of the input that are edges and vertices of the mesh; vertices by their numbers in the input.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, Default, serde::Serialize)]
pub struct WiresRow {
    /// The vertices of each edge, and its label.
    pub edges: Vec<[u32; 3]>,
    /// The vertex of each point, and its label.
    pub points: Vec<[u32; 2]>,
    /// Facets with this number or a higher one are not triangles of the input: each supports an embedded edge.
    pub fin_first: u64,
}

/// Qualities of a sub-domain.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct QualityRow {
    /// Tetrahedra with q in [1,2[, [2,3[ .. [9,10[, [10,inf[.
    pub bins: [u64; QUALITY_BINS],
    /// Greatest q and the tetrahedron that has it (the first of several).
    pub worst: f64,
    /// Its number in the sub-domain.
    pub worst_tet: u32,
    /// Least and greatest dihedral angle in radians.
    pub dihedral: [f64; 2],
}

/// A sub-domain.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, serde::Serialize)]
pub struct SubdomainRow {
    /// Its number, from 0.
    pub rank: u32,
    /// Generation of the sub-domain's current file.
    pub generation: u32,
    /// Its state.
    pub state: SubdomainState,
    /// Tetrahedra.
    pub tets: u64,
    /// Vertices, those shared with others included.
    pub vertices: u64,
    /// Facets.
    pub facets: u64,
    /// Faces shared with other sub-domains.
    pub interface_faces: u64,
    /// Chunks of tetrahedra, vertices, facets, interface faces, and then blocks of their summaries.
    pub chunks: [u32; 8],
    /// Digest of the tetrahedra; see [`Digest`](crate::digest::Digest).
    pub digest: [u64; 2],
    /// Digest of the interface faces.
    pub interface_digest: [u64; 2],
    /// Qualities of its tetrahedra.
    pub quality: QualityRow,
    /// Sum of the volumes in the sealed order.
    pub volume: f64,
    /// Low and high corner of the bounding box.
    pub bounds: [[f64; 3]; 2],
    /// Length of the file.
    pub bytes: u64,
}

const SUBDOMAIN: &str = "subdomain";
const COARSE: &str = "coarse";
const FIELD: &str = "field";

/// A current file of the store: the working or sealed mesh of a sub-domain in one generation.
#[derive(
    Archive,
    Serialize,
    Deserialize,
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    serde::Serialize,
)]
pub struct FileRow {
    /// Rank of the sub-domain.
    pub subdomain: u32,
    /// Generation in the name of the file.
    pub generation: u32,
}

impl FileRow {
    /// Name of the file of a sub-domain.
    pub fn subdomain_name(self) -> String {
        self.name(SUBDOMAIN)
    }

    /// Name of the file of a coarse snapshot.
    pub fn coarse_name(self) -> String {
        self.name(COARSE)
    }

    /// Name of the file of a field's values in a sub-domain; the generation is the file's serial number.
    pub fn field_name(self) -> String {
        self.name(FIELD)
    }

    /// The inverse of [`FileRow::field_name`].
    pub fn from_field_name(name: &str) -> Option<Self> {
        Self::from_name(FIELD, name)
    }

    /// The inverse of [`FileRow::subdomain_name`].
    pub fn from_subdomain_name(name: &str) -> Option<Self> {
        Self::from_name(SUBDOMAIN, name)
    }

    /// The inverse of [`FileRow::coarse_name`].
    pub fn from_coarse_name(name: &str) -> Option<Self> {
        Self::from_name(COARSE, name)
    }

    fn name(self, prefix: &str) -> String {
        format!("{prefix}-{:05}-g{}.redb", self.subdomain, self.generation)
    }

    fn from_name(prefix: &str, name: &str) -> Option<Self> {
        let (subdomain, generation) = name
            .strip_prefix(prefix)?
            .strip_prefix('-')?
            .strip_suffix(".redb")?
            .split_once("-g")?;
        let file =
            Self { subdomain: subdomain.parse().ok()?, generation: generation.parse().ok()? };
        (file.name(prefix) == name).then_some(file)
    }
}

impl SubdomainRow {
    /// Its file.
    pub const fn file(&self) -> FileRow {
        FileRow { subdomain: self.rank, generation: self.generation }
    }
}

impl CoarseRow {
    /// Its file.
    pub const fn file(&self) -> FileRow {
        FileRow { subdomain: self.rank, generation: self.generation }
    }
}

/// A coarse snapshot: the working mesh from which a sub-domain was meshed.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct CoarseRow {
    /// Rank of the sub-domain.
    pub rank: u32,
    /// Generation in the name of the snapshot's file.
    pub generation: u32,
    /// Tetrahedra.
    pub tets: u64,
    /// Vertices.
    pub vertices: u64,
    /// Facets.
    pub facets: u64,
    /// Faces on interfaces.
    pub interface_faces: u64,
    /// Chunks of tetrahedra, vertices, facets, interface faces.
    pub chunks: [u32; 4],
    /// Length of the file.
    pub bytes: u64,
}

/// An interface: the faces two sub-domains share because of one cut.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct InterfaceRow {
    /// Number of the cut, from 1.
    pub cut: u32,
    /// Ranks, the lower one first.
    pub low: u32,
    /// The higher rank.
    pub high: u32,
    /// Number of faces.
    pub faces: u64,
    /// Digest of the faces; the same from both sides.
    pub digest: [u64; 2],
}

/// The neighbors of a sub-domain.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, serde::Serialize)]
pub struct TopologyRow {
    /// Its rank.
    pub subdomain: u32,
    /// By rank.
    pub neighbors: Vec<NeighborRow>,
}

/// A neighbor and the number of faces shared with it.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct NeighborRow {
    /// Rank of the neighbor.
    pub subdomain: u32,
    /// Faces shared with it.
    pub faces: u64,
}

/// A version of a finished store: its rows and files that a change can replace. Number 0, without a name, is what was before the last change.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, Default)]
pub struct VersionRow {
    /// Its name.
    pub name: String,
    /// A note of its user.
    pub note: String,
    /// When it was saved: seconds since 1970.
    pub saved: u64,
    /// The key of each row and the key of its copy, ascending.
    pub rows: Vec<[u64; 2]>,
    /// Files of sub-domains.
    pub meshes: Vec<FileRow>,
    /// Files of fields.
    pub fields: Vec<FileRow>,
}

/// A finished step.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, serde::Serialize)]
pub struct JournalRow {
    /// The state of the store after it.
    pub state: StoreState,
    /// The sub-domain it was done to; `None`: the whole store.
    pub subdomain: Option<u32>,
    /// The name of the step.
    pub step: String,
    /// Seconds it took.
    pub seconds: f64,
    /// Figures of the step.
    pub measures: Vec<Measure>,
}

/// A figure of a step.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, serde::Serialize)]
pub struct Measure {
    /// In `snake_case`, with the unit last.
    pub name: String,
    /// The number.
    pub value: f64,
}

/// A moment of a bisection at which a mesh is kept.
#[derive(
    Archive,
    Serialize,
    Deserialize,
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    serde::Serialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Before the bisection.
    Coarse,
    /// After its zone was refined.
    Refined,
}

/// A mesh kept during a bisection for pictures. Is not: a part of the finished mesh.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, serde::Serialize)]
pub struct StageRow {
    /// Number of the cut, from 1.
    pub cut: u32,
    /// The moment at which it was kept.
    pub stage: Stage,
    /// The plane of the cut: `normal · x = offset`.
    pub normal: [f64; 3],
    /// See `normal`, which has length 1.
    pub offset: f64,
    /// Its file, as that of a sealed sub-domain; `rank` is the number of the cut.
    pub row: SubdomainRow,
}
