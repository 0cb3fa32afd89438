//! Meshes in VTK's XML files of unstructured grids, `.vtu`: arrays as text, base64 or appended, plain or packed with zlib.
//!
//! A first pass finds the places of the arrays; then those that matter are read side by side, each through a buffer.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use hdf5_reader::Hdf5File;

use super::hdf_rows::HdfRows;
use super::numbers::{Coding, Layout, Numbers, field_number};
use super::{FilePlace, MeshFields, RawMesh, ReadError, ReadFault, Result};
use crate::read::error::Spot;
use crate::read::feed::{check_point, quote};
use crate::read::open::{open_plain, unpacked_name};
use crate::read::xml::Tag;
use tetdb_base::geom::{Point, counted};
use tetdb_schema::field::FieldPlace;

/// Longest tag that is read.
const TAG_MAX: u64 = 1 << 16;
/// Longest text that is read: a million names of 64 letters.
const TEXT_MAX: u64 = 1 << 26;

/// An array of a piece.
#[derive(Clone)]
pub struct ArrayAt {
    pub section: String,
    pub name: String,
    pub kind: String,
    pub n_components: usize,
    /// How its numbers are written; in an HDF5 file its path.
    pub format: String,
    /// Byte behind its tag, its place in the appended data, or its first row in an HDF5 file.
    pub at: u64,
    /// Number of rows, where the file says it.
    pub rows: u64,
}

pub struct Piece {
    pub n_points: u64,
    pub n_cells: u64,
    /// Number of the partition of a VTKHDF file.
    pub partition: Option<i64>,
    pub arrays: Vec<ArrayAt>,
}

/// Name of the array that stands for the partitions of a VTKHDF file.
const PARTITION: &str = "partition";

/// The arrays of the cells of a piece.
struct CellArrays {
    types: Numbers,
    ends: Numbers,
    vertices: Numbers,
    /// Regions, parts, labels and kinds of copies, where there are any.
    lists: [Option<Numbers>; 4],
    /// Values, and their fields.
    values: Vec<(usize, Numbers)>,
}

/// An array of values that is taken: its name, its section, and its field.
type TakenArray = (String, String, usize);

pub struct Grid {
    name: String,
    path: std::path::PathBuf,
    layout: Layout,
    appended: Option<(u64, Coding)>,
    pub(super) pieces: Vec<Piece>,
    /// Texts of the whole, as bytes.
    texts: Vec<ArrayAt>,
    hdf: Option<Hdf5File>,
}

impl Grid {
    /// Reads the pieces into a mesh. Errors: those of the file.
    pub(super) fn read(&self, fields: MeshFields, mesh: &mut RawMesh) -> Result<()> {
        let taken = self.values(fields, mesh);
        let names = self.names("region_names")?;
        let (mut first, mut n_ghosts) = (0, 0);
        for piece in &self.pieces {
            self.points(piece, &taken, mesh)?;
            n_ghosts += self.cells(piece, first, fields, (&taken, &names), mesh)?;
            first += piece.n_points;
        }
        if n_ghosts > 0 {
            let text = "[cell is a copy of one in another piece and was|cells are copies of those in other pieces and were] left out";
            mesh.notes.push(counted(n_ghosts, text));
        }
        Ok(())
    }

    /// Begins a field for each array of values that all pieces have alike; notes the others.
    fn values(&self, fields: MeshFields, mesh: &mut RawMesh) -> Vec<TakenArray> {
        let (mut taken, mut left_out): (Vec<TakenArray>, Vec<&str>) = (Vec::new(), Vec::new());
        let pieces = || self.pieces.iter().filter(|piece| piece.n_points > 0);
        let known =
            [fields.region, fields.part, Some("region"), Some("label"), Some("vtkGhostType")];
        for array in pieces().flat_map(|piece| &piece.arrays) {
            let name = array.name.as_str();
            let place = match array.section.as_str() {
                "PointData" => FieldPlace::Vertices,
                "CellData" => FieldPlace::Tets,
                _ => continue,
            };
            let is_new = !taken.iter().any(|(known, section, _)| {
                (known.as_str(), section.as_str()) == (name, array.section.as_str())
            });
            if known.contains(&Some(name)) || !is_new || left_out.contains(&name) {
                continue;
            }
            let is_alike = |other: &&ArrayAt| {
                (&other.section, &other.name, &other.kind, other.n_components)
                    == (&array.section, &array.name, &array.kind, array.n_components)
            };
            let is_everywhere = pieces().all(|piece| piece.arrays.iter().any(|a| is_alike(&a)));
            let is_wanted = fields.values.is_some_and(|takes| takes(name)) && is_everywhere;
            let number = field_number(&array.kind).filter(|_| is_wanted);
            let n = array.n_components.max(1);
            match number.and_then(|number| mesh.field(name, place, number, n)) {
                Some(field) => taken.push((name.to_owned(), array.section.clone(), field)),
                None => left_out.push(name),
            }
        }
        mesh.leave_out(&left_out);
        taken
    }

