//! Builds a surface while files are read: welding, labels, fans.

use std::collections::{HashMap, HashSet};

use super::label_sets::{JOIN_BYTES, LabelNumbers, drop_unused_labels};
use super::polygon::{cut_facet, cut_polygon};
use super::vertex_table::VertexTable;
use super::{Note, NoteKind, Seed, SourceFile, Surface, SurfaceError};
use crate::geom::Point;
use crate::storage::{filled, push};

/// Collects triangles from one file after the other and welds vertices with identical bits.
///
/// Between [`begin_file`](Self::begin_file) and [`end_file`](Self::end_file) triangles name the
/// file's own vertices, 0-based, in the order given to [`vertex`](Self::vertex); they may come before
/// their vertices. Same calls, same surface: nothing depends on hash order.
#[derive(Default)]
pub struct SurfaceBuilder {
    surface: Surface,
    table: VertexTable,
    labels: LabelNumbers,
    /// Triangles listed in several groups are to become one each.
    joins_groups: bool,
    file: String,
    triangle_first: usize,
    /// Vertices, notes and seeds before this file.
    before: [usize; 3],
    /// Vertex of the file -> welded vertex.
    file2vert: Vec<u32>,
    /// Vertices of this file that repeated an earlier position.
    n_welded: u64,
    /// Polygons of this file with more than three corners.
    n_fanned: u64,
    /// Those of them that are no fan from their first corner.
    n_cut: u64,
    /// Number of polygons with corners that repeat the one before.
    n_repeated: u64,
    /// First triangle and corners of each polygon of this file that came before its vertices.
    uncut: Vec<[u32; 2]>,
    /// Triangles of this file are given by position, not by the file's vertex numbers.
    by_position: bool,
    /// Ends of edges of this file that are embedded later, by the file's numbers, and those of all files before.
    edge_ends: Vec<u32>,
    embedded: HashSet<u32>,
    /// Bytes it may hold; `None` for as many as there are.
    bytes_max: Option<u64>,
}

impl SurfaceBuilder {
    /// A builder without files.
    pub fn new() -> Self {
        Self::default()
    }

    /// A builder that holds at most that many bytes.
    pub fn within(bytes_max: u64) -> Self {
        Self { bytes_max: Some(bytes_max), ..Self::default() }
    }

    /// Bytes held: the surface and the table of its vertices.
    fn bytes(&self) -> u64 {
        let ids = self.file2vert.capacity() + self.table.n_slots();
        (self.surface.bytes() + ids * size_of::<u32>()) as u64
    }

    /// Refuses to exceed the memory cap; called before an array grows.
    fn check_bytes(&self) -> Result<(), SurfaceError> {
        self.check_more(0)
    }

    /// Refuses `more` bytes that do not fit beside what it holds.
    pub fn check_more(&self, more: u64) -> Result<(), SurfaceError> {
        match self.bytes_max.filter(|&most| self.bytes() + more > most) {
            None => Ok(()),
            Some(bytes_max) => Err(SurfaceError::Memory {
                bytes_max,
                triangles: self.surface.n_triangles(),
                vertices: self.surface.n_vertices(),
            }),
        }
    }

    /// Starts a file whose triangles will name its own vertices.
    pub fn begin_file(&mut self, name: &str) {
        self.file = name.to_owned();
        self.triangle_first = self.surface.triangles.len();
        let surface = &self.surface;
        self.before = [surface.points.len(), surface.notes.len(), surface.seeds.len()];
        self.file2vert.clear();
        (self.n_welded, self.n_fanned, self.n_cut, self.n_repeated) = (0, 0, 0, 0);
        (self.by_position, self.joins_groups) = (false, false);
        self.uncut.clear();
        self.surface
            .files
            .push(SourceFile { name: name.to_owned(), triangle_first: self.triangle_first as u32 });
    }

    /// Forgets all that the current file has given, to read it again.
    pub fn restart_file(&mut self) {
        let [n_points, n_notes, n_seeds] = self.before;
        let surface = &mut self.surface;
        surface.points.truncate(n_points);
        surface.notes.truncate(n_notes);
        surface.seeds.truncate(n_seeds);
        surface.triangles.truncate(self.triangle_first);
        surface.labels.truncate(self.triangle_first);
        surface.files.pop();
        self.table = VertexTable::new(&surface.points);
        let name = std::mem::take(&mut self.file);
        self.begin_file(&name);
    }

    /// Number of vertices the current file has given so far.
    pub fn n_file_vertices(&self) -> usize {
        self.file2vert.len()
    }

    /// Number of triangles the current file has given so far.
    pub fn n_file_triangles(&self) -> usize {
        self.surface.triangles.len() - self.triangle_first
    }

