//! Fields: named values at the vertices or tetrahedra of a finished mesh.

use std::time::Instant;

use serde::Serialize;

use super::error::Remedy;
use super::field_sources::{FieldSource, SharedVertices, with_words};
use super::field_spec::{NewField, Words, bad, packed};
use super::store::open_to_change;
use super::{Code, Error, Settings, Store, guarded};
use tetdb_base::storage::{DiskPath, check_cancelled};
use tetdb_schema::catalog::JournalRow;
pub use tetdb_schema::field::{FieldNumber, FieldPlace, Scalar};
use tetdb_schema::field::{FieldPart, FieldRange, FieldRow};
use tetdb_store::sealed::{FieldFile, FieldWriter, Subdomain};
use tetdb_store::store::Catalog;

/// Memory of redb for one open file of a field.
const CACHE_BYTES: usize = 2 << 20;
/// Least and greatest memory of a file being written, and of the sub-domain that it lines up with.
const FILE_BYTES: [u64; 2] = [4 << 20, 64 << 20];
/// Help for a step that a full disk ended.
const NOTHING_CHANGED: &str = "free some space, then do it again; the store is as it was before";

/// A field of a store.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Field {
    /// Name of the field.
    pub name: String,
    /// Where its values are.
    pub at: FieldPlace,
    /// Type of its numbers.
    #[serde(rename = "type")]
    pub number: FieldNumber,
    /// Numbers of a value.
    pub components: u32,
    /// Names of the components in conditions and columns.
    pub columns: Vec<String>,
    /// Number of values; a vertex that several sub-domains share counts in each.
    pub values: u64,
    /// Least and greatest value of each component, and how many are not numbers.
    pub ranges: Vec<FieldRange>,
    /// Bytes of its files.
    pub bytes: u64,
    /// Digest of its values, as 16 hexadecimal digits. Equal values of equal meshes have equal digests.
    pub digest: String,
}

/// Values of a chunk, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub enum FieldValues {
    /// Of 32 bits.
    F32(Vec<f32>),
    /// Of 64 bits.
    F64(Vec<f64>),
    /// Integers of 32 bits.
    I32(Vec<i32>),
    /// Integers of 64 bits.
    I64(Vec<i64>),
}

impl FieldValues {
    /// The numbers as words of the type. Errors: a number that the type does not have.
    fn pack(&self, number: FieldNumber) -> Result<Vec<u64>, Error> {
        let numbers: Vec<Scalar> = match self {
            Self::F32(list) => list.iter().map(|&x| Scalar::Float(x.into())).collect(),
            Self::F64(list) => list.iter().map(|&x| Scalar::Float(x)).collect(),
            Self::I32(list) => list.iter().map(|&n| Scalar::Int(n.into())).collect(),
            Self::I64(list) => list.iter().map(|&n| Scalar::Int(n)).collect(),
        };
        numbers.into_iter().map(|n| packed(number, n)).collect()
    }

    /// Type and count of the numbers.
    fn kind(&self) -> (FieldNumber, usize) {
        match self {
            Self::F32(list) => (FieldNumber::F32, list.len()),
            Self::F64(list) => (FieldNumber::F64, list.len()),
            Self::I32(list) => (FieldNumber::I32, list.len()),
            Self::I64(list) => (FieldNumber::I64, list.len()),
        }
    }

    fn unpack(number: FieldNumber, words: &[u64]) -> Self {
        let int = |&word: &u64| word as i64;
        match number {
            FieldNumber::F32 => {
                Self::F32(words.iter().map(|&word| f32::from_bits(word as u32)).collect())
            }
            FieldNumber::F64 => Self::F64(words.iter().map(|&word| f64::from_bits(word)).collect()),
            FieldNumber::I32 => Self::I32(words.iter().map(|word| int(word) as i32).collect()),
            FieldNumber::I64 => Self::I64(words.iter().map(int).collect()),
        }
    }
}

/// The values of a field in one sub-domain, open for reading. Chunks are those of the sub-domain's vertices or tetrahedra.
pub struct FieldReader(FieldFile);

impl FieldReader {
    /// Number of chunks.
    pub fn n_chunks(&self) -> u32 {
        self.0.n_chunks()
    }

    /// The values of a chunk, one after the other. Errors: damage.
    pub fn chunk(&mut self, chunk: u32) -> Result<FieldValues, Error> {
        Ok(FieldValues::unpack(self.0.field().number, &self.0.chunk(chunk)?))
    }
}

impl Store {
    /// The fields of the store, in the order in which they were added. Errors: damage.
    pub fn fields(&self) -> Result<Vec<Field>, Error> {
        guarded(self.settings(), || fields_of(&mut self.catalog_shared()))
    }

    /// Opens the values of a field in a sub-domain. Errors: `no-such-part`; damage.
    pub fn field(&self, name: &str, rank: u32) -> Result<FieldReader, Error> {
        guarded(self.settings(), || {
            let mut catalog = self.catalog_shared();
            let field = field_called(&mut catalog, name)?;
            let mesh = catalog.open_subdomain(rank, CACHE_BYTES)?;
            Ok(FieldReader(catalog.open_field(&field, &mesh, CACHE_BYTES)?))
        })
    }

