//! Where the parts of a surface came from.

use crate::catalog::{Job, SurfaceSource};

/// A part of a surface: its origin, and the fingerprint by which a changed file is noticed.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Where it came from.
    pub origin: Origin,
    /// Length of a file in bytes, else 0.
    pub bytes: u64,
    /// xxh3-128 of the content, low half first; 0 where there is none.
    pub hash: [u64; 2],
}

/// Where a part of a surface came from. Later parts build on the parts before them.
#[derive(Clone, Debug, PartialEq)]
pub enum Origin {
    /// A file, by its absolute path, behind [`BOUNDARY_OF`] if the boundary of its volume cells is the surface.
    File(String),
    /// A generated surface, by its specification.
    Sample(String),
    /// A copy of the surface in the store, of triangles that were in no file.
    Copy,
    /// An embedded sheet.
    Sheet(NamedFile),
    /// All triangles from this number on are sheets.
    SheetsFrom(usize),
    /// Crossing triangles were divided; what was done, in words. The fingerprint is that of the divided surface.
    Resolved(String),
    /// Holes were closed by winding numbers; what was done, in words. The fingerprint is that of the closed surface.
    Closed(String),
    /// Near points were joined, and what needs no guess was repaired; what was done, in words that begin with the share of the box
    /// diagonal. The fingerprint is that of the repaired surface.
    Welded(String),
    /// A closed surface around the triangles took their place; gap and offset. The fingerprint is that of the wrap.
    Wrapped(String),
    /// The surface was remeshed within a tolerance; how, in words. The fingerprint is that of the remeshed surface.
    Remeshed(String),
    /// The tetrahedra came from this file, by its absolute path; the surface is theirs.
    Imported(String),
    /// All parts that are not closed are sheets.
    OpenParts,
    /// Embedded edges.
    Edges(NamedFile),
    /// Embedded points.
    Points(NamedFile),
    /// A copy of embedded edges and points in the store, with the number of each.
    EmbeddedCopy([u64; 2]),
}

/// A file, and the name that its parts have in the mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedFile {
    /// The name; it has no `=`.
    pub name: String,
    /// Absolute path, or the specification of a sample.
    pub file: String,
}

/// Before the path of a file whose volume cells bound the surface.
pub const BOUNDARY_OF: &str = "boundary-of:";
const SAMPLE: &str = "sample:";
const COPY: &str = "store:surface.obj";
const SHEET: &str = "sheet:";
const SHEETS_FROM: &str = "sheets-from:";
const RESOLVED: &str = "resolved:";
const CLOSED: &str = "closed:";
const WELDED: &str = "welded:";
const WRAPPED: &str = "wrapped:";
const REMESHED: &str = "remeshed:";
const IMPORTED: &str = "imported:";
const OPEN_PARTS: &str = "open-parts:";
const EDGES: &str = "edges:";
const POINTS: &str = "points:";
const EMBEDDED_COPY: &str = "wires:";

impl Job {
    /// True if the mesh of the store was imported.
    pub fn is_imported(&self) -> bool {
        let mut sources = self.surfaces.iter().filter_map(Source::from_record);
        sources.any(|source| matches!(source.origin, Origin::Imported(_)))
    }
}

impl Source {
    /// A source without a fingerprint.
    pub fn unmarked(origin: Origin) -> Self {
        Self { origin, bytes: 0, hash: [0; 2] }
    }

    /// Reads a row of the record; `None` for one that no version wrote.
    pub fn from_record(row: &SurfaceSource) -> Option<Self> {
        let text = row.path.as_str();
        let named = |rest: &str| {
            let (name, file) = rest.split_once('=')?;
            Some(NamedFile { name: name.to_owned(), file: file.to_owned() })
        };
        let after = |prefix| text.strip_prefix(prefix);
        let origin = if text == COPY {
            Origin::Copy
        } else if text == OPEN_PARTS {
            Origin::OpenParts
        } else if let Some(rest) = after(RESOLVED) {
            Origin::Resolved(rest.to_owned())
        } else if let Some(rest) = after(CLOSED) {
            Origin::Closed(rest.to_owned())
        } else if let Some(rest) = after(WELDED) {
            Origin::Welded(rest.to_owned())
        } else if let Some(rest) = after(WRAPPED) {
            Origin::Wrapped(rest.to_owned())
        } else if let Some(rest) = after(REMESHED) {
            Origin::Remeshed(rest.to_owned())
        } else if let Some(rest) = after(IMPORTED) {
            Origin::Imported(rest.to_owned())
        } else if let Some(rest) = after(SHEETS_FROM) {
            Origin::SheetsFrom(rest.parse().ok()?)
        } else if let Some(rest) = after(SHEET) {
            Origin::Sheet(named(rest)?)
        } else if let Some(rest) = after(EDGES) {
            Origin::Edges(named(rest)?)
        } else if let Some(rest) = after(POINTS) {
            Origin::Points(named(rest)?)
        } else if let Some(rest) = after(EMBEDDED_COPY) {
            let (edges, points) = rest.split_once(',')?;
            Origin::EmbeddedCopy([edges.parse().ok()?, points.parse().ok()?])
        } else if text.starts_with(SAMPLE) {
            Origin::Sample(text.to_owned())
        } else {
            Origin::File(text.to_owned())
        };
        Some(Self { origin, bytes: row.bytes, hash: row.hash })
    }

