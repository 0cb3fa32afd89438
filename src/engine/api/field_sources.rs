//! Where the values of a new field come from: expressions, arrays and tables.
//!
//! Values of a file are matched with the mesh by keys: lasting ids, or numbers of an export. Both the values and the places of the mesh are
//! sorted by key in external memory and joined; places of vertices are then sorted back into the order of the store.

use std::path::PathBuf;

use super::field_spec::{NewField, Words, bad, packed};
use super::{Error, ExprError, Settings, VARIABLES};
use tetdb_base::expr::{ExprKind, Expression};
use tetdb_base::storage::{DiskPath, SortRecord, Sorted, Sorter, check_cancelled, sort_record};
use tetdb_io::read::{FieldTable, FieldValue};
use tetdb_io::write::{VertexPlace, each_vertex_place, leaves_out_vertices};
use tetdb_schema::code::Code;
use tetdb_schema::field::{FieldNumber, FieldPlace, FieldRow, Scalar};
use tetdb_schema::ids::{Owner, SubdomainId, TetId, VertexId};
use tetdb_store::query::Hit;
use tetdb_store::sealed::Subdomain;
use tetdb_store::store::Catalog;

/// Variables of an expression at vertices.
const AT_VERTICES: [&str; 3] = ["x", "y", "z"];

/// The order of values in a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum FieldIds {
    /// A table with a column `id` has lasting ids there; all other values are in the order of an export.
    #[default]
    AsFound,
    /// The first column of the table has lasting ids, such as `7:104` or `surface:12`.
    Stable,
    /// The first column of the table, if it is named `id`, has numbers of an export; without it the values are in that order.
    Export,
    /// A `.npy` file has the lasting id of each value, as a number.
    File(PathBuf),
}

/// Where the values of a new field come from.
#[derive(Clone, Debug)]
pub enum FieldSource {
    /// An expression of `x`, `y`, `z`, and at tetrahedra of the other variables of conditions too; several, with commas between them, for
    /// several components.
    Expression(String),
    /// A `.npy` array, or a table of text.
    File(PathBuf, FieldIds),
}

/// Calls `write` with the row of the new field and the words of its values.
pub(super) fn with_words<T>(
    catalog: &mut Catalog,
    settings: &Settings,
    new: &NewField,
    source: &FieldSource,
    write: impl FnOnce(&mut Catalog, FieldRow, &mut Words) -> Result<T, Error>,
) -> Result<T, Error> {
    let (path, ids) = match source {
        FieldSource::File(path, ids) => (path, ids),
        FieldSource::Expression(text) => {
            let expressions = expressions(text, new.place)?;
            let row = new.row(FieldNumber::F64, expressions.len() as u32)?;
            let (place, number) = (row.place, row.number);
            return write(catalog, row, &mut |mesh, chunk| {
                evaluate(&expressions, (place, number), mesh, chunk)
            });
        }
    };
    let table = FieldTable::open(path, *ids == FieldIds::Stable)?;
    let row = new.row(table.number(), table.components())?;
    let scratch = catalog.scratch_dir()?;
    let given = Given { table, ids, row: &row, path, dir: &scratch, memory: settings.cap()? / 5 };
    let done = match row.components {
        1 => given.join::<24, T>(catalog, write),
        3 => given.join::<40, T>(catalog, write),
        6 => given.join::<64, T>(catalog, write),
        _ => given.join::<88, T>(catalog, write),
    };
    drop(scratch.remove_dir_all());
    done
}

/// Splits a list of expressions at the commas outside of brackets. Errors: `bad-expression`.
fn expressions(text: &str, place: FieldPlace) -> Result<Vec<Expression>, Error> {
    let mut depth = 0;
    let at_comma = |c: char| {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ => {}
        }
        c == ',' && depth == 0
    };
    let variables: &[&str] = match place {
        FieldPlace::Vertices => &AT_VERTICES,
        // The excess needs the surface.
        FieldPlace::Tets => &VARIABLES[..VARIABLES.len() - 1],
    };
    let mut start = 0;
    let mut list = Vec::new();
    for part in text.split(at_comma) {
        let parsed = Expression::parse(part, variables).and_then(|parsed| match parsed.kind() {
            ExprKind::Number => Ok(parsed),
            ExprKind::Truth => {
                let message = "this is a truth; write if(truth, 1, 0) for a number".to_owned();
                Err(ExprError { at: 0, message })
            }
        });
        list.push(parsed.map_err(|error| {
            Error::new(Code::BadExpression, &error)
                .at(format!("character {} of {text}", start + error.at + 1))
                .with_help("such as 300 + 20*x, or for three components -y, x, 0")
        })?);
        start += part.len() + 1;
    }
    Ok(list)
}

