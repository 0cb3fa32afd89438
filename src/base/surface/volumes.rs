//! The volumes that a surface encloses, found from its triangles alone.
//!
//! ```text
//!        \   t2        Around an edge the triangles follow each other by exact signs; between two of them
//!   side  \  /          lies one volume. So sides that face each other are joined; what is left apart are
//!          \/           shells, and a line along z up from each shell joins the sides that see each other on it.
//!   t1 ----*            The side that sees nothing lies outside.
//! ```

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::Surface;
use super::edges::{Facets, Groups, TriangleAtEdge};
use super::seeker::{Crossing, Seeker};
use crate::geom::{Point, orient_sign};
use crate::storage::{ScratchSpace, parallel};

/// Bytes held for each triangle while volumes are identified: which sides see each other, which triangles hang together, which is left out.
pub const VOLUMES_TRIANGLE: usize = 13;

/// Shells from which threads look up before what they see is joined.
const SHELLS_AT_ONCE: usize = 1 << 12;

/// The number of the unbounded volume.
pub const OUTSIDE: u32 = 0;

/// The wall between two volumes: triangles whose front faces the lower-numbered one, and the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wall {
    /// Triangles whose front looks into the lower-numbered volume.
    pub front: u64,
    /// The other triangles.
    pub back: u64,
}

/// The volumes of a closed surface.
///
/// Invariant: volume 0 is the unbounded one; the others are numbered by the first triangle at each, as the regions of the mesh are.
/// Two triangles that are the two sides of one wall are both listed, with the same volumes.
#[derive(Clone, Debug, PartialEq)]
pub struct EnclosedVolumes {
    /// For each triangle: the volume in front, the volume behind.
    pub of_side: Vec<[u32; 2]>,
    /// Number of volumes, the unbounded one included.
    pub n_volumes: u32,
    /// For each volume: the sum of its angles at edges in radians; each angle is correct to a hundredth.
    pub angles: Vec<f64>,
}

impl EnclosedVolumes {
    /// [`EnclosedVolumes::new_in`] in memory.
    pub fn new(seeker: &Seeker) -> Self {
        Self::new_in(seeker, &ScratchSpace::boundless())
    }

    /// Identifies the volumes within scratch space. Sides at open edges are joined, so an open surface encloses
    /// nothing. Memory outside the scratch space: [`VOLUMES_TRIANGLE`] bytes a triangle, which the caller leases. A
    /// scratch file that fails unwinds.
    pub fn new_in(seeker: &Seeker, scratch: &ScratchSpace) -> Self {
        let surface = seeker.surface();
        let n = surface.n_triangles();
        let mut facets = Facets::new(surface, scratch);
        let mut sides = Groups::new(2 * n + 1);
        let mut shells = Groups::new(n);
        facets.each_edge(|uses| {
            join_around(surface, uses, &mut sides);
            for pair in uses.windows(2) {
                shells.join(pair[0].triangle(), pair[1].triangle());
            }
        });
        for &[a, b] in &facets.duplicates {
            sides.join(2 * a, 2 * b);
            sides.join(2 * a + 1, 2 * b + 1);
        }
        for &[a, b] in &facets.two_sided {
            sides.join(2 * a, 2 * b + 1);
            sides.join(2 * a + 1, 2 * b);
            shells.join(a, b);
        }
        for t in (0..n as u32).filter(|&t| surface.is_sheet(t)) {
            sides.join(2 * t, 2 * t + 1);
        }
        let outside = 2 * n as u32;
        let shells = Shells::new(seeker, &facets, shells);
        for some in shells.list.chunks(SHELLS_AT_ONCE) {
            let of = |shell: &Shell| shells.seen_from(shell, outside);
            let seen: Vec<_> = parallel(|| some.par_iter().map(of).collect());
            seen.into_iter().flatten().for_each(|[below, above]| sides.join(below, above));
        }
        drop(shells);
        let mut volumes = numbered(surface, sides);
        facets.each_edge(|uses| volumes.add_angles(surface, uses));
        volumes
    }

