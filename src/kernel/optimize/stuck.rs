//! Moves of vertices and removals of edges that were tried in vain since anything changed around them.
//!
//! A vertex or an edge has several bad tetrahedra around it, and what moving or removing it brings does not depend on the one that asks. Without
//! this the same search is repeated for each of them: half of the time of rounds where a third of all tetrahedra stay bad.

use crate::mesh::anatomy::EDGES;
use crate::mesh::{Mesh, Tet};
use tetdb_base::geom::mix;
use tetdb_base::storage::Pages;

/// Places of each table: of two at the same place the later is remembered.
const PLACES: usize = 1 << 15;

/// Two tables, of vertices and of edges, each at the place its ids say.
pub(super) struct Stuck {
    vertices: Vec<u32>,
    /// Both ends, and what a removal had to be worth.
    edges: Vec<(u64, f64)>,
}

const NO_VERTEX: u32 = u32::MAX;
const NO_EDGE: (u64, f64) = (u64::MAX, 0.0);

impl Default for Stuck {
    fn default() -> Self {
        Self { vertices: vec![NO_VERTEX; PLACES], edges: vec![NO_EDGE; PLACES] }
    }
}

impl Stuck {
    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.vertices.fill(NO_VERTEX);
        self.edges.fill(NO_EDGE);
    }

    /// Whether `v` was tried in vain.
    #[inline]
    pub(super) fn has_vertex(&self, v: u32) -> bool {
        self.vertices[v as usize % PLACES] == v
    }

    /// Remembers that moving `v` brings nothing.
    #[inline]
    pub(super) fn add_vertex(&mut self, v: u32) {
        self.vertices[v as usize % PLACES] = v;
    }

    /// Whether edge `e` of a tetrahedron was tried in vain for something worth `least` or less.
    #[inline]
    pub(super) fn has_edge(&self, tet: &Tet, e: usize, least: f64) -> bool {
        let (edge, place) = edge_of(tet, e);
        let (known, bar) = self.edges[place];
        known == edge && bar <= least
    }

    /// Remembers that removing edge `e` of a tetrahedron is not worth `least`.
    #[inline]
    pub(super) fn add_edge(&mut self, tet: &Tet, e: usize, least: f64) {
        let (edge, place) = edge_of(tet, e);
        self.edges[place] = (edge, least);
    }

    /// Forgets the vertices and edges of tetrahedra that are new or moved: all around which something changed are among them.
    pub(super) fn forget<P: Pages>(&mut self, mesh: &mut Mesh<P>, changed: &[u32]) {
        for &t in changed {
            let tet = mesh.tet(t);
            for v in tet.vertices() {
                let known = &mut self.vertices[v as usize % PLACES];
                if *known == v {
                    *known = NO_VERTEX;
                }
            }
            for e in 0..6 {
                let (edge, place) = edge_of(&tet, e);
                if self.edges[place].0 == edge {
                    self.edges[place] = NO_EDGE;
                }
            }
        }
    }
}

/// An edge's name and place.
#[inline]
fn edge_of(tet: &Tet, e: usize) -> (u64, usize) {
    let [a, b] = EDGES[e].map(|i| tet.vertex(i));
    let edge = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
    (edge, mix(edge) as usize % PLACES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::tests::{delaunay, live, random};
    use tetdb_base::geom::Point;
    use tetdb_base::storage::FlatPages;

    #[test]
    fn what_changed_is_tried_again_and_nothing_else_is() {
        let mut next = random(7);
        let points: Vec<Point> = (0..40).map(|_| Point::new(next(), next(), next())).collect();
        let mut mesh = delaunay(Mesh::new(FlatPages::default()), &points, points.len(), 1.0);
        let tets = live(&mut mesh);
        let mut stuck = Stuck::default();
        for (_, tet) in &tets {
            tet.vertices().into_iter().for_each(|v| stuck.add_vertex(v));
            (0..6).for_each(|e| stuck.add_edge(tet, e, 0.2));
        }
        let (t, changed) = tets[tets.len() / 2];
        let is_far = |tet: &Tet| tet.vertices().iter().all(|&v| changed.local(v).is_none());
        let (_, far) = *tets.iter().find(|(_, tet)| is_far(tet)).expect("one far away");
        let known = |stuck: &Stuck, tet: &Tet| {
            let vertices = tet.vertices().into_iter().filter(|&v| stuck.has_vertex(v));
            let edges = (0..6).filter(|&e| stuck.has_edge(tet, e, 0.2));
            (vertices.count(), edges.count())
        };
        assert_eq!((known(&stuck, &changed), known(&stuck, &far)), ((4, 6), (4, 6)));
        // What is not worth 0.2 may be worth 0.1.
        assert!(!stuck.has_edge(&changed, 0, 0.1) && stuck.has_edge(&changed, 0, 0.3));
        stuck.forget(&mut mesh, &[t]);
        assert_eq!((known(&stuck, &changed), known(&stuck, &far)), ((0, 0), (4, 6)));
        stuck.clear();
        assert_eq!(known(&stuck, &far), (0, 0));
    }
}
