//! Everything a store has on record, finished or not.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::{Error, Settings, guarded};
use crate::pipeline;
use tetdb_base::geom::{Aabb, Point};
use tetdb_schema::catalog::{
    InterfaceRow, JournalRow, NeighborRow, QualityRow, RegionRow, Stage, StoreState, SubdomainRow,
    SubdomainState, SurfaceSource,
};
use tetdb_schema::digest::Digest;
use tetdb_store::store::Catalog;

/// The record of a store. Serialized, it is the answer of `tetdb info --json`; the guide lists the keys.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct StoreInfo {
    /// Path of the store.
    pub store: String,
    /// Last step that was finished.
    pub state: StoreState,
    /// Whether the mesh is complete.
    pub finished: bool,
    /// Files, or the sample, that the surface came from.
    pub surfaces: Vec<SurfaceSource>,
    /// Options of the mesh as they are on record.
    pub options: Value,
    /// Version of the program that began the store.
    pub tool_version: String,
    /// Names of the labels; a label is a position here.
    pub labels: Vec<String>,
    /// Embedded edges and points by label.
    pub wires: Vec<EmbeddedInfo>,
    /// Regions by number, empty ones among them.
    pub regions: Vec<RegionInfo>,
    /// Tetrahedra.
    pub tets: u64,
    /// Triangles of the surface, where a store has them on record.
    pub input_triangles: Option<u64>,
    /// Vertices; one shared by several sub-domains counts in each.
    pub vertices: u64,
    /// Low and high corner of the box around all vertices.
    pub bounds: [[f64; 3]; 2],
    /// Bytes of the sub-domains' files.
    pub bytes: u64,
    /// Bytes of the coarse snapshots.
    pub coarse_bytes: u64,
    /// Bytes of the previous versions that an undo brings back.
    pub previous_bytes: u64,
    /// Bytes of the catalog.
    pub catalog_bytes: u64,
    /// Digest of all tetrahedra: equal for equal meshes.
    pub digest: String,
    /// Meshes before and after the zones of cuts were refined, where they were kept.
    pub stages: Vec<StageInfo>,
    /// Sub-domains by rank.
    pub subdomains: Vec<SubdomainInfo>,
    /// Pairs of sub-domains that share faces, by cut.
    pub interfaces: Vec<InterfaceRow>,
    /// Steps that were done, in order.
    pub journal: Vec<JournalRow>,
    /// Sub-domains with a previous version.
    #[serde(skip)]
    pub n_previous: usize,
}

/// A label of embedded edges and points.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct EmbeddedInfo {
    /// Name of the label.
    pub name: Option<String>,
    /// Edges that have it.
    pub edges: u64,
    /// Points that have it.
    pub points: u64,
}

/// A region and its name.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct RegionInfo {
    /// Its row in the catalog.
    #[serde(flatten)]
    pub row: RegionRow,
    /// Its name, if it has one.
    pub name: Option<String>,
}

/// A mesh that was kept on the way to the finished one.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct StageInfo {
    /// Number of the cut, from 1.
    pub cut: u32,
    /// Before or after its zone was refined.
    pub stage: Stage,
    /// Tetrahedra.
    pub tets: u64,
    /// Bytes of its file.
    pub bytes: u64,
}

/// A sub-domain.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct SubdomainInfo {
    /// Its rank, from 0.
    pub id: u32,
    /// Whether it is finished, and how it is stored.
    pub state: SubdomainState,
    /// Tetrahedra.
    pub tets: u64,
    /// Vertices, those shared with others included.
    pub vertices: u64,
    /// Facets of the input.
    pub facets: u64,
    /// Faces shared with other sub-domains.
    pub interface_faces: u64,
    /// Digest of its tetrahedra.
    pub digest: String,
    /// Digest of its interface faces.
    pub interface_digest: String,
    /// Neighbors and how many faces each shares; `None` before the topology is known.
    pub neighbors: Option<Vec<NeighborRow>>,
    /// Qualities of its tetrahedra.
    pub quality: QualityRow,
    /// Greatest quality q; 1 is regular.
    pub worst_q: f64,
    /// Volume in cubed input units.
    pub volume: f64,
    /// Low and high corner of the box around its vertices.
    pub bounds: [[f64; 3]; 2],
    /// Bytes of its file.
    pub bytes: u64,
    /// Bytes of its coarse snapshot, if that was kept.
    pub coarse_bytes: Option<u64>,
    /// Sizes it was meshed with again; `None` for those of the first run.
    pub sizes: Option<Value>,
}

impl StoreInfo {
    /// Reads the record of the store at `path`, which need not be finished. No mesh is read.
    ///
    /// # Errors
    /// `no-such-store`, `not-a-store`, `store-format`, `busy`, `damaged`.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        guarded(&Settings::new(), || Self::of(path.as_ref()))
    }

    fn of(path: &Path) -> Result<Self, Error> {
        let catalog = &mut Catalog::open(path)?;
        let (state, job) = (catalog.state()?, catalog.job()?);
        let rows = catalog.subdomains()?;
        let previous = catalog.previous()?;
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
            wires: embedded(catalog)?,
            regions: regions(catalog)?,
            tets: rows.iter().map(|r| r.tets).sum(),
            input_triangles: catalog.n_input_triangles()?,
            vertices: rows.iter().map(|r| r.vertices).sum(),
            bounds: [all.low, all.high].map(|p| p.to_array()),
            bytes: rows.iter().map(|r| r.bytes).sum(),
            coarse_bytes: coarse.iter().map(|c| c.bytes).sum(),
            previous_bytes: previous.iter().map(|r| r.bytes).sum(),
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
            n_previous: previous.len(),
        })
    }

    /// Bytes of the whole store on disk.
    pub fn bytes_on_disk(&self) -> u64 {
        self.bytes + self.coarse_bytes + self.previous_bytes + self.catalog_bytes
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
        let sizes = pipeline::asked(catalog, row.rank)?;
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
    // Names are those of regions 1, 2, …, empty for a region without one.
    let name_of = |row: &RegionRow| names.get((row.region as usize).checked_sub(1)?);
    let info = |row: RegionRow| {
        let name = name_of(&row).filter(|name| !name.is_empty()).cloned();
        RegionInfo { row, name }
    };
    Ok(rows.into_iter().map(info).collect())
}
