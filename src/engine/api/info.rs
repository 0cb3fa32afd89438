//! The record of a store, finished or not.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::fields::{Field, fields_of};
use super::periodic::{Periodic, periodic_of};
use super::store::at_version;
use super::versions::kept;
use super::{Error, Settings, guarded};
use crate::pipeline;
use tetdb_base::geom::{Aabb, Point};
use tetdb_schema::catalog::{
    InterfaceRow, JournalRow, NeighborRow, QualityRow, RegionRow, Stage, StoreState, SubdomainRow,
    SubdomainState, SurfaceSource,
};
use tetdb_schema::digest::Digest;
use tetdb_schema::labels::LabelSet;
use tetdb_store::store::{BEFORE, Catalog};

/// The record of a store.
///
/// Serialized, it is the answer of `tetdb info --json`; the guide lists the keys.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct StoreInfo {
    /// Path of the store.
    pub store: String,
    /// Last finished step.
    pub state: StoreState,
    /// True if the mesh is complete.
    pub finished: bool,
    /// The files, or the sample, that the surface was read from.
    pub surfaces: Vec<SurfaceSource>,
    /// Recorded options of the mesh.
    pub options: Value,
    /// Version of the program that began the store.
    pub tool_version: String,
    /// Names of the labels. A label is a position in this list.
    pub labels: Vec<String>,
    /// Labels of triangles in several groups, and the labels of those; none where no triangle is in two.
    pub label_sets: Vec<LabelSet>,
    /// Embedded edges and points by label.
    pub wires: Vec<EmbeddedInfo>,
    /// Regions by number, including empty ones.
    pub regions: Vec<RegionInfo>,
    /// Number of tetrahedra.
    pub tets: u64,
    /// Number of triangles of the surface, if recorded.
    pub input_triangles: Option<u64>,
    /// Number of vertices. A vertex shared by several sub-domains counts in each.
    pub vertices: u64,
    /// Low and high corner of the bounding box.
    pub bounds: [[f64; 3]; 2],
    /// Bytes of the sub-domains' files.
    pub bytes: u64,
    /// Bytes of the coarse snapshots.
    pub coarse_bytes: u64,
    /// Bytes that only the version before the last change needs, which an undo restores.
    pub previous_bytes: u64,
    /// Names of the versions, the oldest first.
    pub versions: Vec<String>,
    /// Bytes of files that only versions need, besides `previous_bytes`.
    pub version_bytes: u64,
    /// Periodic pairs of labels, in the order in which they were recorded.
    pub periodic: Vec<Periodic>,
    /// Fields, in the order in which they were added.
    pub fields: Vec<Field>,
    /// Bytes of the fields' files.
    pub field_bytes: u64,
    /// Bytes of the catalog.
    pub catalog_bytes: u64,
    /// Digest of all tetrahedra. Equal meshes have equal digests.
    pub digest: String,
    /// Kept intermediate meshes: before and after the refinement of each cut's zone.
    pub stages: Vec<StageInfo>,
    /// Sub-domains, in order of rank.
    pub subdomains: Vec<SubdomainInfo>,
    /// Pairs of sub-domains that share faces, in order of cut.
    pub interfaces: Vec<InterfaceRow>,
    /// Finished steps, in order.
    pub journal: Vec<JournalRow>,
    /// Number of sub-domains with a previous version.
    #[serde(skip)]
    pub n_previous: usize,
    /// Bytes of all files of sub-domains and fields.
    #[serde(skip)]
    file_bytes: u64,
}

/// A label of embedded edges and points.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct EmbeddedInfo {
    /// Name of the label.
    pub name: Option<String>,
    /// Number of edges with this label.
    pub edges: u64,
    /// Number of points with this label.
    pub points: u64,
}

/// A region and its name.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct RegionInfo {
    /// Row of the region in the catalog.
    #[serde(flatten)]
    pub row: RegionRow,
    /// Name of the region, if any.
    pub name: Option<String>,
}

