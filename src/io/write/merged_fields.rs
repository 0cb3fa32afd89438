//! Values of fields beside the vertices and tetrahedra of a merged mesh.

use super::error::Result;
use tetdb_schema::field::{FieldNumber, FieldPart, FieldPlace, FieldRow};
use tetdb_store::sealed::{FieldFile, Subdomain};
use tetdb_store::store::Catalog;

/// Memory of an open field: half for redb, half for decoded columns.
const FIELD_BYTES: usize = 2 << 20;

/// The values of some fields in a chunk, as words.
pub(super) struct FieldChunk(Vec<(usize, Vec<u64>)>);

impl FieldChunk {
    /// Errors: damage.
    pub fn read(files: &mut [FieldFile], chunk: u32) -> Result<Self> {
        let read =
            |file: &mut FieldFile| Ok((file.field().components as usize, file.chunk(chunk)?));
        Ok(Self(files.iter_mut().map(read).collect::<Result<_>>()?))
    }

    /// All numbers at a place.
    pub fn row(&self, i: usize) -> Vec<u64> {
        self.0.iter().flat_map(|(n, words)| &words[i * n..(i + 1) * n]).copied().collect()
    }
}

/// Opens fields in a sub-domain. Errors: damage.
pub(super) fn open_fields(
    store: &mut Catalog,
    fields: &[FieldRow],
    part: &Subdomain,
) -> Result<Vec<FieldFile>> {
    fields.iter().map(|field| Ok(store.open_field(field, part, FIELD_BYTES)?)).collect()
}

/// Returns whether a field has values at all vertices that are written, also at midpoints of edges and at doubles of vertices on sheets.
pub fn has_values_at(field: &FieldRow, has_midpoints: bool, has_doubles: bool) -> bool {
    let has_means = !field.number.is_integer();
    field.place == FieldPlace::Tets || (!has_doubles && (!has_midpoints || has_means))
}

/// Returns whether doubles hold all values of a field. Ranges are rounded, so 2^53 itself is not let through.
pub fn fits_doubles(field: &FieldRow, parts: &[FieldPart]) -> bool {
    let own = parts.iter().filter(|part| part.field == field.id);
    let mut ranges = own.flat_map(|part| &part.ranges);
    let limit = (1u64 << 53) as f64;
    field.number != FieldNumber::I64 || ranges.all(|range| range.low > -limit && range.high < limit)
}

/// The words of the values of some fields at a place as doubles.
pub(super) fn to_doubles<'a>(
    fields: &'a [FieldRow],
    words: &'a [u64],
) -> impl Iterator<Item = f64> + 'a {
    let numbers = fields.iter().flat_map(|f| std::iter::repeat_n(f.number, f.components as usize));
    numbers.zip(words).map(|(number, &word)| number.unpack(word).to_f64())
}
