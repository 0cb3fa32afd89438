//! Positions for new vertices: grains of a periodic arrangement of points that is already relaxed.
//!
//! Points that divide edges stand anywhere; smoothing takes many sweeps to spread them evenly. So each moves to the nearest place of
//! a pattern before it is tried: points at distances of one wanted length that repeat in all directions, with no tetrahedron of
//! q ≥ 2 between them (`pattern.bin`, from `tools/pattern.py`). They are a glass, not a lattice: a lattice is as good, and its
//! directions can be seen. Space is divided into grains, each with the pattern turned and shifted at random and with one size, so
//! that nothing repeats and sizes may vary. A place depends on position and size alone: zones and sub-domains agree about it.

use super::field::Field;
use super::grain::{Around, octave, width};
use super::tile::Tile;
use tetdb_base::geom::Point;

/// Greatest difference of a grain's size from the wanted one. With 0.3 graded meshes have up to 4 % fewer tetrahedra.
pub(super) const MISMATCH: f64 = 0.18;

/// Finds places of the pattern, and remembers the grains around the last points.
pub(super) struct Pattern {
    tile: &'static Tile,
    /// By the last bit of the octave: where sizes vary, points of two octaves take turns.
    around: [Around; 2],
}

impl Pattern {
    pub fn new() -> Self {
        Self { tile: Tile::get(), around: [Around::new(), Around::new()] }
    }

    /// The place nearest to `p`, where `h` is wanted; none where the grain's size is another.
    pub fn nearest(&mut self, field: &Field, p: Point, h: f64) -> Option<Point> {
        // Grains follow the size in steps of two.
        let octave = octave(h);
        let width = width(octave);
        let at = (p - field.bounds.low) / width;
        let around = &mut self.around[octave as usize & 1];
        let grain = around.nearest(at, octave).grain(field, width);
        if (grain.h - h).abs() > MISMATCH * h {
            return None;
        }
        Some(grain.position(self.tile.nearest(grain.local(p))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::grain::random;
    use crate::refine::{Everywhere, Lengths};

    #[test]
    fn places_depend_on_position_and_size_alone_and_lie_a_length_apart() {
        let field = Field {
            lengths: Lengths::Field,
            h: &|_| 0.013,
            place: &Everywhere,
            bounds: tetdb_base::geom::Aabb::around([Point::ZERO, Point::ONE]),
        };
        let (mut one, mut other) = (Pattern::new(), Pattern::new());
        let (mut moved, mut far) = (0, 0);
        for k in 0..2000 {
            let p = (random(k) + Point::ONE) * 0.5;
            let place = one.nearest(&field, p, 0.013).expect("one size everywhere");
            assert_eq!(other.nearest(&field, p, 0.013), Some(place));
            assert!(place.distance(p) < 0.9 * 0.013);
            moved += u32::from(one.nearest(&field, place, 0.013) != Some(place));
            far += u32::from(place.distance(p) > 0.2 * 0.013);
            assert_eq!(one.nearest(&field, p, 0.03), None);
        }
        // But at the limits of grains, a place is its own.
        assert!(moved < 1800 && far > 1500, "{moved} {far}");
    }
}
