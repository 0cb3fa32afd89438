//! The target of a recovery, and whether a new edge or face would cross it.

use super::complex::TetComplex;

/// The missing part; nothing new may cross it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RecoveryTarget {
    Edge(u32, u32),
    Face([u32; 3]),
    /// The plane of these three: no edge may cross it anywhere.
    Plane([u32; 3]),
    /// No edge or face is forbidden.
    Free,
}

impl RecoveryTarget {
    /// Returns whether the new edge `x y`, with its faces to `c` and `d`, keeps clear of the target.
    pub fn allows_edge<S: TetComplex>(self, s: &mut S, x: u32, y: u32, [c, d]: [u32; 2]) -> bool {
        match self {
            Self::Edge(a, b) => {
                !edge_meets_face(s, a, b, [x, y, c]) && !edge_meets_face(s, a, b, [x, y, d])
            }
            Self::Free => true,
            Self::Face(f) => {
                // An edge with an end in the plane, on or off the facet, stays on its side.
                let (sx, sy) = (s.orient([f[0], f[1], f[2], x]), s.orient([f[0], f[1], f[2], y]));
                sx == 0.0 || sy == 0.0 || (sx > 0.0) == (sy > 0.0) || !edge_meets_face(s, x, y, f)
            }
            Self::Plane([p, q, r]) => {
                let (sx, sy) = (s.orient([p, q, r, x]), s.orient([p, q, r, y]));
                sx == 0.0 || sy == 0.0 || (sx > 0.0) == (sy > 0.0)
            }
        }
    }

    /// Returns whether the new face keeps clear of the target, its edges being known to.
    pub fn allows_face<S: TetComplex>(self, s: &mut S, face: [u32; 3]) -> bool {
        match self {
            Self::Edge(a, b) => !edge_meets_face(s, a, b, face),
            Self::Face(_) | Self::Plane(_) | Self::Free => true,
        }
    }
}

/// Returns whether the segment `a b` meets the closed triangle elsewhere than in shared vertices.
///
/// Exact if false; true may also occur in a coplanar neighborhood without contact.
pub(super) fn edge_meets_face<S: TetComplex>(s: &mut S, a: u32, b: u32, f: [u32; 3]) -> bool {
    let (has_a, has_b) = (f.contains(&a), f.contains(&b));
    if has_a && has_b {
        return false;
    }
    if has_a || has_b {
        return edge_runs_in_face(s, a, b, f);
    }
    let (sa, sb) = (s.orient([f[0], f[1], f[2], a]), s.orient([f[0], f[1], f[2], b]));
    if sa * sb > 0.0 || (sa > 0.0 && sb > 0.0) || (sa < 0.0 && sb < 0.0) {
        return false;
    }
    if sa == 0.0 && sb == 0.0 {
        return true;
    }
    let w = [0, 1, 2].map(|i| s.orient([a, b, f[i], f[(i + 1) % 3]]));
    !(w.iter().any(|&x| x > 0.0) && w.iter().any(|&x| x < 0.0))
}

/// The case of one shared vertex: the rest of the segment lies in the triangle's plane and corner.
fn edge_runs_in_face<S: TetComplex>(s: &mut S, a: u32, b: u32, f: [u32; 3]) -> bool {
    let (h, goal) = if f.contains(&a) { (a, b) } else { (b, a) };
    if s.orient([f[0], f[1], f[2], goal]) != 0.0 {
        return false;
    }
    let i = f.iter().position(|&v| v == h).expect("shared");
    let (p, q) = (f[(i + 1) % 3], f[(i + 2) % 3]);
    // In the plane: goal lies in the corner iff p and q are not on one strict side of the line h goal,
    // and not both behind. Rounded positions decide the latter; a wrong yes only costs a possibility.
    let [o, g, p, q] = [h, goal, p, q].map(|v| s.position(v));
    let (g, p, q) = (g - o, p - o, q - o);
    let n = p.cross(q);
    let (left, right) = (p.cross(g).dot(n), g.cross(q).dot(n));
    let slack = 1e-12 * n.length() * g.length() * (p.length() + q.length());
    left >= -slack && right >= -slack
}
