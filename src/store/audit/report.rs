//! The result of a verification: counts, findings and examples.

use std::collections::BTreeMap;
use std::fmt::Display;

use serde::Serialize;
use tetdb_schema::ids::VertexId;

use crate::sealed::Corner;
use tetdb_base::geom::Point;

/// Offenders kept for each kind of finding; all are counted.
const OFFENDERS_KEPT: u64 = 10;

/// The levels of checking, each with those before it.
#[derive(
    Default,
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Serialize,
    rkyv::Archive,
    rkyv::Serialize,
    rkyv::Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Every record can be read and counts agree; nodes exist and differ; digests are right.
    #[default]
    Element,
    /// Every face has two sides, or one and is required.
    Adjacency,
    /// Facets and interface faces are faces of their tetrahedra; regions change only there.
    Topology,
    /// Orientations are exactly positive; facets are the input's triangles, all of them; volumes agree.
    Geometry,
    /// Share of inner faces that are locally Delaunay; never makes a mesh invalid.
    Delaunay,
}

/// Kinds of faults that make a mesh invalid.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Serialize,
    rkyv::Archive,
    rkyv::Serialize,
    rkyv::Deserialize,
)]
#[rkyv(derive(PartialEq, Eq, PartialOrd, Ord))]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// Two nodes of a tetrahedron are the same.
    RepeatedNode,
    /// A vertex that no tetrahedron and no facet has.
    UnusedVertex,
    /// A digest or count of the catalog is not that of the records.
    CatalogDiffers,
    /// More than one tetrahedron on one side of a face.
    CrowdedFace,
    /// A face with one side that is neither a facet nor an interface face.
    OpenFace,
    /// A facet or interface face that is no face of the tetrahedron it names.
    StrayFacet,
    /// The two sides of a face do not agree whether it is a facet.
    OneSidedFacet,
    /// The region changes across a face that is no facet.
    RegionLeak,
    /// An interface face without its equal in the other sub-domain.
    UnmatchedInterface,
    /// A tetrahedron whose exact orientation is not positive.
    NotPositive,
    /// A facet that is not the input triangle it names.
    NotAnInputTriangle,
    /// An input triangle that is nowhere in the mesh.
    MissingTriangle,
    /// An embedded edge that no tetrahedron has.
    MissingEdge,
    /// An embedded point that is no vertex of a tetrahedron, or is elsewhere.
    MissingPoint,
    /// A vertex of a facet that is no vertex of the input.
    AddedVertex,
    /// The volume of the tetrahedra is not the volume within their boundary.
    VolumeDiffers,
}

/// One example of a finding.
#[derive(Clone, Debug, PartialEq, Serialize, rkyv::Archive, rkyv::Serialize, rkyv::Deserialize)]
pub struct Offender {
    /// The kind of fault.
    pub finding: Finding,
    /// Rank of the sub-domain where it was found, if there is one.
    pub subdomain: Option<u32>,
    /// Id of the tetrahedron, `7:1048211`.
    pub tet: Option<String>,
    /// Ids of the vertices, parallel to `points`.
    pub vertices: Vec<String>,
    /// Positions of the vertices.
    pub points: Vec<[f64; 3]>,
    /// The expected and the found state, as a sentence.
    pub what: String,
}

/// The result of a verification.
#[derive(
    Default, Clone, Debug, PartialEq, Serialize, rkyv::Archive, rkyv::Serialize, rkyv::Deserialize,
)]
pub struct Report {
    /// How much was checked.
    pub level: Level,
    /// True if there are no findings.
    pub valid: bool,
    /// True if the mesh was compared with its input.
    pub against_input: bool,
    /// Number of sub-domains checked.
    pub subdomains: u64,
    /// Number of tetrahedra.
    pub tets: u64,
    /// Number of vertices, those on interfaces counted once.
    pub vertices: u64,
    /// Number of facets.
    pub facets: u64,
    /// Number of interface faces, each counted once.
    pub interface_faces: u64,
    /// Faces between two tetrahedra of one sub-domain.
    pub inner_faces: u64,
    /// Faces with one tetrahedron that are facets.
    pub boundary_faces: u64,
    /// Input triangles that are in the mesh with a filled side, without one, and not at all.
    pub triangles_present: u64,
    /// Input triangles that are faces of the mesh, without a filled side.
    pub triangles_unfilled: u64,
    /// Input triangles that are no faces of the mesh.
    pub triangles_missing: u64,
    /// Embedded edges that are edges of tetrahedra.
    pub edges_present: u64,
    /// Embedded edges that are not.
    pub edges_missing: u64,
    /// Embedded points that are vertices of tetrahedra.
    pub points_present: u64,
    /// Embedded points that are not.
    pub points_missing: u64,
    /// Sum over the tetrahedra in order, and over the boundary.
    pub volume: f64,
    /// Volume enclosed by the boundary, by the divergence theorem; in cubed input units.
    pub volume_within_boundary: f64,
    /// Inner faces that are no facets: tested, and with an empty sphere.
    pub delaunay_tested: u64,
    /// Number of tested faces that have an empty sphere.
    pub delaunay_faces: u64,
    /// Digest of the whole mesh.
    pub digest: String,
    /// Digest of the interfaces alone.
    pub interface_digest: String,
    /// Number of findings of each kind.
    pub findings: BTreeMap<Finding, u64>,
    /// The first of each kind.
    pub offenders: Vec<Offender>,
}

