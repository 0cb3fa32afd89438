//! The end of a sheet inside a volume, while a vertex on its segment is removed.
//!
//! ```text
//!        p1--p2             The facet's faces at X make half a turn around its segment a' b'; a vertex in the ball beyond the
//!       /  \ /  \           segment that has faces with X and both ends makes the other half: X lies on the edge a' b'
//!     a'----X----b'         of the triangle a' b' q, so the two faces are that triangle. With it the ball has two wedges, as
//!       ' . | . '           between two facets, and what holds there holds here. Afterwards the triangle is no facet.
//!           q
//! ```

use std::collections::BTreeSet;

use super::chain::PatchFailure;
use super::complex::{TetComplex, sorted};
use super::patch::RecoveryPatch;
use super::suppress::{CavitySkin, Fan};
use super::walk::{ball, swapped};
use crate::mesh::FaceRef;
use tetdb_base::geom::Point;
use tetdb_base::storage::Pages;

impl<P: Pages> RecoveryPatch<'_, P> {
    /// Adds the triangle beyond the segment to the skin, as its last facet. Errors: no vertex of the ball is joined to both ends.
    pub(super) fn continue_sheet(
        &mut self,
        skin: &mut CavitySkin,
        x: u32,
        tets: &[u32],
        fan: &Fan,
    ) -> Result<(), PatchFailure> {
        let missing = PatchFailure::Precision(
            "no vertex is joined to both ends of the segment where the sheet ends",
        );
        let (Some(&a), Some(&b)) = (fan.polygon.first(), fan.polygon.last()) else {
            return Err(missing);
        };
        let beside = |patch: &mut Self, end: u32| {
            let mut found = BTreeSet::new();
            for &t in tets {
                let tet = patch.tet(t);
                if tet.local(end).is_some() {
                    found.extend(tet.vertices());
                }
            }
            found
        };
        let (of_a, of_b) = (beside(self, a), beside(self, b));
        let both = of_a.intersection(&of_b).copied();
        let both = both.filter(|v| *v != x && !fan.polygon.contains(v));
        // The farthest around the segment from the facet leaves the widest wedges.
        let along = self.offset(x, b).normalize_or_zero();
        let across = |d: Point| (d - along * d.dot(along)).normalize_or_zero();
        let inner = &fan.polygon[1..fan.polygon.len() - 1];
        let facet: Point = inner.iter().map(|&v| self.offset(x, v)).sum();
        let turned = |v: u32| across(facet).dot(across(self.offset(x, v)));
        let q = both.min_by(|&v, &w| turned(v).total_cmp(&turned(w)).then(v.cmp(&w)));
        let q = match q {
            Some(q) => q,
            None => self.vertex_between(tets, a, b).ok_or(missing)?,
        };
        let facet = skin.facets.len();
        skin.facets.push([a, b, q]);
        for face in [[a, x, q], [x, b, q]] {
            skin.faces.insert(sorted(face), (facet, face));
        }
        let tets = ball(self, x);
        self.require_known(skin, &tets);
        Ok(())
    }

    /// A new vertex joined to `a` and `b`: in a face of `x` that has `a` on one side and `b` on the other.
    fn vertex_between(&mut self, tets: &[u32], a: u32, b: u32) -> Option<u32> {
        for &t in tets {
            let tet = self.tet(t);
            let Some(i) = tet.local(a).filter(|&i| !tet.is_required(i)) else {
                continue;
            };
            let across = self.across(t, i).tet();
            let other = self.tet(across);
            if other.local(b).is_none() {
                continue;
            }
            let face = tet.face(i);
            // The middle of the face; should rounding put it outside, a place nearer to one of its corners.
            for toward in [None, Some(0), Some(1), Some(2)] {
                let mut place = face.iter().map(|&v| self.position(v)).sum::<Point>() / 3.0;
                if let Some(k) = toward {
                    place = place.midpoint(self.position(face[k]));
                }
                let y = self.add_vertex(place, None);
                let quads: Vec<[u32; 4]> = (face.iter())
                    .flat_map(|&v| [(&tet, v), (&other, v)])
                    .filter_map(|(tet, v)| Some(swapped(tet, tet.local(v)?, y)))
                    .collect();
                if quads.iter().all(|&q| self.orient(q) > 0.0) {
                    self.replace(&[t, across], &quads);
                    return Some(y);
                }
                self.drop_vertex(y);
            }
        }
        None
    }

    /// Takes the facets from number `first` on out of the skin: they are faces like others again.
    pub(super) fn end_sheet(&mut self, skin: &mut CavitySkin, first: usize) {
        let gone: Vec<[u32; 3]> = (skin.faces.iter())
            .filter(|(_, (facet, _))| *facet >= first)
            .map(|(_, (_, face))| *face)
            .collect();
        skin.facets.truncate(first);
        for face in gone {
            skin.faces.remove(&sorted(face));
            for t in ball(self, face[0]) {
                let tet = self.tet(t);
                for i in (0..4).filter(|&i| sorted(tet.face(i)) == sorted(face)) {
                    self.release(FaceRef::new(t, i));
                }
            }
        }
    }
}