    /// Adds the next vertex of the file; the coordinates must be finite.
    ///
    /// # Errors
    /// [`SurfaceError::TooLarge`] beyond 2^30 vertices; [`SurfaceError::Memory`] beyond the builder's bytes, as for all that follow.
    pub fn vertex(&mut self, p: Point) -> Result<(), SurfaceError> {
        SurfaceError::check_size("vertices", self.file2vert.len() + 1)?;
        if self.file2vert.len() == self.file2vert.capacity() {
            self.check_bytes()?;
        }
        let before = self.surface.points.len();
        let vert = self.weld(p)?;
        self.n_welded += u64::from((vert as usize) < before);
        push(&mut self.file2vert, vert);
        Ok(())
    }

    fn weld(&mut self, p: Point) -> Result<u32, SurfaceError> {
        debug_assert!(p.is_finite(), "{p:?}");
        let p = p + Point::ZERO; // -0.0 becomes +0.0
        SurfaceError::check_size("vertices", self.surface.points.len() + 1)?;
        Ok(self.table.find_or_add(p, &mut self.surface.points))
    }

    /// The id of the label `name`, which is added if new.
    pub fn label(&mut self, name: &str) -> u32 {
        self.labels.label(&mut self.surface, name)
    }

    /// The label of triangles in all groups of these labels, of which there is one at least.
    pub fn label_of_all(&mut self, labels: &[u32]) -> u32 {
        self.labels.label_of_all(&mut self.surface, labels)
    }

    /// Makes one triangle of those that this file lists once for each of their groups.
    pub fn join_groups_at_end(&mut self) {
        self.joins_groups = true;
    }

    fn join_groups(&mut self) -> Result<(), SurfaceError> {
        let labels = &self.surface.labels[self.triangle_first..];
        if self.joins_groups && labels.iter().any(|label| *label != labels[0]) {
            self.check_more(JOIN_BYTES * labels.len() as u64)?;
            self.labels.join_triangles(&mut self.surface, self.triangle_first);
        }
        Ok(())
    }

    /// Adds a triangle of vertices of the file.
    ///
    /// # Errors
    /// [`SurfaceError::TooLarge`] beyond 2^30 triangles.
    pub fn triangle(&mut self, corners: [u32; 3], label: u32) -> Result<(), SurfaceError> {
        SurfaceError::check_size("triangles", self.surface.triangles.len() + 1)?;
        if self.surface.triangles.len() == self.surface.triangles.capacity() {
            self.check_bytes()?;
        }
        push(&mut self.surface.triangles, corners);
        push(&mut self.surface.labels, label);
        Ok(())
    }

    /// Counts the ends of an edge, which is embedded later, as used.
    pub fn edge(&mut self, ends: [u32; 2]) {
        self.edge_ends.extend(ends);
    }

    /// Adds a polygon of at least three vertices of the file: a fan from its first one where that is right, else other triangles of its
    /// corners. A polygon before its vertices is cut at the end of the file.
    ///
    /// # Errors
    /// [`SurfaceError::TooLarge`] beyond 2^30 triangles; [`SurfaceError::Polygon`] for one that crosses itself, repeats a corner or has
    /// no area.
    pub fn polygon(&mut self, corners: &[u32], label: u32) -> Result<(), SurfaceError> {
        debug_assert!(corners.len() >= 3);
        let kept = self.without_repeats(corners);
        let (corners, is_edge) = match &kept {
            Some(kept) if kept.len() > 2 => (&kept[..], false),
            // Degenerate triangles, which validation reports and repair drops.
            Some(_) => (corners, true),
            None => (corners, false),
        };
        self.n_repeated += u64::from(kept.is_some() && !is_edge);
        let mut other = None;
        if corners.len() > 3 && !is_edge {
            self.n_fanned += 1;
            match self.cut(corners) {
                None => {
                    let first = self.surface.triangles.len() as u32;
                    self.uncut.push([first, corners.len() as u32]);
                }
                Some(cut) => other = cut?,
            }
        }
        match other {
            Some(triangles) => triangles.into_iter().try_for_each(|t| self.triangle(t, label)),
            None => (corners[1..].windows(2))
                .try_for_each(|pair| self.triangle([corners[0], pair[0], pair[1]], label)),
        }
    }

