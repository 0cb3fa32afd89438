//! Sums over the tetrahedra of a sub-domain while it is written.

use std::collections::BTreeMap;

use tetdb_schema::chunk::TetSummary;
use tetdb_schema::digest::Digest;
use tetdb_schema::record::SealedTet;

use super::{Corner, FacePairs, Paired, Shape, quality_bin, sorted_faces};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::map_into;
use tetdb_schema::catalog::QUALITY_BINS;
use tetdb_schema::catalog::QualityRow;
use tetdb_schema::totals::RegionTotals;

/// Tetrahedra whose corners are held at once.
const PIECE: usize = 4096;

/// Sums over tetrahedra, in their order.
pub struct SubdomainTotals {
    /// Digest of the tetrahedra.
    pub digest: Digest,
    /// Bounds of the vertices, set by the caller.
    pub bounds: Aabb,
    /// As in [`QualityRow`].
    pub bins: [u64; QUALITY_BINS],
    /// Greatest quality.
    pub worst: f64,
    /// The first tetrahedron of the greatest quality.
    pub worst_tet: u32,
    /// Least and greatest cosine of a dihedral angle.
    pub cosines: [f64; 2],
    /// Sum of the volumes, in order.
    pub volume: f64,
    /// Sums of the regions by number.
    pub regions: BTreeMap<u32, RegionTotals>,
    scratch: SumScratch,
}

/// Vertices and shapes of the current piece; kept, because the system clears newly allocated memory.
#[derive(Default)]
pub(super) struct SumScratch {
    corners: Vec<[VertexSum; 4]>,
    shapes: Vec<Shape>,
}

/// Sums over a chunk of tetrahedra.
pub(super) struct ChunkSums {
    /// Without the number of open faces and the bytes.
    pub summary: TetSummary,
    digest: Digest,
    bins: [u64; QUALITY_BINS],
    worst: f64,
    worst_tet: u32,
    cosines: [f64; 2],
    /// Of each tetrahedron.
    volumes: Vec<f64>,
}

/// The parts of a vertex that are summed.
#[derive(Clone, Copy)]
struct VertexSum {
    point: Point,
    mix: u64,
}

impl VertexSum {
    #[inline(always)]
    fn new(corner: &Corner) -> Self {
        Self { point: corner.point, mix: corner.mix }
    }
}

/// Consecutive tetrahedra of one region, so that the map of regions is searched once.
struct RegionRun {
    region: u32,
    totals: RegionTotals,
}

impl RegionRun {
    fn begin(region: u32, regions: &BTreeMap<u32, RegionTotals>) -> Self {
        let totals = regions.get(&region).copied().unwrap_or_default();
        Self { region, totals }
    }

    fn end(self, regions: &mut BTreeMap<u32, RegionTotals>) {
        regions.insert(self.region, self.totals);
    }
}

/// Extends a box to a point with one instruction for each side; a minimum that treats NaN takes four. Coordinates that are
/// NaN are left out here too.
#[inline(always)]
fn extend(bounds: &mut Aabb, p: Point) {
    let less = |a: f64, b: f64| if a < b { a } else { b };
    let more = |a: f64, b: f64| if a > b { a } else { b };
    let (low, high) = (bounds.low, bounds.high);
    bounds.low = Point::new(less(p.x, low.x), less(p.y, low.y), less(p.z, low.z));
    bounds.high = Point::new(more(p.x, high.x), more(p.y, high.y), more(p.z, high.z));
}

/// Least and greatest coordinates.
pub(super) fn array(bounds: &Aabb) -> [[f64; 3]; 2] {
    [bounds.low.to_array(), bounds.high.to_array()]
}

/// The least number not below `x` that 32 bits can hold.
fn rounded_up(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) < x { near.next_up() } else { near }
}

/// Faces of a chunk that have no partner in it.
pub(super) fn count_open(pairs: &mut FacePairs, tets: &[SealedTet]) -> u32 {
    pairs.clear();
    let mut open = 0u32;
    for tet in tets {
        for (_, face, odd) in sorted_faces(tet.nodes) {
            match pairs.add(face, odd, 0) {
                Paired::With(_) => open -= 1,
                Paired::Open => open += 1,
                Paired::Same(_) | Paired::Third => {}
            }
        }
    }
    open
}

/// Sums of no tetrahedra.
impl Default for SubdomainTotals {
    fn default() -> Self {
        Self {
            digest: Digest::default(),
            bounds: Aabb::EMPTY,
            bins: [0; QUALITY_BINS],
            worst: 0.0,
            worst_tet: 0,
            cosines: [1.0, -1.0],
            volume: 0.0,
            regions: BTreeMap::new(),
            scratch: SumScratch::default(),
        }
    }
}

impl SubdomainTotals {
    /// Adds a chunk and returns its summary without the number of open faces and the bytes.
    ///
    /// Errors: those of `corners_of`.
    pub fn add<E>(
        &mut self,
        first: u32,
        tets: &[SealedTet],
        rank: u32,
        corners_of: impl FnMut(&SealedTet) -> Result<[Corner; 4], E>,
    ) -> Result<TetSummary, E> {
        let mut scratch = std::mem::take(&mut self.scratch);
        let sums = ChunkSums::of((first, tets), rank, self.cosines, &mut scratch, corners_of);
        self.scratch = scratch;
        let sums = sums?;
        self.add_sums(tets, &sums);
        Ok(sums.summary)
    }

