//! Sizes of a sub-domain that is meshed again: wanted lengths inside, current lengths along its skin.
//!
//! ```text
//!   h  current -.           .-- current   The faces of the skin stay, and so do lengths at them. Away from them lengths
//!                `.       .'              approach the wanted ones as fast as the slope allows: they stay between the
//!      wanted      `-----'                cones below and above the current lengths at the skin.
//!      skin                  skin
//! ```
//!
//! Where the wanted length is the current one, the result equals the current field, except for rounding: it has the
//! same octree there, and a leaf may be as steep as before. The positions of vertices depend on the last digits of
//! lengths (of 20,000 tetrahedra in a steep field, a hundredth more or fewer). So a part without a changed constraint
//! keeps its field to the bit. Sizes from the skin's edges would not do. On a surface of small and large triangles,
//! adjacent vertices differ far more than the slope allows, and the slopes of large ones reach over the zones of small
//! ones.

use super::SizingError;
use super::constraint::SizeConstraint;
use super::constraints::SizeConstraints;
use super::corners::{PAIRS, TreeCorners};
use super::field::SizeField;
use super::options::Targets;
use super::seeds::Seeds;
use super::tree::{LATTICE, Tree};
use super::values::CornerSizes;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{ScratchSpace, SpillVec};

/// Wanted lengths that differ from the current ones by no more than this share are the same: the octree is not divided
/// for them.
const SAME: f64 = 0.01;
/// Sizes of shapes next to the octree are sampled into it up to this error. At a tenth, which suffices for a formula,
/// lengths around a sphere come out up to a tenth larger than they were.
const BEND_MAX: f64 = 0.02;
/// Where a shape ends, sizes have a kink; cells there are this many sizes wide. With two, a ball of a tenth of the
/// length around it has 2.3 % fewer tetrahedra after remeshing with the same lengths.
const CELLS_PER_SIZE: f64 = 1.0;

impl SizeField {
    /// The field of `constraint` inside a fixed skin, for a part with the lengths of this field; triangles index
    /// points. `None`: the constraint equals the current lengths.
    ///
    /// Near the skin lengths are those of this field. Away from it they approach the constraint as fast as the slope
    /// `beta` allows, to smaller ones as well as to larger ones. Where the constraint is infinite, sizes are those
    /// around it, or those of this field if no constraint is finite anywhere. The result does not depend on `scratch`.
    ///
    /// Memory: besides the scratch space 40 bytes a point and 16 a leaf.
    /// # Errors
    /// A skin without edges; a constraint without a size somewhere; more leaves than can be numbered.
    pub fn within(
        &self,
        points: &[Point],
        triangles: &[[u32; 3]],
        constraint: &dyn SizeConstraint,
        beta: f64,
        scratch: &ScratchSpace,
    ) -> Result<Option<Self>, SizingError> {
        let frame = self.frame;
        let seeds = Seeds::with_sizes(points, triangles, frame, |p| self.h(p))?;
        let used = triangles.iter().flatten().map(|&v| points[v as usize]);
        let constraints = SizeConstraints {
            list: &[self, constraint],
            frame,
            bounds: Aabb::around(used),
            least: 0.0,
            bend_max: BEND_MAX,
            cells_per_size: CELLS_PER_SIZE,
            // Else corners on the box's walls would hang on coarser cells outside, with other sizes than they had.
            beside: 1.0,
        };
        let tree = self.tree_within(points, &seeds, &constraints)?;
        let mut corners = TreeCorners::new(&tree, scratch);
        let mut current = at_corners(&tree, &mut corners, frame.side, scratch, &|p| {
            Ok(self.h(frame.low + p * frame.side))
        })?;
        let mut wanted = at_corners(&tree, &mut corners, frame.side, scratch, &|p| {
            constraint.h(frame.low + p * frame.side)
        })?;
        if is_same(&tree, &mut corners, [&mut current, &mut wanted], &constraints) {
            return Ok(None);
        }
        let slope_factor = slope_factor(&tree, &mut corners, &mut current, beta, scratch);
        let mut sizes = CornerSizes {
            tree: &tree,
            corners: &mut corners,
            seeds: &seeds,
            beta,
            slope_factor: Some(slope_factor),
            scratch,
            parts: None,
        };
        let (mut at_skin, nearest) = sizes.gather(|seeds, v| seeds.h(v));
        for i in 0..at_skin.len() {
            if at_skin.get(i).is_finite() {
                at_skin.set(i, current.get(i));
            }
        }
        let [mut upper, mut lower] = sizes.cones(&mut at_skin, nearest);
        let mut h = sizes.fill(wanted);
        for i in 0..h.len() {
            let current = current.get(i);
            let wanted = Some(h.get(i)).filter(|h| h.is_finite()).unwrap_or(current);
            // Rounded slopes must not change the current lengths.
            let (low, high) = (lower.get(i).min(current), upper.get(i).max(current));
            h.set(i, wanted.max(low).min(high));
        }
        sizes.grading().grade_closed(&mut h);
        drop(sizes);
        Ok(Some(Self::from_corners(frame, beta, tree, corners, h, scratch)))
    }

