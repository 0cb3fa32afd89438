//! Where two triangles meet.

use std::cmp::Ordering;

use super::exact::{ExactPoint, Plane, Projection};
use tetdb_base::geom::{Point, orient_sign};

/// What two triangles have in common.
pub enum Meeting {
    /// A part of a line; a point is a part with equal ends.
    Along(Box<[ExactPoint; 2]>),
    /// They lie in one plane.
    Coplanar,
    /// Nothing.
    Apart,
}

/// What triangles `p` and `q` have in common; both must have area.
pub fn meeting(p: [Point; 3], q: [Point; 3]) -> Meeting {
    let sides = |t: [Point; 3], of: [Point; 3]| of.map(|x| orient_sign(t[0], t[1], t[2], x));
    let q_sides = sides(p, q);
    if q_sides == [Ordering::Equal; 3] {
        return Meeting::Coplanar;
    }
    let (Some([p_low, p_high]), Some([q_low, q_high])) =
        (cut(p, sides(q, p), q), cut(q, q_sides, p))
    else {
        return Meeting::Apart;
    };
    let low = if p_low.compare(&q_low).is_lt() { q_low } else { p_low };
    let high = if p_high.compare(&q_high).is_gt() { q_high } else { p_high };
    match low.compare(&high) {
        Ordering::Greater => Meeting::Apart,
        _ => Meeting::Along(Box::new([low, high])),
    }
}

/// The part of `t` in the plane of `of`, from its first end on the line of the planes to its last.
fn cut(t: [Point; 3], sides: [Ordering; 3], of: [Point; 3]) -> Option<[ExactPoint; 2]> {
    let mut found: Vec<ExactPoint> = Vec::new();
    let mut plane = None;
    for k in 0..3 {
        let l = (k + 1) % 3;
        if sides[k].is_eq() {
            found.push(t[k].into());
        } else if sides[k] == sides[l].reverse() {
            let plane = plane.get_or_insert_with(|| Plane::new(of));
            let (a, b) = (t[k].into(), t[l].into());
            found.push(ExactPoint::between(&a, &b, &plane.value(t[k]), &plane.value(t[l])));
        }
    }
    found.sort_by(ExactPoint::compare);
    Some([found.first()?.clone(), found.last()?.clone()])
}

/// The part of the segment `a b` in the plane of triangle `t` that lies in `t`.
pub fn clipped(
    a: Point,
    b: Point,
    t: &[ExactPoint; 3],
    plane: &Projection,
) -> Option<[ExactPoint; 2]> {
    let (mut a, mut b) = (ExactPoint::from(a), ExactPoint::from(b));
    for k in 0..3 {
        let (from, to) = (&t[k], &t[(k + 1) % 3]);
        let (a_turn, b_turn) = (plane.turn(from, to, &a), plane.turn(from, to, &b));
        if a_turn.max(b_turn) < 0 {
            return None;
        }
        if a_turn.min(b_turn) < 0 {
            let (a_value, b_value) = (plane.area(from, to, &a), plane.area(from, to, &b));
            let end = ExactPoint::between(&a, &b, &a_value, &b_value);
            *(if a_turn < 0 { &mut a } else { &mut b }) = end;
        }
    }
    Some([a, b])
}
