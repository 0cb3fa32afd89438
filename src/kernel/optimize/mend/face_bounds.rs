//! The bounds of the surface's triangles, and what tetrahedra are worth beside them.

use std::collections::HashMap;

use crate::mesh::anatomy::FACES;
use crate::mesh::{Mesh, Tet};
use tetdb_base::geom::Point;
use tetdb_base::shape::inverse_quality;
use tetdb_base::shape::{face_least, face_most, least};
use tetdb_base::storage::Pages;

/// What tetrahedra are judged by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measure {
    /// q, while one of this q is mended: half of it counts as reached by what stands on a triangle that allows no less.
    Quality(f64),
    /// q over the bound.
    Excess,
}

impl Measure {
    /// What 1 / q is multiplied with on a face of this bound.
    fn weight(self, bound: f64) -> f64 {
        match self {
            Self::Quality(q) => (2.0 * bound / q).clamp(1.0, f64::MAX),
            Self::Excess => weight(bound),
        }
    }
}

/// What 1 / q is multiplied with on a face of this bound, to be compared with tetrahedra that nothing forces: the bound of a good
/// triangle, 0.65 of that of a needle.
///
/// Twice a bound of 1 is an element to compute with, twice one of 1000 is a loss of 1000. A face without area in doubles is no
/// reason to do anything.
fn weight(bound: f64) -> f64 {
    if bound < NEEDLE {
        bound * (1.0 - 0.35 * (bound - 1.0) / (NEEDLE - 1.0))
    } else if bound.is_finite() {
        0.65 * bound
    } else {
        f64::MAX
    }
}

/// Triangles of this bound and more are needles.
const NEEDLE: f64 = 10.0;

/// The bounds of required faces and of tetrahedra between several met so far: their corners never move.
///
/// A bound takes a search; where a number that it is not above decides, that is all that is asked for.
pub(super) struct FaceBounds {
    /// All are forgotten when there are so many.
    known_max: usize,
    known: HashMap<[u32; 3], Known>,
    /// By vertices in ascending order and their faces, as bits.
    known_several: HashMap<([u32; 4], u8), f64>,
}

/// What is known of a face.
#[derive(Clone, Copy)]
struct Known {
    /// The bound is not above this.
    most: f64,
    /// NaN until it is searched: a bound is a number.
    bound: f64,
}

impl Default for FaceBounds {
    /// Of 57,344 faces, in 2.2 MB; of tetrahedra between several of them as many, in 2.2 MB.
    fn default() -> Self {
        Self::remembering(7 << 13)
    }
}

impl FaceBounds {
    /// Of so many faces at once.
    pub(super) fn remembering(known_max: usize) -> Self {
        Self { known_max, known: HashMap::new(), known_several: HashMap::new() }
    }

    /// What is known, and the corners in the order of the vertices: a search from another corner finds another number, by rounding and a bit, and
    /// what is found must not depend on who asks first.
    fn known(&mut self, vertices: [u32; 3], points: [Point; 3]) -> (&mut Known, [Point; 3]) {
        if self.known.len() >= self.known_max {
            self.known.clear();
        }
        let mut order = [0, 1, 2];
        order.sort_unstable_by_key(|&i| vertices[i]);
        let points = order.map(|i| points[i]);
        let known = (self.known.entry(order.map(|i| vertices[i])))
            .or_insert_with(|| Known { most: face_most(points), bound: f64::NAN });
        (known, points)
    }

    fn most_of(&mut self, vertices: [u32; 3], points: [Point; 3]) -> f64 {
        self.known(vertices, points).0.most
    }

    fn of(&mut self, vertices: [u32; 3], points: [Point; 3]) -> f64 {
        let (known, points) = self.known(vertices, points);
        if known.bound.is_nan() {
            known.bound = face_least(points);
        }
        known.bound
    }

    /// What tetrahedra and faces weigh by a measure.
    pub(super) fn by(&mut self, measure: Measure) -> Weights<'_> {
        let bounds = self;
        Weights { bounds, measure }
    }

    /// The required face of a tetrahedron that has one only, and whether there are several.
    fn required(tet: &Tet) -> (Option<usize>, bool) {
        let mut required = (0..4).filter(|&i| tet.is_required(i));
        (required.next(), required.next().is_some())
    }

    /// The bound of a tetrahedron.
    pub(super) fn of_tet(&mut self, tet: &Tet, points: [Point; 4]) -> f64 {
        match Self::required(tet) {
            (None, _) => 1.0,
            (Some(i), false) => self.of(tet.face(i), FACES[i].map(|k| points[k])),
            (Some(_), true) => self.of_several(tet, points),
        }
    }

    /// The same where there are several required faces: then all corners are the surface's.
    pub(super) fn of_several(&mut self, tet: &Tet, points: [Point; 4]) -> f64 {
        if self.known_several.len() >= self.known_max {
            self.known_several.clear();
        }
        let mut order = [0, 1, 2, 3];
        order.sort_unstable_by_key(|&i| tet.vertex(i));
        let bit = |k: usize| u8::from(tet.is_required(order[k])) << k;
        let faces = (0..4).fold(0, |faces, k| faces | bit(k));
        let name = (order.map(|i| tet.vertex(i)), faces);
        *(self.known_several).entry(name).or_insert_with(|| {
            // The same order whoever asks, and positive.
            if !is_even(order) {
                order.swap(2, 3);
            }
            least(order.map(|i| points[i]), order.map(|i| tet.is_required(i)))
        })
    }

    /// Whether q over the bound is above `excess` for certain; `false` where that takes a search.
    pub(super) fn is_surely_above(
        &mut self,
        tet: &Tet,
        points: [Point; 4],
        q: f64,
        excess: f64,
    ) -> bool {
        match Self::required(tet) {
            (None, _) => q > excess,
            (Some(i), false) => q > excess * self.most_of(tet.face(i), FACES[i].map(|k| points[k])),
            (Some(_), true) => false,
        }
    }
}

/// What 1 / q is multiplied with, by one measure.
pub(super) struct Weights<'a> {
    bounds: &'a mut FaceBounds,
    measure: Measure,
}

impl Weights<'_> {
    /// The weight of a required face.
    pub(super) fn of_face(&mut self, vertices: [u32; 3], points: [Point; 3]) -> f64 {
        let (bounds, measure) = (&mut *self.bounds, self.measure);
        if let Measure::Quality(q) = measure
            && (q.is_infinite() || 2.0 * bounds.most_of(vertices, points) <= q)
        {
            return 1.0;
        }
        measure.weight(bounds.of(vertices, points))
    }

    /// The weight of a tetrahedron.
    fn of_tet(&mut self, tet: &Tet, points: [Point; 4]) -> f64 {
        match (self.measure, FaceBounds::required(tet)) {
            (Measure::Quality(q), _) if q.is_infinite() => 1.0,
            (_, (Some(i), false)) => self.of_face(tet.face(i), FACES[i].map(|k| points[k])),
            (measure, _) => measure.weight(self.bounds.of_tet(tet, points)),
        }
    }
}

/// Whether an even number of swaps leads to this order.
fn is_even(order: [usize; 4]) -> bool {
    let pairs = (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j)));
    pairs.filter(|&(i, j)| order[i] > order[j]).count() % 2 == 0
}

/// 1 / q of a tetrahedron of the mesh, and what it counts in the same units as the sides of a star.
pub(super) fn value_of<P: Pages>(mesh: &mut Mesh<P>, tet: &Tet, weights: &mut Weights) -> [f64; 2] {
    let points = mesh.points(tet);
    let good = inverse_quality(points).max(0.0);
    [good, good * weights.of_tet(tet, points)]
}