fn evaluate(
    expressions: &[Expression],
    (place, number): (FieldPlace, FieldNumber),
    mesh: &mut Subdomain,
    chunk: u32,
) -> Result<Vec<u64>, Error> {
    let mut words = Vec::new();
    let mut add = |values: &[f64]| -> Result<(), Error> {
        for expression in expressions {
            words.push(packed(number, Scalar::Float(expression.number(values)))?);
        }
        Ok(())
    };
    match place {
        FieldPlace::Vertices => {
            for vertex in mesh.vertex_chunk(chunk)?.records {
                add(&vertex.point)?;
            }
        }
        FieldPlace::Tets => {
            let tets = mesh.tet_chunk(chunk)?;
            for (local, tet) in (tets.first..).zip(&tets.records) {
                let corners = mesh.corners(tet.nodes)?;
                let id = TetId::new(mesh.id(), local)
                    .ok_or_else(|| mesh.damaged("a tetrahedron has no id"))?;
                let (ids, points) = (corners.map(|c| c.id), corners.map(|c| c.point));
                add(&Hit::new(id, tet.region, ids, points).values())?;
            }
        }
    }
    Ok(words)
}

sort_record! {
    /// A vertex of a sub-domain and the key of its value.
    struct KeyedPlace {
        key: u64,
        /// No tetrahedron has the vertex, so it may lack a value.
        is_free: bool,
        /// Rank and number in the sub-domain.
        place: u64,
    }
}

/// Values of a file, and how they are ordered.
struct Given<'g> {
    table: FieldTable,
    ids: &'g FieldIds,
    row: &'g FieldRow,
    path: &'g std::path::Path,
    dir: &'g DiskPath,
    /// For each of at most three sorts at the same time.
    memory: u64,
}

/// A value with its key and line, as bytes that sort by key.
type Record<const N: usize> = [u8; N];

fn record<const N: usize>(key: u64, line: u64, words: &[u64]) -> Record<N> {
    let mut bytes = [0; N];
    for (place, word) in bytes.chunks_exact_mut(8).zip([key, line].iter().chain(words)) {
        place.copy_from_slice(&word.to_be_bytes());
    }
    bytes
}

fn words_of<const N: usize>(record: &Record<N>) -> impl Iterator<Item = u64> + '_ {
    record.chunks_exact(8).map(|word| u64::from_be_bytes(word.try_into().expect("eight bytes")))
}

/// Values by key, compared with the keys of the mesh.
struct Joined<const N: usize>
where
    Record<N>: SortRecord,
{
    values: Sorted<Record<N>>,
    next: Option<Record<N>>,
    /// Number of all values.
    count: u64,
    /// The key of `next`, once the mesh had it.
    last: Option<u64>,
    place: Box<dyn Fn(u64) -> String>,
    show: fn(u64) -> String,
}

impl<const N: usize> Joined<N>
where
    Record<N>: SortRecord<Bytes = Record<N>>,
{
    /// The value with this key; keys ascend, and may repeat. Errors: a key without a value, a value without a key.
    fn take(&mut self, key: u64) -> Result<Record<N>, Error> {
        self.find(key)?.ok_or_else(|| {
            let message = format!("there is no value for {}", (self.show)(key));
            bad(message).with_help("give a value for each, and each once")
        })
    }

    /// As [`Joined::take`]; `None` for a key without a value.
    fn find(&mut self, key: u64) -> Result<Option<Record<N>>, Error> {
        if self.last.is_some_and(|last| last != key) {
            self.advance()?;
            self.last = None;
        }
        match self.next {
            Some(record) if words_of(&record).next() == Some(key) => {
                self.last = Some(key);
                Ok(Some(record))
            }
            Some(record) if words_of(&record).next() < Some(key) => Err(self.surplus(&record)),
            _ => Ok(None),
        }
    }

    fn advance(&mut self) -> Result<(), Error> {
        self.next = self.values.next().transpose()?;
        match (self.next, self.last) {
            (Some(record), Some(last)) if words_of(&record).next() == Some(last) => {
                let what = format!("{} has a second value", (self.show)(last));
                Err(bad(what).at((self.place)(line_of(&record))))
            }
            _ => Ok(()),
        }
    }

    fn surplus(&self, record: &Record<N>) -> Error {
        let key = words_of(record).next().unwrap_or_default();
        let message = format!("the store has no {}", (self.show)(key));
        bad(message).at((self.place)(line_of(record)))
    }

    fn end(mut self) -> Result<(), Error> {
        if self.last.is_some() {
            self.advance()?;
        }
        match self.next {
            Some(record) => Err(self.surplus(&record)),
            None => Ok(()),
        }
    }
}

fn line_of<const N: usize>(record: &Record<N>) -> u64 {
    words_of(record).nth(1).unwrap_or_default()
}

