//! The load ∫ h⁻³ of a mesh, summed over pieces in which h varies little.
//!
//! A coarse tetrahedron may span the whole domain while h varies tenfold within: its corners say nothing of its
//! middle. It is divided along its longest edge until h varies little between the corners and the edge is a bounded number of
//! wanted lengths long; the pieces then have a closed form.

use crate::mesh::Mesh;
use crate::sizing::density_of_tet;
use tetdb_base::geom::Point;
use tetdb_base::storage::{Pages, check_cancelled, for_each_mut};

/// Longest edge of a piece in units of its smallest h: a narrow dip of a field graded by 1.3 per unit length is not stepped over, and the load is known where it lies.
const EDGE_MAX: f64 = 5.0;
/// Largest ratio of sizes at the corners of a piece that is longer than [`EDGE_FINE`].
const RATIO_MAX: f64 = 1.5;
/// A piece with less load than this (ten tetrahedra) is not divided, however long: coarse tetrahedra span the domain and are thin,
/// and dividing them all to the last took half of a bisection.
const LOAD_MIN: f64 = 1.0;
/// Pieces of about the wanted length are not divided further.
const EDGE_FINE: f64 = 2.0;

/// A piece of a tetrahedron.
#[derive(Clone, Copy, Debug)]
pub struct TetPiece {
    pub points: [Point; 4],
    /// Load ∫ h⁻³ of the piece.
    pub load: f64,
    /// Wanted length in its middle, as the mean of the corners.
    pub h: f64,
}

/// Sums are kept in so many lanes at once. The result depends on it in its last bits, so it is a constant.
const LANES: usize = 16;
/// Consecutive tetrahedra that go to the same lane, and how many such blocks are read before the lanes are worked on.
const BLOCK: usize = 64;
const BLOCKS: usize = 256;

/// A wanted length at each point, called from several threads.
pub type SizeFn<'a> = dyn Fn(Point) -> f64 + Sync + 'a;

/// Corners of a tetrahedron and the sizes there.
type Sized4 = ([Point; 4], [f64; 4]);

/// Adds every piece of every tetrahedron to the sum of its lane; `empty` creates a sum.
///
/// `see` is shown the corners of all tetrahedra. Which lane a tetrahedron goes to, and in which order, depends on the mesh alone; the caller adds the lanes up in order.
pub fn tally<P: Pages, T: Send>(
    mesh: &mut Mesh<P>,
    h: &SizeFn,
    empty: impl Fn() -> T,
    visit_corner: &mut impl FnMut(Point),
    add: impl Fn(&mut T, &TetPiece) + Sync,
) -> [T; LANES] {
    let mut lanes: [(Vec<Sized4>, T); LANES] = std::array::from_fn(|_| (Vec::new(), empty()));
    let mut from = 0;
    loop {
        let mut read = 0;
        while let Some((t, tet)) = mesh.next_tet(from).filter(|_| read < BLOCK * BLOCKS) {
            from = t + 1;
            let [a, b, c, d] = mesh.ends(&tet);
            let points = [a.point, b.point, c.point, d.point];
            let sizes = [a.h, b.h, c.h, d.h].map(f64::from);
            points.into_iter().for_each(&mut *visit_corner);
            lanes[read / BLOCK % LANES].0.push((points, sizes));
            read += 1;
        }
        if read == 0 {
            return lanes.map(|(_, sum)| sum);
        }
        check_cancelled();
        for_each_mut(&mut lanes, |(tets, sum)| {
            let mut stack = Vec::new();
            for tet in &*tets {
                divide(*tet, h, &mut stack, &mut |piece| add(sum, piece));
            }
            tets.clear();
        });
    }
}

/// Calls `visit` with every piece of a tetrahedron; `stack` is empty before and after.
fn divide(tet: Sized4, h: &SizeFn, stack: &mut Vec<Sized4>, visit: &mut impl FnMut(&TetPiece)) {
    let mut next = Some(tet);
    while let Some((points, sizes)) = next.take().or_else(|| stack.pop()) {
        let (edge, [i, j]) = longest(&points);
        let least = (sizes[0].min(sizes[1])).min(sizes[2].min(sizes[3]));
        let most = (sizes[0].max(sizes[1])).max(sizes[2].max(sizes[3]));
        let coarse = edge > EDGE_MAX * least || most > RATIO_MAX * least;
        let [a, b, c, d] = points;
        let volume = (b - a).cross(c - a).dot(d - a) / 6.0;
        if coarse && edge > EDGE_FINE * least {
            let middle = (points[i] + points[j]) * 0.5;
            let size = h(middle);
            if volume > LOAD_MIN * least.min(size).powi(3) {
                let half = |end: usize| {
                    let (mut points, mut sizes) = (points, sizes);
                    (points[end], sizes[end]) = (middle, size);
                    (points, sizes)
                };
                stack.push(half(i));
                next = Some(half(j));
                continue;
            }
        }
        let load = density_of_tet(sizes) * volume.max(0.0);
        let h = sizes.iter().sum::<f64>() * 0.25;
        visit(&TetPiece { points, load, h });
    }
}

/// The longest edge (the first of equals) and its ends.
fn longest(p: &[Point; 4]) -> (f64, [usize; 2]) {
    let (mut most, mut ends) = (-1.0, [0, 1]);
    for pair in crate::mesh::anatomy::EDGES {
        let length = (p[pair[0]] - p[pair[1]]).length_squared();
        if length > most {
            (most, ends) = (length, pair);
        }
    }
    (most.sqrt(), ends)
}

/// The load of the whole mesh.
pub fn load_of<P: Pages>(mesh: &mut Mesh<P>, h: &SizeFn) -> f64 {
    let sums = tally(mesh, h, || 0.0, &mut |_| (), |sum, piece| *sum += piece.load);
    sums.into_iter().sum()
}
