//! Once through each sub-domain: facets, then tetrahedra chunk by chunk, then the faces left open.

use std::path::Path;

use rayon::prelude::*;
use tetdb_schema::chunk::{ChunkRecord, TetSummary};
use tetdb_schema::digest::Digest;
use tetdb_schema::record::{FACES, NO_TET, SealedTet};

use super::against::{Input, check_owners};
use super::embedded::EmbeddedSearch;
use super::interface::InterfaceAudit;
use super::pairing::{OpenSide, OpenSides};
use super::part_report::MeshVolumes;
use super::rows::{Rederived, RegionSums};
use super::{Finding, Level, Report, VerifyOptions};
use crate::sealed::{
    BitSet, Corner, FaceJoin, FaceJoinSorter, FacePairs, Paired, Subdomain, sorted_face,
};
use crate::store::StoreError;
use tetdb_base::geom::{Point, insphere, orient};
use tetdb_base::storage::{check_cancelled, parallel};

/// Marks of faces: the reasons for which a face is required.
const FACET: u8 = 1;
/// See [`FACET`].
const INTERFACE: u8 = 2;

/// A verification under way.
pub(super) struct Audit<'a> {
    pub(super) options: &'a VerifyOptions,
    pub(super) scratch: &'a Path,
    pub(super) input: Option<Input<'a>>,
    pub(super) embedded: Option<EmbeddedSearch<'a>>,
    pub(super) interfaces: InterfaceAudit,
    pub(super) pairs: FacePairs,
    pub(super) report: Report,
    pub(super) digests: [Digest; 2],
    pub(super) regions: RegionSums,
    pub(super) volumes: MeshVolumes,
    /// First corner of the boundary, from which cones to the facets are measured: a distant apex would cancel digits.
    pub(super) apex: Option<Point>,
}

/// The two sides of a face in a chunk.
struct FacePair {
    a: u32,
    b: u32,
}

impl<'a> Audit<'a> {
    /// `apex`: the first corner of the boundary, where other processes read the first sub-domains.
    pub(super) fn new(
        surface: Option<&'a tetdb_base::surface::Surface>,
        options: &'a VerifyOptions,
        scratch: &'a Path,
        apex: Option<Point>,
    ) -> Self {
        let mut report = Report::new(options.level);
        report.against_input = surface.is_some() && options.level >= Level::Geometry;
        Self {
            options,
            scratch,
            input: surface.map(Input::new),
            embedded: surface.and_then(EmbeddedSearch::new),
            interfaces: InterfaceAudit::new(scratch, options.memory_bytes / 16),
            pairs: FacePairs::new(SealedTet::COUNT_MAX),
            report,
            digests: [Digest::default(); 2],
            regions: RegionSums::new(),
            volumes: MeshVolumes::default(),
            apex,
        }
    }

    pub(super) fn level(&self, level: Level) -> bool {
        self.options.level >= level
    }

    pub(super) fn subdomain(&mut self, part: &mut Subdomain) -> Result<(), StoreError> {
        // Summed separately: sums must not depend on the process that read a sub-domain.
        let others = std::mem::take(&mut self.volumes);
        self.walk(part)?;
        self.volumes = others.and(&self.volumes);
        // Damage of chunks was reported with their places before; the tree between them remains.
        Ok(part.check()?)
    }

    fn walk(&mut self, part: &mut Subdomain) -> Result<(), StoreError> {
        let row = part.row().clone();
        let report = &mut self.report;
        report.subdomains += 1;
        report.tets += row.tets;
        report.vertices += row.vertices;
        report.facets += row.facets;
        report.interface_faces += row.interface_faces;
        let mut used = BitSet::new(row.vertices);
        let mut claims = self.facets(part, &mut used)?;
        let digest = self.tets(part, &mut claims, &mut used)?;
        while let Some(claim) = claims.next_below(u32::MAX)? {
            self.stray(part, claim.tet, &claim.vertices)?;
        }
        self.unused(part, &used)?;
        if digest[0].lanes != row.digest || digest[1].lanes != row.interface_digest {
            let [own, interface] = digest;
            let what =
                format_args!("the digests are {own} and {interface}, not those of the catalog");
            self.report.find(Finding::CatalogDiffers, row.rank, what);
        }
        for (sum, part) in self.digests.iter_mut().zip(digest) {
            sum.merge(&part);
        }
        Ok(())
    }

