//! Exact walks: from a vertex towards another, around an edge, along a missing edge.

use super::complex::TetComplex;
use crate::mesh::{FaceRef, Tet};
use tetdb_base::geom::IdSet;
use tetdb_base::storage::check_cancelled;

/// Steps towards a direction inside one ball before all of it is searched.
const TURNS_MAX: u32 = 400;

/// The next part that a straight line meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Exit {
    /// The goal: it is a vertex of this tetrahedron.
    Reached(u32),
    /// Another vertex.
    Vertex(u32),
    /// The inside of a face; named from the tetrahedron left behind.
    Face(FaceRef),
    /// The inside of an edge `c d` of tetrahedron `tet`.
    Edge { tet: u32, c: u32, d: u32 },
    /// The hull, or a walk without end: the space is damaged.
    Lost,
}

/// Vertices of `tet` with the one at `i` replaced by `v`.
#[inline]
pub(super) fn swapped(tet: &Tet, i: usize, v: u32) -> [u32; 4] {
    let mut q = tet.vertices();
    q[i] = v;
    q
}

/// The tetrahedron of the ball of `h` whose closed cone at `h` holds `b`; it has `b` iff the edge exists.
pub(super) fn cone<S: TetComplex>(s: &mut S, h: u32, b: u32) -> Option<u32> {
    let mut t = s.tet_of(h);
    for step in 0..TURNS_MAX {
        let tet = s.tet(t);
        let i = tet.local(h)?;
        if tet.local(b).is_some() {
            return Some(t);
        }
        match separating_face(s, &tet, i, b, step) {
            None => return Some(t),
            Some(j) => {
                let across = s.across(t, j);
                if !across.exists() {
                    break;
                }
                t = across.tet();
            }
        }
    }
    let ball = ball(s, h);
    ball.into_iter().find(|&t| {
        let tet = s.tet(t);
        tet.local(b).is_some()
            || tet.local(h).is_some_and(|i| separating_face(s, &tet, i, b, 0).is_none())
    })
}

/// A face at vertex `i` that strictly separates the cone from `b`.
fn separating_face<S: TetComplex>(
    s: &mut S,
    tet: &Tet,
    i: usize,
    b: u32,
    turn: u32,
) -> Option<usize> {
    (0..3)
        .map(|k| (i + 1 + (k + turn as usize) % 3) & 3)
        .find(|&j| s.orient(swapped(tet, j, b)) < 0.0)
}

/// All tetrahedra that have `v`.
pub(super) fn ball<S: TetComplex>(s: &mut S, v: u32) -> Vec<u32> {
    check_cancelled();
    let first = s.tet_of(v);
    let mut seen: IdSet<u32> = IdSet::from_iter([first]);
    let mut all = vec![first];
    let mut next = 0;
    while next < all.len() {
        let t = all[next];
        next += 1;
        let tet = s.tet(t);
        for i in 0..4 {
            if tet.vertex(i) != v {
                let across = s.across(t, i);
                if across.exists() && seen.insert(across.tet()) {
                    all.push(across.tet());
                }
            }
        }
    }
    all
}

/// A tetrahedron that has the edge `a b`, if the edge exists.
pub(super) fn find_edge<S: TetComplex>(s: &mut S, a: u32, b: u32) -> Option<u32> {
    let t = cone(s, a, b)?;
    s.tet(t).local(b).map(|_| t)
}

/// A tetrahedron that has the edge `a b`, where `t` had it before.
pub(super) fn edge_at<S: TetComplex>(s: &mut S, t: u32, a: u32, b: u32) -> Option<u32> {
    let tet = s.tet(t);
    let still = tet.is_live() && tet.local(a).is_some() && tet.local(b).is_some();
    if still { Some(t) } else { find_edge(s, a, b) }
}

/// The tetrahedra around an edge `c d` and the vertices opposite it.
///
/// Invariant: `tets[i]` has the vertices `c, d, ring[i], ring[i + 1]`, positive in this order.
#[derive(Clone, Debug)]
pub(super) struct EdgeRing {
    pub tets: Vec<u32>,
    pub ring: Vec<u32>,
    /// True if a required face has the edge.
    pub required: bool,
}

/// The two vertices other than `c` and `d`, so that `c d x y` is positive.
pub(super) fn opposite(tet: &Tet, c: u32, d: u32) -> Option<(usize, usize)> {
    let (i, j) = (tet.local(c)?, tet.local(d)?);
    let mut rest = (0..4).filter(|&k| k != i && k != j);
    let (k, l) = (rest.next()?, rest.next()?);
    let p = [i, j, k, l];
    let inversions =
        (0..4).flat_map(|x| (x + 1..4).map(move |y| (x, y))).filter(|&(x, y)| p[x] > p[y]).count();
    Some(if inversions % 2 == 0 { (k, l) } else { (l, k) })
}

/// The shell of the edge `c d` of tetrahedron `t`; `None` when it reaches the hull.
pub(super) fn shell<S: TetComplex>(s: &mut S, t: u32, c: u32, d: u32) -> Option<EdgeRing> {
    // Every flip and every search comes by here.
    check_cancelled();
    let mut shell = EdgeRing { tets: Vec::new(), ring: Vec::new(), required: false };
    let mut at = t;
    loop {
        let tet = s.tet(at);
        let (x, y) = opposite(&tet, c, d)?;
        shell.tets.push(at);
        shell.ring.push(tet.vertex(x));
        shell.required |= tet.is_required(x);
        let across = s.across(at, x);
        if !across.exists() {
            return None;
        }
        at = across.tet();
        if at == t {
            return Some(shell);
        }
        debug_assert_eq!(s.tet(at).local(tet.vertex(y)).map(|_| ()), Some(()));
    }
}