    /// Pairs of volumes with a common wall, and its triangles; triangles with one volume on both sides are no wall.
    pub fn walls(&self) -> BTreeMap<(u32, u32), Wall> {
        let mut walls: BTreeMap<(u32, u32), Wall> = BTreeMap::new();
        for &[front, back] in self.of_side.iter().filter(|[f, b]| f != b) {
            let wall = walls.entry((front.min(back), front.max(back))).or_default();
            if front < back {
                wall.front += 1;
            } else {
                wall.back += 1;
            }
        }
        walls
    }

    /// Number of walls between the outside and each volume.
    pub fn depths(&self) -> Vec<u32> {
        let mut depths = vec![u32::MAX; self.n_volumes as usize];
        depths[OUTSIDE as usize] = 0;
        let walls: Vec<(u32, u32)> = self.walls().into_keys().collect();
        // Each round reaches one wall farther.
        let mut next = 1;
        loop {
            let mut is_found = false;
            for &(a, b) in &walls {
                for (from, to) in [(a, b), (b, a)] {
                    if depths[from as usize] == next - 1 && depths[to as usize] > next {
                        depths[to as usize] = next;
                        is_found = true;
                    }
                }
            }
            if !is_found {
                return depths;
            }
            next += 1;
        }
    }

    /// The volumes that triangles of labels enclose: of the two at each the one farther from the outside, both where they are equally far.
    pub fn enclosed_by(&self, surface: &Surface, labels: &[u32]) -> BTreeSet<u32> {
        let depths = self.depths();
        let depth = |v: u32| depths[v as usize];
        let mut found = BTreeSet::new();
        for (&[front, back], _) in (self.of_side.iter().zip(&surface.labels))
            .filter(|([f, b], l)| labels.contains(l) && f != b)
        {
            let deepest = depth(front).max(depth(back));
            found.extend([front, back].into_iter().filter(|&v| depth(v) == deepest));
        }
        found.remove(&OUTSIDE);
        found
    }

    /// The volume that holds `p`, which is not on the surface.
    pub fn at(&self, seeker: &Seeker, p: Point) -> u32 {
        seeker.above(p).map_or(OUTSIDE, |c| {
            let side = c.sides()[0];
            self.of_side[side as usize / 2][side as usize % 2]
        })
    }

    fn add_angles(&mut self, surface: &Surface, uses: &[TriangleAtEdge]) {
        for [this, next] in pairs_around(surface, uses) {
            let side = this.side_after(surface) as usize;
            let volume = self.of_side[side / 2][side % 2];
            // Around the end of a sheet there is one volume.
            self.angles[volume as usize] += match uses.len() {
                1 => std::f64::consts::TAU,
                _ => this.angle_to(next, surface),
            };
        }
    }
}

/// Joins the sides that face each other around one edge.
fn join_around(surface: &Surface, uses: &[TriangleAtEdge], sides: &mut Groups) {
    for [this, next] in pairs_around(surface, uses) {
        sides.join(this.side_after(surface), next.side_before(surface));
    }
}

/// Triangles that follow each other around an edge.
fn pairs_around(surface: &Surface, uses: &[TriangleAtEdge]) -> Vec<[TriangleAtEdge; 2]> {
    let mut order = uses.to_vec();
    if uses.len() > 2 {
        sort_around(surface, &mut order);
    }
    let next = order.iter().cycle().skip(1);
    order.iter().zip(next).map(|(&a, &b)| [a, b]).collect()
}

