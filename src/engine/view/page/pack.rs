//! Compact text of triangles: differences as numbers of seven bits per byte, then base 64. `assets/tools.js` unpacks them.

use tetdb_base::geom::{Aabb, Point};

/// Steps along the longest side of the box.
const STEPS: f64 = 65535.0;

/// A surface to be packed.
///
/// Shape: `triangles[i]` = places in `points`, numbered by first use; each of `channels` has one number per triangle.
pub struct Surface<'a> {
    /// Positions of the vertices.
    pub points: &'a [Point],
    /// Vertices of each triangle.
    pub triangles: &'a [[u32; 3]],
    /// Numbers of the triangles, one list per channel.
    pub channels: &'a [Vec<u32>],
}

struct Packed(Vec<u8>);

impl Packed {
    fn number(&mut self, mut n: u32) {
        while n >= 128 {
            self.0.push(n as u8 | 128);
            n >>= 7;
        }
        self.0.push(n as u8);
    }

    /// Writes a signed number: 0, -1, 1, -2, … become 0, 1, 2, 3, …
    fn difference(&mut self, n: i32) {
        self.number((n << 1 ^ n >> 31) as u32);
    }
}

/// Packs the surface as text; see [`packed`].
pub(super) fn pack(surface: &Surface, bounds: &Aabb) -> String {
    base64(&packed(surface, bounds))
}

/// Packs the surface as bytes. Positions are rounded to 1/65535 of the longest side of `bounds`.
pub fn packed(surface: &Surface, bounds: &Aabb) -> Vec<u8> {
    let mut out = Packed(Vec::new());
    out.number(surface.points.len() as u32);
    out.number(surface.triangles.len() as u32);
    out.number(surface.channels.len() as u32);
    let side = (bounds.high - bounds.low).max_element();
    let mut last = [0; 3];
    for &p in surface.points {
        let share = (p - bounds.low) / side;
        let at = share.to_array().map(|x| (x * STEPS).round().clamp(0.0, STEPS) as i32);
        for (now, before) in at.into_iter().zip(last) {
            out.difference(now - before);
        }
        last = at;
    }
    let mut seen = 0;
    for &v in surface.triangles.as_flattened() {
        assert!(v <= seen, "vertices are numbered by their first use");
        out.number(seen - v);
        seen += u32::from(v == seen);
    }
    for channel in surface.channels {
        assert_eq!(channel.len(), surface.triangles.len());
        for run in channel.chunk_by(|a, b| a == b) {
            out.number(run.len() as u32);
            out.number(run[0]);
        }
    }
    out.0
}

/// Encodes bytes in base 64. Source: RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word =
            three.iter().fold(0, |word, &b| word << 8 | u32::from(b)) << (8 * (3 - three.len()));
        for k in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * k) & 63) as usize];
            text.push(if k <= three.len() { letter as char } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_64_is_that_of_the_standard() {
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn a_triangle_is_a_few_letters() {
        let points = [Point::ZERO, Point::X, Point::Y, Point::ONE];
        let surface = Surface {
            points: &points,
            triangles: &[[0, 1, 2], [2, 1, 3]],
            channels: &[vec![7, 7], vec![0, 300]],
        };
        let bounds = Aabb { low: Point::ZERO, high: Point::ONE };
        let up = [254, 255, 7];
        let down = [253, 255, 7];
        let bytes = [
            &[4, 2, 2][..],
            &[0, 0, 0],
            &up,
            &[0, 0],
            &down,
            &up,
            &[0],
            &up,
            &[0],
            &up,
            &[0, 0, 0, 1, 2, 0],
            &[2, 7],
            &[1, 0, 1, 172, 2],
        ];
        assert_eq!(pack(&surface, &bounds), base64(&bytes.concat()));
    }
}