impl Given<'_> {
    /// Joins the values with the mesh and calls `write`.
    fn join<const N: usize, T>(
        mut self,
        catalog: &mut Catalog,
        write: impl FnOnce(&mut Catalog, FieldRow, &mut Words) -> Result<T, Error>,
    ) -> Result<T, Error>
    where
        Record<N>: SortRecord<Bytes = Record<N>>,
    {
        let by_export = !self.has_stable_ids();
        let at_tets = self.row.place == FieldPlace::Tets;
        let mut joined = self.sorted::<N>(by_export, at_tets)?;
        let rows = catalog.subdomains()?;
        let memory = self.memory as usize;
        let is_dense =
            by_export && rows.len() == 1 && !leaves_out_vertices(catalog, self.dir.path(), memory)?;
        // Here the keys ascend in the order of the store.
        if at_tets || is_dense {
            let key = |number: u64, mesh: Option<TetId>| match mesh {
                Some(id) if !by_export => id.number(),
                _ => number,
            };
            if joined.count > catalog.n_values(self.row.place)? {
                // Finds the one that is too many, before anything is written.
                let mut number = 0;
                for row in rows {
                    let rank = SubdomainId::new(row.rank).unwrap_or_default();
                    let n = if at_tets { row.tets } else { row.vertices };
                    for local in 0..n as u32 {
                        joined.take(key(number, TetId::new(rank, local)))?;
                        number += 1;
                    }
                }
                joined.end()?;
                return Err(bad("there are more values than the store has places"));
            }
            let mut number = 0;
            return write(catalog, self.row.clone(), &mut |mesh, chunk| {
                let mut words = Vec::new();
                for local in chunk_of(self.row.place, mesh, chunk) {
                    let value = joined.take(key(number, TetId::new(mesh.id(), local)))?;
                    number += 1;
                    words.extend(words_of(&value).skip(2));
                }
                Ok(words)
            });
        }
        let places = self.places(catalog, by_export)?;
        let mut sorter = Sorter::new(self.dir.clone(), self.memory);
        for keyed in places {
            let KeyedPlace { key, is_free, place } = keyed?;
            let value = if is_free { joined.find(key)? } else { Some(joined.take(key)?) };
            let words: Vec<u64> = match value {
                Some(value) => words_of(&value).skip(2).collect(),
                None => vec![self.row.number.nothing(); self.row.components as usize],
            };
            sorter.push(record::<N>(place, 0, &words))?;
        }
        joined.end()?;
        let mut values = sorter.finish()?;
        write(catalog, self.row.clone(), &mut |mesh, chunk| {
            let mut words = Vec::new();
            for _ in chunk_of(FieldPlace::Vertices, mesh, chunk) {
                let value = values.next().transpose()?;
                let value = value.ok_or_else(|| bad("there are too few values"))?;
                words.extend(words_of(&value).skip(2));
            }
            Ok(words)
        })
    }

    fn has_stable_ids(&self) -> bool {
        match self.ids {
            FieldIds::AsFound => self.table.has_ids(),
            FieldIds::Stable | FieldIds::File(_) => true,
            FieldIds::Export => false,
        }
    }

    /// All values of the file by key.
    fn sorted<const N: usize>(&mut self, by_export: bool, at_tets: bool) -> Result<Joined<N>, Error>
    where
        Record<N>: SortRecord<Bytes = Record<N>>,
    {
        let mut id_file = match self.ids {
            FieldIds::File(path) => Some(FieldTable::open(path, false)?),
            _ => None,
        };
        let mut sorter = Sorter::new(self.dir.clone(), self.memory);
        let (mut value, mut id, mut number) = (FieldValue::default(), FieldValue::default(), 0);
        let parse = if at_tets { tet_key } else { vertex_key };
        while self.table.read(&mut value)? {
            if number % 65_536 == 0 {
                check_cancelled();
            }
            let here = || self.table.place(value.line);
            let key = match &mut id_file {
                Some(ids) => {
                    let is_there = ids.read(&mut id)?;
                    let key = match id.numbers[..] {
                        [Scalar::Int(key)] if is_there => u64::try_from(key).ok(),
                        _ => None,
                    };
                    key.ok_or_else(|| bad("there is no id for this value").at(here()))?
                }
                None if !self.table.has_ids() => number,
                None => {
                    let parsed = if by_export { value.id.parse().ok() } else { parse(&value.id) };
                    parsed.ok_or_else(|| bad(format!("{:?} is no id", value.id)).at(here()))?
                }
            };
            let words = value.numbers.iter().map(|&n| packed(self.row.number, n));
            let words = words.collect::<Result<Vec<_>, _>>().map_err(|error| error.at(here()))?;
            sorter.push(record::<N>(key, value.line, &words))?;
            number += 1;
        }
        if let Some(ids) = &mut id_file
            && ids.read(&mut id)?
        {
            return Err(bad("there are more ids than values").at(ids.place(id.line)));
        }
        let mut values = sorter.finish()?;
        let next = values.next().transpose()?;
        let is_array = self.table.n_values().is_some();
        let (path, what) = (self.path.display().to_string(), if is_array { "row" } else { "line" });
        let place = Box::new(move |line| format!("{path}, {what} {line}"));
        let show: fn(u64) -> String = match (by_export, at_tets) {
            (true, true) => |key| format!("tetrahedron number {key}"),
            (true, false) => |key| format!("vertex number {key}"),
            (false, true) => |key| match TetId::from_number(key) {
                Some(id) => format!("tetrahedron {id}"),
                None => format!("tetrahedron {key}"),
            },
            (false, false) => |key| match VertexId::from_number(key) {
                Some(id) => format!("vertex {id}"),
                None => format!("vertex {key}"),
            },
        };
        Ok(Joined { values, next, count: number, last: None, place, show })
    }

    /// All vertices by key.
    fn places(&self, catalog: &mut Catalog, by_export: bool) -> Result<Sorted<KeyedPlace>, Error> {
        let mut sorter = Sorter::new(self.dir.clone(), self.memory);
        let memory = self.memory as usize;
        each_vertex_place(catalog, self.dir.path(), memory, |vertex| {
            let VertexPlace { id, number, rank, local } = vertex;
            // No value has the greatest number.
            let key = if by_export { number.unwrap_or(u64::MAX) } else { id };
            let place = u64::from(rank) << 32 | u64::from(local);
            sorter.push(KeyedPlace { key, is_free: number.is_none(), place })
        })?;
        Ok(sorter.finish()?)
    }
}