    /// The numbers of taken arrays of one section of a piece, and their fields.
    fn taken_numbers(
        &self,
        piece: &Piece,
        taken: &[TakenArray],
        section: &str,
    ) -> Result<Vec<(usize, Numbers)>> {
        let own = taken.iter().filter(|(_, own, _)| own == section);
        own.map(|(name, _, field)| {
            let mut arrays = piece.arrays.iter();
            let array = arrays.find(|a| a.section == section && a.name == *name);
            let array = array.ok_or_else(|| self.expected(0, "an array of values"))?;
            Ok((*field, self.numbers(array, "a value of an array")?))
        })
        .collect()
    }

    fn refuse(&self, at: u64, fault: ReadFault) -> ReadError {
        FilePlace { file: self.name.clone(), spot: Spot::Byte(at) }.refuse(fault)
    }

    /// Finds the arrays of a file. Errors: what is no such grid.
    pub(super) fn open(path: &Path, block_max: u64) -> Result<Self> {
        if unpacked_name(path) != path {
            let what = "a packed .vtu, which is read at several places at once,".to_owned();
            return Err(FilePlace::new(path).refuse(ReadFault::Unsupported(what)));
        }
        let (mut file, _) = open_plain(path)?;
        let mut grid = Self {
            name: path.to_string_lossy().into_owned(),
            path: path.to_owned(),
            layout: Layout { is_big: false, header: 4, is_packed: false, block_max },
            appended: None,
            pieces: Vec::new(),
            texts: Vec::new(),
            hdf: None,
        };
        let (mut at, mut sections, mut is_vtk) = (0, Vec::<String>::new(), false);
        while let Some(text) = next_tag(&mut file, &mut at) {
            let Some(tag) = Tag::next(&text, 0) else { continue };
            match (tag.name, tag.is_end) {
                ("VTKFile", false) => {
                    is_vtk = true;
                    grid.head(&tag, at)?;
                }
                ("Piece", false) => {
                    let n = |key| tag.get(key).and_then(|n| n.trim().parse().ok());
                    let (n_points, n_cells) = (n("NumberOfPoints"), n("NumberOfCells"));
                    let (Some(n_points), Some(n_cells)) = (n_points, n_cells) else {
                        return Err(grid.expected(at, "NumberOfPoints and NumberOfCells"));
                    };
                    let (partition, arrays) = (None, Vec::new());
                    grid.pieces.push(Piece { n_points, n_cells, partition, arrays });
                }
                ("AppendedData", false) => {
                    let mut skipped = Vec::new();
                    let n = file.read_until(b'_', &mut skipped).unwrap_or(0) as u64;
                    if skipped.last() != Some(&b'_') {
                        return Err(grid.expected(at, "`_` before appended data"));
                    }
                    let coding = match tag.get("encoding") {
                        Some("base64") => Coding::Base64,
                        _ => Coding::Raw,
                    };
                    grid.appended = Some((at + n, coding));
                    break;
                }
                ("DataArray", false) => {
                    if let Some(section) = sections.last() {
                        let text = |key| tag.get(key).unwrap_or_default().to_owned();
                        let offset = tag.get("offset").and_then(|n| n.parse().ok());
                        let array = ArrayAt {
                            section: section.clone(),
                            name: text("Name"),
                            kind: text("type"),
                            n_components: text("NumberOfComponents").parse().unwrap_or(1),
                            format: text("format"),
                            at: offset.unwrap_or(at),
                            rows: text("NumberOfTuples").parse().unwrap_or(0),
                        };
                        match grid.pieces.last_mut() {
                            _ if section == "FieldData" => grid.texts.push(array),
                            Some(piece) => piece.arrays.push(array),
                            None => {}
                        }
                    }
                }
                (name, false) if !tag.is_empty => sections.push(name.to_owned()),
                (name, true) if sections.last().is_some_and(|s| s == name) => drop(sections.pop()),
                _ => {}
            }
        }
        match is_vtk {
            true => Ok(grid),
            false => Err(grid.expected(0, "a tag `VTKFile`")),
        }
    }