/// A kept intermediate mesh.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct StageInfo {
    /// Number of the cut, from 1.
    pub cut: u32,
    /// Before or after the refinement of the cut's zone.
    pub stage: Stage,
    /// Number of tetrahedra.
    pub tets: u64,
    /// Bytes of its file.
    pub bytes: u64,
}

/// A sub-domain.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct SubdomainInfo {
    /// Rank of the sub-domain, from 0.
    pub id: u32,
    /// State: whether the sub-domain is finished, and how it is stored.
    pub state: SubdomainState,
    /// Number of tetrahedra.
    pub tets: u64,
    /// Number of vertices, including those shared with other sub-domains.
    pub vertices: u64,
    /// Number of input facets.
    pub facets: u64,
    /// Number of faces shared with other sub-domains.
    pub interface_faces: u64,
    /// Digest of the sub-domain's tetrahedra.
    pub digest: String,
    /// Digest of the sub-domain's interface faces.
    pub interface_digest: String,
    /// Neighbors, and the number of faces shared with each; `None` before the topology is known.
    pub neighbors: Option<Vec<NeighborRow>>,
    /// Qualities of the sub-domain's tetrahedra.
    pub quality: QualityRow,
    /// Greatest quality q; 1 is regular.
    pub worst_q: f64,
    /// Volume in cubed input units.
    pub volume: f64,
    /// Low and high corner of the bounding box.
    pub bounds: [[f64; 3]; 2],
    /// Bytes of the sub-domain's file.
    pub bytes: u64,
    /// Bytes of the coarse snapshot, if kept.
    pub coarse_bytes: Option<u64>,
    /// Sizes of the last time the sub-domain was meshed again; `None` for those of the first run.
    pub sizes: Option<Value>,
}

impl StoreInfo {
    /// Reads the record of the store at `path`, which need not be finished. No mesh is read.
    ///
    /// # Errors
    /// `no-such-store`, `not-a-store`, `store-format`, `busy`, `damaged`.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read_with(path, &Settings::new())
    }

    /// Like [`StoreInfo::read`], at the version that the settings name. Errors: also `no-such-part`.
    pub fn read_with(path: impl AsRef<Path>, settings: &Settings) -> Result<Self, Error> {
        guarded(settings, || Self::of(path.as_ref(), settings))
    }

    fn of(path: &Path, settings: &Settings) -> Result<Self, Error> {
        let mut catalog = Catalog::open(path)?;
        let (kept, n_previous) = (kept(&mut catalog)?, pipeline::previous(&mut catalog)?.len());
        let catalog = &mut at_version(catalog, settings)?;
        let (state, job) = (catalog.state()?, catalog.job()?);
        let rows = catalog.subdomains()?;
        let fields = fields_of(catalog)?;
        let (coarse, subdomains) = (catalog.coarse_snapshots()?, subdomains(catalog, &rows)?);
        let stages = catalog.stages()?.into_iter();
        let all = (rows.iter()).map(|r| Aabb::around(r.bounds.map(Point::from_array)));
        let all = all.fold(Aabb::EMPTY, Aabb::union);
        let digests = rows.iter().map(|r| r.digest);
        let digest = digests.fold([0; 2], |s, d| [0, 1].map(|i| d[i].wrapping_add(s[i])));
        Ok(Self {
            store: path.display().to_string(),
            state,
            finished: state.is_finished(),
            surfaces: job.surfaces,
            options: serde_json::from_str(&job.options).unwrap_or(Value::Null),
            tool_version: job.tool_version,
            labels: catalog.labels()?,
            label_sets: catalog.label_sets()?,
            wires: embedded(catalog)?,
            regions: regions(catalog)?,
            tets: rows.iter().map(|r| r.tets).sum(),
            input_triangles: catalog.n_input_triangles()?,
            vertices: rows.iter().map(|r| r.vertices).sum(),
            bounds: [all.low, all.high].map(|p| p.to_array()),
            bytes: rows.iter().map(|r| r.bytes).sum(),
            coarse_bytes: coarse.iter().map(|c| c.bytes).sum(),
            previous_bytes: kept.alone.get(&BEFORE).copied().unwrap_or(0),
            versions: kept.names,
            version_bytes: kept.bytes - kept.alone.get(&BEFORE).copied().unwrap_or(0),
            file_bytes: kept.all_bytes,
            periodic: periodic_of(catalog)?,
            field_bytes: fields.iter().map(|field| field.bytes).sum(),
            fields,
            catalog_bytes: catalog.file_bytes()?,
            digest: text_of(digest),
            stages: stages
                .map(|s| StageInfo {
                    cut: s.cut,
                    stage: s.stage,
                    tets: s.row.tets,
                    bytes: s.row.bytes,
                })
                .collect(),
            subdomains,
            interfaces: catalog.interfaces()?,
            journal: catalog.journal()?,
            n_previous,
        })
    }

    /// Total bytes of the store on disk.
    pub fn bytes_on_disk(&self) -> u64 {
        self.file_bytes + self.coarse_bytes + self.catalog_bytes
    }

    /// Qualities of all tetrahedra.
    pub fn quality(&self) -> QualityRow {
        let none = QualityRow {
            bins: Default::default(),
            worst: 0.0,
            worst_tet: 0,
            dihedral: [f64::INFINITY, 0.0],
        };
        self.subdomains.iter().fold(none, |mut all, part| {
            let row = &part.quality;
            all.bins.iter_mut().zip(row.bins).for_each(|(sum, n)| *sum += n);
            all.worst = all.worst.max(row.worst);
            let [low, high] = row.dihedral;
            all.dihedral = [all.dihedral[0].min(low), all.dihedral[1].max(high)];
            all
        })
    }
}