    /// Adds the sums of the next chunk.
    pub(super) fn add_sums(&mut self, tets: &[SealedTet], sums: &ChunkSums) {
        self.digest.merge(&sums.digest);
        self.bins.iter_mut().zip(sums.bins).for_each(|(all, n)| *all += n);
        if sums.worst > self.worst {
            (self.worst, self.worst_tet) = (sums.worst, sums.worst_tet);
        }
        let [least, most] = self.cosines;
        self.cosines = [least.min(sums.cosines[0]), most.max(sums.cosines[1])];
        // Volumes one after another: a sum does not depend on chunks.
        let Some(tet) = tets.first() else {
            return;
        };
        let mut run = RegionRun::begin(tet.region, &self.regions);
        for (tet, &volume) in tets.iter().zip(&sums.volumes) {
            self.volume += volume;
            if run.region != tet.region {
                run.end(&mut self.regions);
                run = RegionRun::begin(tet.region, &self.regions);
            }
            run.totals.tets += 1;
            run.totals.volume += volume;
        }
        run.end(&mut self.regions);
    }

    /// The table of qualities.
    pub fn quality(&self) -> QualityRow {
        let angle = |cosine: f64| cosine.clamp(-1.0, 1.0).acos();
        QualityRow {
            bins: self.bins,
            worst: self.worst,
            worst_tet: self.worst_tet,
            dihedral: [angle(self.cosines[1]), angle(self.cosines[0])],
        }
    }
}

impl ChunkSums {
    /// Sums over the tetrahedra of a chunk, the first of which has number `first`. Cosines between those `known` are left out.
    ///
    /// Errors: those of `corners_of`.
    pub fn of<E>(
        (first, tets): (u32, &[SealedTet]),
        rank: u32,
        known: [f64; 2],
        scratch: &mut SumScratch,
        mut corners_of: impl FnMut(&SealedTet) -> Result<[Corner; 4], E>,
    ) -> Result<Self, E> {
        let mut bounds = Aabb::EMPTY;
        let mut sums = Self {
            summary: TetSummary {
                bounds: [[0.0; 3]; 2],
                volume: 0.0,
                quality: [0.0; 2],
                regions: [u32::MAX, 0],
                vertices: [u32::MAX, 0],
                first,
                count: tets.len() as u32,
                open_faces: 0,
                bytes: 0,
                edge_max: 0.0,
            },
            digest: Digest::default(),
            bins: [0; QUALITY_BINS],
            worst: 0.0,
            worst_tet: first,
            cosines: known,
            volumes: Vec::with_capacity(tets.len()),
        };
        let SumScratch { corners, shapes } = scratch;
        // Rounded once at the end: rounding keeps the order.
        let (mut quality, mut edge_max) = ([f64::INFINITY, 0.0f64], 0.0f64);
        // A piece at a time: the corners of a whole chunk would take ten times its bytes.
        for (piece, first) in tets.chunks(PIECE).zip((first..).step_by(PIECE)) {
            corners.clear();
            for tet in piece {
                let [a, b, c, d] = &corners_of(tet)?;
                corners.push([
                    VertexSum::new(a),
                    VertexSum::new(b),
                    VertexSum::new(c),
                    VertexSum::new(d),
                ]);
            }
            // Shapes in parallel, sums in order: the same for any number of threads.
            let known = sums.cosines;
            map_into(corners, shapes, |[a, b, c, d]| {
                Shape::beyond([a.point, b.point, c.point, d.point], known)
            });
            let known = piece.iter().zip(&*corners).zip(&*shapes);
            for (place, ((tet, corners), shape)) in (first..).zip(known) {
                let [a, b, c, d] = corners;
                sums.digest.add_tet([a.mix, b.mix, c.mix, d.mix], tet.region, rank);
                corners.iter().for_each(|c| extend(&mut bounds, c.point));
                sums.add_shape(place, shape);
                edge_max = edge_max.max(shape.edge_max);
                quality = [quality[0].min(shape.quality), quality[1].max(shape.quality)];
                let summary = &mut sums.summary;
                summary.volume += shape.volume;
                let [least, most] = summary.regions;
                summary.regions = [least.min(tet.region), most.max(tet.region)];
                for v in tet.nodes {
                    let [least, most] = summary.vertices;
                    summary.vertices = [least.min(v), most.max(v)];
                }
            }
        }
        sums.summary.bounds = array(&bounds);
        sums.summary.quality = quality.map(|q| q as f32);
        sums.summary.edge_max = rounded_up(edge_max);
        Ok(sums)
    }

    fn add_shape(&mut self, place: u32, shape: &Shape) {
        self.bins[quality_bin(shape.quality)] += 1;
        if shape.quality > self.worst {
            self.worst = shape.quality;
            self.worst_tet = place;
        }
        let [least, most] = self.cosines;
        self.cosines = [least.min(shape.cosines[0]), most.max(shape.cosines[1])];
        self.volumes.push(shape.volume);
    }
}