impl Report {
    pub(super) fn new(level: Level) -> Self {
        Self { level, valid: true, ..Self::default() }
    }

    /// Adds the counts and findings of another part of the mesh; volumes, digests and the input are left to the whole.
    pub(super) fn add(&mut self, part: Self) {
        for (sum, n) in [
            (&mut self.subdomains, part.subdomains),
            (&mut self.tets, part.tets),
            (&mut self.vertices, part.vertices),
            (&mut self.facets, part.facets),
            (&mut self.interface_faces, part.interface_faces),
            (&mut self.inner_faces, part.inner_faces),
            (&mut self.boundary_faces, part.boundary_faces),
            (&mut self.delaunay_tested, part.delaunay_tested),
            (&mut self.delaunay_faces, part.delaunay_faces),
        ] {
            *sum += n;
        }
        for offender in part.offenders {
            let listed = (self.offenders.iter()).filter(|o| o.finding == offender.finding);
            if (listed.count() as u64) < OFFENDERS_KEPT {
                self.offenders.push(offender);
            }
        }
        for (finding, n) in part.findings {
            self.valid = false;
            *self.findings.entry(finding).or_default() += n;
        }
    }

    /// Share of the tested inner faces that are locally Delaunay; 1 when none was tested.
    pub fn delaunay_share(&self) -> f64 {
        if self.delaunay_tested == 0 {
            return 1.0;
        }
        self.delaunay_faces as f64 / self.delaunay_tested as f64
    }

    /// Number of findings of a kind.
    pub fn count(&self, finding: Finding) -> u64 {
        self.findings.get(&finding).copied().unwrap_or(0)
    }

    /// Counts a finding; the first few of its kind are kept, and described by `what` as a sentence.
    pub(super) fn find(
        &mut self,
        finding: Finding,
        subdomain: impl Into<Option<u32>>,
        what: impl Display,
    ) -> KeptOffender<'_> {
        self.valid = false;
        let count = self.findings.entry(finding).or_default();
        *count += 1;
        if *count > OFFENDERS_KEPT {
            return KeptOffender(None);
        }
        self.offenders.push(Offender {
            finding,
            subdomain: subdomain.into(),
            tet: None,
            vertices: Vec::new(),
            points: Vec::new(),
            what: what.to_string(),
        });
        KeptOffender(self.offenders.last_mut())
    }
}

/// An offender being described, unless enough of its kind are kept.
pub(super) struct KeptOffender<'a>(Option<&'a mut Offender>);

impl KeptOffender<'_> {
    /// Adds its tetrahedron.
    pub(super) fn with_tet(self, local: u32) -> Self {
        let Some(offender) = self.0 else { return self };
        let subdomain = offender.subdomain.unwrap_or_default();
        offender.tet = Some(format!("{subdomain}:{local}"));
        Self(Some(offender))
    }

    /// Adds ids and positions of vertices.
    pub(super) fn with_corners(self, corners: &[Corner]) -> Self {
        let Some(offender) = self.0 else { return self };
        let id = |c: &Corner| match VertexId::from_number(c.id) {
            Some(id) => id.to_string(),
            None => format!("{:#x}", c.id),
        };
        offender.vertices = corners.iter().map(id).collect();
        Self(Some(offender)).with_points(corners.iter().map(|c| c.point))
    }

    /// Adds positions.
    pub(super) fn with_points(self, points: impl IntoIterator<Item = Point>) -> Self {
        let Some(offender) = self.0 else { return self };
        offender.points = points.into_iter().map(|p| p.to_array()).collect();
        Self(Some(offender))
    }
}
