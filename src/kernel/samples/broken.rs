//! Broken surfaces, as scanners, assemblies and exports leave them.

use std::collections::BTreeSet;

use super::build::{Builder, triangles_checked};
use super::random::Random;
use super::sample::Sample;
use super::sphere::make_sphere;
use super::{SampleError, boxes::make_box};
use tetdb_base::geom::Point;

/// Width of the cracks.
const CRACK: f64 = 1e-6;
/// Length of the triangles of a soup, where the cube of their places has side 1.
const SOUP_TRIANGLE: f64 = 0.4;

/// What is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BrokenKind {
    /// Triangles of a sphere are missing.
    Holes,
    /// Turned boxes that go through each other.
    Crossings,
    /// Boxes in a row that each bring their own wall where they touch.
    Doubled,
    /// Triangles of a sphere are a little off their neighbors.
    Cracks,
    /// Triangles of a sphere are seen from inside.
    Turned,
    /// Triangles of a box have a vertex in an edge that their neighbor has not.
    TJunctions,
    /// Triangles here and there.
    Soup,
}

impl BrokenKind {
    /// The kinds and their words.
    pub const WORDS: [(Self, &'static str); 7] = [
        (Self::Holes, "holes"),
        (Self::Crossings, "crossings"),
        (Self::Doubled, "doubled"),
        (Self::Cracks, "cracks"),
        (Self::Turned, "turned"),
        (Self::TJunctions, "tjunctions"),
        (Self::Soup, "soup"),
    ];

    /// The word of this kind.
    pub fn word(self) -> &'static str {
        Self::WORDS.iter().find(|(kind, _)| *kind == self).map_or("", |(_, word)| word)
    }
}

/// A broken surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Broken {
    /// What is broken.
    pub kind: BrokenKind,
    /// Broken places, boxes or triangles.
    pub count: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Edge length of spheres and boxes.
    pub h: f64,
}

/// Triangles by position, each with the number of its part.
type Soup = Vec<([Point; 3], usize)>;

impl Broken {
    pub(super) fn make(&self, bytes_max: u64) -> Result<Sample, SampleError> {
        triangles_checked("broken", 12.0 * self.count as f64, bytes_max)?;
        let mut random = Random::new(self.seed);
        let soup = match self.kind {
            BrokenKind::Crossings => self.crossings(&mut random),
            BrokenKind::Doubled => self.doubled(&mut random),
            BrokenKind::Soup => self.soup(&mut random),
            BrokenKind::TJunctions => {
                self.spoiled(make_box(Point::ONE, self.h, bytes_max)?, &mut random)
            }
            _ => self.spoiled(make_sphere(1.0, self.h, bytes_max)?, &mut random),
        };
        let mut build = Builder::default();
        let n_parts = 1 + soup.iter().map(|(_, part)| *part).max().unwrap_or(0);
        for part in 0..n_parts {
            build.label(if n_parts == 1 {
                "broken".to_owned()
            } else {
                format!("part-{}", part + 1)
            });
        }
        for (corners, part) in soup {
            let corners = corners.map(|p| build.seam_point(p));
            build.triangle(corners, false, part as u32);
        }
        Ok(build.finish())
    }

    fn crossings(&self, random: &mut Random) -> Soup {
        let mut soup = Soup::new();
        // As far apart that most meet some others, and no place is in very many.
        let side = 0.9 * super::random::cube_root(self.count as f64);
        for part in 0..self.count {
            let (middle, [x, y, z]) = (random.in_cube() * side, random.rotation());
            push_box(&mut soup, part, |p| {
                let p = p - Point::splat(0.5);
                middle + x * p.x + y * p.y + z * p.z
            });
        }
        soup
    }

    fn doubled(&self, random: &mut Random) -> Soup {
        let mut soup = Soup::new();
        for part in 0..self.count {
            let low = random.in_cube() * Point::new(0.0, 0.5, 0.5) + Point::X * part as f64;
            push_box(&mut soup, part, |p| low + p);
        }
        soup
    }

    fn soup(&self, random: &mut Random) -> Soup {
        let triangle = |_| {
            let middle = random.in_cube();
            ([0; 3].map(|_| middle + (random.in_cube() - Point::splat(0.5)) * SOUP_TRIANGLE), 0)
        };
        (0..self.count).map(triangle).collect()
    }

    /// A closed surface with broken triangles.
    fn spoiled(&self, whole: Sample, random: &mut Random) -> Soup {
        let n = whole.triangles.len();
        let mut chosen = BTreeSet::new();
        while chosen.len() < self.count.min(n / 2) {
            chosen.insert((random.unit() * n as f64) as usize);
        }
        let mut soup = Soup::new();
        for (t, triangle) in whole.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|v| whole.points[v as usize]);
            match (self.kind, chosen.contains(&t)) {
                (BrokenKind::Holes, true) => {}
                (BrokenKind::Turned, true) => soup.push(([a, c, b], 0)),
                (BrokenKind::Cracks, true) => {
                    let off = (random.in_cube() - Point::splat(0.5)) * CRACK;
                    soup.push(([a + off, b + off, c + off], 0));
                }
                (BrokenKind::TJunctions, true) => {
                    let middle = a.midpoint(b);
                    soup.extend([([a, middle, c], 0), ([middle, b, c], 0)]);
                }
                _ => soup.push(([a, b, c], 0)),
            }
        }
        soup
    }
}

/// The unit cube where `place` puts it.
fn push_box(soup: &mut Soup, part: usize, place: impl Fn(Point) -> Point) {
    let corner = |c: usize| {
        let at = |axis: usize| (c >> axis & 1) as f64;
        place(Point::new(at(0), at(1), at(2)))
    };
    let walls =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    for [a, b, c, d] in walls {
        soup.extend([[a, b, c], [a, c, d]].map(|t| (t.map(corner), part)));
    }
}
