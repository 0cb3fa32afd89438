//! The tetrahedra of the pattern, each once for all its periods.

use std::sync::OnceLock;

use super::super::tile::{CELLS, Tile};
use crate::delaunay::{Kernel, enclose};
use crate::mesh::{Mesh, dense};
use tetdb_base::geom::{Aabb, HilbertFrame, Point};
use tetdb_base::storage::Pager;

/// Cells around one period whose points are needed to know its tetrahedra: spheres are less than a cell in radius.
const MARGIN: i32 = 3;
/// Memory for the mesh of a period and what is around it.
const MESH_BYTES: u64 = 64 << 20;

/// A point of the pattern seen from another one: its cell, counted from that one's, and its number in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Beside {
    pub cell: [i8; 3],
    pub rank: u8,
}

/// A tetrahedron of the pattern. It belongs to one of its vertices, the first of them in the order of cells within a period.
#[derive(Clone, Copy, Debug)]
pub(super) struct PatternTet {
    /// Its vertices, seen from its owner; positive.
    pub corners: [Beside; 4],
    /// Beyond each face: the owner of the tetrahedron there, its number among the owner's, and its face.
    pub across: [(Beside, u8, u8); 4],
}

/// All tetrahedra of the pattern, by owner.
pub(super) struct PatternTets {
    tets: Vec<PatternTet>,
    /// Of each cell the number of its first point; and the number of all.
    points: Vec<u32>,
    /// Of each point where its tetrahedra begin, and the end of the last.
    starts: Vec<u32>,
    /// Of each point how many tetrahedra have it.
    stars: Vec<u8>,
}

impl PatternTets {
    /// Computed the first time: it takes as long as 50,000 tetrahedra of a mesh.
    pub fn get() -> &'static Self {
        static TETS: OnceLock<PatternTets> = OnceLock::new();
        TETS.get_or_init(|| Self::of(Tile::get()))
    }

    /// The number of the first point of a cell of the period, and how many points the cell has.
    pub fn points_of(&self, cell: usize) -> (u32, u32) {
        let [from, to] = [self.points[cell], self.points[cell + 1]];
        (from, to - from)
    }

    /// The tetrahedra that belong to point `n`.
    pub fn owned(&self, n: u32) -> &[PatternTet] {
        let [from, to] = [0, 1].map(|k| self.starts[n as usize + k] as usize);
        &self.tets[from..to]
    }

    /// How many tetrahedra have point `n`.
    pub fn star(&self, n: u32) -> u8 {
        self.stars[n as usize]
    }

    fn of(tile: &Tile) -> Self {
        let (vertices, mut mesh) = mesh_of(tile);
        let n_cells = CELLS * CELLS * CELLS;
        let mut points = vec![0];
        for cell in 0..n_cells {
            points.push(points[cell] + tile.points_of(along(cell)).len() as u32);
        }
        let n_points = points[n_cells];
        let number = |v: &Vertex| points[wrapped(v.cell)] + u32::from(v.rank);
        let vertex = |v: u32| vertices.get((dense(v) as usize).checked_sub(BOX)?);
        // Those that belong to a point of this period, by owner.
        let mut found = Vec::new();
        let mut stars = vec![0u8; n_points as usize];
        let mut from = 0;
        while let Some((t, tet)) = mesh.next_tet(from) {
            from = t + 1;
            let [Some(a), Some(b), Some(c), Some(d)] = tet.vertices().map(vertex) else {
                continue;
            };
            let corners = [*a, *b, *c, *d];
            let owner = owner(&corners, &number);
            if owner.is_inside() {
                for v in &corners {
                    stars[number(v) as usize] += 1;
                }
                found.push((number(&owner), t, corners.map(|v| v.beside(&owner))));
            }
        }
        found.sort_unstable_by_key(|&(n, t, _)| (n, t));
        let starts = (0..=n_points).map(|n| found.partition_point(|f| f.0 < n) as u32);
        let starts: Vec<u32> = starts.collect();
        let tets = found.iter().map(|&(_, t, corners)| {
            let here = owner(&mesh.tet(t).vertices().map(|v| *vertex(v).expect(NEAR)), &number);
            let across = mesh.tet(t).neighbor.map(|face| {
                let beyond = mesh.tet(face.tet()).vertices();
                let beyond = beyond.map(|v| *vertex(v).expect(NEAR));
                let there = owner(&beyond, &number);
                // It may be that of another period, with its vertices in another order.
                let seen = beyond.map(|v| v.beside(&there));
                let n = number(&there) as usize;
                let owned = &found[starts[n] as usize..starts[n + 1] as usize];
                let same = |own: &[Beside; 4]| seen.iter().all(|corner| own.contains(corner));
                let k = owned.iter().position(|(_, _, own)| same(own));
                let k = k.expect("every tetrahedron has its like in this period");
                let apex = seen[face.face()];
                let face = owned[k].2.iter().position(|c| *c == apex);
                let face = face.expect("they have the same vertices");
                (there.beside(&here), k as u8, face as u8)
            });
            PatternTet { corners, across }
        });
        Self { tets: tets.collect(), points, starts, stars }
    }
}

/// Vertices of the box around a mesh, which come first.
const BOX: usize = 8;
/// Why a tetrahedron beside one of the period has no vertex of the box.
const NEAR: &str = "spheres are smaller than the margin";

