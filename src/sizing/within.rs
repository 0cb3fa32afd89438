//! Sizes of a part that is meshed again: wanted lengths inside, the fixed faces around it as they are.

use super::SizingError;
use super::constraint::SizeConstraint;
use super::constraints::SizeConstraints;
use super::corners::Corners;
use super::field::SizeField;
use super::options::Targets;
use super::seeds::seeds_of;
use super::tree::Tree;
use super::values::Maker;
use crate::geom::Point;
use crate::storage::ScratchSpace;

impl SizeField {
    /// The field of `constraint` inside a skin that stays: triangles index points.
    ///
    /// Near the skin lengths are those of its edges, away from it they tend to the wish as the slope `beta` allows, to smaller ones as
    /// well as to larger ones. Where the wish is infinite (outside of what it knows) sizes are those around it.
    ///
    /// # Errors
    /// A skin without edges; a wish that is no size somewhere; more leaves than can be numbered.
    pub fn within(
        points: &[Point],
        triangles: &[[u32; 3]],
        constraint: &dyn SizeConstraint,
        beta: f64,
    ) -> Result<Self, SizingError> {
        let room = &ScratchSpace::boundless();
        let (frame, bounds, seeds) = seeds_of(points, triangles, room)?;
        let constraints = SizeConstraints {
            list: &[constraint],
            frame,
            bounds,
            least: 0.0,
        };
        // A wanted length of nothing differs from every edge's: cells along the whole skin are as fine as its edges.
        let along_skin = Targets {
            hsiz: Some(0.0),
            hmin: None,
            hmax: None,
            beta,
        };
        let tree = Tree::build(&seeds, &along_skin, |tree| constraints.refine(tree))?;
        let mut corners = Corners::of(&tree, room);
        let mut maker = Maker {
            tree: &tree,
            corners: &mut corners,
            seeds: &seeds,
            beta,
            constraints: &constraints,
            room,
        };
        let h = maker.values_within()?;
        Ok(Self::of_corners(frame, beta, tree, corners, h, room))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let field = SizeField::within(&points, &triangles, &Constant(constraint), beta);
            let field = field.expect("a good skin");
            let middle = field.h(Point::splat(0.5));
            let reach = 0.5 * beta;
            let expected = constraint.clamp(0.11 - reach, 0.11 + reach);
            assert!(
                (middle / expected - 1.0).abs() < 0.15,
                "{constraint}: {middle}"
            );
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
        let field = SizeField::within(&points, &triangles, &Constant(f64::INFINITY), 0.26);
        let middle = field.expect("a good skin").h(Point::splat(0.5));
        assert!(middle > 0.1 && middle < 0.3, "{middle}");
        assert!(SizeField::within(&points, &[], &Constant(1.0), 0.26).is_err());
    }
}
