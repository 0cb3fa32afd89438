//! A vertex on the surface is replaced by one vertex inside each volume around it.
//!
//! ```text
//!        c1--c2                      The faces of each facet at X form a fan. Without X the fan's outline is a
//!       / \  / \                     polygon in the facet's plane (for X on a segment, a' b' closes it), which has a
//!      a'--X---b'    facet 1         triangulation. The facets divide the ball of X into wedges. A point of a
//!       \ /  \ /                     wedge near X sees all outer faces of the wedge, as X does, and the polygons of
//!        d1--d2      facet 2         its two facets if it is inside their planes: an open cone at X, never empty.
//! ```
//! So in exact arithmetic there is always a place. It is taken as far from all planes as possible, rounded,
//! and accepted only if every exact sign is right. Before that, vertices that exist already are tried.
//!
//! Source: P.-L. George, H. Borouchaki and E. Saltel, "'Ultimate' robustness in meshing an arbitrary polyhedron",
//! International Journal for Numerical Methods in Engineering 58 (2003).

use std::collections::BTreeMap;

use super::chain::PatchFailure;
use super::complex::{TetComplex, sorted};
use super::flips::Flipper;
use super::free_vertex::moved;
use super::inscribed_ball::HalfSpace;
use super::patch::RecoveryPatch;
use super::polygon::triangulate;
use super::target::RecoveryTarget;
use super::walk::{self, ball, edge_at};
use crate::mesh::FaceRef;
use tetdb_base::geom::{IdMap, IdSet, Point};
use tetdb_base::storage::Pages;

/// The facets of a patch and the faces that make them up.
#[derive(Default)]
pub(super) struct CavitySkin {
    /// Three corners of each flat part: its plane.
    pub facets: Vec<[u32; 3]>,
    /// Sorted face to its part and itself in the part's direction.
    pub faces: IdMap<[u32; 3], (usize, [u32; 3])>,
}

/// The fan of one facet around the vertex.
pub(super) struct Fan {
    pub facet: usize,
    /// In the facet's direction; open at the vertex if it lies on a segment.
    pub polygon: Vec<u32>,
    pub closed: bool,
}

/// The half-space behind a triangle; `None` when doubles see no normal.
pub(super) fn half_space([a, b, c]: [Point; 3]) -> Option<HalfSpace> {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    (normal != Point::ZERO).then(|| HalfSpace { normal, offset: normal.dot(a) })
}