/// The first part that the line from vertex `h` to `b` meets.
pub(super) fn exit_vertex<S: TetComplex>(s: &mut S, h: u32, b: u32) -> Exit {
    let Some(t) = cone(s, h, b) else {
        return Exit::Lost;
    };
    let tet = s.tet(t);
    if tet.local(b).is_some() {
        return Exit::Reached(t);
    }
    let i = tet.local(h).expect("the cone has its apex");
    let others = [1, 2, 3].map(|k| (i + k) & 3);
    let flat = others.map(|j| s.orient(swapped(&tet, j, b)) == 0.0);
    match flat.iter().filter(|&&f| f).count() {
        0 => Exit::Face(FaceRef::new(t, i)),
        1 => {
            let j = flat.iter().position(|&f| f).expect("one is flat");
            let mut rest = others.iter().filter(|&&k| k != others[j]);
            let (&p, &q) = (rest.next().expect("two"), rest.next().expect("two"));
            Exit::Edge { tet: t, c: tet.vertex(p), d: tet.vertex(q) }
        }
        _ => {
            let j = flat.iter().position(|&f| !f).unwrap_or(0);
            Exit::Vertex(tet.vertex(others[j]))
        }
    }
}

/// The part that the line `a b` meets after the inside of `face`.
pub(super) fn exit_face<S: TetComplex>(s: &mut S, a: u32, b: u32, face: FaceRef) -> Exit {
    let across = s.across(face.tet(), face.face());
    if !across.exists() {
        return Exit::Lost;
    }
    let tet = s.tet(across.tet());
    let e = tet.vertex(across.face());
    if e == b {
        return Exit::Reached(across.tet());
    }
    let p = tet.face(across.face());
    let side = s.orient([a, b, p[0], p[1]]).signum();
    let w = p.map(|p| s.orient([a, b, p, e]) * side);
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        if w[j] > 0.0 && w[i] < 0.0 {
            let l = tet.local(p[k]).expect("a vertex of the face");
            return Exit::Face(FaceRef::new(across.tet(), l));
        }
        if w[i] == 0.0 && w[j] > 0.0 {
            return Exit::Edge { tet: across.tet(), c: p[i], d: e };
        }
    }
    Exit::Vertex(e)
}

/// The part that the line `a b` meets after the inside of the edge `c d` of `t`.
pub(super) fn exit_edge<S: TetComplex>(s: &mut S, a: u32, b: u32, t: u32, c: u32, d: u32) -> Exit {
    let Some(shell) = shell(s, t, c, d) else {
        return Exit::Lost;
    };
    let n = shell.ring.len();
    if let Some(i) = shell.ring.iter().position(|&r| r == b) {
        return Exit::Reached(shell.tets[i]);
    }
    for i in 0..n {
        let (x, y) = (shell.ring[i], shell.ring[(i + 1) % n]);
        let (at_x, at_y) = (s.orient([c, d, x, b]), s.orient([c, d, b, y]));
        if at_x < 0.0 || at_y <= 0.0 {
            continue;
        }
        let tet = shell.tets[i];
        if at_x == 0.0 {
            // Along the face c d x: it leaves through one of its other edges.
            let (of_x, of_c) = (s.orient([a, b, x, y]), s.orient([a, b, c, y]));
            return if of_x == 0.0 {
                Exit::Vertex(x)
            } else if (of_x > 0.0) == (of_c > 0.0) {
                Exit::Edge { tet, c: d, d: x }
            } else {
                Exit::Edge { tet, c, d: x }
            };
        }
        let s0 = s.orient([a, b, x, y]);
        if s0 == 0.0 {
            return Exit::Edge { tet, c: x, d: y };
        }
        let s1 = s.orient([a, b, y, c]);
        let through_c = (s0 > 0.0) == (s1 > 0.0);
        let record = s.tet(tet);
        let kept = record.local(if through_c { d } else { c });
        return kept.map_or(Exit::Lost, |k| Exit::Face(FaceRef::new(tet, k)));
    }
    Exit::Lost
}

/// All parts that the missing edge `a b` crosses, from `a` on; `Err` is the part that ends the walk early.
pub(super) fn crossings<S: TetComplex>(
    s: &mut S,
    a: u32,
    b: u32,
    n_max: usize,
) -> Result<Vec<Exit>, Exit> {
    let mut met = Vec::new();
    let mut exit = exit_vertex(s, a, b);
    loop {
        match exit {
            Exit::Reached(_) => return Ok(met),
            Exit::Vertex(_) | Exit::Lost => return Err(exit),
            _ if met.len() >= n_max => return Err(Exit::Lost),
            _ => {}
        }
        met.push(exit);
        exit = match exit {
            Exit::Face(face) => exit_face(s, a, b, face),
            Exit::Edge { tet, c, d } => exit_edge(s, a, b, tet, c, d),
            other => other,
        };
    }
}