    /// As fine as this field and the constraint in the skin's box, and along the skin where they differ: there the
    /// slopes begin.
    fn tree_within(
        &self,
        points: &[Point],
        seeds: &Seeds,
        constraints: &SizeConstraints,
    ) -> Result<Tree, SizingError> {
        let mut moved = Vec::new();
        for v in seeds.vertices() {
            let current = seeds.h(v) * self.frame.side;
            let wanted = constraints.list[1].h(points[v as usize])?;
            if wanted.is_finite() && (wanted - current).abs() > SAME * current {
                moved.push(v);
            }
        }
        // A wanted length of zero differs from any: cells along the skin are as fine as the seeds.
        let along_skin = Targets {
            hsiz: Some(0.0),
            hmin: None,
            hmax: None,
            beta: self.beta,
            beta_needles: self.beta,
        };
        Tree::build_near(&moved, seeds, &along_skin, |tree| constraints.refine(tree))
    }
}

/// A size at each corner, in units of the cube's side; `size` takes positions in those units and returns input units.
fn at_corners(
    tree: &Tree,
    corners: &mut TreeCorners,
    side: f64,
    scratch: &ScratchSpace,
    size: &(dyn Fn(Point) -> Result<f64, SizingError> + Sync),
) -> Result<SpillVec<f32>, SizingError> {
    let mut h = scratch.vec(corners.n_corners, 0.0f32);
    let size_at = |at: [u32; 3]| {
        let [x, y, z] = at.map(f64::from);
        size(Point::new(x, y, z) * (1.0 / f64::from(LATTICE)))
    };
    corners.sample(tree, &size_at, |id, size| h.set(id, (size / side) as f32))?;
    Ok(h)
}

/// Returns whether two lists of sizes are equal wherever leaves meet the box of the skin: the octree is as fine as either needs there.
fn is_same(
    tree: &Tree,
    corners: &mut TreeCorners,
    [current, wanted]: [&mut SpillVec<f32>; 2],
    constraints: &SizeConstraints,
) -> bool {
    tree.leaves().enumerate().all(|(i, leaf)| {
        !constraints.is_in_bounds(leaf) || {
            let mut ids = corners.of_leaf.get(i).into_iter();
            ids.all(|id| current.get(id as usize) == wanted.get(id as usize))
        }
    })
}

