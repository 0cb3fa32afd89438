//! Embedding edges and points in a surface, from files and from arrays.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use tetdb_schema::code::Code;

use tetdb_schema::source::{NamedFile, Origin, Source};
use xxhash_rust::xxh3::Xxh3;

use super::error::Error;
use super::surface::{halves, source};
use super::{Length, Settings, Surface, guarded};
use tetdb_base::geom::Point;
use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface::{Divided, EmbeddedSet, Note, NoteKind};
use tetdb_io::read::{WireKind, is_stream, read_wires};
use tetdb_io::write;

impl Surface {
    /// Lets later calls divide triangles where embedded points, or the ends of embedded edges, lie on them.
    ///
    /// A point inside a triangle divides it in three. A point on an edge divides all triangles at this edge in two. A point that misses a
    /// triangle by rounding, at most 1.8e-15 of the largest coordinate, lies on it. The surface then bends by that distance. The store
    /// keeps a copy of a divided surface.
    ///
    /// Default: a point on a triangle is refused unless it is a corner.
    pub fn dividing(mut self) -> Self {
        self.divides = true;
        self
    }

    /// Lets later calls move embedded points, and the ends of embedded edges, onto triangles nearer than `within`, and divides the
    /// triangles there as [`Surface::dividing`] does.
    ///
    /// A point goes to the nearest place of the surface or of a sheet. It goes to a vertex instead that is at most a quarter of `within`
    /// from that place, or else onto such an edge. A [note](Surface::notes) says how many points moved, and how far at most.
    ///
    /// Default: no point moves. Errors of the later calls: `bad-size` for a length that is none; `duplicate-wire` and `degenerate-edge`
    /// where two points come to the same vertex.
    pub fn snapping(mut self, within: Length) -> Self {
        self.snaps = Some(within);
        self
    }

    /// Embeds the edges of a file: `.obj` (`l`), legacy `.vtk` or `.poly` (polygons of two corners).
    ///
    /// Each becomes an undivided edge of the mesh, in its place. Edges may touch each other, sheets and the surface only in vertices
    /// that both have. Names: as in [`Surface::embedded`], which must be called first.
    ///
    /// Errors: a file that cannot be read; `degenerate-edge`, `duplicate-wire`, `wire-contact` and `wire-too-near` name the edge and the
    /// place.
    pub fn embedded_edges(self, file: impl AsRef<Path>, name: Option<&str>) -> Result<Self, Error> {
        self.with_wires_of(file.as_ref(), WireKind::Edges, name)
    }

    /// Embeds the points of a file: `.csv` (x, y, z and a name), `.node`, `.obj` (`p`) or legacy `.vtk`.
    ///
    /// Each becomes a vertex of the mesh and is not moved. A point on a triangle must be one of its corners. Names and errors: as in
    /// [`Surface::embedded_edges`].
    pub fn embedded_points(
        self,
        file: impl AsRef<Path>,
        name: Option<&str>,
    ) -> Result<Self, Error> {
        self.with_wires_of(file.as_ref(), WireKind::Points, name)
    }

    /// Like [`Surface::embedded_edges`], from arrays.
    ///
    /// Shape: each edge is two positions in `points`. `labels`, if given, runs parallel to `edges` and has a name for each. The store
    /// keeps a copy.
    ///
    /// Errors: `index-out-of-range`, `not-a-number` and `count-mismatch` name the edge or the point; others as for files.
    pub fn embedded_edges_of(
        self,
        points: &[[f64; 3]],
        edges: &[[u32; 2]],
        labels: Option<&[&str]>,
        name: &str,
    ) -> Result<Self, Error> {
        let mut set = set_of(points)?;
        let labels = labels_of(&mut set, (edges.len(), "edges"), labels, name)?;
        for (i, (&[a, b], label)) in edges.iter().zip(labels).enumerate() {
            if let Some(v) = [a, b].into_iter().find(|&v| v as usize >= points.len()) {
                let message = format!("there is no point {v}, there are {}", points.len());
                return Err(Error::new(Code::IndexOutOfRange, message).at(format!("edge {i}")));
            }
            set.edges.push([a, b, label]);
        }
        self.with_set(&set, name)
    }