/// A digest as 32 hex digits.
fn text_of(lanes: [u64; 2]) -> String {
    Digest { lanes }.to_string()
}

fn subdomains(catalog: &mut Catalog, rows: &[SubdomainRow]) -> Result<Vec<SubdomainInfo>, Error> {
    let (topology, coarse) = (catalog.topology()?, catalog.coarse_snapshots()?);
    let mut subdomains = Vec::with_capacity(rows.len());
    for row in rows {
        let sizes = pipeline::recorded_request(catalog, row.rank)?;
        let neighbors = topology.iter().find(|t| t.subdomain == row.rank);
        subdomains.push(SubdomainInfo {
            id: row.rank,
            state: row.state,
            tets: row.tets,
            vertices: row.vertices,
            facets: row.facets,
            interface_faces: row.interface_faces,
            digest: text_of(row.digest),
            interface_digest: text_of(row.interface_digest),
            neighbors: neighbors.map(|t| t.neighbors.clone()),
            quality: row.quality,
            worst_q: row.quality.worst,
            volume: row.volume,
            bounds: row.bounds,
            bytes: row.bytes,
            coarse_bytes: coarse.iter().find(|c| c.rank == row.rank).map(|c| c.bytes),
            sizes: sizes.map(|text| serde_json::from_str(&text).unwrap_or(Value::Null)),
        });
    }
    Ok(subdomains)
}

fn embedded(catalog: &mut Catalog) -> Result<Vec<EmbeddedInfo>, Error> {
    let (wires, labels) = (catalog.wires()?, catalog.labels()?);
    let mut counts = BTreeMap::<u32, [u64; 2]>::new();
    for [.., label] in wires.edges {
        counts.entry(label).or_default()[0] += 1;
    }
    for [_, label] in wires.points {
        counts.entry(label).or_default()[1] += 1;
    }
    let info = |(label, [edges, points]): (u32, [u64; 2])| EmbeddedInfo {
        name: labels.get(label as usize).cloned(),
        edges,
        points,
    };
    Ok(counts.into_iter().map(info).collect())
}

fn regions(catalog: &mut Catalog) -> Result<Vec<RegionInfo>, Error> {
    let (rows, names) = (catalog.regions()?, catalog.region_names()?);
    // Element i is the name of region i + 1, empty if the region has none.
    let name_of = |row: &RegionRow| names.get((row.region as usize).checked_sub(1)?);
    let info = |row: RegionRow| {
        let name = name_of(&row).filter(|name| !name.is_empty()).cloned();
        RegionInfo { row, name }
    };
    Ok(rows.into_iter().map(info).collect())
}