    /// Adds a field with values from a file or an expression, in one step. A stopped call leaves the store as it was.
    ///
    /// Errors: `bad-field`, `bad-expression`; those of reading the file; `busy`; the disk.
    pub fn add_field_from(&mut self, new: &NewField, source: &FieldSource) -> Result<Field, Error> {
        self.change_fields(|catalog, settings| {
            with_words(catalog, settings, new, source, |catalog, row, words| {
                add(catalog, settings, row, words)
            })
        })
    }

    /// Adds a field with values that `fill` gives for each chunk, once: those of the sub-domain's vertices or tetrahedra, by number. Type
    /// and components are those of the first chunk's values where they are not set.
    ///
    /// ```
    /// # use tetdb_engine::api as tetdb;
    /// # let dir = tempfile::tempdir()?;
    /// # let path = dir.path().join("box.tetdb");
    /// # let mut store = tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.2")?).create(&path)?;
    /// use tetdb::{FieldPlace, FieldValues, NewField};
    ///
    /// let height = NewField::new("height", FieldPlace::Vertices);
    /// store.add_field(&height, |mesh, chunk| {
    ///     let vertices = mesh.vertex_chunk(chunk)?.records;
    ///     Ok(FieldValues::F64(vertices.iter().map(|vertex| vertex.point[2]).collect()))
    /// })?;
    /// assert!(store.query().where_("height > 0.9")?.answers()?.next().is_some());
    /// let mut values = store.field("height", 0)?;
    /// assert!(values.n_chunks() > 0 && values.chunk(0).is_ok());
    /// store.drop_field("height")?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    /// Errors: `bad-field`, also for a vertex that has another value in another sub-domain; those of `fill`.
    pub fn add_field(
        &mut self,
        new: &NewField,
        mut fill: impl FnMut(&mut Subdomain, u32) -> Result<FieldValues, Error>,
    ) -> Result<Field, Error> {
        self.change_fields(|catalog, settings| {
            check_is_new(catalog, &new.name)?;
            new.row(FieldNumber::F64, new.components.unwrap_or(1))?;
            let mut mesh = catalog.open_subdomain(0, CACHE_BYTES)?;
            let mut first = Some(fill(&mut mesh, 0)?);
            let (number, n) = first.as_ref().map_or((FieldNumber::F64, 0), FieldValues::kind);
            let count = count_of(&mesh, new.place, 0).max(1) as usize;
            let number = new.number.unwrap_or(number);
            let row = new.row(number, new.components.unwrap_or((n / count) as u32))?;
            drop(mesh);
            add(catalog, settings, row, &mut |mesh, chunk| {
                let values = first.take().map_or_else(|| fill(mesh, chunk), Ok);
                values?.pack(number)
            })
        })
    }

    /// Drops a field, in one step. Errors: `no-such-part`; `busy`.
    pub fn drop_field(&mut self, name: &str) -> Result<(), Error> {
        self.change_fields(|catalog, _| {
            let field = field_called(catalog, name)?;
            drop_values(catalog, &field)
        })
    }

    pub(super) fn change_fields<T>(
        &mut self,
        change: impl FnOnce(&mut Catalog, &Settings) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.close_session();
        let done = guarded(self.settings(), || {
            let mut catalog = open_to_change(self.path(), self.settings())?;
            let done = change(&mut catalog, self.settings())?;
            catalog.close()?;
            Ok(done)
        })
        .map_err(|error| match error.code() {
            Code::DiskFull => error.with_help(NOTHING_CHANGED).with_remedy(Remedy::AsSaid),
            _ => error,
        })?;
        self.reopen()?;
        Ok(done)
    }
}

/// The fields of a store.
pub(super) fn fields_of(catalog: &mut Catalog) -> Result<Vec<Field>, Error> {
    let parts = catalog.field_parts()?;
    let fields = catalog.fields()?;
    Ok(fields.into_iter().map(|row| shown(row, &parts)).collect())
}

fn shown(row: FieldRow, parts: &[FieldPart]) -> Field {
    let own = || parts.iter().filter(|part| part.field == row.id);
    let mut ranges = vec![FieldRange::EMPTY; row.components as usize];
    let mut digest = 0u64;
    for part in own() {
        ranges.iter_mut().zip(&part.ranges).for_each(|(all, range)| all.union(range));
        digest = digest.rotate_left(7) ^ part.digest;
    }
    Field {
        columns: row.columns(),
        at: row.place,
        number: row.number,
        components: row.components,
        values: own().map(|part| part.values).sum(),
        ranges,
        bytes: own().map(|part| part.bytes).sum(),
        digest: format!("{digest:016x}"),
        name: row.name,
    }
}