    /// Like [`Surface::embedded_points`], from an array. Shape and errors: as in [`Surface::embedded_edges_of`].
    pub fn embedded_points_of(
        self,
        points: &[[f64; 3]],
        labels: Option<&[&str]>,
        name: &str,
    ) -> Result<Self, Error> {
        let mut set = set_of(points)?;
        let labels = labels_of(&mut set, (points.len(), "points"), labels, name)?;
        set.marks = (0..).zip(labels).map(|(v, label)| [v, label]).collect();
        self.with_set(&set, name)
    }

    fn with_wires_of(self, file: &Path, kind: WireKind, name: Option<&str>) -> Result<Self, Error> {
        guarded(&Settings::new(), || {
            let scratch = ScratchSpace::boundless();
            self.with_wires(file, kind, name, &scratch)
        })
    }

    pub(super) fn with_wires(
        self,
        file: &Path,
        kind: WireKind,
        name: Option<&str>,
        scratch: &ScratchSpace,
    ) -> Result<Self, Error> {
        let Source { origin, bytes, hash } = source(file)?;
        let set = read_wires(file, kind, scratch.cap())?;
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let name = name.unwrap_or(&stem);
        let path = origin.file().unwrap_or_default().to_owned();
        let named = NamedFile { name: name.to_owned(), file: path };
        let origin = match kind {
            WireKind::Edges => Origin::Edges(named),
            WireKind::Points => Origin::Points(named),
        };
        self.with_recorded(&set, name, Some(Source { origin, bytes, hash }), scratch)
    }

    /// Embeds the edges of the surface's own files: polygons of two corners in `.poly`. Call after sheets are embedded.
    pub(super) fn with_own_edges(mut self, scratch: &ScratchSpace) -> Result<Self, Error> {
        let notes = self.inner.notes.iter();
        let files: Vec<String> = notes
            .filter(|note| matches!(note.kind, NoteKind::Edges { .. }))
            .map(|note| note.file.clone())
            .collect();
        for file in files {
            if is_stream(Path::new(&file)) {
                let message = "edges of a pipe cannot be embedded: they are read a second time";
                return Err(Error::new(Code::UnreadableFile, message)
                    .at(file)
                    .with_help("write it to a file first"));
            }
            self = self.with_wires(Path::new(&file), WireKind::Edges, None, scratch)?;
        }
        Ok(self)
    }

    fn with_set(self, set: &EmbeddedSet, name: &str) -> Result<Self, Error> {
        guarded(&Settings::new(), || {
            self.with_recorded(set, name, None, &ScratchSpace::boundless())
        })
    }

    /// Adds edges and points. `record` is the file to read them from again; it is used only while the store needs no copy.
    fn with_recorded(
        mut self,
        set: &EmbeddedSet,
        name: &str,
        record: Option<Source>,
        scratch: &ScratchSpace,
    ) -> Result<Self, Error> {
        let mut set = Cow::Borrowed(set);
        let done = self.divide_at(&mut set, name, scratch)?;
        attempt(|| self.inner.embed_set(&set, name, scratch))??;
        let is_kept = self.keeps_embedded();
        match record {
            Some(record) if done == Divided::default() && !is_kept => self.sources.push(record),
            _ => self.keep_all(scratch)?,
        }
        Ok(self)
    }

    /// Divides triangles where vertices of `set` lie on them, or are moved to.
    fn divide_at(
        &mut self,
        set: &mut Cow<'_, EmbeddedSet>,
        name: &str,
        scratch: &ScratchSpace,
    ) -> Result<Divided, Error> {
        let within = match self.snaps {
            None if !self.divides => return Ok(Divided::default()),
            None => 0.0,
            Some(within) => {
                within.check("snap_embedded")?;
                within.resolve(self.inner.bounds().diagonal())
            }
        };
        let done = attempt(|| self.inner.divide_at(set.to_mut(), within, scratch))??;
        if done.moved > 0 {
            let Divided { moved, farthest, .. } = done;
            let text = format!(
                "{moved} embedded {} moved onto the surface, by {farthest:.1e} at most",
                if moved == 1 {
                    "point or end of an edge was"
                } else {
                    "points or ends of edges were"
                }
            );
            let (file, kind) = (name.to_owned(), NoteKind::Said(text));
            self.inner.notes.push(Note { file, kind });
        }
        Ok(done)
    }

