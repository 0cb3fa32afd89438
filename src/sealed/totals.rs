//! What is summed over the tetrahedra of a sub-domain while it is written.

use std::collections::BTreeMap;

use tetdb_schema::chunk::TetSummary;
use tetdb_schema::digest::Digest;
use tetdb_schema::record::{FACES, SealedTet};

use super::{Corner, FacePairs, Paired, Shape, quality_bin, sorted_face};
use crate::geom::Aabb;
use crate::storage::map_into;
use tetdb_schema::catalog::QUALITY_BINS;
use tetdb_schema::catalog::QualityRow;

/// Tetrahedra whose corners are held at once.
const PIECE: usize = 4096;

/// What is summed over tetrahedra, in their order.
pub(crate) struct Totals {
    /// Of the tetrahedra.
    pub digest: Digest,
    /// Of the vertices; whoever has them sets it.
    pub bounds: Aabb,
    /// As in [`QualityRow`].
    pub bins: [u64; QUALITY_BINS],
    /// Greatest quality.
    pub worst: f64,
    /// The first that has it.
    pub worst_tet: u32,
    /// Least and greatest cosine of a dihedral angle.
    pub cosines: [f64; 2],
    /// Sum in order.
    pub volume: f64,
    /// By number.
    pub regions: BTreeMap<u32, RegionTotals>,
    /// Of the piece at hand; kept, for memory that is asked for anew is cleared by the system each time.
    corners: Vec<[Corner; 4]>,
    shapes: Vec<Shape>,
}

/// Least and greatest coordinates.
pub(super) fn array(bounds: &Aabb) -> [[f64; 3]; 2] {
    [bounds.low.to_array(), bounds.high.to_array()]
}

/// The least number not below `x` that 32 bits can hold.
fn rounded_up(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) < x {
        near.next_up()
    } else {
        near
    }
}

/// Faces of a chunk that have no partner in it.
pub(super) fn count_open(pairs: &mut FacePairs, tets: &[SealedTet]) -> u32 {
    pairs.clear();
    let mut open = 0u32;
    for tet in tets {
        for corners in FACES {
            let (face, odd) = sorted_face(corners.map(|i| tet.nodes[i]));
            match pairs.add(face, odd, 0) {
                Paired::With(_) => open -= 1,
                Paired::Open => open += 1,
                Paired::Same(_) | Paired::Third => {}
            }
        }
    }
    open
}

/// Of nothing.
impl Default for Totals {
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
            corners: Vec::with_capacity(PIECE),
            shapes: Vec::with_capacity(PIECE),
        }
    }
}

impl Totals {
    /// Adds a chunk and returns its summary, but for what only its bytes and faces tell.
    ///
    /// Errors: those of `corners_of`.
    pub fn add<E>(
        &mut self,
        first: u32,
        tets: &[SealedTet],
        rank: u32,
        mut corners_of: impl FnMut(&SealedTet) -> Result<[Corner; 4], E>,
    ) -> Result<TetSummary, E> {
        let mut bounds = Aabb::EMPTY;
        let mut summary = TetSummary {
            bounds: [[0.0; 3]; 2],
            volume: 0.0,
            quality: [f32::INFINITY, 0.0],
            regions: [u32::MAX, 0],
            vertices: [u32::MAX, 0],
            first,
            count: tets.len() as u32,
            open_faces: 0,
            bytes: 0,
            edge_max: 0.0,
        };
        let mut buffers = (
            std::mem::take(&mut self.corners),
            std::mem::take(&mut self.shapes),
        );
        let (corners, shapes) = (&mut buffers.0, &mut buffers.1);
        // A piece at a time: the corners of a whole chunk would take ten times its bytes.
        for (piece, first) in tets.chunks(PIECE).zip((first..).step_by(PIECE)) {
            corners.clear();
            for tet in piece {
                corners.push(corners_of(tet)?);
            }
            // Shapes in parallel, sums in order: the same for any number of threads.
            map_into(corners, shapes, |c| Shape::of(c.map(|c| c.point)));
            let known = piece.iter().zip(&*corners).zip(&*shapes);
            for (place, ((tet, corners), shape)) in (first..).zip(known) {
                self.digest
                    .add_tet(corners.map(|c| c.mix), tet.region, rank);
                bounds = corners.iter().fold(bounds, |b, c| b.with(c.point));
                self.add_shape(place, shape);
                let region = self.regions.entry(tet.region).or_default();
                region.tets += 1;
                region.volume += shape.volume;
                summary.volume += shape.volume;
                summary.edge_max = summary.edge_max.max(rounded_up(shape.edge_max));
                let q = shape.quality as f32;
                summary.quality = [summary.quality[0].min(q), summary.quality[1].max(q)];
                let [least, most] = summary.regions;
                summary.regions = [least.min(tet.region), most.max(tet.region)];
                for v in tet.nodes {
                    let [least, most] = summary.vertices;
                    summary.vertices = [least.min(v), most.max(v)];
                }
            }
        }
        (self.corners, self.shapes) = buffers;
        summary.bounds = array(&bounds);
        Ok(summary)
    }

    fn add_shape(&mut self, place: u32, shape: &Shape) {
        self.bins[quality_bin(shape.quality)] += 1;
        if shape.quality > self.worst {
            self.worst = shape.quality;
            self.worst_tet = place;
        }
        let [least, most] = self.cosines;
        self.cosines = [least.min(shape.cosines[0]), most.max(shape.cosines[1])];
        self.volume += shape.volume;
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

/// What a region has in this sub-domain.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct RegionTotals {
    /// Its tetrahedra.
    pub tets: u64,
    /// Summed in the sealed order.
    pub volume: f64,
}