/// Numbers of the records of a chunk.
fn chunk_of(place: FieldPlace, mesh: &Subdomain, chunk: u32) -> std::ops::Range<u32> {
    let [first, count] = match place {
        FieldPlace::Tets => {
            let s = &mesh.tet_summaries()[chunk as usize];
            [s.first, s.count]
        }
        FieldPlace::Vertices => {
            let s = &mesh.vertex_summaries()[chunk as usize];
            [s.first, s.count]
        }
    };
    first..first + count
}

fn tet_key(text: &str) -> Option<u64> {
    text.parse().ok().or_else(|| text.parse().map(TetId::number).ok())
}

fn vertex_key(text: &str) -> Option<u64> {
    text.parse().ok().or_else(|| text.parse().map(VertexId::number).ok())
}

sort_record! {
    /// A vertex that several sub-domains may have, and a hash of its value.
    struct SharedVertex {
        id: u64,
        value: u64,
    }
}

/// Checks that a vertex has the same value in all its sub-domains.
pub(super) struct SharedVertices {
    /// `None` where no vertex is shared.
    sorter: Option<Sorter<SharedVertex>>,
    components: usize,
}

impl SharedVertices {
    pub fn new(
        catalog: &mut Catalog,
        settings: &Settings,
        field: &FieldRow,
    ) -> Result<Self, Error> {
        let is_needed = field.place == FieldPlace::Vertices && catalog.subdomains()?.len() > 1;
        let memory = settings.cap()? / 16;
        let sorter = match is_needed {
            true => Some(Sorter::new(catalog.scratch_dir()?, memory)),
            false => None,
        };
        Ok(Self { sorter, components: field.components as usize })
    }

    pub fn add(&mut self, mesh: &mut Subdomain, chunk: u32, words: &[u64]) -> Result<(), Error> {
        let Some(sorter) = &mut self.sorter else { return Ok(()) };
        let vertices = mesh.vertex_chunk(chunk)?.records;
        for (vertex, value) in vertices.iter().zip(words.chunks(self.components)) {
            let owner = VertexId::from_number(vertex.id).map(|id| id.owner);
            if !matches!(owner, Some(Owner::Subdomain(_))) {
                let hash = value.iter().fold(0, |hash, &word| tetdb_base::geom::mix(hash ^ word));
                sorter.push(SharedVertex { id: vertex.id, value: hash })?;
            }
        }
        Ok(())
    }

    /// Errors: `bad-field` with the first vertex that has two values.
    pub fn check(self) -> Result<(), Error> {
        let mut last = None;
        for vertex in self.sorter.map(Sorter::finish).transpose()?.into_iter().flatten() {
            let SharedVertex { id, value } = vertex?;
            if last.is_some_and(|(known, other)| known == id && other != value) {
                let id = VertexId::from_number(id).map_or(id.to_string(), |id| id.to_string());
                let message = format!("vertex {id} has different values in two sub-domains");
                return Err(bad(message));
            }
            last = Some((id, value));
        }
        Ok(())
    }
}
