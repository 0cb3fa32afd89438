//! The piece of the pattern that has room in one grain.

use tetdb_schema::page::NONE;

use super::super::field::Field;
use super::super::grain::{Around, Grain, PERIOD, Site, octave, width};
use super::super::pattern;
use super::super::tile::{CELLS, Tile};
use super::claims::{Claim, octave_and_corner};
use super::tets::{Beside, PatternTet, PatternTets, wrapped};
use tetdb_base::geom::Point;

/// Nothing that was there before is nearer to a piece than this, in units of h.
const CLEAR: f64 = 0.82;
/// Places keep this distance, in units of h, from the limits of their grain, so that those of two grains are far enough apart.
const MARGIN: f64 = 0.36;
/// Greatest difference of a grain's size from the wanted one within a piece.
const MISMATCH: f64 = 0.15;
/// Cells from a grain's middle that are looked at.
const RADIUS_MAX: f64 = 51.0;
/// Cells between those of a piece and the limits of what is looked at: no tetrahedron of the pattern, nor one beside it, reaches farther.
const BESIDE: i32 = 5;
/// A piece with fewer vertices inside is not worth it.
pub(super) const INNER_MIN: usize = 1024;
/// Nor has one with fewer places so many inside.
const PLACES_MIN: usize = 4 * INNER_MIN;

/// Why the corners of a tetrahedron of a piece are known.
pub(super) const OPEN: &str = "all corners of a piece are in open cells";

/// What a cell of the pattern is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Cell {
    Unknown,
    /// Something is near.
    Blocked,
    /// Beyond the limits of the grain or of where points may go.
    Beyond,
    /// Blocked, beside an open one.
    Rim,
    Open,
}

/// What becomes of a place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Use {
    /// It stays empty.
    None,
    /// All its tetrahedra are those of the pattern.
    Inner,
    /// Some of its tetrahedra are.
    Outer,
}

/// A place of the pattern.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub point: Point,
    pub h: f32,
    /// Whether a vertex may be there.
    pub fits: bool,
    /// Number of its cell here, and its number in the pattern.
    cell: u32,
    pub(super) number: u32,
}

/// A face of a piece.
#[derive(Clone, Copy)]
pub(super) struct OuterFace {
    /// The tetrahedron of the piece, and which face of it.
    pub tet: u32,
    pub face: usize,
}

/// The places and tetrahedra that a grain has room for.
pub(super) struct Piece {
    tile: &'static Tile,
    around: Around,
    octave: u32,
    width: f64,
    corner: Point,
    grain: Grain,
    /// The pattern's cell that is the first here.
    origin: [i32; 3],
    /// Cells along an axis.
    side: i32,
    cells: Vec<Cell>,
    /// Of each open cell its first place.
    first: Vec<u32>,
    pub places: Vec<Place>,
    /// What is asked of places out of order, in arrays of its own, which the caches hold: what becomes of each, whether it may be one of the
    /// piece, and the number of its first tetrahedron.
    pub used: Vec<Use>,
    pub allowed: Vec<bool>,
    pub(super) tets: Vec<u32>,
    /// Of each tetrahedron of a place that may be used: which connected part it belongs to; [`NONE`] when not used.
    pub(super) parts: Vec<u32>,
    /// The place it belongs to.
    pub(super) owners: Vec<u32>,
    /// Of each part its outer faces.
    pub(super) outer: Vec<Vec<OuterFace>>,
}

impl Piece {
    /// The piece for which these claims leave room; all are of one grain. None where there is none.
    pub fn of(claims: &[Claim], field: &Field) -> Option<Self> {
        if claims[0].tet == NONE {
            // Those with room come first.
            return None;
        }
        let (octave, corner) = octave_and_corner(claims[0].grain);
        let width = width(octave);
        let mut site = Site::new(corner, octave);
        let grain = *site.grain(field, width);
        let cell = PERIOD / CELLS as f64 * grain.h;
        let radius = width / cell;
        if radius.is_nan() || radius > RADIUS_MAX {
            // The size in its middle is far from the others.
            return None;
        }
        let mut rooms = claims.iter().take_while(|claim| claim.tet != NONE);
        if !rooms.any(|room| is_like(&grain, octave, (field.h)(room.point()))) {
            return None;
        }
        let radius = radius.ceil() as i32 + BESIDE;
        let side = 2 * radius + 1;
        let middle = cell_at(grain.local(field.bounds.low + site.at * width));
        let n_cells = (side * side * side) as usize;
        let mut piece = Self {
            tile: Tile::get(),
            around: Around::new(),
            octave,
            width,
            corner,
            grain,
            origin: middle.map(|c| c - radius),
            side,
            cells: vec![Cell::Unknown; n_cells],
            first: Vec::new(),
            places: Vec::new(),
            used: Vec::new(),
            allowed: Vec::new(),
            tets: Vec::new(),
            parts: Vec::new(),
            owners: Vec::new(),
            outer: Vec::new(),
        };
        piece.block(claims);
        if piece.flood(claims, field) < INNER_MIN {
            return None;
        }
        if piece.list_places(field) < PLACES_MIN {
            return None;
        }
        piece.number_tets();
        piece.choose();
        piece.parts.iter().any(|&part| part != NONE).then_some(piece)
    }