/// The vertex that a tetrahedron belongs to.
fn owner(corners: &[Vertex; 4], number: &impl Fn(&Vertex) -> u32) -> Vertex {
    let [a, b, c, d] = *corners;
    let first = |a: Vertex, b: Vertex| if number(&b) < number(&a) { b } else { a };
    first(first(a, b), first(c, d))
}

/// A point of the pattern somewhere: its cell, counted from the period's first, and its number in it.
#[derive(Clone, Copy)]
struct Vertex {
    cell: [i32; 3],
    rank: u8,
}

impl Vertex {
    /// This one as `owner` sees it.
    fn beside(&self, owner: &Self) -> Beside {
        Beside {
            cell: std::array::from_fn(|k| (self.cell[k] - owner.cell[k]) as i8),
            rank: self.rank,
        }
    }

    fn is_inside(&self) -> bool {
        self.cell.iter().all(|c| (0..CELLS as i32).contains(c))
    }
}

/// The place along each axis of a cell.
fn along(cell: usize) -> [usize; 3] {
    [cell % CELLS, cell / CELLS % CELLS, cell / (CELLS * CELLS)]
}

/// The number, within a period, of a cell somewhere.
pub(super) fn wrapped(cell: [i32; 3]) -> usize {
    let [x, y, z] = cell.map(|c| c.rem_euclid(CELLS as i32) as usize);
    (z * CELLS + y) * CELLS + x
}

/// The Delaunay mesh of a period and the cells around it, and which point each vertex is, those of the box left out.
fn mesh_of(tile: &Tile) -> (Vec<Vertex>, Mesh) {
    let mut mesh = Mesh::new(Pager::new(MESH_BYTES, None));
    let low = Point::splat(-f64::from(MARGIN) / CELLS as f64);
    let bounds = Aabb::around([low, Point::ONE - low]);
    let mut hint = enclose(&mut mesh, &bounds);
    let frame = HilbertFrame::new(&bounds);
    let range = -MARGIN..CELLS as i32 + MARGIN;
    let mut all = Vec::new();
    for z in range.clone() {
        for y in range.clone() {
            for x in range.clone() {
                let cell = [x, y, z];
                let period = cell.map(|c| f64::from(c.div_euclid(CELLS as i32)));
                let at = cell.map(|c| c.rem_euclid(CELLS as i32) as usize);
                for (rank, &p) in (0..).zip(tile.points_of(at)) {
                    let p = p + Point::from_array(period);
                    all.push((frame.index(p), p, Vertex { cell, rank }));
                }
            }
        }
    }
    all.sort_unstable_by_key(|a| a.0);
    let mut kernel = Kernel::default();
    let mut vertices = Vec::with_capacity(all.len());
    for (_, p, vertex) in all {
        let v = mesh.add_vertex(p, 0.0);
        let inserted = kernel.insert(&mut mesh, v, p, hint);
        hint = inserted.expect("points of the pattern differ and lie in the box");
        vertices.push(vertex);
    }
    (vertices, mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tetrahedra_fill_the_period_and_agree_about_their_neighbors() {
        let (tile, tets) = (Tile::get(), PatternTets::get());
        let (mut volume, mut n, mut n_corners) = (0.0, 0usize, 0usize);
        for cell in 0..CELLS * CELLS * CELLS {
            let home = along(cell).map(|c| c as i32);
            let position = |seen: Beside, home: [i32; 3]| {
                let cell: [i32; 3] = std::array::from_fn(|k| home[k] + i32::from(seen.cell[k]));
                let period = cell.map(|c| f64::from(c.div_euclid(CELLS as i32)));
                let p = tile.points_of(along(wrapped(cell)))[usize::from(seen.rank)];
                p + Point::from_array(period)
            };
            let (first, n_here) = tets.points_of(cell);
            for point in first..first + n_here {
                for tet in tets.owned(point) {
                    let [a, b, c, d] = tet.corners.map(|c| position(c, home));
                    let six = (b - a).cross(c - a).dot(d - a);
                    assert!(six > 0.0);
                    volume += six / 6.0;
                    (n, n_corners) = (n + 1, n_corners + 4);
                    for (i, &(owner, k, face)) in tet.across.iter().enumerate() {
                        let there: [i32; 3] =
                            std::array::from_fn(|k| home[k] + i32::from(owner.cell[k]));
                        let number = tets.points_of(wrapped(there)).0 + u32::from(owner.rank);
                        let other = &tets.owned(number)[usize::from(k)];
                        let mut here: Vec<[u64; 3]> = (0..4)
                            .filter(|&j| j != i)
                            .map(|j| position(tet.corners[j], home).to_array().map(f64::to_bits))
                            .collect();
                        let mut beyond: Vec<[u64; 3]> = (0..4)
                            .filter(|&j| j != usize::from(face))
                            .map(|j| position(other.corners[j], there).to_array().map(f64::to_bits))
                            .collect();
                        here.sort_unstable();
                        beyond.sort_unstable();
                        assert_eq!(here, beyond);
                    }
                }
            }
        }
        assert!((volume - 1.0).abs() < 1e-9, "{volume}");
        let stars: usize = tets.stars.iter().map(|&s| usize::from(s)).sum();
        assert_eq!(stars, n_corners);
        assert!(n > 5 * 4096, "{n}");
    }
}
