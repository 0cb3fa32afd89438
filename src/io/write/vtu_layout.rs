//! The shape of a VTK XML file with raw appended arrays: the head names each array's place behind it.

use std::path::Path;

use super::error::{Result, WriteError};
use super::stream::{Stream, Strip};

/// Where an array belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    PointData,
    CellData,
    Points,
    Cells,
}

/// An array of the file.
pub(super) struct Array {
    pub group: Group,
    pub name: &'static str,
    /// VTK's word for the type of a component.
    pub kind: &'static str,
    pub components: u64,
    /// Bytes of a component.
    pub width: u64,
}

impl Array {
    pub fn new(group: Group, name: &'static str, kind: &'static str) -> Self {
        let width = match kind {
            "UInt8" => 1,
            "Int32" | "UInt32" => 4,
            _ => 8,
        };
        Self {
            group,
            name,
            kind,
            components: 1,
            width,
        }
    }

    /// The same with three components.
    pub fn vectors(self) -> Self {
        Self {
            components: 3,
            ..self
        }
    }
}

/// Connectivity and offsets in the narrowest signed integers that hold them.
#[derive(Clone, Copy)]
pub(super) struct Index {
    narrow: bool,
}

impl Index {
    /// For `n_points` points and cells with `n_corners` corners together.
    pub fn new(n_points: u64, n_corners: u64) -> Self {
        let narrow = n_points.max(n_corners) <= i32::MAX as u64;
        Self { narrow }
    }

    pub fn kind(self) -> &'static str {
        if self.narrow { "Int32" } else { "Int64" }
    }

    #[inline]
    pub fn put(self, strip: &mut Strip, value: u64) -> Result<()> {
        if self.narrow {
            strip.put(&(value as u32).to_le_bytes())
        } else {
            strip.put(&value.to_le_bytes())
        }
    }
}

/// A file with its arrays measured.
pub(super) struct Layout {
    arrays: Vec<Array>,
    n_points: u64,
    n_cells: u64,
    n_corners: u64,
    head: String,
}

const TAIL: &str = "\n  </AppendedData>\n</VTKFile>\n";

impl Layout {
    /// `arrays` in the order of the groups; `field_data` is put into the head as it is.
    pub fn new(
        arrays: Vec<Array>,
        [n_points, n_cells, corners]: [u64; 3],
        field_data: &str,
    ) -> Self {
        let mut layout = Self {
            arrays,
            n_points,
            n_cells,
            n_corners: corners * n_cells,
            head: String::new(),
        };
        layout.head = layout.write_head(field_data);
        layout
    }

    fn bytes(&self, array: &Array) -> u64 {
        let tuples = match array.group {
            Group::Points | Group::PointData => self.n_points,
            Group::Cells if array.name == "connectivity" => self.n_corners,
            Group::CellData | Group::Cells => self.n_cells,
        };
        tuples * array.components * array.width
    }

    fn write_head(&self, field_data: &str) -> String {
        let mut text = format!(
            "<?xml version=\"1.0\"?>\n\
             <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  \
             <UnstructuredGrid>\n{field_data}    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
            self.n_points, self.n_cells
        );
        let mut offset = 0;
        for group in [
            Group::PointData,
            Group::CellData,
            Group::Points,
            Group::Cells,
        ] {
            text += &format!("      <{group:?}>\n");
            for array in self.arrays.iter().filter(|a| a.group == group) {
                text += &format!(
                    "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{offset}\"/>\n",
                    array.kind, array.name, array.components
                );
                offset += 8 + self.bytes(array);
            }
            text += &format!("      </{group:?}>\n");
        }
        text + "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n   _"
    }

    /// Length of the whole file.
    pub fn file_bytes(&self) -> u64 {
        let arrays: u64 = self.arrays.iter().map(|a| 8 + self.bytes(a)).sum();
        self.head.len() as u64 + arrays + TAIL.len() as u64
    }

    /// Writes head, array lengths and tail, and opens a strip for each array.
    pub fn open<const N: usize>(&self, path: &Path) -> Result<[Strip; N]> {
        let mut stream = Stream::open(path)?;
        stream.text(&self.head);
        stream.finish()?;
        let mut at = self.head.len() as u64;
        let mut strips = Vec::with_capacity(N);
        for array in &self.arrays {
            let bytes = self.bytes(array);
            let mut length = Strip::open(path, at, 8)?;
            length.put(&bytes.to_le_bytes())?;
            length.finish()?;
            strips.push(Strip::open(path, at + 8, bytes)?);
            at += 8 + bytes;
        }
        let mut tail = Strip::open(path, at, TAIL.len() as u64)?;
        tail.put(TAIL.as_bytes())?;
        tail.finish()?;
        strips.try_into().map_err(|_| WriteError::Io {
            path: path.to_owned(),
            source: std::io::Error::other("the arrays of the file were miscounted"),
        })
    }
}