pub(super) fn field_called(catalog: &mut Catalog, name: &str) -> Result<FieldRow, Error> {
    let fields = catalog.fields()?;
    let names: Vec<String> = fields.iter().map(|field| field.name.clone()).collect();
    fields.into_iter().find(|field| field.name == name).ok_or_else(|| {
        let known = match names.is_empty() {
            true => "the store has none".to_owned(),
            false => format!("there are {}", names.join(", ")),
        };
        let help = match names.is_empty() {
            true => "add a field to the store first",
            false => "take the name of one that is there",
        };
        Error::new(Code::NoSuchPart, format!("there is no field {name}; {known}")).with_help(help)
    })
}

/// Drops a field with all its values, in one step.
fn drop_values(catalog: &mut Catalog, field: &FieldRow) -> Result<(), Error> {
    let clock = Instant::now();
    let parts = catalog.field_parts()?;
    let state = catalog.state()?;
    Ok(catalog.commit(|step| {
        step.remove_field(field, &parts);
        step.append_journal(&journal(state, "drop field", clock));
        Ok(())
    })?)
}

pub(super) fn journal(
    state: tetdb_schema::catalog::StoreState,
    step: &str,
    clock: Instant,
) -> JournalRow {
    let (subdomain, measures) = (None, Vec::new());
    let seconds = clock.elapsed().as_secs_f64();
    JournalRow { state, subdomain, step: step.to_owned(), seconds, measures }
}

/// Errors: the store has a field of that name.
fn check_is_new(catalog: &mut Catalog, name: &str) -> Result<(), Error> {
    match catalog.fields()?.iter().any(|field| field.name == name) {
        true => Err(bad(format!("there is a field {name} already"))
            .with_help("drop it first, or take another name")),
        false => Ok(()),
    }
}

/// Number of values in a chunk.
fn count_of(mesh: &Subdomain, place: FieldPlace, chunk: usize) -> u32 {
    match place {
        FieldPlace::Tets => mesh.tet_summaries()[chunk].count,
        FieldPlace::Vertices => mesh.vertex_summaries()[chunk].count,
    }
}

/// Writes the values of a field and lists them in one commit.
pub(super) fn add(
    catalog: &mut Catalog,
    settings: &Settings,
    mut field: FieldRow,
    words: &mut Words,
) -> Result<Field, Error> {
    let clock = Instant::now();
    check_is_new(catalog, &field.name)?;
    let (id, serial) = catalog.next_field()?;
    field.id = id;
    let memory = (settings.cap()? / 8).clamp(FILE_BYTES[0], FILE_BYTES[1]) as usize;
    let mut files = Vec::new();
    let written = write_parts(catalog, settings, (&field, serial, memory), words, &mut files);
    let parts = match written {
        Ok(parts) => parts,
        Err(error) => {
            // What stays behind is removed when the store is next changed.
            files.iter().for_each(|file| drop(file.remove_file()));
            return Err(error);
        }
    };
    let state = catalog.state()?;
    catalog.commit(|step| {
        step.set_field(&field);
        parts.iter().for_each(|part| step.set_field_part(part));
        step.append_journal(&journal(state, "field", clock));
        Ok(())
    })?;
    Ok(shown(field, &parts))
}

fn write_parts(
    catalog: &mut Catalog,
    settings: &Settings,
    (field, serial, memory): (&FieldRow, u32, usize),
    words: &mut Words,
    files: &mut Vec<DiskPath>,
) -> Result<Vec<FieldPart>, Error> {
    let mut same = SharedVertices::new(catalog, settings, field)?;
    let (mut parts, mut done) = (Vec::new(), 0);
    let total = catalog.n_values(field.place)?;
    for row in catalog.subdomains()? {
        let rank = row.rank;
        let mut mesh = catalog.open_row(row, memory)?;
        let file = tetdb_schema::catalog::FileRow { subdomain: rank, generation: serial };
        let path = catalog.field_path(file);
        files.push(path.clone());
        let mut writer = FieldWriter::create(path, field, &mesh, serial, memory)?;
        let n_chunks = match field.place {
            FieldPlace::Tets => mesh.tet_summaries().len(),
            FieldPlace::Vertices => mesh.vertex_summaries().len(),
        };
        for chunk in 0..n_chunks as u32 {
            check_cancelled();
            let count = count_of(&mesh, field.place, chunk as usize);
            let values = words(&mut mesh, chunk)?;
            let expected = count as usize * field.components as usize;
            if values.len() != expected {
                let message = format!(
                    "{} numbers for chunk {chunk} of sub-domain {rank}, expected {expected}",
                    values.len()
                );
                return Err(bad(message));
            }
            same.add(&mut mesh, chunk, &values)?;
            writer.push(&values)?;
            done += u64::from(count);
            settings.count("field", done, total, "values");
        }
        parts.push(writer.finish(&mut mesh)?);
    }
    same.check().map(|()| parts)
}

impl From<Vec<f64>> for FieldValues {
    fn from(list: Vec<f64>) -> Self {
        Self::F64(list)
    }
}
