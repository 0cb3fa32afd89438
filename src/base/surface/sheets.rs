//! Embedded sheets: triangles that become faces of the mesh with the same volume on both sides.

use super::edges::{Facets, TriangleAtEdge};
use super::label_sets::drop_unused_labels;
use super::vertex_table::VertexTable;
use super::weld::drop_unused_points;
use super::{SourceFile, Surface, SurfaceError};
use crate::storage::ScratchSpace;
use tetdb_schema::labels::LabelSet;

impl Surface {
    /// Returns whether triangle `t` is part of an embedded sheet.
    #[inline]
    pub fn is_sheet(&self, t: u32) -> bool {
        self.sheets.get(t as usize).is_some_and(|&is_sheet| is_sheet)
    }

    /// Returns whether it has embedded sheets.
    pub fn has_sheets(&self) -> bool {
        !self.sheets.is_empty()
    }

    /// Triangles of embedded sheets.
    pub fn n_sheet_triangles(&self) -> usize {
        let own = self.sheets.iter().take(self.n_input_triangles());
        own.filter(|&&is_sheet| is_sheet).count()
    }

    /// A surface of the sheets alone, as ordinary triangles, or of the other triangles.
    pub fn part(&self, sheets: bool) -> Self {
        let mut part = self.without_embedded();
        let flags = std::mem::take(&mut part.sheets);
        let is_kept = |t: usize| flags.get(t).copied().unwrap_or(false) == sheets;
        let mut kept = (0..part.n_triangles()).map(is_kept);
        part.triangles.retain(|_| kept.next() == Some(true));
        let mut kept = (0..part.labels.len()).map(is_kept);
        part.labels.retain(|_| kept.next() == Some(true));
        drop_unused_points(&mut part);
        drop_unused_labels(&mut part);
        part
    }

    /// Takes all triangles from `first` on for sheets.
    pub fn sheets_from(&mut self, first: usize) {
        self.sheets.resize(first, false);
        self.sheets.resize(self.n_triangles(), true);
    }

    /// Puts sheets behind all other triangles, which stay in their order, as they do. Returns where they begin.
    pub fn sheets_last(&mut self) -> usize {
        let mut order: Vec<u32> = (0..self.n_triangles() as u32).collect();
        order.sort_by_key(|&t| self.is_sheet(t));
        self.triangles = order.iter().map(|&t| self.triangles[t as usize]).collect();
        self.labels = order.iter().map(|&t| self.labels[t as usize]).collect();
        self.sheets.sort_unstable();
        self.n_triangles() - self.n_sheet_triangles()
    }

    /// Adds the triangles of `other` as sheets, behind those that are here; vertices with the same coordinates become one.
    ///
    /// Its labels are called `name:LABEL`, or `name` where it has one alone; a name that is taken gets a number.
    ///
    /// # Errors
    /// [`SurfaceError::TooLarge`] beyond 2^30 vertices or triangles.
    pub fn embed(&mut self, other: &Self, name: &str) -> Result<(), SurfaceError> {
        let first = self.n_triangles();
        let mut table = VertexTable::new(&self.points);
        let mut verts = Vec::with_capacity(other.points.len());
        for &p in &other.points {
            verts.push(table.find_or_add(p, &mut self.points));
        }
        SurfaceError::check_size("vertices", self.points.len())?;
        SurfaceError::check_size("triangles", first + other.n_triangles())?;
        let first_label = self.add_labels(&other.label_names, &other.label_sets, name);
        let triangles = other.triangles.iter();
        (self.triangles).extend(triangles.map(|t| t.map(|v| verts[v as usize])));
        (self.labels).extend(other.labels.iter().map(|label| first_label + label));
        self.files.extend(other.files.iter().map(|file| SourceFile {
            name: file.name.clone(),
            triangle_first: first as u32 + file.triangle_first,
        }));
        self.notes.extend_from_slice(&other.notes);
        self.seeds.extend_from_slice(&other.seeds);
        let known = self.sheets.len().max(first);
        self.sheets.resize(known, false);
        self.sheets.resize(first + other.n_triangles(), true);
        Ok(())
    }