/// The angle of a direction seen from the x axis, from 0 to 2π, within 0.004: from basic operations, equal on every machine.
fn angle(x: f64, y: f64) -> f64 {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let (low, high) = (x.abs().min(y.abs()), x.abs().max(y.abs()));
    let t = if high > 0.0 { low / high } else { 0.0 };
    let eighth = t * (FRAC_PI_4 + 0.273 * (1.0 - t));
    let quarter = if y.abs() > x.abs() { FRAC_PI_2 - eighth } else { eighth };
    let half = if x < 0.0 { PI - quarter } else { quarter };
    if y < 0.0 { 2.0 * PI - half } else { half }
}

impl TriangleAtEdge {
    /// The side seen when turning on from the triangle, counter-clockwise seen from the edge's larger vertex.
    fn side_after(self, surface: &Surface) -> u32 {
        2 * self.triangle() + u32::from(!self.is_forward(surface))
    }

    fn side_before(self, surface: &Surface) -> u32 {
        self.side_after(surface) ^ 1
    }

    /// The angle to another triangle at the same edge, turning as [`Self::side_after`] does.
    fn angle_to(self, other: Self, surface: &Surface) -> f64 {
        let [a, b] = self.edge.map(|v| surface.points[v as usize]);
        let axis = (b - a).normalize_or_zero();
        let across = |p: Point| (p - a) - axis * (p - a).dot(axis);
        let (p, q) = (across(self.apex(surface)), across(other.apex(surface)));
        angle(p.dot(q), axis.dot(p.cross(q)))
    }

    fn apex(self, surface: &Surface) -> Point {
        let t = surface.triangles[self.triangle() as usize];
        surface.points[t[(self.corner() + 2) % 3] as usize]
    }
}

/// Sorts triangles around their edge, counter-clockwise, from the first.
fn sort_around(surface: &Surface, uses: &mut [TriangleAtEdge]) {
    let [a, b] = uses[0].edge.map(|v| surface.points[v as usize]);
    let first = uses[0].apex(surface);
    // Quarter: the first itself, less than half a turn on, half a turn, more.
    let place = |p: Point| match orient_sign(a, b, first, p) {
        Ordering::Greater => 1,
        Ordering::Less => 3,
        Ordering::Equal if p == first => 0,
        Ordering::Equal => 2,
    };
    uses[1..].sort_by(|x, y| {
        let (p, q) = (x.apex(surface), y.apex(surface));
        let turn = || orient_sign(a, b, q, p);
        place(p).cmp(&place(q)).then_with(turn).then(x.cmp(y))
    });
}

/// Triangles that hang together through edges.
#[derive(Clone, Copy)]
struct Shell {
    /// The first of its triangles.
    root: u32,
    /// The triangle that shows most from above.
    triangle: u32,
    /// Its highest z.
    top: f64,
}

/// All shells of a surface.
struct Shells<'a> {
    seeker: &'a Seeker<'a>,
    /// By triangle.
    is_left_out: &'a [bool],
    /// By triangle its shell's first one.
    roots: Vec<u32>,
    /// By their first triangles.
    list: Vec<Shell>,
}

impl<'a> Shells<'a> {
    fn new(seeker: &'a Seeker<'a>, facets: &'a Facets, groups: Groups) -> Self {
        let roots = groups.into_roots();
        let mut best: BTreeMap<u32, (f64, Shell)> = BTreeMap::new();
        for (triangle, &root) in (0u32..).zip(&roots) {
            if facets.is_left_out[triangle as usize] {
                continue;
            }
            let [a, b, c] = seeker.surface().corners(triangle);
            let area = (b - a).cross(c - a).z.abs();
            let top = a.z.max(b.z).max(c.z);
            let (most, shell) = best.entry(root).or_insert((area, Shell { root, triangle, top }));
            if area > *most {
                (*most, shell.triangle) = (area, triangle);
            }
            shell.top = shell.top.max(top);
        }
        let list = best.into_values().map(|(_, shell)| shell).collect();
        Self { seeker, is_left_out: &facets.is_left_out, roots, list }
    }

