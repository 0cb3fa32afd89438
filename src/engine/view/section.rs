//! A cut through the mesh by a plane, as flat pieces in drawing order.
//!
//! A *section* has the polygon in which the plane cuts each tetrahedron. A *crinkle cut* has the whole tetrahedra that meet the
//! plane: their faces towards the viewer, the far ones first. Positions are rounded here, because they only serve drawing.

use std::path::Path;

use tetdb_base::geom::Point;
use tetdb_base::storage::{Payload, Sorted, Sorter, sort_record};
use tetdb_schema::record::FACES;
use tetdb_store::query::Hit;
use tetdb_store::query::Selection;
use tetdb_store::query::Solid;
use tetdb_store::query::{QueryError, QuerySession};

/// A plane, viewed from the side its normal points to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    origin: Point,
    right: Point,
    up: Point,
    normal: Point,
}

impl View {
    /// Creates the view of the plane through `origin`, orthogonal to `normal`, which is not zero. The z axis is up where
    /// possible.
    pub fn new(origin: Point, normal: Point) -> Self {
        // The normal is scaled twice: a single division of a very long or short one has an error above rounding.
        let normal = (normal / normal.abs().max_element()).normalize();
        let upright = if normal.z.abs() > 0.999 { Point::Y } else { Point::Z };
        let up = (upright - normal * upright.dot(normal)).normalize();
        Self { origin, right: up.cross(normal), up, normal }
    }

    /// Returns how directly a face with this normal faces the viewer, -1 to 1.
    pub(super) fn facing(&self, normal: Point) -> f64 {
        normal.dot(self.normal)
    }

    /// Returns the point and the direction in the plane of a straight line in space that lies in the plane.
    pub fn line(&self, point: Point, direction: Point) -> [[f64; 2]; 2] {
        let to = self.flat(self.origin + direction);
        [self.flat(point), to]
    }

    /// Returns the line in which another plane meets this one, as a point and a direction in this plane; `None` for parallel
    /// planes.
    pub fn crossing(&self, point: Point, normal: Point) -> Option<[[f64; 2]; 2]> {
        let direction = self.normal.cross(normal);
        let square = direction.length_squared();
        if square < 1e-12 {
            return None;
        }
        let across = direction.cross(self.normal);
        let step = (point - self.origin).dot(normal) / across.dot(normal);
        Some(self.line(self.origin + across * step, direction / square.sqrt()))
    }

    /// Returns the point in space at a position in the plane.
    pub(super) fn raised(&self, [x, y]: [f64; 2]) -> Point {
        self.origin + self.right * x + self.up * y
    }

    pub(super) fn height(&self, p: Point) -> f64 {
        (p - self.origin).dot(self.normal)
    }

    pub(super) fn flat(&self, p: Point) -> [f64; 2] {
        let p = p - self.origin;
        [p.dot(self.right), p.dot(self.up)]
    }
}

/// A flat piece of a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Corners in the plane, in input units, to the right and up; the fourth counts only if `n` is 4.
    pub corners: [[f64; 2]; 4],
    /// Number of corners, 3 or 4.
    pub n: usize,
    /// Heights of the corners over the plane, towards the viewer.
    pub heights: [f64; 4],
    /// How directly the piece faces the viewer, 0 to 1 (1 in a section); for a shell, negative if seen from behind.
    pub facing: f32,
    /// Rank of the sub-domain.
    pub subdomain: u32,
    /// Number of the region.
    pub region: u32,
    /// Number of the label, for an input triangle.
    pub label: Option<u32>,
    /// Quality q of the tetrahedron; its value where a field is selected.
    pub quality: f32,
    /// Mean length of the tetrahedron's longest and shortest edge.
    pub size: f32,
}

/// Number and ranges of all pieces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Number of pieces.
    pub n: u64,
    /// Low and high corner in the plane.
    pub bounds: [[f64; 2]; 2],
    /// Least and greatest quality q.
    pub quality: [f32; 2],
    /// Least and greatest size.
    pub size: [f32; 2],
}

/// Record value for no label.
const NO_LABEL: u32 = u32::MAX;

sort_record! {
    /// A piece, sorted by depth.
    struct DeepPiece {
        depth: f64,
        corners: Payload<[f64; 8]>,
        heights: Payload<[f64; 4]>,
        n: Payload<u32>,
        facing: Payload<f32>,
        subdomain: Payload<u32>,
        region: Payload<u32>,
        label: Payload<u32>,
        quality: Payload<f32>,
        size: Payload<f32>,
    }
}

/// The pieces of a cut, far ones first.
pub struct Section {
    /// Number and ranges of all pieces.
    pub extent: Extent,
    sorted: Sorted<DeepPiece>,
}

/// Cuts the tetrahedra that match `selection`; with `crinkle`, takes them whole. Holds about `memory_bytes` and writes sort runs
/// in `dir`.
///
/// Errors: damage, the disk.
pub fn section(
    session: &mut QuerySession,
    view: &View,
    crinkle: bool,
    mut selection: Selection,
    dir: &Path,
    memory_bytes: u64,
) -> Result<Section, QueryError> {
    selection.solids.push(Solid::Plane { point: view.origin, normal: view.normal });
    let mut all = Pieces::new(dir, memory_bytes);
    let has_field = !selection.extra.is_empty();
    for tet in session.select(selection)? {
        let tet = tet?;
        for (depth, mut piece) in pieces(view, crinkle, &tet) {
            if has_field {
                piece.quality = tet.extra[0].to_f64() as f32;
            }
            all.push(depth, &piece)?;
        }
    }
    all.finish()
}