    /// Adds a facet of vertices of the file: what its polygons enclose, without the parts around its holes. Polygons of one or two
    /// corners are vertices and edges in it; one has at least three.
    ///
    /// # Errors
    /// As [`SurfaceBuilder::polygon`]; a hole that is not inside.
    pub fn facet(
        &mut self,
        polygons: &[Vec<u32>],
        holes: &[Point],
        label: u32,
    ) -> Result<(), SurfaceError> {
        if let ([polygon], []) = (polygons, holes) {
            return self.polygon(polygon, label);
        }
        // Vertices of the file with one position are one corner.
        let (mut known, mut vertices) = (HashMap::new(), Vec::new());
        let mut corner = |&v: &u32| {
            let vert = self.file2vert.get(v as usize).ok_or(SurfaceError::NoSuchVertex {
                triangle: (self.surface.triangles.len() - self.triangle_first) as u32,
                vertex: v,
                n_vertices: self.file2vert.len(),
            })?;
            Ok(*known.entry(*vert).or_insert_with(|| {
                vertices.push(v);
                vertices.len() as u32 - 1
            }))
        };
        let polygons = polygons.iter().map(|polygon| polygon.iter().map(&mut corner).collect());
        let polygons = polygons.collect::<Result<Vec<Vec<u32>>, SurfaceError>>()?;
        let polygons: Vec<&[u32]> = polygons.iter().map(Vec::as_slice).collect();
        let points = self.positions(&vertices).unwrap_or_default();
        let cut = cut_facet(&points, &polygons, holes);
        let triangles = cut.map_err(|reason| SurfaceError::Polygon { reason, points })?;
        let triangles = triangles.into_iter().map(|t| t.map(|k| vertices[k as usize]));
        triangles.into_iter().try_for_each(|t| self.triangle(t, label))
    }

    /// Triangles of a polygon instead of its fan; `None` while a vertex is not known.
    fn cut(&mut self, corners: &[u32]) -> Option<Result<Option<Vec<[u32; 3]>>, SurfaceError>> {
        let points = self.positions(corners)?;
        let cut = cut_polygon(&points);
        self.n_cut += u64::from(matches!(cut, Ok(Some(_))));
        let cut = cut.map(|triangles| {
            triangles.map(|t| t.into_iter().map(|t| t.map(|k| corners[k as usize])).collect())
        });
        Some(cut.map_err(|reason| SurfaceError::Polygon { reason, points }))
    }

    /// The corners of a polygon of more than three without those that repeat the corner before; `None` where none does.
    fn without_repeats(&self, corners: &[u32]) -> Option<Vec<u32>> {
        let vert = |v: u32| self.file2vert.get(v as usize);
        let is_same = |a: u32, b: u32| a == b || vert(a).is_some() && vert(a) == vert(b);
        let before = |k: usize| corners[(k + corners.len() - 1) % corners.len()];
        let is_kept = |&k: &usize| !is_same(corners[k], before(k));
        let n = corners.len();
        if n < 4 || (0..n).all(|k| is_kept(&k)) {
            return None;
        }
        Some((0..n).filter(is_kept).map(|k| corners[k]).collect())
    }

    /// Positions of vertices of the file, if all are known.
    fn positions(&self, vertices: &[u32]) -> Option<Vec<Point>> {
        let point = |&v: &u32| {
            let vert = *self.file2vert.get(v as usize)?;
            self.surface.points.get(vert as usize).copied()
        };
        vertices.iter().map(point).collect()
    }

    /// Cuts the polygons that came before their vertices.
    fn cut_late(&mut self) -> Result<(), SurfaceError> {
        for [first, n] in std::mem::take(&mut self.uncut) {
            let triangles = first as usize..(first + n - 2) as usize;
            let fan = &self.surface.triangles[triangles.clone()];
            let corners: Vec<u32> =
                [fan[0][0], fan[0][1]].into_iter().chain(fan.iter().map(|t| t[2])).collect();
            // A vertex that is still missing is reported with its triangle.
            if let Some(cut) = self.cut(&corners)
                && let Some(cut) = cut?
            {
                self.surface.triangles[triangles].copy_from_slice(&cut);
            }
        }
        Ok(())
    }

    /// Adds a triangle by the positions of its corners, for files without vertex numbers.
    ///
    /// A file uses this for all its triangles or for none.
    ///
    /// # Errors
    /// [`SurfaceError::TooLarge`] beyond 2^30 vertices or triangles.
    pub fn triangle_at(&mut self, corners: [Point; 3], label: u32) -> Result<(), SurfaceError> {
        self.by_position = true;
        let [a, b, c] = corners;
        let ids = [self.weld(a)?, self.weld(b)?, self.weld(c)?];
        self.triangle(ids, label)
    }

    /// Adds a seed of the volume around a point.
    pub fn seed(&mut self, seed: Seed) {
        self.surface.seeds.push(seed);
    }

    /// The vertex of the surface that vertex `v` of the current file is, where the file has it.
    pub(super) fn vert(&self, v: u32) -> Option<u32> {
        self.file2vert.get(v as usize).copied()
    }

