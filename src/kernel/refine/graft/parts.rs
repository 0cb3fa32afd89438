//! Which tetrahedra of the pattern make up a piece, and its connected parts.

use tetdb_schema::page::NONE;

use super::piece::{INNER_MIN, OPEN, OuterFace, Piece, Place, Use};
use super::tets::{PatternTet, PatternTets};

/// In place of a part's number: it has none yet.
const CHOSEN: u32 = NONE - 1;

impl Piece {
    /// Chooses tetrahedra and what becomes of each place, from the places that are allowed.
    pub fn choose(&mut self) {
        self.parts.clear();
        self.parts.resize(self.owners.len(), NONE);
        let tets = PatternTets::get();
        let mut stars = vec![0u8; self.places.len()];
        for (place, _) in self.allowed.iter().enumerate().filter(|(_, a)| **a) {
            for (t, tet) in self.tets_of(place) {
                if let Some(corners) = self.corners_of(tet, &self.places[place])
                    && corners.iter().all(|&p| self.allowed[p as usize])
                {
                    corners.iter().for_each(|&p| stars[p as usize] += 1);
                    self.parts[t] = CHOSEN;
                }
            }
        }
        self.used.clear();
        for ((place, &allowed), star) in self.places.iter().zip(&self.allowed).zip(stars) {
            let whole = allowed && star == tets.star(place.number);
            self.used.push(if whole { Use::Inner } else { Use::None });
        }
        // Those around inner places are all of the piece; the others save nothing.
        for place in 0..self.places.len() {
            for (t, tet) in self.tets_of(place) {
                if self.parts[t] == CHOSEN && !self.has_inner(tet, &self.places[place]) {
                    self.parts[t] = NONE;
                }
            }
        }
        self.split();
        for place in 0..self.places.len() {
            for (t, tet) in self.tets_of(place) {
                if self.parts[t] != NONE {
                    for p in self.corners_of(tet, &self.places[place]).expect(OPEN) {
                        let used = &mut self.used[p as usize];
                        if *used == Use::None {
                            *used = Use::Outer;
                        }
                    }
                }
            }
        }
    }

    /// The tetrahedra of a place, each with its number.
    fn tets_of(&self, place: usize) -> impl Iterator<Item = (usize, &'static PatternTet)> + use<> {
        let owned = PatternTets::get().owned(self.places[place].number);
        (self.tets[place] as usize..).zip(owned)
    }

    /// Whether a tetrahedron, all of whose corners are in open cells, has an inner one.
    fn has_inner(&self, tet: &PatternTet, place: &Place) -> bool {
        let corners = self.corners_of(tet, place).expect(OPEN);
        corners.iter().any(|&p| self.used[p as usize] == Use::Inner)
    }

    /// Numbers connected parts, and gives up the small ones.
    fn split(&mut self) {
        self.outer.clear();
        let mut n_parts = 0;
        let (mut part, mut outer) = (Vec::new(), Vec::new());
        for seed in 0..self.parts.len() as u32 {
            if self.parts[seed as usize] != CHOSEN {
                continue;
            }
            part.clear();
            outer.clear();
            part.push(seed);
            self.parts[seed as usize] = n_parts;
            let mut next = 0;
            while next < part.len() {
                let t = part[next];
                next += 1;
                let (tet, place) = self.tet(t);
                let across: [_; 4] = std::array::from_fn(|i| self.across_of(tet, place, i));
                for (i, beyond) in across.into_iter().enumerate() {
                    let Some(face) = beyond else {
                        outer.push(OuterFace { tet: t, face: i });
                        continue;
                    };
                    if self.parts[face.tet as usize] == CHOSEN {
                        self.parts[face.tet as usize] = n_parts;
                        part.push(face.tet);
                    }
                }
            }
            // A place owns six tetrahedra in the mean.
            let owner = |t: u32| self.owners[t as usize] as usize;
            let inner = part.iter().filter(|&&t| self.used[owner(t)] == Use::Inner);
            if inner.count() >= 6 * INNER_MIN {
                n_parts += 1;
                self.outer.push(outer.clone());
                continue;
            }
            for &t in &part {
                self.parts[t as usize] = NONE;
                for p in self.corners(t).expect(OPEN) {
                    self.used[p as usize] = Use::None;
                }
            }
        }
    }

    /// The tetrahedra of each part.
    pub fn tets_by_part(&self) -> Vec<Vec<u32>> {
        let n_parts = self.parts.iter().filter(|&&part| part != NONE).max();
        let mut tets = vec![Vec::new(); n_parts.map_or(0, |&last| last as usize + 1)];
        for (t, &part) in (0..).zip(&self.parts) {
            if part != NONE {
                tets[part as usize].push(t);
            }
        }
        tets
    }

    /// The outer faces of each part.
    pub fn outer_by_part(&self) -> &[Vec<OuterFace>] {
        &self.outer
    }
}
