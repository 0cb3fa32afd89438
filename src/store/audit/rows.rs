//! Summaries and rows of the catalog, compared with values recomputed from the records.
//!
//! The writer sums in the order of the records, and so does this module: numbers must agree bit for bit.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fmt::Display;

use tetdb_schema::catalog::{InterfaceRow, NeighborRow, RegionRow, SubdomainRow, TopologyRow};
use tetdb_schema::chunk::{TetSummary, VertexSummary};
use tetdb_schema::digest::Digest;
use tetdb_schema::record::SealedTet;

use super::{Finding, Report};
use crate::sealed::{Corner, Subdomain, SubdomainTotals};
use crate::store::{Catalog, StoreError};
use tetdb_base::geom::{Aabb, Point};
use tetdb_schema::row::RowKind;
use tetdb_schema::totals::RegionTotals;

/// Recomputed values of one sub-domain.
pub(super) struct Rederived {
    totals: SubdomainTotals,
    rank: u32,
}

/// Regions of the whole mesh, summed sub-domain by sub-domain.
pub(super) type RegionSums = BTreeMap<u32, RegionTotals>;

impl Rederived {
    pub(super) fn new(rank: u32) -> Self {
        let totals = SubdomainTotals::default();
        Self { totals, rank }
    }

    /// Adds the next chunk of tetrahedra, its corners and its summary.
    pub(super) fn add(
        &mut self,
        tets: &[SealedTet],
        corners: &[[Corner; 4]],
        stored: &TetSummary,
        report: &mut Report,
    ) {
        let mut corners = corners.iter();
        let corners_of = |_: &SealedTet| {
            let next = corners.next().expect("as many as there are tetrahedra");
            Ok::<_, Infallible>(*next)
        };
        let (first, rank) = (stored.first, self.rank);
        let Ok(mut found) = self.totals.add(first, tets, rank, corners_of);
        // Both are checked elsewhere: faces when they are paired, bytes when they are read.
        (found.open_faces, found.bytes) = (stored.open_faces, stored.bytes);
        // Summaries of earlier versions lack it.
        if stored.edge_max == 0.0 {
            found.edge_max = 0.0;
        }
        if found != *stored {
            let what =
                format_args!("the summary of the chunk of tetrahedra {first} and on is another's");
            differs(rank, what, report);
        }
    }

    /// Digest of all tetrahedra.
    pub(super) fn digest(&self) -> Digest {
        self.totals.digest
    }

    /// Compares all vertices with their summaries, and the row with everything; adds the regions to those of the whole.
    pub(super) fn finish(
        self,
        part: &mut Subdomain,
        regions: &mut RegionSums,
        report: &mut Report,
    ) -> Result<(), StoreError> {
        let rank = self.rank;
        let mut around = Aabb::EMPTY;
        for chunk in 0..part.vertex_summaries().len() {
            let records = part.vertex_chunk(chunk as u32)?;
            let points = || records.records.iter().map(|v| v.point);
            let own = Aabb::around(points().map(Point::from_array));
            around = around.with(own.low).with(own.high);
            let bounds = [own.low, own.high].map(|p| p.to_array());
            let stored = part.vertex_summaries()[chunk];
            let mut found = VertexSummary {
                bounds,
                first: records.first,
                count: records.records.len() as u32,
                cells: VertexSummary::cells_of(&bounds, points()),
            };
            if stored.cells == 0 {
                found.cells = 0;
            }
            if found != stored {
                let what = format_args!("the summary of chunk {chunk} of vertices is another's");
                differs(rank, what, report);
            }
        }
        let row = part.row();
        let bytes = std::fs::metadata(part.path()).map_or(row.bytes, |file| file.len());
        let found = SubdomainRow {
            quality: self.totals.quality(),
            volume: self.totals.volume,
            bounds: [around.low, around.high].map(|p| p.to_array()),
            bytes,
            ..row.clone()
        };
        if found != *row {
            let what = "its row gives another quality, volume, box or length of the file";
            differs(rank, what, report);
        }
        for (region, here) in self.totals.regions {
            let sum = regions.entry(region).or_default();
            sum.tets += here.tets;
            sum.volume += here.volume;
        }
        Ok(())
    }
}

/// Compares the regions' rows with the sums over all sub-domains.
pub(super) fn check_regions(rows: &[RegionRow], sums: &RegionSums, report: &mut Report) {
    for row in rows {
        let found = sums.get(&row.region).copied().unwrap_or_default();
        // The volume of an empty region is not known.
        if row.tets != found.tets || (row.filled && row.volume != found.volume) {
            let RegionRow { region, tets, .. } = row;
            let what = format_args!(
                "region {region} has {} tetrahedra of volume {}, the catalog says {tets} of {}",
                found.tets, found.volume, row.volume
            );
            report.find(Finding::CatalogDiffers, None, what);
        }
    }
}

/// Compares the neighbors with the interfaces, which were compared with their faces, and the list of files with the rows that need them.
///
/// Errors: a damaged catalog.
pub(super) fn check_catalog(store: &mut Catalog, report: &mut Report) -> Result<(), StoreError> {
    let mut expected = BTreeMap::<u32, BTreeMap<u32, u64>>::new();
    for InterfaceRow { low, high, faces, .. } in store.interfaces()? {
        for [a, b] in [[low, high], [high, low]] {
            *expected.entry(a).or_default().entry(b).or_default() += faces;
        }
    }
    for TopologyRow { subdomain, neighbors } in store.topology()? {
        let of = expected.remove(&subdomain).unwrap_or_default().into_iter();
        let of = of.map(|(subdomain, faces)| NeighborRow { subdomain, faces });
        if !of.eq(neighbors) {
            let what = "its row of neighbors is not what its interfaces say";
            differs(subdomain, what, report);
        }
    }
    for rank in expected.into_keys() {
        differs(rank, "it has interfaces and no row of neighbors", report);
    }
    let (needed, listed) = (store.everywhere(RowKind::Subdomain)?, store.files()?);
    for row in needed.iter().filter(|row: &&SubdomainRow| !listed.contains(&row.file())) {
        differs(row.rank, "its file is not listed", report);
    }
    Ok(())
}

fn differs(rank: u32, what: impl Display, report: &mut Report) {
    report.find(Finding::CatalogDiffers, rank, what);
}
