//! Whether tetrahedra overlap or meet elsewhere than in shared corners, edges and faces, by the boundary of the mesh alone.
//!
//! All are positive, so a point is in as many of them as the boundary winds around it. If the boundary touches itself in shared corners
//! and edges alone, and each volume beside it is either behind all its triangles or in front of all, that is one or none. So this also
//! finds a third tetrahedron at a face whose first two were matched before.

use super::BadMesh;
use super::faces::CONFORM_HELP;
use super::place::Placed;
use crate::pipeline::error::PipelineError;
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::{
    Contact, EnclosedVolumes, OUTSIDE, PAIRS_MAX, Seeker, Surface, VOLUMES_TRIANGLE,
    pairs_that_touch, show,
};
use tetdb_schema::page::NONE;

const OVERLAP_HELP: &str =
    "remove the tetrahedra that fill space a second time, or mesh the part again";

/// A volume lies in front of a triangle, or behind one.
const IN_FRONT: u8 = 1;
const BEHIND: u8 = 2;

/// Checks the boundary of a mesh whose faces are matched. Errors: the first tetrahedra that overlap or do not conform.
pub fn check(placed: &mut Placed, space: &ScratchSpace) -> Result<(), PipelineError> {
    let (mut triangles, mut tets) = (Vec::new(), Vec::new());
    for k in 0..placed.kept.len() {
        let [.., behind, front, triangle] = placed.kept.get(k);
        if front == NONE {
            triangles.push(placed.surface.triangles[triangle as usize]);
            tets.push(behind);
        }
    }
    let _held = space.lease((VOLUMES_TRIANGLE + 20) * tets.len());
    let points = std::mem::take(&mut placed.surface.points);
    let labels = vec![0; triangles.len()];
    let boundary = Surface { points, triangles, labels, ..Surface::default() };
    let checked = match pairs_that_touch(&boundary, space) {
        Some(pairs) if pairs.is_empty() => volumes(&boundary, &tets, space),
        pairs => Err(touching(pairs, &tets)),
    };
    placed.surface.points = boundary.points;
    Ok(checked?)
}

fn touching(pairs: Option<Vec<([u32; 2], Contact)>>, tets: &[u32]) -> BadMesh {
    let first = pairs.iter().flatten().map(|(_, contact)| contact.kind).next();
    let how = first.map_or(String::new(), |kind| format!(": {kind}"));
    let what = format!("two faces of the boundary meet, and not in shared corners or edges{how}");
    let mut bad = BadMesh::new(what, CONFORM_HELP);
    match pairs {
        None => bad.n = PAIRS_MAX,
        Some(pairs) => pairs.into_iter().for_each(|(pair, contact)| {
            let [a, b] = pair.map(|t| tets[t as usize] + 1);
            let (a, b) = (a.min(b), a.max(b));
            bad.add_place(|| format!("tetrahedra {a} and {b} at {}", show(contact.at)));
        }),
    }
    bad
}

fn volumes(boundary: &Surface, tets: &[u32], space: &ScratchSpace) -> Result<(), BadMesh> {
    let seeker = Seeker::with_filter(boundary, space, |_| true);
    let volumes = EnclosedVolumes::new_in(&seeker, space);
    let mut seen = vec![0; volumes.n_volumes as usize];
    seen[OUTSIDE as usize] = IN_FRONT;
    for [front, behind] in &volumes.of_side {
        seen[*front as usize] |= IN_FRONT;
        seen[*behind as usize] |= BEHIND;
    }
    let mut bad = BadMesh::new("tetrahedra overlap", OVERLAP_HELP);
    for (t, sides) in (0..).zip(&volumes.of_side) {
        if sides.iter().any(|&volume| seen[volume as usize] == IN_FRONT | BEHIND) {
            bad.add("tetrahedron", tets[t as usize].into(), &boundary.corners(t));
        }
    }
    if bad.n == 0 { Ok(()) } else { Err(bad) }
}