    fn expected(&self, at: u64, what: &str) -> ReadError {
        let (expected, found) = (what.to_owned(), "something else".to_owned());
        self.refuse(at, ReadFault::Unexpected { expected, found })
    }

    fn head(&mut self, tag: &Tag, at: u64) -> Result<()> {
        let unsupported = |grid: &Self, what| Err(grid.refuse(at, ReadFault::Unsupported(what)));
        self.layout.is_big = tag.get("byte_order") == Some("BigEndian");
        self.layout.header = if tag.get("header_type") == Some("UInt64") { 8 } else { 4 };
        let compressor = tag.get("compressor");
        self.layout.is_packed = compressor.is_some();
        let kind = tag.get("type").unwrap_or_default();
        if kind != "UnstructuredGrid" {
            return unsupported(self, format!("a VTK file of type {}", quote(kind.as_bytes())));
        }
        match compressor.filter(|name| *name != "vtkZLibDataCompressor") {
            Some(other) => unsupported(self, format!("data packed by {}", quote(other.as_bytes()))),
            None => Ok(()),
        }
    }

    /// The pieces of an HDF5 file.
    pub fn of_hdf(path: &Path, file: Hdf5File, pieces: Vec<Piece>, texts: Vec<ArrayAt>) -> Self {
        Self {
            name: path.to_string_lossy().into_owned(),
            path: path.to_owned(),
            layout: Layout { is_big: false, header: 0, is_packed: false, block_max: 0 },
            appended: None,
            pieces,
            texts,
            hdf: Some(file),
        }
    }

    /// Names by number, a zero after each, from a text of the whole; nothing where the file has no such text.
    pub(super) fn names(&self, text: &str) -> Result<Vec<String>> {
        let is_text = |a: &&ArrayAt| a.name == text && a.kind == "UInt8" && a.rows < TEXT_MAX;
        let Some(array) = self.texts.iter().find(is_text) else { return Ok(Vec::new()) };
        let mut numbers = self.numbers(array, "a byte of a text")?;
        let bytes: Vec<u8> =
            (0..array.rows).map(|_| Ok(numbers.integer()? as u8)).collect::<Result<_>>()?;
        let names = bytes.split(|&byte| byte == 0);
        Ok(names.map(|name| String::from_utf8_lossy(name).into_owned()).collect())
    }

    /// Opens the numbers of an array.
    pub(super) fn numbers(&self, array: &ArrayAt, what: &'static str) -> Result<Numbers> {
        if let Some(file) = &self.hdf {
            let place = FilePlace::new(&self.path);
            let rows = file.dataset(&array.format);
            let rows = rows.map_err(|e| place.refuse(ReadFault::Unreadable(e.to_string())))?;
            let rows = HdfRows::new(rows, array.at, array.rows);
            return Numbers::hdf(place, rows, &array.kind, what);
        }
        let file = File::open(&self.path)
            .map_err(|e| self.refuse(0, ReadFault::Unreadable(e.to_string())))?;
        let (at, coding) = match (array.format.as_str(), self.appended) {
            ("ascii" | "", _) => return Numbers::text(&self.name, file, array.at, what),
            ("binary", _) => (array.at, Coding::Base64),
            ("appended", Some((start, coding))) => (start.saturating_add(array.at), coding),
            _ => return Err(self.expected(array.at, "a format of an array that is known")),
        };
        Numbers::binary(&self.name, file, at, &array.kind, (coding, self.layout), what)
    }