impl<P: Pages> RecoveryPatch<'_, P> {
    /// Removes edges of `x` that are on no facet, as far as that goes: fewer faces to be seen.
    pub(super) fn thin_out(&mut self, x: u32) {
        loop {
            let ball = ball(self, x);
            let mut link: Vec<(u32, u32)> = Vec::new();
            for &t in &ball {
                link.extend(self.tets_vertices(t).into_iter().filter(|&v| v != x).map(|v| (v, t)));
            }
            link.sort_unstable();
            link.dedup_by_key(|l| l.0);
            let mut thinner = false;
            for (v, t) in link {
                // Mostly still where it was: finding it again takes signs of exact points.
                let Some(t) = edge_at(self, t, x, v) else {
                    continue;
                };
                let mut flipper = Flipper::new(self, RecoveryTarget::Free);
                flipper.work = 1;
                thinner |= flipper.remove_edge(t, x, v, 0);
            }
            if !thinner {
                return;
            }
        }
    }

    /// Takes vertex `x` off the surface. Returns the number of vertices that replace it.
    ///
    /// If a sheet ends at `x`, a triangle on the other side of its segment replaces the missing facet.
    pub(super) fn suppress(&mut self, skin: &mut CavitySkin, x: u32) -> Result<u32, PatchFailure> {
        self.thin_out(x);
        let ball = ball(self, x);
        let fans = self.fans(skin, x, &ball)?;
        match &fans[..] {
            [] => Ok(0),
            [only] if !only.closed => {
                let n_facets = skin.facets.len();
                self.continue_sheet(skin, x, &ball, only)?;
                let ball = walk::ball(self, x);
                let fans = self.fans(skin, x, &ball)?;
                let done = self.suppress_fans(skin, x, ball, fans);
                self.end_sheet(skin, n_facets);
                done
            }
            _ => self.suppress_fans(skin, x, ball, fans),
        }
    }

    fn suppress_fans(
        &mut self,
        skin: &mut CavitySkin,
        x: u32,
        ball: Vec<u32>,
        fans: Vec<Fan>,
    ) -> Result<u32, PatchFailure> {
        if self.collapse_on_surface(skin, x, &ball, &fans) {
            return Ok(0);
        }
        let mut faces = Vec::new();
        for fan in &fans {
            faces.push(self.fill_polygon(skin.facets[fan.facet], &fan.polygon, &ball)?);
        }
        let wedges = self.wedges(skin, x, &ball, &fans)?;
        let mut old = ball.clone();
        let mut taken: IdSet<u32> = ball.iter().copied().collect();
        let mut new = Vec::new();
        let mut added = 0;
        for wedge in &wedges {
            let walls: Vec<[u32; 3]> = wedge
                .walls
                .iter()
                .flat_map(|&(fan, above)| {
                    let turn =
                        move |&[p, q, r]: &[u32; 3]| if above { [p, q, r] } else { [q, p, r] };
                    faces[fan].iter().map(turn)
                })
                .collect();
            if let Some(mut quads) = self.join_to_link(x, wedge, &walls, &fans) {
                new.append(&mut quads);
                continue;
            }
            match self.join_to_new(x, wedge, &walls, &taken) {
                Some(mut grown) => {
                    added += 1;
                    new.append(&mut grown.quads);
                    taken.extend(grown.cavity.iter().copied());
                    old.extend(&grown.cavity[wedge.tets.len()..]);
                }
                None => {
                    return Err(PatchFailure::Precision(
                        "doubles leave no place between it and its neighbors",
                    ));
                }
            }
        }
        let ids = self.replace(&old, &new);
        self.renew_skin(skin, x, &fans, &faces, &ids);
        Ok(added)
    }

    pub(super) fn tets_vertices(&mut self, t: u32) -> [u32; 4] {
        self.tet(t).vertices()
    }

    /// The fans of the facets around `x`.
    fn fans(&mut self, skin: &CavitySkin, x: u32, ball: &[u32]) -> Result<Vec<Fan>, PatchFailure> {
        let mut edges: BTreeMap<usize, BTreeMap<u32, u32>> = BTreeMap::new();
        for &t in ball {
            let tet = self.tet(t);
            for i in (0..4).filter(|&i| tet.vertex(i) != x && tet.is_required(i)) {
                let Some(&(facet, face)) = skin.faces.get(&sorted(tet.face(i))) else {
                    return Err(PatchFailure::Broken("a facet of another patch at a new vertex"));
                };
                let k = face.iter().position(|&v| v == x).expect("a face of the ball");
                edges.entry(facet).or_default().insert(face[(k + 1) % 3], face[(k + 2) % 3]);
            }
        }
        let mut fans = Vec::new();
        for (facet, next) in edges {
            let ends: IdSet<u32> = next.values().copied().collect();
            let start = next.keys().copied().find(|p| !ends.contains(p));
            let closed = start.is_none();
            let first = start.unwrap_or_else(|| *next.keys().next().expect("not empty"));
            let mut polygon = vec![first];
            let mut at = first;
            while let Some(&q) = next.get(&at) {
                if q == first || polygon.len() > next.len() {
                    break;
                }
                polygon.push(q);
                at = q;
            }
            if polygon.len() != next.len() + usize::from(!closed) {
                return Err(PatchFailure::Broken("a facet meets a vertex twice"));
            }
            fans.push(Fan { facet, polygon, closed });
        }
        Ok(fans)
    }

    /// Moves `x` along the surface onto a vertex all fans share.
    fn collapse_on_surface(
        &mut self,
        skin: &mut CavitySkin,
        x: u32,
        ball: &[u32],
        fans: &[Fan],
    ) -> bool {
        let candidates: Vec<u32> = match fans {
            [fan] => fan.polygon.clone(),
            _ => vec![fans[0].polygon[0], *fans[0].polygon.last().expect("not empty")],
        };
        let mut blocking = 0;
        for u in candidates {
            let Some(quads) = moved(self, x, u, ball, &mut blocking) else {
                continue;
            };
            let faces: Vec<Vec<[u32; 3]>> = fans
                .iter()
                .map(|fan| {
                    let n = fan.polygon.len();
                    let last = if fan.closed { n } else { n - 1 };
                    (0..last)
                        .map(|i| [u, fan.polygon[i], fan.polygon[(i + 1) % n]])
                        .filter(|f| f[1] != u && f[2] != u)
                        .collect()
                })
                .collect();
            let ids = self.replace(ball, &quads);
            self.renew_skin(skin, x, fans, &faces, &ids);
            return true;
        }
        false
    }

    /// The best triangulation of a polygon in the plane of a facet, in its direction.
    fn fill_polygon(
        &mut self,
        f: [u32; 3],
        polygon: &[u32],
        ball: &[u32],
    ) -> Result<Vec<[u32; 3]>, PatchFailure> {
        let mut off_plane = None;
        'search: for &t in ball {
            for v in self.tets_vertices(t) {
                let side = self.orient([f[0], f[1], f[2], v]);
                if side != 0.0 {
                    off_plane = Some((v, side.signum()));
                    break 'search;
                }
            }
        }
        let (w, side) = off_plane.ok_or(PatchFailure::Broken("a flat ball"))?;
        let n = polygon.len();
        let found = triangulate(
            n,
            |_, _| true,
            |i, k, j| {
                let [a, b, c] = [polygon[i], polygon[k], polygon[j]];
                let turn = self.orient([a, b, c, w]) * side;
                if turn <= 0.0 {
                    return 0.0;
                }
                let [p, q, r] = [a, b, c].map(|v| self.position(v));
                let longest =
                    p.distance_squared(q).max(q.distance_squared(r)).max(r.distance_squared(p));
                ((q - p).cross(r - p).length() / longest).max(f64::MIN_POSITIVE)
            },
        );
        let triangles = found.ok_or(PatchFailure::Broken("a fan without outline"))?;
        Ok(triangles.into_iter().map(|t| t.map(|i| polygon[i])).collect())
    }

    /// Forgets the faces at `x`, marks the new ones.
    fn renew_skin(
        &mut self,
        skin: &mut CavitySkin,
        x: u32,
        fans: &[Fan],
        faces: &[Vec<[u32; 3]>],
        ids: &[u32],
    ) {
        for fan in fans {
            let n = fan.polygon.len();
            let last = if fan.closed { n } else { n - 1 };
            for i in 0..last {
                let old = sorted([x, fan.polygon[i], fan.polygon[(i + 1) % n]]);
                skin.faces.remove(&old);
            }
        }
        for (fan, faces) in fans.iter().zip(faces) {
            for &face in faces {
                skin.faces.insert(sorted(face), (fan.facet, face));
            }
        }
        self.require_known(skin, ids);
    }

    /// Marks the faces of `tets` that are in the skin.
    pub(super) fn require_known(&mut self, skin: &CavitySkin, tets: &[u32]) {
        for &t in tets {
            let tet = self.tet(t);
            for i in 0..4 {
                if !tet.is_required(i) && skin.faces.contains_key(&sorted(tet.face(i))) {
                    self.require(FaceRef::new(t, i));
                }
            }
        }
    }
}