    /// Reads facets and interface faces; returns the faces that they name of tetrahedra.
    fn facets(&mut self, part: &mut Subdomain, used: &mut BitSet) -> Result<FaceJoin, StoreError> {
        let rank = part.id().rank();
        let mut claims = FaceJoinSorter::new(self.scratch, self.options.memory_bytes as u64 / 8);
        let (chunks, total) = (part.row().chunks[2], part.row().facets);
        let mut n = 0;
        for chunk in 0..chunks {
            check_cancelled();
            for facet in part.facet_chunk(chunk)?.records {
                n += 1;
                let corners = part.corners(facet.vertices)?;
                used.insert_all(facet.vertices);
                for (side, tet) in facet.tets.into_iter().enumerate() {
                    if tet != NO_TET {
                        claims.push(tet, facet.vertices, side == 0, FACET.into())?;
                    }
                }
                if self.level(Level::Geometry) {
                    check_owners(rank, &corners, &mut self.report);
                    self.boundary_volume(&facet.tets, &corners);
                    if let Some(input) = &mut self.input {
                        input.check(rank, &facet, &corners, &mut self.report);
                    }
                }
            }
        }
        counted(part, "facets", n, total)?;
        self.interface_faces(part, &mut claims)?;
        Ok(claims.finish()?)
    }

    fn interface_faces(
        &mut self,
        part: &mut Subdomain,
        claims: &mut FaceJoinSorter,
    ) -> Result<(), StoreError> {
        let rank = part.id().rank();
        let (chunks, total) = (part.row().chunks[3], part.row().interface_faces);
        let mut n = 0;
        for chunk in 0..chunks {
            for face in part.interface_chunk(chunk)?.records {
                n += 1;
                let corners = part.corners(face.vertices)?;
                claims.push(face.tet, face.vertices, false, INTERFACE.into())?;
                self.interfaces.push(rank, &face, &corners)?;
            }
        }
        counted(part, "interface faces", n, total)
    }

    /// Adds a facet's share of the volume within the boundary: a cone to one point for each filled side.
    fn boundary_volume(&mut self, tets: &[u32; 2], corners: &[Corner; 3]) {
        let apex = *self.apex.get_or_insert(corners[0].point);
        let [a, b, c] = corners.map(|c| c.point - apex);
        let (u, v) = (b - a, c - a);
        let cone = a.dot(u.cross(v)) / 6.0;
        let sides = tets.map(|t| f64::from(u8::from(t != NO_TET)));
        let sums = &mut self.volumes;
        sums.within_boundary += cone * (sides[1] - sides[0]);
        sums.scale += cone.abs();
        sums.rounding += 4.0 * f64::EPSILON * a.length() * u.length() * v.length();
    }

    fn tets(
        &mut self,
        part: &mut Subdomain,
        claims: &mut FaceJoin,
        used: &mut BitSet,
    ) -> Result<[Digest; 2], StoreError> {
        let rank = part.id().rank();
        let mut digest = [Digest::default(); 2];
        let mut rows = Rederived::new(rank);
        let mut open = OpenSides::new(self.scratch, self.options.memory_bytes / 4);
        let mut expected = 0;
        for place in 0..part.tet_summaries().len() {
            check_cancelled();
            let chunk = part.tet_chunk(place as u32)?;
            let summary = part.tet_summaries()[place];
            if chunk.first != expected {
                let found = chunk.first;
                let what = format!("a chunk of tetrahedra starts at {found}, expected {expected}");
                return Err(part.damaged(what).into());
            }
            expected += chunk.records.len() as u32;
            let tets = &chunk.records;
            let mut corners = Vec::with_capacity(tets.len());
            for (i, tet) in tets.iter().enumerate() {
                let c = part.corners(tet.nodes)?;
                used.insert_all(tet.nodes);
                self.distinct(rank, chunk.first + i as u32, tet, &c);
                if let Some(embedded) = &mut self.embedded {
                    embedded.see(&c);
                }
                corners.push(c);
            }
            rows.add(tets, &corners, &summary, &mut self.report);
            let marks = self.marks(part, claims, chunk.first, tets)?;
            if self.level(Level::Geometry) {
                self.orientations(rank, chunk.first, &corners);
            }
            if self.level(Level::Adjacency) {
                self.pair(rank, &summary, tets, &corners, &marks, &mut open)?;
            }
            if let Some(progress) = &self.options.progress {
                progress(tets.len() as u64);
            }
        }
        let total = part.row().tets;
        counted(part, "tetrahedra", u64::from(expected), total)?;
        digest[0] = rows.digest();
        rows.finish(part, &mut self.regions, &mut self.report)?;
        for chunk in 0..part.row().chunks[3] {
            for face in part.interface_chunk(chunk)?.records {
                let mixes = part.corners(face.vertices)?.map(|c| c.mix);
                digest[1].add_face(mixes, face.cut);
            }
        }
        open.for_each_face(|sides| self.open_face(part, sides))?;
        Ok(digest)
    }