    /// The middle of four vertices of the current file, where it has them.
    pub fn middle(&self, corners: [u32; 4]) -> Option<Point> {
        let mut sum = Point::ZERO;
        for p in self.positions(&corners)? {
            sum += p;
        }
        Some(0.25 * sum)
    }

    /// Volume of a tetrahedron of vertices of the current file, where it has them.
    pub fn volume(&self, corners: [u32; 4]) -> Option<f64> {
        let p = self.positions(&corners)?;
        Some((p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]).abs())
    }

    /// The welded vertex of a vertex of the current file.
    pub fn welded(&self, vertex: u32) -> Option<u32> {
        self.file2vert.get(vertex as usize).copied()
    }

    /// The position of a vertex of the current file.
    pub fn position(&self, vertex: u32) -> Option<Point> {
        Some(self.positions(&[vertex])?[0])
    }

    /// Triangles of the current file so far, as vertices of the file.
    pub fn file_triangles(&self) -> impl Iterator<Item = &[u32; 3]> {
        self.surface.triangles[self.triangle_first..].iter()
    }

    /// Marks all volumes of the surface as filled but those with a hole.
    pub fn fill_rest(&mut self) {
        self.surface.fills_rest = true;
    }

    /// Asks for a length in the region of a name.
    pub fn region_size(&mut self, name: String, h: f64) {
        self.surface.region_sizes.push((name, h));
    }

    /// Lengths asked for in regions so far.
    pub fn region_sizes(&self) -> &[(String, f64)] {
        &self.surface.region_sizes
    }

    /// Adds a note about the current file.
    pub fn note(&mut self, kind: NoteKind) {
        let file = self.file.clone();
        self.surface.notes.push(Note { file, kind });
    }

    /// Ends the file: its triangles now name welded vertices.
    ///
    /// # Errors
    /// The first triangle and vertex number without a vertex, as [`SurfaceError::NoSuchVertex`].
    pub fn end_file(&mut self) -> Result<(), SurfaceError> {
        self.cut_late()?;
        self.join_groups()?;
        if !self.by_position {
            let map = &self.file2vert;
            for (i, triangle) in
                self.surface.triangles[self.triangle_first..].iter_mut().enumerate()
            {
                for v in triangle {
                    *v = *map.get(*v as usize).ok_or(SurfaceError::NoSuchVertex {
                        triangle: i as u32,
                        vertex: *v,
                        n_vertices: map.len(),
                    })?;
                }
            }
        }
        let ends = self.edge_ends.drain(..).filter_map(|v| self.file2vert.get(v as usize));
        self.embedded.extend(ends);
        if self.n_welded > 0 {
            self.note(NoteKind::WeldedVertices { n: self.n_welded });
        }
        if self.n_repeated > 0 {
            self.note(NoteKind::RepeatedCorners { n: self.n_repeated });
        }
        if self.n_cut > 0 {
            self.note(NoteKind::CutPolygons { n: self.n_cut });
        }
        if self.n_fanned > self.n_cut {
            self.note(NoteKind::FannedPolygons { n: self.n_fanned - self.n_cut });
        }
        self.file2vert = Vec::new();
        Ok(())
    }

    /// The surface, without the vertices no triangle uses and the labels none carries.
    pub fn finish(self) -> Surface {
        let mut surface = self.surface;
        drop(self.table);
        let mut own_ends = self.embedded;
        if !own_ends.is_empty() {
            surface.triangles.iter().flatten().for_each(|v| _ = own_ends.remove(v));
        }
        let n_unused = drop_unused_points(&mut surface) - own_ends.len() as u64;
        if n_unused > 0 {
            let file = surface.files.first().map_or(String::new(), |f| f.name.clone());
            surface.notes.push(Note { file, kind: NoteKind::UnusedVertices { n: n_unused } });
        }
        drop_unused_labels(&mut surface);
        surface.name_label_sets(0);
        surface
    }
}

/// Keeps the points that triangles use, in their order; returns how many went.
pub fn drop_unused_points(surface: &mut Surface) -> u64 {
    const UNUSED: u32 = u32::MAX;
    let mut new_ids = filled(surface.points.len(), UNUSED);
    for v in surface.triangles.iter().flatten() {
        new_ids[*v as usize] = 0;
    }
    let mut n_used = 0u32;
    for (old, id) in new_ids.iter_mut().enumerate() {
        if *id != UNUSED {
            *id = n_used;
            surface.points[n_used as usize] = surface.points[old];
            n_used += 1;
        }
    }
    let n_unused = surface.points.len() - n_used as usize;
    if n_unused > 0 {
        surface.points.truncate(n_used as usize);
        for v in surface.triangles.iter_mut().flatten() {
            *v = new_ids[*v as usize];
        }
    }
    n_unused as u64
}
