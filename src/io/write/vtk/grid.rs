//! An unstructured grid as a VTK file, XML with raw appended arrays or VTKHDF.
//!
//! Every array has its place in the file before the first byte is written, so the arrays are filled side by side.
//! Source: the VTK file formats document, appended raw data with 64-bit lengths; the VTKHDF file format, version 2.

use std::borrow::Cow;
use std::path::Path;

use crate::write::columns::{Number, TableColumn, put_row};
use crate::write::error::Result;
use crate::write::hdf5::{self, Hdf5Object};
use crate::write::stream::Strip;

/// The group of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Group {
    PointData,
    CellData,
    Points,
    Cells,
}

/// An array of the file.
struct Array {
    group: Group,
    name: Cow<'static, str>,
    number: Number,
    components: u64,
}

impl Array {
    fn of_columns<T>(group: Group, columns: &[TableColumn<T>]) -> impl Iterator<Item = Self> {
        columns.iter().map(move |column| Self {
            group,
            name: column.name.clone(),
            number: column.number,
            components: column.components,
        })
    }

    /// Bytes for each point, cell and partition, where a cell has so many corners.
    fn bytes_per(&self, corners: u64, is_hdf: bool) -> [u64; 3] {
        let bytes = self.components * self.number.bytes();
        match (self.group, &*self.name) {
            (Group::Points | Group::PointData, _) => [bytes, 0, 0],
            (Group::Cells, "connectivity") => [0, corners * bytes, 0],
            // Offsets of each partition begin with a 0.
            (Group::Cells, "offsets") if is_hdf => [0, bytes, bytes],
            (Group::CellData | Group::Cells, _) => [0, bytes, 0],
        }
    }
}

/// VTK's kinds of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::write) enum VtkCells {
    /// Those of first or second order.
    OfOrder,
    /// Lagrange's, of any order: the only ones that DOLFINx 0.10 reads.
    Lagrange,
}

/// How a VTK file holds its arrays.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Container {
    /// `.vtu`: one mesh.
    Xml,
    /// `.vtkhdf`: partitions with points of their own. Shape: points and cells of each.
    Hdf(VtkCells, Vec<[u64; 2]>),
}

/// An array of the field data and its texts: UTF-8 with a zero after each, because not every program reads arrays of text.
pub(super) type Texts<'a> = (&'static str, &'a [u8]);

/// Numbers of points, of cells, and of the corners of a cell.
pub(super) type Counts = [u64; 3];

/// A VTK file: its columns and the place of each array.
///
/// `P` and `C` are the rows of points and cells; all cells have equally many corners.
pub(super) struct VtkGrid<P, C> {
    points: Vec<TableColumn<P>>,
    cells: Vec<TableColumn<C>>,
    /// Connectivity and offsets have 32 bits.
    is_narrow: bool,
    is_hdf: bool,
    /// Points, cells and partitions.
    rows: [u64; 3],
    corners: u64,
    /// VTK's number of the kind of cells.
    kind: u8,
    layout: Layout,
    /// Bytes that each array has for each point, cell and partition.
    bytes_per: Vec<[u64; 3]>,
}

/// Places in a file.
struct Layout {
    /// Bytes that are known at once, each after its place.
    fixed: Vec<(u64, Vec<u8>)>,
    /// First byte of each array.
    starts: Vec<u64>,
    file_bytes: u64,
}

const TAIL: &str = "\n  </AppendedData>\n</VTKFile>\n";

impl<P, C> VtkGrid<P, C> {
    /// Lays out a file. `texts` go into the field data, unless they are empty.
    pub fn new(
        container: &Container,
        counts: Counts,
        texts: Texts,
        points: Vec<TableColumn<P>>,
        cells: Vec<TableColumn<C>>,
    ) -> Self {
        let [n_points, n_cells, corners] = counts;
        let is_hdf = *container != Container::Xml;
        let is_narrow = !is_hdf && n_points.max(n_cells * corners) <= i32::MAX as u64;
        let index = if is_narrow { Number::I32 } else { Number::I64 };
        let mut arrays: Vec<Array> = Array::of_columns(Group::PointData, &points)
            .chain(Array::of_columns(Group::CellData, &cells))
            .collect();
        for (group, name, number, components) in [
            (Group::Points, "Points", Number::F64, 3),
            (Group::Cells, "connectivity", index, 1),
            (Group::Cells, "offsets", index, 1),
            (Group::Cells, "types", Number::U8, 1),
        ] {
            arrays.push(Array { group, name: name.into(), number, components });
        }
        let bytes_per: Vec<_> = arrays.iter().map(|a| a.bytes_per(corners, is_hdf)).collect();
        let (layout, n_partitions) = match container {
            Container::Xml => (Layout::xml(&arrays, &bytes_per, counts, texts), 1),
            Container::Hdf(_, parts) => (Layout::hdf(parts, &arrays, counts, texts), parts.len()),
        };
        let kind = match container {
            Container::Xml => cell_type(VtkCells::OfOrder, corners),
            Container::Hdf(cells, _) => cell_type(*cells, corners),
        };
        let rows = [n_points, n_cells, n_partitions as u64];
        Self { points, cells, is_narrow, is_hdf, rows, corners, kind, layout, bytes_per }
    }