    /// Adds labels called `name:LABEL`, or `name` for one alone; a name that is taken gets a number. Returns the first one's number.
    pub(super) fn add_labels(&mut self, labels: &[String], sets: &[LabelSet], name: &str) -> u32 {
        let first = self.label_names.len() as u32;
        for label in labels {
            let wanted = match labels.len() {
                1 => name.to_owned(),
                _ => format!("{name}:{label}"),
            };
            let taken = |name: &String| self.label_names.contains(name);
            let numbered = (2..).map(|n| format!("{wanted}~{n}"));
            let free = [wanted.clone()].into_iter().chain(numbered).find(|n| !taken(n));
            self.label_names.extend(free);
        }
        self.add_label_sets(first, sets);
        first
    }

    /// Turns triangles at open edges into sheets, then those at the edges that are open without them, and so on.
    ///
    /// Returns how many. Memory: 24 bytes a triangle. A scratch file that fails unwinds.
    pub fn open_parts_to_sheets(&mut self, scratch: &ScratchSpace) -> usize {
        let mut edges = OpenEdges::new(self, scratch);
        let mut n = 0;
        while let Some(t) = edges.next() {
            if self.sheets.is_empty() {
                self.sheets = vec![false; self.n_triangles()];
            }
            self.sheets[t as usize] = true;
            edges.remove(t);
            n += 1;
        }
        n
    }
}

/// Edges of shells with the number of their triangles, while triangles go.
struct OpenEdges {
    /// Edges of each triangle; triangles that are left out have none.
    edges: Vec<[u32; 3]>,
    /// For each edge the number of its triangles, and the XOR of their numbers: for one triangle, its number.
    uses: Vec<(u32, u32)>,
    open: Vec<u32>,
}

const NO_EDGE: u32 = u32::MAX;

impl OpenEdges {
    fn new(surface: &Surface, scratch: &ScratchSpace) -> Self {
        let mut edges = vec![[NO_EDGE; 3]; surface.n_triangles()];
        let mut uses = Vec::new();
        Facets::new(surface, scratch).each_edge(|all| {
            let mut here = (0, 0);
            for use_ in all.iter().filter(|u| !surface.is_sheet(u.triangle())) {
                edges[use_.triangle() as usize][use_.corner()] = uses.len() as u32;
                here = (here.0 + 1, here.1 ^ use_.triangle());
            }
            uses.push(here);
        });
        let open = (0u32..).zip(&uses).filter(|(_, u)| u.0 == 1);
        let open = open.map(|(edge, _)| edge).collect();
        Self { edges, uses, open }
    }

    /// A triangle at an open edge.
    fn next(&mut self) -> Option<u32> {
        loop {
            let (n, triangle) = self.uses[self.open.pop()? as usize];
            if n == 1 {
                return Some(triangle);
            }
        }
    }

    fn remove(&mut self, t: u32) {
        for edge in self.edges[t as usize].into_iter().filter(|&e| e != NO_EDGE) {
            let (n, triangles) = &mut self.uses[edge as usize];
            *n -= 1;
            *triangles ^= t;
            if *n == 1 {
                self.open.push(edge);
            }
        }
    }
}

/// Calls `visit` with the two shell triangles at an edge if there are two, then with the two sheet triangles.
pub(super) fn each_pair(
    surface: &Surface,
    uses: &[TriangleAtEdge],
    mut visit: impl FnMut(TriangleAtEdge, TriangleAtEdge),
) {
    if !surface.has_sheets() {
        if let [a, b] = uses {
            visit(*a, *b);
        }
        return;
    }
    for is_sheet in [false, true] {
        let mut own = (uses.iter()).filter(|u| surface.is_sheet(u.triangle()) == is_sheet);
        if let (Some(a), Some(b), None) = (own.next(), own.next(), own.next()) {
            visit(*a, *b);
        }
    }
}