    /// The row of the record.
    pub fn to_record(&self) -> SurfaceSource {
        let named = |prefix: &str, of: &NamedFile| format!("{prefix}{}={}", of.name, of.file);
        let path = match &self.origin {
            Origin::File(text) | Origin::Sample(text) => text.clone(),
            Origin::Copy => COPY.to_owned(),
            Origin::Sheet(file) => named(SHEET, file),
            Origin::SheetsFrom(first) => format!("{SHEETS_FROM}{first}"),
            Origin::Resolved(what) => format!("{RESOLVED}{what}"),
            Origin::Closed(what) => format!("{CLOSED}{what}"),
            Origin::Welded(what) => format!("{WELDED}{what}"),
            Origin::Wrapped(what) => format!("{WRAPPED}{what}"),
            Origin::Remeshed(what) => format!("{REMESHED}{what}"),
            Origin::Imported(file) => format!("{IMPORTED}{file}"),
            Origin::OpenParts => OPEN_PARTS.to_owned(),
            Origin::Edges(file) => named(EDGES, file),
            Origin::Points(file) => named(POINTS, file),
            Origin::EmbeddedCopy([edges, points]) => format!("{EMBEDDED_COPY}{edges},{points}"),
        };
        SurfaceSource { path, bytes: self.bytes, hash: self.hash }
    }
}

impl Origin {
    /// The file that the part can be read from again.
    pub fn file(&self) -> Option<&str> {
        match self {
            Self::File(file) => Some(file.strip_prefix(BOUNDARY_OF).unwrap_or(file)),
            Self::Sheet(of) | Self::Edges(of) | Self::Points(of) => {
                Some(of.file.strip_prefix(BOUNDARY_OF).unwrap_or(&of.file))
            }
            _ => None,
        }
    }

    /// Returns whether it is a repair of the parts before it, or a remeshing.
    pub fn is_repair(&self) -> bool {
        use Origin::{Closed, Remeshed, Resolved, Welded, Wrapped};
        matches!(self, Resolved(_) | Closed(_) | Welded(_) | Wrapped(_) | Remeshed(_))
    }

    /// Returns whether the part is inside the surface, and was added after its own triangles.
    pub fn is_inside(&self) -> bool {
        !matches!(self, Self::File(_) | Self::Sample(_) | Self::Copy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_as_they_were() {
        for path in [
            "/home/a/part.stl",
            "boundary-of:/home/a/part.msh",
            "sample:box,h=0.1",
            "store:surface.obj",
            "sheet:north=/home/a/fault=1.stl",
            "sheets-from:120",
            "open-parts:",
            "resolved:56 pairs",
            "closed:holes=2,area=3e-1",
            "welded:share=1e-6,joined=4",
            "wrapped:gap=1e-2,offset=1e-3",
            "remeshed:tolerance=1e-3,angle=40",
            "imported:/home/a/part.msh",
            "edges:well=/home/a/wells.obj",
            "points:sensor=/home/a/p.csv",
            "wires:12,3",
        ] {
            let row = SurfaceSource { path: path.to_owned(), bytes: 7, hash: [1, 2] };
            let source = Source::from_record(&row).expect("a source");
            assert_eq!(source.to_record(), row);
            assert_eq!(
                source.origin.is_inside(),
                !path.starts_with(['/', 's', 'b']) || path.starts_with("sheet")
            );
        }
        for path in ["sheet:nofile", "sheets-from:x", "wires:1"] {
            let row = SurfaceSource { path: path.to_owned(), ..SurfaceSource::default() };
            assert_eq!(Source::from_record(&row), None, "{path}");
        }
    }
}