    fn distinct(&mut self, rank: u32, number: u32, tet: &SealedTet, corners: &[Corner; 4]) {
        let [a, b, c, d] = tet.nodes;
        if a == b || a == c || a == d || b == c || b == d || c == d {
            let found = self.report.find(Finding::RepeatedNode, rank, "two nodes are the same");
            found.with_tet(number).with_corners(corners);
        }
    }

    /// Marks the required faces of a chunk; reports facets and interface faces that are no faces of their tetrahedra.
    fn marks(
        &mut self,
        part: &mut Subdomain,
        claims: &mut FaceJoin,
        first: u32,
        tets: &[SealedTet],
    ) -> Result<Vec<[u8; 4]>, StoreError> {
        let mut marks = vec![[0; 4]; tets.len()];
        while let Some(claim) = claims.next_below(first + tets.len() as u32)? {
            let place = (claim.tet - first) as usize;
            let mark = claim.mark as u8;
            match claim.place(tets[place].nodes) {
                Some(i) if marks[place][i] & mark == 0 => marks[place][i] |= mark,
                _ => self.stray(part, claim.tet, &claim.vertices)?,
            }
        }
        Ok(marks)
    }

    fn stray(&mut self, part: &mut Subdomain, tet: u32, face: &[u32; 3]) -> Result<(), StoreError> {
        let corners = part.corners(*face)?;
        if self.level(Level::Topology) {
            let what = "the tetrahedron named by a facet or interface face does not have it on that side, or is named twice";
            let found = self.report.find(Finding::StrayFacet, part.id().rank(), what);
            found.with_tet(tet).with_corners(&corners);
        }
        Ok(())
    }

    fn orientations(&mut self, rank: u32, first: u32, corners: &[[Corner; 4]]) {
        let volumes: Vec<f64> = parallel(|| {
            corners
                .par_iter()
                .with_min_len(1024)
                .map(|c| {
                    let [a, b, c, d] = c.map(|c| c.point);
                    orient(a, b, c, d)
                })
                .collect()
        });
        for (i, &six_volumes) in volumes.iter().enumerate() {
            self.volumes.of_tets += six_volumes / 6.0;
            if six_volumes <= 0.0 {
                let what = "its orientation is not positive";
                let found = self.report.find(Finding::NotPositive, rank, what);
                found.with_tet(first + i as u32).with_corners(&corners[i]);
            }
        }
    }

    /// Matches the faces of a chunk; sends the others to the sort.
    fn pair(
        &mut self,
        rank: u32,
        summary: &TetSummary,
        tets: &[SealedTet],
        corners: &[[Corner; 4]],
        marks: &[[u8; 4]],
        open: &mut OpenSides,
    ) -> Result<(), StoreError> {
        let (first, mut n_open) = (summary.first, 0);
        self.pairs.clear();
        let mut inner = Vec::with_capacity(tets.len() * 2);
        for (t, tet) in tets.iter().enumerate() {
            for (i, face) in FACES.iter().enumerate() {
                let (key, odd) = sorted_face(face.map(|k| tet.nodes[k]));
                let reference = (t * 4 + i) as u32;
                match self.pairs.add(key, odd, reference) {
                    Paired::Open => {}
                    Paired::With(other) => inner.push(FacePair { a: other, b: reference }),
                    Paired::Same(_) | Paired::Third => {
                        let c = face.map(|k| corners[t][k]);
                        self.crowded(rank, first + t as u32, &c);
                    }
                }
            }
        }
        for (key, odd, reference) in self.pairs.open() {
            let (t, i) = (reference as usize / 4, reference as usize % 4);
            n_open += 1;
            open.push(&OpenSide {
                face: key,
                odd,
                reference: first * 4 + reference,
                apex: tets[t].nodes[i],
                region: tets[t].region,
                mark: marks[t][i],
            })?;
        }
        if n_open != summary.open_faces {
            let counted = summary.open_faces;
            let what =
                format_args!("a chunk has {n_open} open faces, its summary counts {counted}");
            self.report.find(Finding::CatalogDiffers, rank, what).with_tet(first);
        }
        self.report.inner_faces += inner.len() as u64;
        for pair in &inner {
            let [(a, i), (b, j)] = [pair.a, pair.b].map(|r| (r as usize / 4, r as usize % 4));
            let c = FACES[i].map(|k| corners[a][k]);
            let number = first + a as u32;
            let regions = [tets[a].region, tets[b].region];
            self.agree(rank, number, [marks[a][i], marks[b][j]], regions, &c);
        }
        if self.level(Level::Delaunay) {
            let tested = parallel(|| {
                inner
                    .par_iter()
                    .with_min_len(1024)
                    .filter(|p| marks[p.a as usize / 4][p.a as usize % 4] == 0)
                    .map(|p| {
                        let [a, b, c, d] = corners[p.a as usize / 4].map(|c| c.point);
                        let apex = corners[p.b as usize / 4][p.b as usize % 4].point;
                        (1, u64::from(insphere(a, b, c, d, apex) <= 0.0))
                    })
                    .reduce(|| (0, 0), |x, y| (x.0 + y.0, x.1 + y.1))
            });
            self.report.delaunay_tested += tested.0;
            self.report.delaunay_faces += tested.1;
        }
        Ok(())
    }