    /// Highest z of a triangle's shell.
    fn top(&self, triangle: u32) -> f64 {
        let root = self.roots[triangle as usize];
        let found = self.list.binary_search_by_key(&root, |shell| shell.root);
        found.map_or(f64::NEG_INFINITY, |i| self.list[i].top)
    }

    /// Sides that see each other on a line along z, from a shell up to the first one that reaches higher; past all shells
    /// the outside.
    ///
    /// This joins all sides of each volume: on the line, the shell's own volume is left into the one around it, and what
    /// follows is either the shell around that volume, which reaches higher; or a shell beside this one, which is passed if
    /// it does not reach higher, with all that lies in it. So each shell is joined to the one around it or, by way of
    /// higher and higher ones beside it, with one that is.
    fn seen_from(&self, shell: &Shell, outside: u32) -> Vec<[u32; 2]> {
        let (surface, t) = (self.seeker.surface(), shell.triangle);
        let [a, b, c] = surface.corners(t);
        let middle = (a + b + c) / 3.0;
        let is_end = |t: u32| !self.is_left_out[t as usize] && self.top(t) > shell.top;
        let mut line = self.seeker.upward(middle, t, is_end);
        line.retain(|c| !self.is_left_out[c.triangle as usize]);
        let mut sides: Vec<u32> = line.iter().flat_map(Crossing::sides).collect();
        if !line.iter().any(|c| is_end(c.triangle)) {
            sides.push(outside);
        }
        // A sheet that is upright, or nearly, is on no line along z. It lies in the volume around its middle.
        let is_upright = surface.is_sheet(t) && line.iter().all(|c| c.triangle != t);
        if is_upright {
            sides.insert(0, 2 * t);
        }
        // What is below the first crossing is not known.
        let first = usize::from(!is_upright);
        sides[first..].chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
    }
}