    /// The cell here with the pattern's cell `c`, if it is well inside.
    fn index(&self, c: [i32; 3], beside: i32) -> Option<usize> {
        let at: [i32; 3] = std::array::from_fn(|k| c[k] - self.origin[k]);
        let inside = at.iter().all(|&x| (beside..self.side - beside).contains(&x));
        inside.then(|| ((at[2] * self.side + at[1]) * self.side + at[0]) as usize)
    }

    /// The pattern's cell that is `cell` here.
    fn coordinates(&self, cell: u32) -> [i32; 3] {
        let (cell, side) = (cell as i32, self.side);
        let at = [cell % side, cell / side % side, cell / (side * side)];
        std::array::from_fn(|k| at[k] + self.origin[k])
    }

    /// Blocks the cells that are near to something.
    fn block(&mut self, claims: &[Claim]) {
        let reach = CLEAR * CELLS as f64 / PERIOD;
        let steps = reach.ceil() as i32;
        for claim in claims.iter().filter(|claim| claim.tet == NONE) {
            let at = self.grain.local(claim.point()) * CELLS as f64;
            let home = at.floor();
            let [x, y, z] = home.to_array().map(|c| c as i32);
            for dz in -steps..=steps {
                for dy in -steps..=steps {
                    for dx in -steps..=steps {
                        let low = home + Point::new(dx.into(), dy.into(), dz.into());
                        let nearest = at.clamp(low, low + Point::ONE);
                        if (nearest - at).length_squared() < reach * reach
                            && let Some(cell) = self.index([x + dx, y + dy, z + dz], 0)
                        {
                            self.cells[cell] = Cell::Blocked;
                        }
                    }
                }
            }
        }
    }

    /// Opens the cells that can be reached from where there is room.
    fn flood(&mut self, claims: &[Claim], field: &Field) -> usize {
        let mut stack: Vec<[i32; 3]> = Vec::new();
        let mut n_open = 0;
        for claim in claims.iter().filter(|claim| claim.tet != NONE) {
            stack.push(cell_at(self.grain.local(claim.point())));
            while let Some(c) = stack.pop() {
                let Some(cell) = self.index(c, BESIDE) else {
                    continue;
                };
                if self.cells[cell] != Cell::Unknown {
                    continue;
                }
                let middle = Point::from_array(c.map(|c| (f64::from(c) + 0.5) / CELLS as f64));
                let middle = self.grain.position(middle);
                let h = (field.h)(middle);
                let inside = is_like(&self.grain, self.octave, h)
                    && self.depth(field, middle) > 0.0
                    && field.place.admits(middle, h);
                if !inside {
                    self.cells[cell] = Cell::Beyond;
                    continue;
                }
                self.cells[cell] = Cell::Open;
                n_open += 1;
                self.mark_rim(cell);
                for k in 0..3 {
                    for step in [-1, 1] {
                        let mut next = c;
                        next[k] += step;
                        stack.push(next);
                    }
                }
            }
        }
        n_open
    }

    /// Tells the blocked cells around an open one.
    fn mark_rim(&mut self, cell: usize) {
        for dz in -1..=1 {
            for dy in -1..=1 {
                for dx in -1..=1 {
                    let near = cell as i32 + (dz * self.side + dy) * self.side + dx;
                    let near = &mut self.cells[near as usize];
                    if *near == Cell::Blocked {
                        *near = Cell::Rim;
                    }
                }
            }
        }
    }

    /// How far a point is from the limits of the grain; negative outside.
    fn depth(&mut self, field: &Field, p: Point) -> f64 {
        let at = (p - field.bounds.low) / self.width;
        let sites = self.around.sites(at, self.octave);
        let Some(own) = sites.iter().find(|site| site.corner == self.corner) else {
            return f64::NEG_INFINITY;
        };
        let (own, squared) = (own.at, (own.at - at).length_squared());
        let depths = sites.iter().filter(|site| site.at != own).map(|site| {
            ((site.at - at).length_squared() - squared) / (2.0 * (site.at - own).length())
        });
        depths.fold(f64::INFINITY, f64::min) * self.width
    }