    /// Makes the store keep a copy of the whole surface, in the order in which the copy is read again.
    pub(super) fn keep_all(&mut self, scratch: &ScratchSpace) -> Result<(), Error> {
        if !self.inner.has_sheets() && !self.inner.has_embedded() {
            self.sources = self.copied(&self.inner);
            return Ok(());
        }
        let set = self.inner.embedded_set();
        let mut plain = self.inner.without_embedded();
        let first = plain.sheets_last();
        self.sources = self.copied(&plain);
        if plain.has_sheets() {
            self.sources.push(Source::unmarked(Origin::SheetsFrom(first)));
        }
        self.inner = plain;
        if !set.edges.is_empty() || !set.marks.is_empty() {
            attempt(|| self.inner.embed_named(&set, scratch))??;
            self.sources.push(kept(&set));
        }
        Ok(())
    }

    /// Leaves out embedded edges and points, by their numbers in ascending order.
    pub(super) fn without_wires(
        &mut self,
        edges: &[usize],
        points: &[usize],
        scratch: &ScratchSpace,
    ) -> Result<(), Error> {
        fn leave_out<T>(list: &mut Vec<T>, numbers: &[usize]) {
            let mut i = 0..list.len();
            list.retain(|_| i.next().is_some_and(|i| numbers.binary_search(&i).is_err()));
        }
        let wires = &mut self.inner.embedded;
        leave_out(&mut wires.edges, edges);
        leave_out(&mut wires.point_lines, points);
        leave_out(&mut wires.points, points);
        if !self.inner.has_embedded() {
            self.inner = self.inner.without_embedded();
        }
        self.keep_all(scratch)
    }

    /// Writes a copy of edges and points that have no files of their own to the store's folder. Errors: the disk.
    pub(super) fn keep_wires_in(&self, store: &Path) -> Result<(), Error> {
        if self.keeps_embedded() {
            write::wires(&self.inner.embedded_set(), &in_store(store))?;
        }
        Ok(())
    }

    /// Returns whether the store keeps a copy of the embedded edges and points.
    fn keeps_embedded(&self) -> bool {
        self.sources.iter().any(|s| matches!(s.origin, Origin::EmbeddedCopy(_)))
    }

    /// Adds the store's copy of embedded edges and points. `counts`: number of edges, number of points.
    pub(super) fn with_kept_wires(
        mut self,
        counts: [u64; 2],
        store: &Path,
        scratch: &ScratchSpace,
    ) -> Result<Self, Error> {
        for (count, kind) in counts.into_iter().zip([WireKind::Edges, WireKind::Points]) {
            if count > 0 {
                let set = read_wires(&in_store(store), kind, scratch.cap())?;
                attempt(|| self.inner.embed_named(&set, scratch))??;
            }
        }
        self.sources.push(kept(&self.inner.embedded_set()));
        Ok(self)
    }
}

/// Path of the copy of edges and points in a store.
fn in_store(store: &Path) -> PathBuf {
    store.join("wires.obj")
}

/// Identity of edges and points that the store keeps: their numbers and a hash.
fn kept(set: &EmbeddedSet) -> Source {
    let mut hash = Xxh3::new();
    for x in set.points.iter().flat_map(|p| p.to_array()) {
        hash.update(&x.to_le_bytes());
    }
    let words = set.edges.iter().flatten().chain(set.marks.iter().flatten());
    words.for_each(|word| hash.update(&word.to_le_bytes()));
    let counts = [set.edges.len(), set.marks.len()].map(|n| n as u64);
    Source { origin: Origin::EmbeddedCopy(counts), bytes: 0, hash: halves(&hash) }
}