/// The groups of sides with numbers, in the place of their roots: both at once would be the most that is held.
fn numbered(surface: &Surface, sides: Groups) -> EnclosedVolumes {
    let mut of_side = sides.into_roots();
    let outside = of_side.pop().unwrap_or(OUTSIDE);
    let mut numbers = BTreeMap::from([(outside, OUTSIDE)]);
    // The volume in front of a triangle is numbered before that behind it, like the mesh's regions; sheets bound no
    // volume.
    for (side, &root) in (0u32..).zip(&of_side) {
        if !surface.is_sheet(side / 2) {
            let next = numbers.len() as u32;
            numbers.entry(root).or_insert(next);
        }
    }
    for side in &mut of_side {
        *side = numbers.get(side).copied().unwrap_or(OUTSIDE);
    }
    let of_side = bytemuck::allocation::cast_slice_box(of_side.into_boxed_slice());
    let n_volumes = numbers.len();
    EnclosedVolumes {
        of_side: of_side.into_vec(),
        n_volumes: n_volumes as u32,
        angles: vec![0.0; n_volumes],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Walls of cubes, welded where they share corners; a cube with `inward` set has its front inside.
    fn cubes(list: &[([f64; 3], f64, bool)]) -> Surface {
        let mut surface = Surface::default();
        for &(low, side, inward) in list {
            let corner = |c: usize| {
                let at = |axis: usize| low[axis] + side * (c >> axis & 1) as f64;
                Point::new(at(0), at(1), at(2))
            };
            let numbers: Vec<u32> = (0..8)
                .map(|c| {
                    let p = corner(c);
                    let known = surface.points.iter().position(|&q| q == p);
                    known.unwrap_or_else(|| {
                        surface.points.push(p);
                        surface.points.len() - 1
                    }) as u32
                })
                .collect();
            for wall in
                [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
            {
                let [a, b, c, d] = wall.map(|k: usize| numbers[k]);
                for mut t in [[a, b, c], [a, c, d]] {
                    if inward {
                        t.swap(1, 2);
                    }
                    surface.triangles.push(t);
                    surface.labels.push(0);
                }
            }
        }
        surface
    }

    #[test]
    fn nested_shells_lie_in_each_other() {
        for inward in [false, true] {
            let surface = cubes(&[([0.0; 3], 3.0, false), ([1.0; 3], 1.0, inward)]);
            let seeker = Seeker::new(&surface);
            let volumes = EnclosedVolumes::new(&seeker);
            assert_eq!(volumes.n_volumes, 3);
            assert!(volumes.of_side[..12].iter().all(|v| *v == [0, 1]));
            let inner = if inward { [2, 1] } else { [1, 2] };
            assert!(volumes.of_side[12..].iter().all(|v| *v == inner));
            for (p, volume) in [(1.5, 2), (0.5, 1), (2.9, 1), (3.5, 0), (-1.0, 0)] {
                let p = Point::new(p, p + 0.01, p - 0.02);
                assert_eq!(volumes.at(&seeker, p), volume, "{p}");
            }
            // Edges with a right angle, diagonals with half a turn.
            let inside = 12.0 * 0.5 * PI + 6.0 * PI;
            let outside = 12.0 * 1.5 * PI + 6.0 * PI;
            for (found, expected) in volumes.angles.iter().zip([outside, inside + outside, inside])
            {
                assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
            }
        }
    }

    #[test]
    fn shared_walls_part_volumes() {
        for axis in 0..3 {
            let mut low = [0.0; 3];
            low[axis] = 1.0;
            // The second cube's wall at 1 is the first one's, so it is given from both sides; without it, from one.
            let whole = cubes(&[([0.0; 3], 1.0, false), (low, 1.0, false)]);
            let mut single = whole.clone();
            let wall = |t: &[u32; 3]| t.iter().all(|&v| whole.points[v as usize][axis] == 1.0);
            let second = 12 + whole.triangles[12..].iter().position(wall).expect("a wall");
            single.triangles.drain(second..second + 2);
            for surface in [&whole, &single] {
                let seeker = Seeker::new(surface);
                let volumes = EnclosedVolumes::new(&seeker);
                assert_eq!(volumes.n_volumes, 3, "along {axis}");
                let walls = volumes.walls();
                let pairs: Vec<(u32, u32)> = walls.keys().copied().collect();
                assert_eq!(pairs, [(0, 1), (0, 2), (1, 2)]);
                assert_eq!(walls[&(0, 1)], Wall { front: 10, back: 0 });
                for (along, volume) in [(0.5, 1), (1.5, 2), (2.5, 0), (-0.5, 0)] {
                    let mut p = Point::new(0.35, 0.4, 0.3);
                    p[axis] = along;
                    assert_eq!(volumes.at(&seeker, p), volume);
                }
            }
        }
    }

    #[test]
    fn hooks_over_each_other_lie_in_what_is_around_both() {
        let mut surface = Surface::default();
        let around =
            (-3..8).flat_map(|x| (-1..2).flat_map(move |y| (-2..8).map(move |z| [x, y, z])));
        add_cells(&mut surface, &around.collect::<Vec<_>>());
        // Each begins below a part of the other.
        let first = [[0, 0], [-1, 0], [-1, 1], [-1, 2], [-1, 3], [-1, 4], [0, 4], [1, 4], [2, 4]];
        let second = [[2, 2], [1, 2], [0, 2]];
        for hook in [&first[..], &second] {
            let cells: Vec<[i32; 3]> = hook.iter().map(|[x, z]| [*x, 0, *z]).collect();
            add_cells(&mut surface, &cells);
        }
        let seeker = Seeker::new(&surface);
        let volumes = EnclosedVolumes::new(&seeker);
        assert_eq!(volumes.n_volumes, 4);
        for ([x, z], volume) in [([0, 0], 2), ([0, 2], 3), ([0, 4], 2), ([0, 3], 1), ([3, 3], 1)] {
            let p = Point::new(f64::from(x), 0.0, f64::from(z)) + Point::new(0.4, 0.5, 0.3);
            assert_eq!(volumes.at(&seeker, p), volume);
        }
    }

    /// Adds the boundary of some unit cells, apart from all triangles there are.
    fn add_cells(surface: &mut Surface, cells: &[[i32; 3]]) {
        let known = surface.points.len();
        for cell in cells {
            for axis in [2, 0, 1] {
                for up in [false, true] {
                    let mut beside = *cell;
                    beside[axis] += if up { 1 } else { -1 };
                    if cells.contains(&beside) {
                        continue;
                    }
                    let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| {
                        let mut at = cell.map(f64::from);
                        at[axis] += f64::from(u8::from(up));
                        at[(axis + 1) % 3] += f64::from(a);
                        at[(axis + 2) % 3] += f64::from(b);
                        let p = Point::from_array(at);
                        let place = surface.points[known..].iter().position(|&q| q == p);
                        let place = place.unwrap_or_else(|| {
                            surface.points.push(p);
                            surface.points.len() - 1 - known
                        });
                        (known + place) as u32
                    });
                    let [a, b, c, d] = corners;
                    let (b, d) = if up { (b, d) } else { (d, b) };
                    surface.triangles.extend([[a, b, c], [a, c, d]]);
                    surface.labels.extend([0, 0]);
                }
            }
        }
    }

    #[test]
    fn upright_sheets_lie_in_what_is_around_them() {
        let mut surface = cubes(&[([0.0; 3], 3.0, false), ([1.0; 3], 1.0, false)]);
        let n = surface.triangles.len() as u32;
        // One in the inner cube, one between the cubes, one outside.
        for x in [1.5, 0.5, 4.5] {
            let first = surface.points.len() as u32;
            for (y, z) in [(1.2, 1.25), (1.7, 1.3), (1.4, 1.75)] {
                surface.points.push(Point::new(x, y, z));
            }
            surface.triangles.push([first, first + 1, first + 2]);
            surface.labels.push(0);
        }
        surface.sheets_from(n as usize);
        let volumes = EnclosedVolumes::new(&Seeker::new(&surface));
        assert_eq!(volumes.n_volumes, 3);
        assert_eq!(volumes.of_side[n as usize..], [[2; 2], [1; 2], [0; 2]]);
    }

    #[test]
    fn an_open_surface_encloses_nothing() {
        let mut surface = cubes(&[([0.0; 3], 1.0, false)]);
        surface.triangles.pop();
        assert_eq!(EnclosedVolumes::new(&Seeker::new(&surface)).n_volumes, 1);
    }

    #[test]
    fn distances_are_those_to_the_cube() {
        let surface = cubes(&[([0.0; 3], 2.0, false)]);
        let seeker = Seeker::new(&surface);
        for k in 0..2000 {
            let at = |step: i32| f64::from(k * step % 199) / 40.0 - 1.5;
            let p = Point::new(at(7), at(31), at(57));
            let walls = p.min(Point::splat(2.0) - p);
            let expected = match walls.min_element() {
                inside if inside > 0.0 => inside,
                _ => (-walls).max(Point::ZERO).length(),
            };
            let found = seeker.distance(p, f64::INFINITY);
            assert!((found - expected).abs() < 1e-12, "{p} {found} {expected}");
            assert_eq!(seeker.distance(p, expected * 0.999), f64::INFINITY);
            let nearest = surface.points.iter().map(|&c| p.distance(c));
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            assert_eq!(seeker.distance_to_vertices(p, f64::INFINITY), nearest);
        }
    }

    #[test]
    fn angles_are_known_to_a_hundredth() {
        for k in 0..1000 {
            let a = f64::from(k) * 2.0 * PI / 1000.0;
            assert!((angle(3.0 * a.cos(), 3.0 * a.sin()) - a).abs() < 0.005, "{a}");
        }
    }
}