    /// Length of the whole file.
    pub fn file_bytes(&self) -> u64 {
        self.layout.file_bytes
    }

    /// Writes all bytes but those of the arrays. Errors: the disk.
    pub fn begin(&self, path: &Path) -> Result<()> {
        for (at, bytes) in &self.layout.fixed {
            let mut strip = Strip::open(path, *at, bytes.len() as u64)?;
            strip.put(bytes)?;
            strip.finish()?;
        }
        Ok(())
    }

    /// Writes all bytes but those of the arrays, and opens the arrays. Errors: the disk.
    pub fn open(&self, path: &Path) -> Result<GridWriter<'_, P, C>> {
        self.begin(path)?;
        self.open_rows(path, [0; 3], self.rows)
    }

    /// Opens the arrays for `here` points, cells and partitions, behind as many as `before` says. Errors: the disk.
    pub fn open_rows(
        &self,
        path: &Path,
        before: [u64; 3],
        here: [u64; 3],
    ) -> Result<GridWriter<'_, P, C>> {
        let mut strips = (self.layout.starts.iter().zip(&self.bytes_per)).map(|(start, per)| {
            Strip::open(path, start + bytes_of(per, before), bytes_of(per, here))
        });
        let mut open = || strips.next().expect("every array has its place");
        Ok(GridWriter {
            grid: self,
            point_data: self.points.iter().map(|_| open()).collect::<Result<_>>()?,
            cell_data: self.cells.iter().map(|_| open()).collect::<Result<_>>()?,
            positions: open()?,
            nodes: open()?,
            ends: open()?,
            types: open()?,
            end: 0,
        })
    }
}

/// The arrays of some or all partitions being written.
pub(super) struct GridWriter<'g, P, C> {
    grid: &'g VtkGrid<P, C>,
    point_data: Vec<Strip>,
    cell_data: Vec<Strip>,
    positions: Strip,
    nodes: Strip,
    ends: Strip,
    types: Strip,
    /// Corners of the partition so far.
    end: u64,
}

impl<P, C> GridWriter<'_, P, C> {
    /// Writes the next point. Errors: the disk.
    pub fn point(&mut self, row: &P, position: [f64; 3]) -> Result<()> {
        put_row(row, &self.grid.points, &mut self.point_data)?;
        position.iter().try_for_each(|x| self.positions.put(&x.to_le_bytes()))
    }

    /// Begins the cells of the next partition. Errors: the disk.
    pub fn begin_partition(&mut self) -> Result<()> {
        self.end = 0;
        match self.grid.is_hdf {
            true => put_index(&mut self.ends, 0, self.grid.is_narrow),
            false => Ok(()),
        }
    }

    /// Writes the next cell. Errors: the disk, and those of `nodes`.
    pub fn cell(&mut self, row: &C, nodes: impl IntoIterator<Item = Result<u64>>) -> Result<()> {
        let is_narrow = self.grid.is_narrow;
        put_row(row, &self.grid.cells, &mut self.cell_data)?;
        for node in nodes {
            put_index(&mut self.nodes, node?, is_narrow)?;
        }
        self.end += self.grid.corners;
        put_index(&mut self.ends, self.end, is_narrow)?;
        self.types.put(&[self.grid.kind])
    }

    /// Ends the arrays, which must be full. Errors: the disk.
    pub fn finish(self) -> Result<()> {
        let own = [self.positions, self.nodes, self.ends, self.types];
        let data = self.point_data.into_iter().chain(self.cell_data);
        data.chain(own).try_for_each(Strip::finish)
    }
}

#[inline]
fn put_index(strip: &mut Strip, value: u64, is_narrow: bool) -> Result<()> {
    match is_narrow {
        true => strip.put(&(value as u32).to_le_bytes()),
        false => strip.put(&value.to_le_bytes()),
    }
}

/// VTK's number of a triangle or tetrahedron, alone or with the midpoints of its edges.
fn cell_type(cells: VtkCells, corners: u64) -> u8 {
    match corners {
        3 | 6 if cells == VtkCells::Lagrange => 69,
        4 | 10 if cells == VtkCells::Lagrange => 71,
        3 => 5,
        6 => 22,
        4 => 10,
        10 => 24,
        _ => unreachable!("no cell has {corners} corners"),
    }
}

/// Bytes of so many points, cells and partitions.
fn bytes_of(per: &[u64; 3], rows: [u64; 3]) -> u64 {
    per.iter().zip(rows).map(|(bytes, n)| bytes * n).sum()
}