fn set_of(points: &[[f64; 3]]) -> Result<EmbeddedSet, Error> {
    let is_bad = |p: &[f64; 3]| p.iter().any(|x| !x.is_finite());
    if let Some(i) = points.iter().position(is_bad) {
        let message = "a coordinate is not a finite number";
        return Err(Error::new(Code::NotANumber, message).at(format!("point {i}")));
    }
    Ok(EmbeddedSet {
        points: points.iter().map(|&p| Point::from_array(p)).collect(),
        ..EmbeddedSet::default()
    })
}

/// The label of each edge or point, as a position in `set.label_names`. Without `labels`, all have the label `name`.
fn labels_of(
    set: &mut EmbeddedSet,
    (n, what): (usize, &str),
    labels: Option<&[&str]>,
    name: &str,
) -> Result<Vec<u32>, Error> {
    let Some(labels) = labels else {
        set.label_names.push(name.to_owned());
        return Ok(vec![0; n]);
    };
    if labels.len() != n {
        let message = format!("{} labels for {n} {what}", labels.len());
        return Err(Error::new(Code::CountMismatch, message)
            .with_help(format!("give one label for each of the {what}")));
    }
    let mut known = HashMap::new();
    let number = |label: &&str| {
        // The store's copy has one label a line; a label is trimmed as it is when the copy is read.
        let label = label.trim().replace(['\n', '\r'], " ");
        *known.entry(label.clone()).or_insert_with(|| {
            set.label_names.push(label);
            set.label_names.len() as u32 - 1
        })
    };
    Ok(labels.iter().map(number).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::{Length, Mesher, Sizes, VerifyLevel};

    #[test]
    fn edges_and_points_of_arrays_stay_with_the_store() {
        let rod = [[0.5, 0.5, 0.5], [0.3, 0.4, 1.0], [0.7, 0.6, 0.2]];
        let surface = Surface::sample("box,h=0.5").unwrap().dividing();
        let surface = surface
            .embedded_edges_of(&rod, &[[0, 1], [0, 2]], Some(&[" up", "down\n"]), "rod")
            .and_then(|s| s.embedded_points_of(&rod[1..], None, "ends"))
            .unwrap();
        assert_eq!(surface.labels()[6..], ["rod:up", "rod:down", "ends"]);
        let dir = tempfile::tempdir().unwrap();
        let mesh = |name: &str, sizes: Sizes| {
            let mesher = Mesher::new(surface.clone()).refine_surface(true);
            mesher.sizes(sizes).create(dir.path().join(name)).unwrap()
        };
        let sizes = || Sizes::interior(Length::units(0.2));
        let store = mesh("a", sizes());
        // The verification reads only the copies in the store.
        assert!(store.verify(VerifyLevel::Delaunay).unwrap().is_valid());
        assert_eq!(mesh("b", sizes()).summary().digest, store.summary().digest);
    }

    #[test]
    fn wrong_arrays_are_refused_with_a_place() {
        let surface = || Surface::sample("box,h=0.5").unwrap();
        let points = [[0.5, 0.5, 0.5], [0.5, 0.5, f64::NAN]];
        let edges = |points: &[[f64; 3]], edges: &[[u32; 2]], labels| {
            surface().embedded_edges_of(points, edges, labels, "e")
        };
        for (code, place, result) in [
            ("not-a-number", "point 1", edges(&points, &[[0, 1]], None)),
            ("index-out-of-range", "edge 0", edges(&points[..1], &[[0, 1]], None)),
            ("count-mismatch", "", edges(&points[..1], &[], Some(&["a"]))),
            ("wire-contact", "", surface().embedded_points_of(&[[0.3, 0.4, 1.0]], None, "p")),
        ] {
            let error = result.expect_err(code);
            assert_eq!(error.code(), code);
            assert!(error.place().unwrap_or_default().contains(place), "{error}");
        }
    }
}