/// Pieces being sorted by depth.
pub(super) struct Pieces {
    sorter: Sorter<DeepPiece>,
    extent: Extent,
}

impl Pieces {
    pub fn new(dir: &Path, memory_bytes: u64) -> Self {
        Self {
            sorter: Sorter::new(dir, memory_bytes),
            extent: Extent {
                n: 0,
                bounds: [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]],
                quality: [f32::INFINITY, f32::NEG_INFINITY],
                size: [f32::INFINITY, 0.0],
            },
        }
    }

    pub fn push(&mut self, depth: f64, piece: &Piece) -> Result<(), QueryError> {
        self.extent.add(piece);
        Ok(self.sorter.push(record(depth, piece))?)
    }

    pub fn finish(self) -> Result<Section, QueryError> {
        Ok(Section { extent: self.extent, sorted: self.sorter.finish()? })
    }
}

impl Extent {
    fn add(&mut self, piece: &Piece) {
        self.n += 1;
        for corner in &piece.corners[..piece.n] {
            for (axis, &x) in corner.iter().enumerate() {
                self.bounds[0][axis] = self.bounds[0][axis].min(x);
                self.bounds[1][axis] = self.bounds[1][axis].max(x);
            }
        }
        let [least, most] = self.quality;
        self.quality = [least.min(piece.quality), most.max(piece.quality)];
        let [least, most] = self.size;
        self.size = [least.min(piece.size), most.max(piece.size)];
    }
}

impl Iterator for Section {
    type Item = Result<Piece, QueryError>;

    fn next(&mut self) -> Option<Self::Item> {
        let record = self.sorted.next()?;
        Some(record.map(|r| piece(&r)).map_err(QueryError::from))
    }
}

/// Returns the pieces of a tetrahedron with their heights over the plane.
pub(super) fn pieces(view: &View, crinkle: bool, tet: &Hit) -> Vec<(f64, Piece)> {
    let [least, most] = tet.edges();
    let piece = |corners: &[[f64; 2]], heights: [f64; 4], facing: f64| {
        let mut all = [[0.0; 2]; 4];
        all[..corners.len()].copy_from_slice(corners);
        Piece {
            corners: all,
            n: corners.len(),
            heights,
            facing: facing as f32,
            subdomain: tet.id.subdomain().rank(),
            region: tet.region,
            label: None,
            quality: tet.shape.quality as f32,
            size: (0.5 * (least + most)) as f32,
        }
    };
    if !crinkle {
        let polygon = polygon(view, tet);
        let seen = polygon.len() >= 3;
        return seen.then(|| (0.0, piece(&polygon, [0.0; 4], 1.0))).into_iter().collect();
    }
    let mut found = Vec::new();
    for face in FACES {
        let [a, b, c] = face.map(|i| tet.corners[i]);
        let outward = (b - a).cross(c - a);
        let facing = outward.dot(view.normal) / outward.length();
        if facing > 0.0 {
            let flat = [a, b, c].map(|p| view.flat(p));
            let [x, y, z] = [a, b, c].map(|p| view.height(p));
            found.push(((x + y + z) / 3.0, piece(&flat, [x, y, z, 0.0], facing)));
        }
    }
    found
}

/// Returns the polygon in which the plane cuts a tetrahedron: three or four corners, or none.
fn polygon(view: &View, tet: &Hit) -> Vec<[f64; 2]> {
    let heights = tet.corners.map(|c| view.height(c));
    let (above, below): (Vec<usize>, Vec<usize>) = (0..4).partition(|&i| heights[i] > 0.0);
    // Interpolates from the vertex of the lower id, so that neighbors compute the same point.
    let cut = |i: usize, j: usize| {
        let (i, j) = match tet.vertices[i] < tet.vertices[j] {
            true => (i, j),
            false => (j, i),
        };
        let t = heights[i] / (heights[i] - heights[j]);
        view.flat(tet.corners[i] + (tet.corners[j] - tet.corners[i]) * t)
    };
    match (&above[..], &below[..]) {
        ([a], [b, c, d]) | ([b, c, d], [a]) => vec![cut(*a, *b), cut(*a, *c), cut(*a, *d)],
        ([a, b], [c, d]) => vec![cut(*a, *c), cut(*a, *d), cut(*b, *d), cut(*b, *c)],
        _ => Vec::new(),
    }
}

fn record(depth: f64, piece: &Piece) -> DeepPiece {
    DeepPiece {
        depth,
        corners: Payload(bytemuck::cast(piece.corners)),
        heights: Payload(piece.heights),
        n: Payload(piece.n as u32),
        facing: Payload(piece.facing),
        subdomain: Payload(piece.subdomain),
        region: Payload(piece.region),
        label: Payload(piece.label.unwrap_or(NO_LABEL)),
        quality: Payload(piece.quality),
        size: Payload(piece.size),
    }
}

fn piece(record: &DeepPiece) -> Piece {
    Piece {
        corners: bytemuck::cast(record.corners.0),
        heights: record.heights.0,
        n: record.n.0 as usize,
        facing: record.facing.0,
        subdomain: record.subdomain.0,
        region: record.region.0,
        label: Some(record.label.0).filter(|&label| label != NO_LABEL),
        quality: record.quality.0,
        size: record.size.0,
    }
}
