//! The surfaces shown in space: the boundary of a mesh, its interfaces, cuts by planes, and tetrahedra that fulfill a condition.

use super::cluster::{Cluster, Patch, TRIANGLE_BYTES};
use super::section::{View, pieces};
use super::shell::for_each_triangle;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Budget, Lease, check_cancelled};
use tetdb_schema::record::FACES;
use tetdb_store::query::{Hit, QueryError, QuerySession, Selection, Solid, shared_select};

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
    /// Quality q of the tetrahedron, or another of its values.
    pub quality: f32,
    /// Mean length of the tetrahedron's longest and shortest edge.
    pub size: f32,
    /// True for each edge (opposite its corner) that is an edge of the tetrahedron's polygon.
    pub edges: [bool; 3],
}

/// Tetrahedra to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnTets {
    /// Their cuts or their faces.
    pub patch: Patch<Cross>,
    /// Number of tetrahedra that fulfill the conditions.
    pub tets: u64,
    /// Number of them in `patch`.
    pub drawn: u64,
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
    /// At least one, all of the same store; each answers on a thread of its own.
    sessions: &'a mut [QuerySession],
    budget: &'a Budget,
}

/// A share of the chunks of a surface: its number, and how many there are.
pub type SurfaceShare = [u32; 2];

/// Opens the surfaces of the mesh for pictures in space. One at a time takes up to 24 MB of `budget`.
pub fn scene<'a>(sessions: &'a mut [QuerySession], budget: &'a Budget) -> Scene<'a> {
    Scene { sessions, budget }
}

impl Scene<'_> {
    /// Returns the input triangles of a share with a tetrahedron on at least one side. Where only one side is filled, the normal points
    /// away from it.
    ///
    /// Errors: damage; a small budget.
    pub fn boundary(&mut self, share: SurfaceShare) -> Result<Patch<ClippedSkin>, QueryError> {
        let (mut cluster, _lease) = self.cluster(BOUNDARY_MOST / share[1] as usize)?;
        let session = &mut self.sessions[0];
        for (rank, chunk) in chunks(session, 2, share) {
            for_each_triangle(session, (rank, chunk), |corners, region, label| {
                cluster.push(corners, ClippedSkin { subdomain: rank, region, label });
                Ok(())
            })?;
        }
        Ok(cluster.finish())
    }

    /// Returns each interface face of a share once, with two sub-domains: the one its normal points away from, and the one it points
    /// into.
    ///
    /// Errors: damage; a small budget.
    pub fn interfaces(&mut self, share: SurfaceShare) -> Result<Patch<[u32; 2]>, QueryError> {
        let (mut cluster, _lease) = self.cluster(INTERFACES_MOST / share[1] as usize)?;
        let session = &mut self.sessions[0];
        for (rank, chunk) in chunks(session, 3, share) {
            check_cancelled();
            session.count_faces();
            let part = &mut session.part(rank)?.subdomain;
            for face in part.interface_chunk(chunk)?.records {
                if rank < face.other {
                    let corners = part.corners(face.vertices)?.map(|c| c.point);
                    cluster.push(corners, [rank, face.other]);
                }
            }
        }
        Ok(cluster.finish())
    }

    /// Returns the axis and coordinate of each cut.
    pub fn places(&self) -> Vec<(u32, f64)> {
        let Aabb { low, high } = self.sessions[0].bounds();
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
        let plane = [normal * at, normal];
        let patch = self.section(plane, Selection::default(), &|_| None, CUT_MOST)?.patch;
        Ok(SceneCut { axis, at, patch })
    }

    /// Returns the cut of the selected tetrahedra by a plane, as a point and a normal, in at most `most` triangles. `value` returns
    /// what stands in the place of the quality.
    ///
    /// Errors: damage; a small budget.
    pub fn section(
        &mut self,
        [point, normal]: [Point; 2],
        mut selection: Selection,
        value: &(dyn Fn(&Hit) -> Option<f32> + Sync),
        most: usize,
    ) -> Result<DrawnTets, QueryError> {
        let view = View::new(point, normal);
        let (mut cluster, _lease) = self.cluster(most)?;
        selection.solids.push(Solid::Plane { point, normal });
        let mut tets = 0;
        let triangles = |tet: Hit| {
            let piece = pieces(&view, false, &tet).pop().map(|(_, piece)| piece)?;
            let raised = piece.corners.map(|c| view.raised(c));
            let cross = |k| Cross {
                subdomain: piece.subdomain,
                region: piece.region,
                quality: value(&tet).unwrap_or(piece.quality),
                size: piece.size,
                edges: [true, k + 1 == piece.n, k == 2],
            };
            let triangle = |k| ([raised[0], raised[k - 1], raised[k]], cross(k));
            Some([Some(triangle(2)), (piece.n == 4).then(|| triangle(3))])
        };
        shared_select(self.sessions, &selection, triangles, |found| {
            tets += 1;
            for (corners, cross) in found.into_iter().flatten().flatten() {
                cluster.push(corners, cross);
            }
        })?;
        Ok(DrawnTets { patch: cluster.finish(), tets, drawn: tets })
    }

    /// Returns the faces of the selected tetrahedra. Of more than `most` tetrahedra, every second, fourth, … one is drawn.
    ///
    /// Errors: damage; a small budget.
    pub fn answers(
        &mut self,
        selection: Selection,
        value: &(dyn Fn(&Hit) -> Option<f32> + Sync),
        most: usize,
    ) -> Result<DrawnTets, QueryError> {
        let (mut cluster, _lease) = self.cluster(FACES.len() * most)?;
        let _kept =
            self.budget.lease((most * size_of::<Hit>()) as u64, "tetrahedra to be drawn")?;
        let (mut kept, mut tets, mut step) = (Vec::new(), 0u64, 1);
        shared_select(
            self.sessions,
            &selection,
            |tet| tet,
            |tet| {
                if tets.is_multiple_of(step) {
                    kept.push(tet);
                }
                tets += 1;
                if kept.len() > most {
                    let mut place = 0..kept.len();
                    kept.retain(|_| place.next().is_some_and(|i| i % 2 == 0));
                    step *= 2;
                }
            },
        )?;
        for tet in &kept {
            let [least, most] = tet.edges();
            let cross = Cross {
                subdomain: tet.id.subdomain().rank(),
                region: tet.region,
                quality: value(tet).unwrap_or(tet.shape.quality as f32),
                size: (0.5 * (least + most)) as f32,
                edges: [true; 3],
            };
            for face in FACES {
                cluster.push(face.map(|i| tet.corners[i]), cross);
            }
        }
        Ok(DrawnTets { patch: cluster.finish(), tets, drawn: kept.len() as u64 })
    }

    fn cluster<T: Copy>(&self, most: usize) -> Result<(Cluster<T>, Lease), QueryError> {
        let bytes = most as u64 * TRIANGLE_BYTES;
        let lease = self.budget.lease(bytes, "triangles of a picture in space")?;
        Ok((Cluster::new(&self.sessions[0].bounds(), most), lease))
    }
}

/// The chunks of a kind in a share, as rank and number.
fn chunks(session: &QuerySession, kind: usize, [number, of]: SurfaceShare) -> Vec<(u32, u32)> {
    let rows = session.rows.iter();
    let all: Vec<(u32, u32)> =
        rows.flat_map(|row| (0..row.chunks[kind]).map(|chunk| (row.rank, chunk))).collect();
    let end = |number: u32| all.len() * number as usize / of as usize;
    all[end(number)..end(number + 1)].to_vec()
}
