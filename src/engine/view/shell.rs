//! Surfaces of a mesh as flat pieces for a distant viewer: its boundary, the shell of one sub-domain, the interface of a cut.

use std::path::Path;

use super::section::{Piece, Pieces, Section, View};
use crate::pipeline::stage_faces;
use tetdb_base::geom::Point;
use tetdb_base::storage::check_cancelled;
use tetdb_schema::record::{FACES, NO_TET};
use tetdb_store::query::{QueryError, QuerySession, Selection, Solid};

/// The faces to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShellView {
    /// Input triangles with a tetrahedron.
    Boundary,
    /// All faces around a sub-domain: input triangles and interfaces.
    Subdomain(u32),
    /// The natural interface of a cut, if stages were kept: each tetrahedron is on the side of its center.
    Natural(u32),
    /// The chosen interface of a cut, if stages were kept.
    Chosen(u32),
}

/// A half space that is left out, as a point and the direction into it. Tetrahedra that its plane cuts are shown whole.
pub type Clip = [Point; 2];

/// Returns the faces that the viewer sees from either side, far ones first. Holds about `memory_bytes` and writes sort runs in
/// `dir`. For faces seen from behind, `facing` is negative.
///
/// Errors: no such sub-domain or stage; damage; the disk.
pub fn shell(
    session: &mut QuerySession,
    view: &View,
    shell: ShellView,
    clip: Option<Clip>,
    dir: &Path,
    memory_bytes: u64,
) -> Result<Section, QueryError> {
    let mut all = Shown { view, clip, pieces: Pieces::new(dir, memory_bytes) };
    match shell {
        ShellView::Boundary => {
            for place in 0..session.rows.len() {
                let rank = session.rows[place].rank;
                triangles(session, rank, &mut all)?;
            }
            cut_tets(session, None, &mut all)?;
        }
        ShellView::Subdomain(rank) => {
            triangles(session, rank, &mut all)?;
            walls(session, rank, &mut all)?;
            cut_tets(session, Some(rank), &mut all)?;
        }
        ShellView::Natural(cut) | ShellView::Chosen(cut) => {
            let Some(faces) = stage_faces(&mut session.store, cut)? else {
                let kept = session.store.stages()?;
                let kept = kept.iter().map(|s| s.cut).collect();
                return Err(QueryError::NoStage { cut, kept });
            };
            let list = match shell {
                ShellView::Natural(_) => faces.natural,
                _ => faces.chosen,
            };
            for face in list {
                all.push(face, cut, 0, None)?;
            }
        }
    }
    all.pieces.finish()
}

/// Returns the normal of a cut's plane, if stages were kept.
///
/// Errors: [`QueryError::NoStage`]; a damaged catalog.
pub fn normal_of(session: &mut QuerySession, cut: u32) -> Result<Point, QueryError> {
    let stages = session.store.stages()?;
    match stages.iter().find(|s| s.cut == cut) {
        Some(stage) => Ok(Point::from_array(stage.normal)),
        None => {
            let kept = stages.iter().map(|s| s.cut).collect();
            Err(QueryError::NoStage { cut, kept })
        }
    }
}

/// Calls `each` with the corners, the region and the label of the input triangles of a chunk of faces that have a tetrahedron on a side;
/// normals point away from it.
pub(super) fn for_each_triangle(
    session: &mut QuerySession,
    (rank, chunk): (u32, u32),
    mut each: impl FnMut([Point; 3], u32, u32) -> Result<(), QueryError>,
) -> Result<(), QueryError> {
    check_cancelled();
    session.count_faces();
    let fin_first = session.wires.fin_first;
    let part = &mut session.part(rank)?.subdomain;
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
        each(corners, facet.regions[side], facet.label)?;
    }
    Ok(())
}

fn triangles(session: &mut QuerySession, rank: u32, all: &mut Shown) -> Result<(), QueryError> {
    for chunk in 0..session.part(rank)?.subdomain.row().chunks[2] {
        for_each_triangle(session, (rank, chunk), |corners, region, label| {
            all.push(corners, rank, region, Some(label))
        })?;
    }
    Ok(())
}

/// Adds the tetrahedra that the plane of a clip cuts, whole.
fn cut_tets(
    session: &mut QuerySession,
    rank: Option<u32>,
    all: &mut Shown,
) -> Result<(), QueryError> {
    let Some([point, normal]) = all.clip else {
        return Ok(());
    };
    let selection = Selection {
        solids: vec![Solid::Plane { point, normal }],
        subdomains: rank.map(|rank| vec![rank]),
        ..Selection::default()
    };
    for tet in session.select(selection)? {
        let tet = tet?;
        for face in FACES {
            let corners = face.map(|i| tet.corners[i]);
            let [a, b, c] = corners;
            // Faces that point away from the viewer lie behind the others of their tetrahedron.
            if all.view.facing((b - a).cross(c - a)) > 0.0 {
                all.show(corners, tet.id.subdomain().rank(), tet.region, None)?;
            }
        }
    }
    Ok(())
}

fn walls(session: &mut QuerySession, rank: u32, all: &mut Shown) -> Result<(), QueryError> {
    for chunk in 0..session.part(rank)?.subdomain.row().chunks[3] {
        check_cancelled();
        session.count_faces();
        let part = &mut session.part(rank)?.subdomain;
        for face in part.interface_chunk(chunk)?.records {
            let corners = part.corners(face.vertices)?.map(|c| c.point);
            // Walls have the color of the sub-domain on their other side.
            all.push(corners, face.other, 0, None)?;
        }
    }
    Ok(())
}

/// Faces collected for the viewer.
struct Shown<'a> {
    view: &'a View,
    clip: Option<Clip>,
    pieces: Pieces,
}

impl Shown<'_> {
    /// Adds a face, unless its centroid is clipped.
    fn push(
        &mut self,
        corners: [Point; 3],
        subdomain: u32,
        region: u32,
        label: Option<u32>,
    ) -> Result<(), QueryError> {
        let [a, b, c] = corners;
        let middle = (a + b + c) / 3.0;
        match self.clip {
            Some([point, beyond]) if (middle - point).dot(beyond) > 0.0 => Ok(()),
            _ => self.show(corners, subdomain, region, label),
        }
    }

    fn show(
        &mut self,
        corners: [Point; 3],
        subdomain: u32,
        region: u32,
        label: Option<u32>,
    ) -> Result<(), QueryError> {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let [p, q, r] = corners.map(|p| self.view.flat(p));
        let [x, y, z] = corners.map(|p| self.view.height(p));
        let size = (a.distance(b) + b.distance(c) + c.distance(a)) / 3.0;
        let piece = Piece {
            corners: [p, q, r, [0.0; 2]],
            n: 3,
            heights: [x, y, z, 0.0],
            facing: self.view.facing(normal) as f32,
            subdomain,
            region,
            label,
            quality: 1.0,
            size: size as f32,
        };
        self.pieces.push((x + y + z) / 3.0, &piece)
    }
}