    /// Lists the places of open cells and beside them; returns how many may be part of a piece.
    fn list_places(&mut self, field: &Field) -> usize {
        let mut n_allowed = 0;
        self.first = vec![NONE; self.cells.len()];
        for cell in 0..self.cells.len() {
            let open = self.cells[cell] == Cell::Open;
            if !open && self.cells[cell] != Cell::Rim {
                continue;
            }
            self.first[cell] = self.places.len() as u32;
            let c = self.coordinates(cell as u32);
            let period = c.map(|c| f64::from(c.div_euclid(CELLS as i32)));
            let at = c.map(|c| c.rem_euclid(CELLS as i32) as usize);
            for &q in self.tile.points_of(at) {
                let point = self.grain.position(Point::from_array(period) + q);
                let depth = self.depth(field, point);
                let h = (field.h)(point);
                let fits = depth > 0.0
                    && is_like(&self.grain, self.octave, h)
                    && field.place.admits(point, h)
                    && !field.place.forbids(point, h);
                let allowed = fits
                    && open
                    && (self.grain.h - h).abs() <= MISMATCH * h
                    && depth >= MARGIN * self.grain.h;
                self.places.push(Place { point, h: h as f32, fits, cell: cell as u32, number: 0 });
                self.allowed.push(allowed);
                n_allowed += usize::from(allowed);
            }
        }
        n_allowed
    }

    /// Numbers the tetrahedra of all places.
    fn number_tets(&mut self) {
        let tets = PatternTets::get();
        let mut at = 0;
        while at < self.places.len() {
            let cell = self.places[at].cell;
            let (number, n) = tets.points_of(wrapped(self.coordinates(cell)));
            for number in number..number + n {
                self.places[at].number = number;
                self.tets.push(self.owners.len() as u32);
                self.owners.extend(tets.owned(number).iter().map(|_| at as u32));
                at += 1;
            }
        }
    }

    /// The place that is `beside` a place, if its cell is open.
    fn beside(&self, place: &Place, beside: Beside) -> Option<u32> {
        let [x, y, z] = beside.cell.map(i32::from);
        let cell = place.cell as i32 + (z * self.side + y) * self.side + x;
        let first = self.first[cell as usize];
        (first != NONE).then_some(first + u32::from(beside.rank))
    }

    /// Tetrahedron `t` of the piece as the pattern has it, and the place it belongs to.
    pub fn tet(&self, t: u32) -> (&'static PatternTet, &Place) {
        let owner = self.owners[t as usize] as usize;
        let (place, number) = (&self.places[owner], (t - self.tets[owner]) as usize);
        (&PatternTets::get().owned(place.number)[number], place)
    }

    /// The places at the corners of tetrahedron `t`, if all are in open cells.
    pub fn corners(&self, t: u32) -> Option<[u32; 4]> {
        let (tet, place) = self.tet(t);
        self.corners_of(tet, place)
    }

    /// The same of a tetrahedron at hand.
    #[inline(always)]
    pub fn corners_of(&self, tet: &PatternTet, place: &Place) -> Option<[u32; 4]> {
        let [a, b, c, d] = &tet.corners;
        let [a, b, c, d] = [
            self.beside(place, *a),
            self.beside(place, *b),
            self.beside(place, *c),
            self.beside(place, *d),
        ];
        Some([a?, b?, c?, d?])
    }

    /// The tetrahedron beyond face `i` of the one at hand, and its face, if it is one of the piece.
    #[inline(always)]
    pub fn across_of(&self, tet: &PatternTet, place: &Place, i: usize) -> Option<OuterFace> {
        let (owner, k, face) = tet.across[i];
        let owner = self.beside(place, owner)?;
        let tet = self.tets[owner as usize] + u32::from(k);
        (self.parts[tet as usize] != NONE).then_some(OuterFace { tet, face: usize::from(face) })
    }

    /// How many tetrahedra are numbered, those that are not used among them.
    pub fn n_tets(&self) -> usize {
        self.parts.len()
    }

    /// Edge length wanted in the grain.
    pub fn h(&self) -> f64 {
        self.grain.h
    }
}

/// Whether points where `h` is wanted may move to places of the grain: it is one of their octave, with a size like theirs.
fn is_like(grain: &Grain, of: u32, h: f64) -> bool {
    octave(h) == of && (grain.h - h).abs() <= pattern::MISMATCH * h
}

/// The pattern's cell at a position in units of its side.
fn cell_at(local: Point) -> [i32; 3] {
    (local * CELLS as f64).floor().to_array().map(|c| c as i32)
}
