//! Values of fields beside the vertices and tetrahedra of a merged mesh.

use super::error::Result;
use tetdb_schema::field::FieldRow;
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
