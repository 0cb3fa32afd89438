//! Fields in the catalog.

use tetdb_schema::catalog::FileRow;
use tetdb_schema::field::{COMPONENTS, FieldPart, FieldPlace, FieldRow};
use tetdb_schema::row::RowKind;

use super::{Catalog, Step, StoreError};
use crate::sealed::{FieldFile, Subdomain};
use tetdb_base::storage::DiskPath;

impl Catalog {
    /// All fields, in the order in which they were added.
    pub fn fields(&mut self) -> Result<Vec<FieldRow>, StoreError> {
        let rows: Vec<FieldRow> = self.rows(RowKind::Field)?;
        match rows.iter().find(|row| !COMPONENTS.contains(&row.components)) {
            Some(row) => {
                let reason = "gives a field a number of components that none has";
                Err(self.damaged_row(RowKind::Field.key(0, row.id), reason))
            }
            None => Ok(rows),
        }
    }

    /// The values of all fields, by field and rank. Errors: damage, such as a row whose field is missing or has other components.
    pub fn field_parts(&mut self) -> Result<Vec<FieldPart>, StoreError> {
        let parts: Vec<FieldPart> = self.rows(RowKind::FieldPart)?;
        let fields = self.fields()?;
        let is_lost = |part: &&FieldPart| {
            let field = fields.iter().find(|field| field.id == part.field);
            field.is_none_or(|field| field.components as usize != part.ranges.len())
        };
        match parts.iter().find(is_lost) {
            Some(part) => {
                let key = RowKind::FieldPart.key(part.field, part.rank);
                Err(self.damaged_row(key, "gives the values of no field"))
            }
            None => Ok(parts),
        }
    }

    /// Path of the file of a field's values.
    pub fn field_path(&self, file: FileRow) -> DiskPath {
        self.disk_path().join(file.field_name())
    }

    /// Opens the values of a field in the sub-domain `mesh` with `cache_bytes` for redb.
    ///
    /// Errors: damage; [`StoreError::Changed`].
    pub fn open_field(
        &mut self,
        field: &FieldRow,
        mesh: &Subdomain,
        cache_bytes: usize,
    ) -> Result<FieldFile, StoreError> {
        let rank = mesh.id().rank();
        let is_own = |part: &FieldPart| (part.field, part.rank) == (field.id, rank);
        let Some(part) = self.field_parts()?.into_iter().find(is_own) else {
            let what = format!("field {}: it has no values here", field.name);
            return Err(mesh.damaged(what).into());
        };
        let row = (field.clone(), part.clone());
        let opened = FieldFile::open(&self.field_path(part.file()), row, mesh, cache_bytes);
        self.of_one_state(opened, |now| Ok(now.everywhere(RowKind::FieldPart)?.contains(&part)))
    }

    /// Files of fields that count, those of versions among them.
    pub(super) fn field_files(&mut self) -> Result<Vec<FileRow>, StoreError> {
        let parts: Vec<FieldPart> = self.rows(RowKind::FieldPart)?;
        let mut files: Vec<FileRow> = parts.iter().map(FieldPart::file).collect();
        files.extend(self.versions()?.into_values().flat_map(|version| version.fields));
        Ok(files)
    }

    /// The numbers of a new field, and of the first of its files.
    pub fn next_field(&mut self) -> Result<(u32, u32), StoreError> {
        let fields: Vec<FieldRow> = self.everywhere(RowKind::Field)?;
        // Stores from before versions may have values of a field that is gone.
        let previous: Vec<FieldPart> = self.rows(RowKind::PreviousFieldPart)?;
        let ids = fields.iter().map(|field| field.id).chain(previous.iter().map(|part| part.field));
        let id = ids.max().unwrap_or(0) + 1;
        // The journal grows with each step, so that no number comes back soon.
        let steps = self.journal()?.len() as u32;
        let used = self.field_files()?.iter().map(|file| file.generation + 1).max();
        Ok((id, used.unwrap_or(1).max(2 * steps)))
    }

    /// Number of values of a field at `place` in the whole store; a vertex counts in each of its sub-domains.
    pub fn n_values(&mut self, place: FieldPlace) -> Result<u64, StoreError> {
        let rows = self.subdomains()?.into_iter();
        Ok(rows
            .map(|row| match place {
                FieldPlace::Vertices => row.vertices,
                FieldPlace::Tets => row.tets,
            })
            .sum())
    }
}

impl Step {
    /// Sets the row of a field.
    pub fn set_field(&mut self, row: &FieldRow) {
        self.put(RowKind::Field.key(0, row.id), row);
    }

    /// Sets the values of a field in a sub-domain; their file is synced before the commit.
    pub fn set_field_part(&mut self, part: &FieldPart) {
        self.put(RowKind::FieldPart.key(part.field, part.rank), part);
        self.field_listed.insert(part.file());
        self.field_unlisted.remove(&part.file());
    }

    /// Removes the file of values after the commit; another row takes the place of theirs.
    pub fn unlist_field_file(&mut self, part: &FieldPart) {
        self.field_unlisted.insert(part.file());
    }

    /// Forgets a field with its values among `parts`; their files are removed after the commit.
    pub fn remove_field(&mut self, row: &FieldRow, parts: &[FieldPart]) {
        self.changes.insert(RowKind::Field.key(0, row.id), None);
        for part in parts.iter().filter(|part| part.field == row.id) {
            self.changes.insert(RowKind::FieldPart.key(part.field, part.rank), None);
            self.unlist_field_file(part);
        }
    }
}
