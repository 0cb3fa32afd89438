//! The band around a cutting surface that is refined to its final density before the cut.
//!
//! Its limit is a noisy surface, a function of position alone: a limit at a constant distance would leave a layer of vertices that
//! shows in the finished mesh (densities between 0.44 and 1.67 of the mean per 0.25 h, measured; with noise they are those of
//! any other place).

use super::surface::{CuttingSurface, Plane};
use crate::blocks::PlacementRule;
use tetdb_base::geom::{Point, mix};
use tetdb_schema::tree::CutPlane;

/// Half the width of the zone at its narrowest, in units of the wanted length. Circumspheres of a saturated mesh have radii below
/// 1.03 h, and interface vertices stay within 1.4 h: from 3.5 on no later vertex reaches a tetrahedron at the interface.
pub const WIDTH_MIN: f64 = 4.0;
/// Largest additional width from the noise.
pub const WIDTH_NOISE: f64 = 2.0;
/// Wavelength of the noise in units of h.
const WAVELENGTH: f64 = 1.5;

/// A refined zone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zone {
    /// Number of the cut, which seeds its noise.
    pub cut: u32,
    /// The plane in the middle of the zone.
    pub surface: Plane,
}

impl From<Zone> for CutPlane {
    fn from(zone: Zone) -> Self {
        let [x, y, z] = zone.surface.normal.to_array();
        Self { cut: zone.cut, plane: [x, y, z, zone.surface.offset] }
    }
}

impl From<CutPlane> for Zone {
    fn from(CutPlane { cut, plane: [x, y, z, offset] }: CutPlane) -> Self {
        Self { cut, surface: Plane { normal: Point::new(x, y, z), offset } }
    }
}

impl Zone {
    /// Half width at `p` in units of h, on the side of `p`.
    pub fn width(&self, p: Point, h: f64) -> f64 {
        let s = self.surface.distance(p);
        let foot = p - self.surface.normal(p) * s;
        // Cells of the noise follow the size in steps of two: dividing by h itself would stretch them with the distance from the origin.
        let cell = WAVELENGTH * f64::from_bits(h.to_bits() & 0xFFF0_0000_0000_0000);
        let seed = u64::from(self.cut) << 1 | u64::from(s < 0.0);
        WIDTH_MIN + WIDTH_NOISE * noise(foot / cell, seed)
    }

    /// Returns whether no vertex may be added at `p` after the cut. At its noisy limit the zone still has holes that
    /// only its surroundings, once refined, let one fill; a tetrahedron at the interface reaches nowhere near there.
    #[inline]
    pub fn is_final(&self, p: Point, h: f64) -> bool {
        self.surface.distance(p).abs() <= WIDTH_MIN * h
    }

    /// Returns whether `p`, where the wanted length is `h`, lies in the zone.
    #[inline]
    pub fn holds(&self, p: Point, h: f64) -> bool {
        let s = self.surface.distance(p).abs();
        s <= WIDTH_MIN * h || (s <= (WIDTH_MIN + WIDTH_NOISE) * h && s <= self.width(p, h) * h)
    }
}

/// The zone of the current cut, without the zones of earlier cuts.
pub(super) struct InZone<'a> {
    pub zone: &'a Zone,
    pub earlier: &'a [Zone],
}

/// Reach of a zone from the surface, in units of h at a point not yet in it: a third more than its width, because the
/// size may grow on the way.
const REACH: f64 = 1.3 * (WIDTH_MIN + WIDTH_NOISE);

/// Growth of lengths from a zone outwards. Tetrahedra that reach from a zone far beyond it would be put off by all blocks.
const COARSE_SLOPE: f64 = 0.5;

impl PlacementRule for InZone<'_> {
    fn is_partial(&self) -> bool {
        true
    }

    fn reaches(&self, points: &[Point; 4], sizes: &[f32; 4]) -> bool {
        let (mut near, mut low, mut high) = (false, false, false);
        for (&p, &h) in points.iter().zip(sizes) {
            let s = self.zone.surface.distance(p);
            near |= s.abs() <= REACH * f64::from(h);
            low |= s < 0.0;
            high |= s > 0.0;
        }
        near || (low && high)
    }

    fn needs(&self, points: &[Point; 4], sizes: &[f32; 4]) -> bool {
        let distance = |p: Point| self.zone.surface.distance(p);
        let is_final = |(&p, &h): (&Point, &f32)| self.zone.is_final(p, f64::from(h));
        points.iter().zip(sizes).any(is_final)
            || points.iter().any(|&p| distance(p) < 0.0)
                && points.iter().any(|&p| distance(p) > 0.0)
    }

    fn coarse_length(&self, p: Point, h: f64) -> f64 {
        let beyond = self.zone.surface.distance(p).abs() - (WIDTH_MIN + WIDTH_NOISE) * h;
        h.max(COARSE_SLOPE * beyond)
    }

    fn admits(&self, p: Point, h: f64) -> bool {
        self.zone.holds(p, h)
    }

    fn forbids(&self, p: Point, h: f64) -> bool {
        self.earlier.iter().any(|zone| zone.is_final(p, h))
    }
}

/// Everywhere but in the zones of earlier cuts.
pub struct OutsideZones<'a>(pub &'a [Zone]);

impl PlacementRule for OutsideZones<'_> {
    fn admits(&self, _: Point, _: f64) -> bool {
        true
    }

    fn forbids(&self, p: Point, h: f64) -> bool {
        self.0.iter().any(|zone| zone.is_final(p, h))
    }
}

/// Smooth noise between 0 and 1 with values at whole positions.
fn noise(p: Point, seed: u64) -> f64 {
    let cell = p.floor();
    let local = p - cell;
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let [x, y, z] = local.to_array().map(ease);
    let value = |dx: f64, dy: f64, dz: f64| {
        let at = (cell + Point::new(dx, dy, dz)).to_array();
        let bits = at.into_iter().fold(seed, |s, c| mix(s ^ (c as i64 as u64)));
        (bits >> 11) as f64 / (1u64 << 53) as f64
    };
    let blend = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let edge = |dy: f64, dz: f64| blend(value(0.0, dy, dz), value(1.0, dy, dz), x);
    let face = |dz: f64| blend(edge(0.0, dz), edge(1.0, dz), y);
    blend(face(0.0), face(1.0), z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_noisy_within_its_bounds_and_continuous() {
        let zone = Zone { cut: 3, surface: Plane { normal: Point::X, offset: 0.5 } };
        let (mut least, mut most) = (f64::INFINITY, 0f64);
        let mut before = None::<f64>;
        for i in 0..40_000 {
            let p = Point::new(0.6, f64::from(i) * 1e-3, 0.25);
            let width = zone.width(p, 1.0);
            assert!((WIDTH_MIN..=WIDTH_MIN + WIDTH_NOISE).contains(&width));
            if let Some(before) = before {
                assert!((width - before).abs() < 0.01);
            }
            before = Some(width);
            (least, most) = (least.min(width), most.max(width));
        }
        assert!(most - least > 0.6 * WIDTH_NOISE, "{least} {most}");
    }
}