    fn points(&self, piece: &Piece, taken: &[TakenArray], mesh: &mut RawMesh) -> Result<()> {
        if piece.n_points == 0 {
            return Ok(());
        }
        let array = piece.arrays.iter().find(|a| a.section == "Points");
        let array = array.ok_or_else(|| self.expected(0, "an array of points"))?;
        if array.n_components != 3 {
            return Err(self.expected(array.at, "points of three coordinates"));
        }
        let mut numbers = self.numbers(array, "a coordinate")?;
        for _ in 0..piece.n_points {
            let p = Point::new(numbers.real()?, numbers.real()?, numbers.real()?);
            check_point(p, numbers.place())?;
            mesh.point(p);
        }
        numbers.end()?;
        for (field, numbers) in self.taken_numbers(piece, taken, "PointData")? {
            mesh.values(field, numbers, piece.n_points)?;
        }
        Ok(())
    }

    fn cell_array(
        &self,
        piece: &Piece,
        name: Option<&str>,
        what: &'static str,
    ) -> Result<Option<Numbers>> {
        let Some(name) = name else { return Ok(None) };
        let cells = || piece.arrays.iter().filter(|a| a.section == "CellData");
        match cells().find(|a| a.name == name) {
            None if name == PARTITION && piece.partition.is_some() => {
                Ok(piece.partition.map(|n| Numbers::constant(FilePlace::new(&self.path), n)))
            }
            Some(array) if array.n_components <= 1 => self.numbers(array, what).map(Some),
            Some(array) => Err(self.expected(array.at, "one number for each cell")),
            None => {
                let names: Vec<&str> = cells().map(|a| a.name.as_str()).collect();
                let expected = format!("an array {name:?} of the cells");
                let found = format!("the arrays {names:?}");
                Err(self.refuse(0, ReadFault::Unexpected { expected, found }))
            }
        }
    }

    /// Opens the arrays of the cells of a piece. Errors: one is missing.
    fn cell_arrays(
        &self,
        piece: &Piece,
        fields: MeshFields,
        taken: &[TakenArray],
    ) -> Result<CellArrays> {
        let array = |name: &str, what| {
            let array = piece.arrays.iter().find(|a| a.section == "Cells" && a.name == name);
            self.numbers(array.ok_or_else(|| self.expected(0, what))?, what)
        };
        let has =
            |name: &&str| piece.arrays.iter().any(|a| a.section == "CellData" && a.name == *name);
        let region = fields.region.or(Some("region").filter(has));
        let (label, ghost) = (Some("label").filter(has), Some("vtkGhostType").filter(has));
        Ok(CellArrays {
            types: array("types", "the types of cells")?,
            ends: array("offsets", "the offsets of cells")?,
            vertices: array("connectivity", "the vertices of cells")?,
            lists: [
                self.cell_array(piece, region, "the region of a cell")?,
                self.cell_array(piece, fields.part, "the part of a cell")?,
                self.cell_array(piece, label, "the label of a cell")?,
                self.cell_array(piece, ghost, "the kind of a copied cell")?,
            ],
            values: self.taken_numbers(piece, taken, "CellData")?,
        })
    }