    fn crowded(&mut self, rank: u32, tet: u32, corners: &[Corner; 3]) {
        let what = "more than one tetrahedron on one side of a face";
        let found = self.report.find(Finding::CrowdedFace, rank, what);
        found.with_tet(tet).with_corners(corners);
    }

    /// Checks the two sides of an inner face: equal marks, none of an interface, and equal regions where there are none.
    fn agree(
        &mut self,
        rank: u32,
        tet: u32,
        marks: [u8; 2],
        regions: [u32; 2],
        corners: &[Corner; 3],
    ) {
        if !self.level(Level::Topology) {
            return;
        }
        let (finding, what) = if marks[0] & INTERFACE != 0 || marks[1] & INTERFACE != 0 {
            let what = "an interface face has both its sides in one sub-domain";
            (Finding::UnmatchedInterface, what.to_owned())
        } else if marks[0] != marks[1] {
            let what = "only one of the two sides of a face is a facet";
            (Finding::OneSidedFacet, what.to_owned())
        } else if marks[0] == 0 && regions[0] != regions[1] {
            let [a, b] = regions;
            let what = format!("regions {a} and {b} meet at a face that is no facet");
            (Finding::RegionLeak, what)
        } else {
            return;
        };
        self.report.find(finding, rank, what).with_tet(tet).with_corners(corners);
    }

    /// Checks a face that its chunk left open, with all its sides.
    fn open_face(&mut self, part: &mut Subdomain, sides: &[OpenSide]) -> Result<(), StoreError> {
        let rank = part.id().rank();
        let tet = sides[0].reference / 4;
        match sides {
            [one] => {
                if one.mark & FACET != 0 {
                    self.report.boundary_faces += 1;
                }
                if one.mark == 0 {
                    let corners = part.corners(one.face)?;
                    let what = "a face with one side is neither a facet nor an interface face";
                    let found = self.report.find(Finding::OpenFace, rank, what);
                    found.with_tet(tet).with_corners(&corners);
                }
            }
            [a, b] if a.odd != b.odd => {
                self.report.inner_faces += 1;
                let corners = part.corners(a.face)?;
                self.agree(rank, tet, [a.mark, b.mark], [a.region, b.region], &corners);
                if self.level(Level::Delaunay) && a.mark == 0 {
                    let [p, q, r] = corners.map(|c| c.point);
                    let [x, y] = part.corners([a.apex, b.apex])?.map(|c| c.point);
                    // Outward from the apex the face turns one way or the other.
                    let (q, r) = if a.odd { (r, q) } else { (q, r) };
                    let empty = insphere(x, p, q, r, y) <= 0.0;
                    self.report.delaunay_tested += 1;
                    self.report.delaunay_faces += u64::from(empty);
                }
            }
            _ => {
                let corners = part.corners(sides[0].face)?;
                self.crowded(rank, tet, &corners);
            }
        }
        Ok(())
    }

    fn unused(&mut self, part: &mut Subdomain, used: &BitSet) -> Result<(), StoreError> {
        for v in 0..part.row().vertices as u32 {
            if !used.contains(v.into()) {
                let corner = part.corner(v)?;
                let what = "no tetrahedron and no facet has the vertex";
                let found = self.report.find(Finding::UnusedVertex, part.id().rank(), what);
                found.with_corners(&[corner]);
            }
        }
        Ok(())
    }
}

/// Checks that the chunks hold as many records as the catalog counts.
fn counted(part: &Subdomain, what: &str, found: u64, total: u64) -> Result<(), StoreError> {
    if found == total {
        return Ok(());
    }
    let what = format!("its chunks hold {found} {what}, the catalog counts {total}");
    Err(part.damaged(what).into())
}
