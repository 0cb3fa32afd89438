//! Vertices near a position.

use std::collections::HashMap;

use tetdb_base::geom::Point;
use tetdb_base::surface::{Surface, VertexTable};

/// Constructed points become a vertex nearer than the largest coordinate times two to minus this. Without it six in twenty pairs of
/// tilted boxes with a wall in common do not settle; with any value from 44 to 51, one or two.
const REACH_BITS: i32 = 48;

/// Vertices of divided triangles by their place in a grid of cubes.
pub struct NearVertices {
    cells: HashMap<[i64; 3], Vec<u32>>,
    all: VertexTable,
    reach: f64,
}

impl NearVertices {
    /// Without any vertex near another position.
    pub fn new(surface: &Surface) -> Self {
        let bounds = surface.bounds();
        let largest = bounds.low.abs().max(bounds.high.abs()).max_element();
        let reach = (largest * 2f64.powi(-REACH_BITS)).max(f64::MIN_POSITIVE);
        Self { cells: HashMap::new(), all: VertexTable::new(&surface.points), reach }
    }

    fn cell(&self, p: Point) -> [i64; 3] {
        (p / self.reach).floor().to_array().map(|x| x as i64)
    }

    /// Lets a vertex be found.
    pub fn add(&mut self, v: u32, p: Point) {
        let in_cell = self.cells.entry(self.cell(p)).or_default();
        if !in_cell.contains(&v) {
            in_cell.push(v);
        }
    }

    /// The vertex at `p`, or the nearest within reach and how far it is; otherwise a new one at `p`.
    pub fn find_or_add(&mut self, p: Point, points: &mut Vec<Point>) -> (u32, f64) {
        // Also one of a triangle that is not divided.
        if self.all.find(p, points) {
            return (self.all.find_or_add(p, points), 0.0);
        }
        let middle = self.cell(p);
        let around = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
        let cells = around.map(|step| [0, 1, 2].map(|axis| middle[axis] + step[axis]));
        let known = cells.filter_map(|cell| self.cells.get(&cell)).flatten();
        let near = known.map(|&v| (v, points[v as usize].distance(p)));
        let nearest = near.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        if let Some(found) = nearest.filter(|(_, distance)| *distance <= self.reach) {
            return found;
        }
        let v = self.all.find_or_add(p, points);
        self.add(v, p);
        (v, 0.0)
    }
}
