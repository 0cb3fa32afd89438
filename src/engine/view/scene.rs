//! The surfaces shown in space: the boundary of a mesh, its interfaces, and cuts across each axis.

use super::cluster::{Cluster, Patch, TRIANGLE_BYTES};
use super::section::{View, pieces};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Budget, Lease, check_cancelled};
use tetdb_schema::record::NO_TET;
use tetdb_store::query::Selection;
use tetdb_store::query::Solid;
use tetdb_store::query::{QueryError, QuerySession};

/// Largest number of triangles of the boundary, of all interfaces, and of one cut. A page with all of them is below 12 MB.
const BOUNDARY_MOST: usize = 160_000;
const INTERFACES_MOST: usize = 120_000;
const CUT_MOST: usize = 24_000;
/// Number of cuts across each axis.
const CUTS: u32 = 9;

/// Data of a triangle of the boundary, or of one between two regions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClippedSkin {
    /// Rank of the sub-domain.
    pub subdomain: u32,
    /// The filled region it bounds.
    pub region: u32,
    /// Label of the input triangle.
    pub label: u32,
}

/// Data of a triangle of a cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cross {
    /// Rank of the sub-domain.
    pub subdomain: u32,
    /// Number of the region.
    pub region: u32,
    /// Quality q of the tetrahedron.
    pub quality: f32,
    /// Mean length of the tetrahedron's longest and shortest edge.
    pub size: f32,
    /// True for each edge (opposite its corner) that is an edge of the tetrahedron's polygon.
    pub edges: [bool; 3],
}

/// The cut of the mesh by a plane across an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCut {
    /// 0, 1 or 2 for x, y or z.
    pub axis: u32,
    /// Coordinate of the plane on that axis.
    pub at: f64,
    /// The triangles of the cut.
    pub patch: Patch<Cross>,
}

/// Access to the surfaces of a mesh, one at a time: each may take a large part of the memory.
pub struct Scene<'a> {
    inquiry: &'a mut QuerySession,
    budget: &'a Budget,
}

/// Opens the surfaces of the mesh for pictures in space. One at a time takes up to 24 MB of `budget`.
pub fn scene<'a>(session: &'a mut QuerySession, budget: &'a Budget) -> Scene<'a> {
    Scene { inquiry: session, budget }
}

impl Scene<'_> {
    /// Returns the input triangles with a tetrahedron on at least one side. Where only one side is filled, the normal points away
    /// from it.
    ///
    /// Errors: damage; a small budget.
    pub fn boundary(&mut self) -> Result<Patch<ClippedSkin>, QueryError> {
        let (mut cluster, _lease) = self.cluster(BOUNDARY_MOST)?;
        for (rank, chunks) in self.chunks(2) {
            for chunk in 0..chunks {
                check_cancelled();
                self.inquiry.count_faces();
                let fin_first = self.inquiry.wires.fin_first;
                let part = &mut self.inquiry.part(rank)?.subdomain;
                for facet in part.facet_chunk(chunk)?.records {
                    if facet.triangle >= fin_first {
                        continue;
                    }
                    // The side behind the triangle comes first: its normal points away from that side.
                    let Some(side) = [1, 0].into_iter().find(|&s| facet.tets[s] != NO_TET) else {
                        continue;
                    };
                    let mut corners = part.corners(facet.vertices)?.map(|c| c.point);
                    if side == 0 {
                        corners.swap(1, 2);
                    }
                    let skin = ClippedSkin {
                        subdomain: rank,
                        region: facet.regions[side],
                        label: facet.label,
                    };
                    cluster.push(corners, skin);
                }
            }
        }
        Ok(cluster.finish())
    }

    /// Returns each interface face once, with two sub-domains: the one its normal points away from, and the one it points into.
    ///
    /// Errors: damage; a small budget.
    pub fn interfaces(&mut self) -> Result<Patch<[u32; 2]>, QueryError> {
        let (mut cluster, _lease) = self.cluster(INTERFACES_MOST)?;
        for (rank, chunks) in self.chunks(3) {
            for chunk in 0..chunks {
                check_cancelled();
                self.inquiry.count_faces();
                let part = &mut self.inquiry.part(rank)?.subdomain;
                for face in part.interface_chunk(chunk)?.records {
                    if rank < face.other {
                        let corners = part.corners(face.vertices)?.map(|c| c.point);
                        cluster.push(corners, [rank, face.other]);
                    }
                }
            }
        }
        Ok(cluster.finish())
    }

    /// Returns the axis and coordinate of each cut.
    pub fn places(&self) -> Vec<(u32, f64)> {
        let Aabb { low, high } = self.inquiry.bounds();
        (0..3 * CUTS)
            .map(|k| {
                let (axis, step) = (k / CUTS, k % CUTS + 1);
                // The offset avoids round coordinates, where generated surfaces have their vertices.
                let share = f64::from(step) / f64::from(CUTS + 1) + 1.0 / 512.0;
                let [from, to] = [low[axis as usize], high[axis as usize]];
                (axis, from + (to - from) * share)
            })
            .collect()
    }

    /// Returns the cut at one of the [`Scene::places`].
    ///
    /// Errors: damage; a small budget.
    pub fn cut(&mut self, (axis, at): (u32, f64)) -> Result<SceneCut, QueryError> {
        let normal = Point::AXES[axis as usize];
        let (view, point) = (View::new(normal * at, normal), normal * at);
        let (mut cluster, _lease) = self.cluster(CUT_MOST)?;
        let mut selection = Selection::default();
        selection.solids.push(Solid::Plane { point, normal });
        for tet in self.inquiry.select(selection)? {
            let tet = tet?;
            for (_, piece) in pieces(&view, false, &tet) {
                let raised = piece.corners.map(|c| view.raised(c));
                for k in 2..piece.n {
                    let cross = Cross {
                        subdomain: piece.subdomain,
                        region: piece.region,
                        quality: piece.quality,
                        size: piece.size,
                        edges: [true, k + 1 == piece.n, k == 2],
                    };
                    cluster.push([raised[0], raised[k - 1], raised[k]], cross);
                }
            }
        }
        let patch = cluster.finish();
        Ok(SceneCut { axis, at, patch })
    }

    fn cluster<T: Copy>(&self, most: usize) -> Result<(Cluster<T>, Lease), QueryError> {
        let bytes = most as u64 * TRIANGLE_BYTES;
        let lease = self.budget.lease(bytes, "triangles of a picture in space")?;
        Ok((Cluster::new(&self.inquiry.bounds(), most), lease))
    }

    /// Returns each rank with its number of chunks of a kind.
    fn chunks(&self, kind: usize) -> Vec<(u32, u32)> {
        let rows = self.inquiry.rows.iter();
        rows.map(|r| (r.rank, r.chunks[kind])).collect()
    }
}