/// For each leaf, the slope of the current sizes between its corners, over `beta`; at least one.
fn slope_factor(
    tree: &Tree,
    corners: &mut TreeCorners,
    current: &mut SpillVec<f32>,
    beta: f64,
    scratch: &ScratchSpace,
) -> SpillVec<f32> {
    let mut slope_factor = scratch.vec(corners.of_leaf.len(), 1.0f32);
    for (i, leaf) in tree.leaves().enumerate() {
        let h = corners.of_leaf.get(i).map(|id| f64::from(current.get(id as usize)));
        let slope = PAIRS.iter().fold(0.0f64, |most, &(a, b, distance2)| {
            let distance = f64::from(distance2).sqrt() * leaf.side();
            most.max((h[a as usize] - h[b as usize]).abs() / distance)
        });
        slope_factor.set(i, (slope / beta).max(1.0) as f32);
    }
    slope_factor
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sizing::SizeOptions;

    fn scratch() -> ScratchSpace {
        ScratchSpace::boundless()
    }

    struct Constant(f64);

    impl SizeConstraint for Constant {
        fn h(&self, _: Point) -> Result<f64, SizingError> {
            Ok(self.0)
        }
    }

    /// The skin of a cube in squares of side 0.1, each of two triangles.
    fn skin() -> (Vec<Point>, Vec<[u32; 3]>) {
        const N: u32 = 10;
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        for axis in 0..3 {
            for side in [0.0, 1.0] {
                let first = points.len() as u32;
                for k in 0..(N + 1) * (N + 1) {
                    let at = [f64::from(k % (N + 1)), f64::from(k / (N + 1))];
                    let mut p = [side; 3];
                    p[(axis + 1) % 3] = at[0] / f64::from(N);
                    p[(axis + 2) % 3] = at[1] / f64::from(N);
                    points.push(Point::from_array(p));
                }
                for k in 0..N * N {
                    let a = first + k % N + k / N * (N + 1);
                    triangles.push([a, a + 1, a + N + 2]);
                    triangles.push([a, a + N + 2, a + N + 1]);
                }
            }
        }
        (points, triangles)
    }

    #[test]
    fn sizes_go_from_the_skin_to_the_wish_at_the_slope() {
        let (points, triangles) = skin();
        let beta = 1.3f64.ln();
        for constraint in [0.03, 0.1, 0.2] {
            let current = SizeField::build(&points, &triangles, &SizeOptions::default())
                .expect("a good surface");
            let field =
                current.within(&points, &triangles, &Constant(constraint), beta, &scratch());
            let field = field.expect("a good skin").expect("another size");
            let middle = field.h(Point::splat(0.5));
            let reach = 0.5 * beta;
            let expected = constraint.clamp(0.11 - reach, 0.11 + reach);
            assert!((middle / expected - 1.0).abs() < 0.15, "{constraint}: {middle}");
            for y in [0.21, 0.5, 0.77] {
                let at_skin = field.h(Point::new(0.0, y, 0.45));
                assert!((0.08..0.14).contains(&at_skin), "{constraint}: {at_skin}");
            }
            let mut before = None::<f64>;
            for i in 0..=200 {
                let h = field.h(Point::new(f64::from(i) * 0.005, 0.5, 0.5));
                if let Some(before) = before {
                    assert!((h - before).abs() < 1.75 * beta * 0.005, "{constraint} {i}");
                }
                before = Some(h);
            }
        }
    }

    #[test]
    fn no_size_is_an_error_and_nothing_wished_is_the_skins() {
        let (points, triangles) = skin();
        let current = SizeField::build(&points, &triangles, &SizeOptions::default());
        let current = current.expect("a good surface");
        let field = current.within(&points, &triangles, &Constant(f64::INFINITY), 0.26, &scratch());
        let field = field.expect("a good skin").expect("no size at all");
        let middle = field.h(Point::splat(0.5));
        assert!(middle > 0.1 && middle < 0.3, "{middle}");
        assert!(current.within(&points, &[], &Constant(1.0), 0.26, &scratch()).is_err());
    }

    /// A box of which one end is fine: the slope bounds sizes all along it.
    fn graded() -> (Vec<Point>, Vec<[u32; 3]>, SizeField) {
        let (mut points, triangles) = skin();
        for p in &mut points {
            // Steps from 0.002 to 0.5.
            p.x = (0.002 * (2f64.powf(10.0 * p.x) - 1.0)).min(2.0);
        }
        let field = SizeField::build(&points, &triangles, &SizeOptions::default());
        (points, triangles, field.expect("a good surface"))
    }

    fn places() -> impl Iterator<Item = Point> {
        (0..4000).map(|k| {
            let at = |step: u32| f64::from(k * step % 4001) / 4000.0;
            Point::new(2.0 * at(7) * at(7), at(1511), at(2903))
        })
    }

    #[test]
    fn where_the_wish_is_what_the_part_has_nothing_changes() {
        /// Another length in one corner alone.
        struct But<'a>(&'a SizeField);
        impl SizeConstraint for But<'_> {
            fn h(&self, p: Point) -> Result<f64, SizingError> {
                let is_there = p.distance(Point::new(2.0, 1.0, 1.0)) < 0.2;
                Ok(self.0.h(p) * if is_there { 0.9 } else { 1.0 })
            }
        }
        let (points, triangles, current) = graded();
        let within = |wish: &dyn SizeConstraint| {
            let field = current.within(&points, &triangles, wish, current.beta(), &scratch());
            field.expect("a good skin")
        };
        assert!(within(&current).is_none());
        let field = within(&But(&current)).expect("another length");
        for p in places().filter(|p| p.x < 0.8) {
            let (old, new) = (current.h(p), field.h(p));
            assert!((new / old - 1.0).abs() < 1e-3, "{p} {old} {new}");
        }
    }

    #[test]
    fn a_smaller_wish_makes_no_place_coarser() {
        struct Share<'a>(&'a SizeField, f64);
        impl SizeConstraint for Share<'_> {
            fn h(&self, p: Point) -> Result<f64, SizingError> {
                Ok(self.0.h(p) * self.1)
            }
            fn divides(&self, middle: Point, width: f64) -> Option<bool> {
                self.0.divides(middle, width)
            }
        }
        let (points, triangles, current) = graded();
        let mut before = current.clone();
        for share in [0.95, 0.8, 0.5] {
            let field = current.within(
                &points,
                &triangles,
                &Share(&current, share),
                current.beta(),
                &scratch(),
            );
            let field = field.expect("a good skin").expect("other sizes");
            for p in places() {
                let (old, new) = (current.h(p), field.h(p));
                assert!(new < old * 1.01 && new > 0.9 * share * old, "{p} {old} {new}");
                assert!(new < before.h(p) * 1.1, "{p} {share}");
            }
            before = field;
        }
    }
}
