//! The shape of a VTK file, XML with raw appended arrays or VTKHDF: the place of each array, known before the first byte.

use std::path::Path;

use super::error::{Result, WriteError};
use super::hdf5::{self, Number, Object};
use super::stream::Strip;

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
        Self { group, name, kind, components: 1, width }
    }

    fn number(&self) -> Number {
        match self.kind {
            "UInt8" => Number::U8,
            "UInt32" => Number::U32,
            "Int64" => Number::I64,
            "Float64" => Number::F64,
            kind => unreachable!("no array of {kind} is written"),
        }
    }

    /// Bytes for each point, each cell, and each partition; a cell has so many corners.
    fn bytes_per(&self, corners: u64, container: &Container) -> [u64; 3] {
        let bytes = self.components * self.width;
        match (self.group, self.name) {
            (Group::Points | Group::PointData, _) => [bytes, 0, 0],
            (Group::Cells, "connectivity") => [0, corners * bytes, 0],
            // Offsets of each partition begin with a 0.
            (Group::Cells, "offsets") if *container != Container::Xml => [0, bytes, bytes],
            (Group::CellData | Group::Cells, _) => [0, bytes, 0],
        }
    }

    /// The same with three components.
    pub fn vectors(self) -> Self {
        Self { components: 3, ..self }
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

    /// As [`Index::new`], but with 64 bits where the container asks for them.
    pub fn within(is_hdf: bool, n_points: u64, n_corners: u64) -> Self {
        match is_hdf {
            false => Self::new(n_points, n_corners),
            true => Self { narrow: false },
        }
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

/// How a VTK file holds its arrays.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Container {
    /// `.vtu`: one mesh.
    Xml,
    /// `.vtkhdf`: partitions, each with points of its own; vertices and tetrahedra of each. Offsets of each begin with a 0.
    Hdf(Vec<[u64; 2]>),
}

/// A file with its arrays measured.
pub(super) struct Layout {
    /// What is known at once, and where it begins.
    fixed: Vec<(u64, Vec<u8>)>,
    /// First byte and length of each array.
    places: Vec<[u64; 2]>,
    /// What each array has for each point, cell and partition.
    bytes_per: Vec<[u64; 3]>,
    bytes: u64,
}

const TAIL: &str = "\n  </AppendedData>\n</VTKFile>\n";
/// An array of the field data and its texts: UTF-8, a zero after each, for not every program reads arrays of text.
pub(super) type Texts<'a> = (&'static str, &'a [u8]);

/// Numbers of points, of cells and of the corners of a cell.
pub(super) type Counts = [u64; 3];

impl Layout {
    /// `arrays` in the order of the groups; `texts` go into the field data, unless they are empty.
    pub fn new(container: &Container, arrays: &[Array], counts: Counts, texts: Texts) -> Self {
        match container {
            Container::Xml => Self::xml(arrays, counts, texts),
            Container::Hdf(partitions) => Self::hdf((container, partitions), arrays, counts, texts),
        }
    }

    fn xml(arrays: &[Array], counts: Counts, texts: Texts) -> Self {
        let head = xml_head(arrays, counts, texts).into_bytes();
        let mut at = head.len() as u64;
        let mut fixed = vec![(0, head)];
        let mut places = Vec::new();
        let bytes_per = all_bytes_per(arrays, counts, &Container::Xml);
        for per in &bytes_per {
            let bytes = of_rows(per, [counts[0], counts[1], 1]);
            fixed.push((at, bytes.to_le_bytes().to_vec()));
            places.push([at + 8, bytes]);
            at += 8 + bytes;
        }
        fixed.push((at, TAIL.as_bytes().to_vec()));
        Self { fixed, places, bytes_per, bytes: at + TAIL.len() as u64 }
    }

    /// Source: the VTKHDF file format in the VTK documentation, version 2, unstructured grids.
    fn hdf(
        (container, partitions): (&Container, &[[u64; 2]]),
        arrays: &[Array],
        counts: Counts,
        texts: Texts,
    ) -> Self {
        let n_partitions = partitions.len() as u64;
        let children = |group: Group| -> Vec<Object> {
            let of_group = arrays.iter().filter(|a| a.group == group);
            of_group
                .map(|array| {
                    let (name, rows) = match array.name {
                        "connectivity" => ("Connectivity", counts[1] * counts[2]),
                        "offsets" => ("Offsets", counts[1] + n_partitions),
                        "types" => ("Types", counts[1]),
                        name if group == Group::CellData => (name, counts[1]),
                        name => (name, counts[0]),
                    };
                    let shape = [rows, array.components];
                    let rank = if array.components == 1 { 1 } else { 2 };
                    Object::array(name, array.number(), &shape[..rank])
                })
                .collect()
        };
        let mut top = vec![
            Object::group("PointData", children(Group::PointData)),
            Object::group("CellData", children(Group::CellData)),
        ];
        top.extend(children(Group::Points));
        top.extend(children(Group::Cells));
        let of_partitions = ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"];
        top.extend(of_partitions.map(|name| Object::array(name, Number::I64, &[n_partitions])));
        let field = Object::array(texts.0, Number::U8, &[texts.1.len() as u64]);
        let fields = if texts.1.is_empty() { vec![] } else { vec![field] };
        top.push(Object::group("FieldData", fields));
        let grid = Object::group("VTKHDF", top)
            .with_integers("Version", &[2, 0])
            .with_text("Type", "UnstructuredGrid");
        let mut plan = hdf5::plan(&Object::group("", vec![grid]));
        let small = plan.arrays.split_off(arrays.len());
        let mut fixed = vec![(0, plan.head)];
        let per_cell = [[1, 0], [0, 1], [0, counts[2]]];
        for ([at, _], [of_points, of_cells]) in small.iter().zip(per_cell) {
            let number = |&[points, cells]: &[u64; 2]| points * of_points + cells * of_cells;
            let values = partitions.iter().map(number);
            fixed.push((*at, values.flat_map(u64::to_le_bytes).collect()));
        }
        if let Some(&[at, _]) = small.get(per_cell.len()) {
            fixed.push((at, texts.1.to_vec()));
        }
        Self {
            fixed,
            places: plan.arrays,
            bytes_per: all_bytes_per(arrays, counts, container),
            bytes: plan.file_bytes,
        }
    }

    /// Length of the whole file.
    pub fn file_bytes(&self) -> u64 {
        self.bytes
    }

    /// Writes what is known.
    pub fn begin(&self, path: &Path) -> Result<()> {
        for (at, bytes) in &self.fixed {
            let mut strip = Strip::open(path, *at, bytes.len() as u64)?;
            strip.put(bytes)?;
            strip.finish()?;
        }
        Ok(())
    }

    /// Opens a strip of each array for `here` points, cells and partitions, behind as many as `before` says.
    pub fn strips<const N: usize>(
        &self,
        path: &Path,
        before: [u64; 3],
        here: [u64; 3],
    ) -> Result<[Strip; N]> {
        let all = self.places.iter().zip(&self.bytes_per);
        let open = |(&[at, _], per): (&[u64; 2], &[u64; 3])| {
            Strip::open(path, at + of_rows(per, before), of_rows(per, here))
        };
        let strips = all.map(open).collect::<Result<Vec<_>>>()?;
        Self::as_expected(strips, path)
    }

    /// Writes what is known, and opens a strip for each array.
    pub fn open<const N: usize>(&self, path: &Path) -> Result<[Strip; N]> {
        self.begin(path)?;
        let open = |&[at, bytes]: &[u64; 2]| Strip::open(path, at, bytes);
        let strips = self.places.iter().map(open).collect::<Result<Vec<_>>>()?;
        Self::as_expected(strips, path)
    }

    fn as_expected<const N: usize>(strips: Vec<Strip>, path: &Path) -> Result<[Strip; N]> {
        strips.try_into().map_err(|_| WriteError::Io {
            path: path.to_owned(),
            source: std::io::Error::other("the arrays of the file were miscounted"),
        })
    }
}

fn all_bytes_per(arrays: &[Array], counts: Counts, container: &Container) -> Vec<[u64; 3]> {
    let per = |array: &Array| array.bytes_per(counts[2], container);
    arrays.iter().map(per).collect()
}

/// Bytes of so many points, cells and partitions.
fn of_rows(per: &[u64; 3], rows: [u64; 3]) -> u64 {
    per.iter().zip(rows).map(|(bytes, n)| bytes * n).sum()
}

fn xml_head(arrays: &[Array], counts: Counts, texts: Texts) -> String {
    let mut text = "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  \
         <UnstructuredGrid>\n"
        .to_owned();
    if !texts.1.is_empty() {
        let numbers: String = texts.1.iter().map(|byte| format!("{byte} ")).collect();
        text += &format!(
            "    <FieldData>\n      <DataArray type=\"UInt8\" Name=\"{}\" NumberOfTuples=\"{}\" format=\"ascii\">\n        \
             {numbers}\n      </DataArray>\n    </FieldData>\n",
            texts.0,
            texts.1.len()
        );
    }
    text +=
        &format!("    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", counts[0], counts[1]);
    let mut offset = 0;
    for group in [Group::PointData, Group::CellData, Group::Points, Group::Cells] {
        text += &format!("      <{group:?}>\n");
        for array in arrays.iter().filter(|a| a.group == group) {
            text += &format!(
                "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{offset}\"/>\n",
                array.kind, array.name, array.components
            );
            let per = array.bytes_per(counts[2], &Container::Xml);
            offset += 8 + of_rows(&per, [counts[0], counts[1], 1]);
        }
        text += &format!("      </{group:?}>\n");
    }
    text + "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n   _"
}