impl Layout {
    fn xml(arrays: &[Array], bytes_per: &[[u64; 3]], counts: Counts, texts: Texts) -> Self {
        let rows = [counts[0], counts[1], 1];
        let lengths: Vec<u64> = bytes_per.iter().map(|per| bytes_of(per, rows)).collect();
        let (offsets, end) = xml_offsets(&lengths);
        let head = xml_head(arrays, &offsets, counts, texts).into_bytes();
        let first = head.len() as u64;
        let mut fixed = vec![(0, head)];
        for (offset, bytes) in offsets.iter().zip(lengths) {
            fixed.push((first + offset, bytes.to_le_bytes().to_vec()));
        }
        let starts = offsets.iter().map(|offset| first + offset + 8).collect();
        let at = first + end;
        fixed.push((at, TAIL.as_bytes().to_vec()));
        Self { fixed, starts, file_bytes: at + TAIL.len() as u64 }
    }

    fn hdf(partitions: &[[u64; 2]], arrays: &[Array], counts: Counts, texts: Texts) -> Self {
        let n_partitions = partitions.len() as u64;
        let [n_points, n_cells, corners] = counts;
        let children = |group: Group| -> Vec<Hdf5Object> {
            let of_group = arrays.iter().filter(|a| a.group == group);
            of_group
                .map(|array| {
                    let (name, rows) = match &*array.name {
                        "connectivity" => ("Connectivity".into(), n_cells * corners),
                        "offsets" => ("Offsets".into(), n_cells + n_partitions),
                        "types" => ("Types".into(), n_cells),
                        _ if group == Group::CellData => (array.name.clone(), n_cells),
                        _ => (array.name.clone(), n_points),
                    };
                    let shape = [rows, array.components];
                    let rank = if array.components == 1 { 1 } else { 2 };
                    Hdf5Object::array(name, array.number, &shape[..rank])
                })
                .collect()
        };
        let mut top = vec![
            Hdf5Object::group("PointData", children(Group::PointData)),
            Hdf5Object::group("CellData", children(Group::CellData)),
        ];
        top.extend(children(Group::Points));
        top.extend(children(Group::Cells));
        let of_partitions = ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"];
        top.extend(of_partitions.map(|name| Hdf5Object::array(name, Number::I64, &[n_partitions])));
        let field = Hdf5Object::array(texts.0, Number::U8, &[texts.1.len() as u64]);
        let fields = if texts.1.is_empty() { vec![] } else { vec![field] };
        top.push(Hdf5Object::group("FieldData", fields));
        let grid = Hdf5Object::group("VTKHDF", top)
            .with_integers("Version", &[2, 0])
            .with_text("Type", "UnstructuredGrid");
        let plan = hdf5::plan(&Hdf5Object::group("", vec![grid]));
        let starts: Vec<u64> = plan.arrays.iter().map(|&[start, _]| start).collect();
        let (own, small) = starts.split_at(arrays.len());
        let mut fixed = vec![(0, plan.head)];
        for (&at, per) in small.iter().zip([[1, 0], [0, 1], [0, corners]]) {
            let number = |&[points, cells]: &[u64; 2]| points * per[0] + cells * per[1];
            let values = partitions.iter().map(number);
            fixed.push((at, values.flat_map(u64::to_le_bytes).collect()));
        }
        fixed.extend(small.get(3).map(|&at| (at, texts.1.to_vec())));
        Self { fixed, starts: own.to_vec(), file_bytes: plan.file_bytes }
    }
}

/// Where each array begins behind the head, and where the last one ends.
///
/// The array named last comes first. meshio replaces these numbers from the first array on by others, and looks for the next array by
/// its number from the top of the file: so it finds the array itself before one that it has renumbered alike.
fn xml_offsets(lengths: &[u64]) -> (Vec<u64>, u64) {
    let mut end = 0;
    let mut offsets = vec![0; lengths.len()];
    for (offset, bytes) in offsets.iter_mut().zip(lengths).rev() {
        *offset = end;
        end += 8 + bytes;
    }
    (offsets, end)
}

/// The text before the arrays. An array of one component does not say so: meshio would make a matrix of it.
fn xml_head(arrays: &[Array], offsets: &[u64], counts: Counts, texts: Texts) -> String {
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
    for group in [Group::PointData, Group::CellData, Group::Points, Group::Cells] {
        text += &format!("      <{group:?}>\n");
        for (array, offset) in arrays.iter().zip(offsets).filter(|(a, _)| a.group == group) {
            let components = match array.components {
                1 => String::new(),
                n => format!(" NumberOfComponents=\"{n}\""),
            };
            text += &format!(
                "        <DataArray type=\"{}\" Name=\"{}\"{components} format=\"appended\" offset=\"{offset}\"/>\n",
                array.number.vtk(),
                array.name
            );
        }
        text += &format!("      </{group:?}>\n");
    }
    text + "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n   _"
}