    /// Reads the cells of a piece; returns how many are copies.
    fn cells(
        &self,
        piece: &Piece,
        first: u64,
        fields: MeshFields,
        (taken, names): (&[TakenArray], &[String]),
        mesh: &mut RawMesh,
    ) -> Result<u64> {
        if piece.n_cells == 0 {
            return Ok(0);
        }
        let CellArrays { mut types, mut ends, mut vertices, lists, mut values } =
            self.cell_arrays(piece, fields, taken)?;
        let [mut regions, mut parts, mut labels, mut ghosts] = lists;
        let mut row = Vec::new();
        let (mut from, mut n_ghosts) = (0, 0);
        let next = |list: &mut Option<Numbers>| list.as_mut().map_or(Ok(0), Numbers::integer);
        for cell in 0..piece.n_cells {
            let (kind, end) = (types.integer()?, ends.integer()?);
            let mut corners = [0; 4];
            let n = end.checked_sub(from).filter(|n| (0..=1 << 20).contains(n));
            let n = n.ok_or_else(|| self.expected(0, "offsets of cells that rise"))?;
            from = end;
            for k in 0..n as usize {
                let v = vertex(&mut vertices, piece.n_points)?;
                if let Some(corner) = corners.get_mut(k) {
                    *corner = (v + first) as u32;
                }
            }
            let (region, part) = (next(&mut regions)?, next(&mut parts)?);
            let (label, ghost) = (next(&mut labels)?, next(&mut ghosts)?);
            row.clear();
            for (field, numbers) in &mut values {
                let field = &mesh.fields[*field];
                let kind = (field.number, field.components);
                numbers.value(kind, (&field.name, cell), &mut row)?;
            }
            if ghost & 1 != 0 {
                n_ghosts += 1;
                continue;
            }
            let [a, b, c, _] = corners;
            match (kind, n) {
                (10, 4) | (24, 10) | (71, 4..) => {
                    mesh.n_curved += u64::from(n > 4);
                    let name = || match fields.region {
                        None => name_of(names, region),
                        Some(_) => String::new(),
                    };
                    let region = mesh.regions.with_name(region, name);
                    let part = if parts.is_some() { mesh.parts.number(part) } else { 0 };
                    mesh.tet(corners, region, part).map_err(|fault| types.place().refuse(fault))?;
                    push_row(&values, mesh, &row);
                }
                (5, 3) | (22, 6) | (69, 3..) => {
                    mesh.n_curved += u64::from(n > 3);
                    let label = if labels.is_some() { label } else { region };
                    let label = mesh.labels.number(label);
                    mesh.triangle([a, b, c], label);
                }
                (1..=4 | 21 | 35 | 68, _) => mesh.n_thin += 1,
                _ => {
                    let what = format!("cell {cell}, of type {kind} with {n} vertices,");
                    return Err(types.place().refuse(ReadFault::Unsupported(what)));
                }
            }
        }
        [types, ends, vertices].into_iter().try_for_each(Numbers::end)?;
        let lists = [regions, parts, labels, ghosts];
        let lists = lists.into_iter().flatten();
        lists.chain(values.into_iter().map(|(_, numbers)| numbers)).try_for_each(Numbers::end)?;
        Ok(n_ghosts)
    }
}

/// The name of a number; empty where there is none.
pub(super) fn name_of(names: &[String], number: i64) -> String {
    let place = usize::try_from(number).ok();
    place.and_then(|place| names.get(place)).cloned().unwrap_or_default()
}

/// The next vertex of a cell. Errors: the piece has no such vertex.
fn vertex(vertices: &mut Numbers, n_points: u64) -> Result<u64> {
    let index = vertices.integer()?;
    let known = u64::try_from(index).ok().filter(|&v| v < n_points);
    known.ok_or_else(|| {
        let (low, high) = (0, n_points as i64 - 1);
        vertices.place().refuse(ReadFault::IndexOutOfRange { index, low, high })
    })
}

/// Adds the words of a cell to their fields.
fn push_row(values: &[(usize, Numbers)], mesh: &mut RawMesh, row: &[u64]) {
    let mut words = row.iter();
    for (field, _) in values {
        let field = &mut mesh.fields[*field];
        words.by_ref().take(field.components as usize).for_each(|&word| field.words.push(word));
    }
}

/// The bytes of the next tag; `at` is moved behind it.
fn next_tag(file: &mut BufReader<File>, at: &mut u64) -> Option<Vec<u8>> {
    // Text between tags may be long.
    loop {
        let buffer = file.fill_buf().ok()?;
        if buffer.is_empty() {
            return None;
        }
        let start = buffer.iter().position(|&b| b == b'<');
        let n = start.unwrap_or(buffer.len());
        file.consume(n);
        *at += n as u64;
        if start.is_some() {
            break;
        }
    }
    let mut tag = Vec::new();
    loop {
        use std::io::Read;
        let n = file.by_ref().take(TAG_MAX).read_until(b'>', &mut tag).ok()?;
        *at += n as u64;
        let is_open = tag.starts_with(b"<!--") && !tag.ends_with(b"-->");
        let n_quotes = tag.iter().filter(|&&b| b == b'"').count();
        if n == 0 || tag.len() as u64 > TAG_MAX {
            return None;
        }
        if !is_open && (n_quotes % 2 == 0 || tag.starts_with(b"<!--")) {
            return Some(tag);
        }
    }
}
