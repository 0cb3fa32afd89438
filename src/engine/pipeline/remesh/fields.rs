//! Fields of a store whose sub-domains are meshed again.

use super::summary::FieldChange;
use crate::pipeline::error::PipelineError;
use crate::pipeline::progress::{Event, Watcher};
use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::field::{FieldPart, FieldRow};
use tetdb_store::store::{Catalog, Step, StoreError};
use tetdb_store::transfer::{FieldTransfer, TransferMethod, transfer};

/// How fields follow a change of sub-domains.
#[derive(Default)]
pub struct FieldChanges {
    /// Values of the changed sub-domains, before and after.
    changed: Vec<[FieldPart; 2]>,
    /// Fields that are dropped.
    dropped: Vec<FieldRow>,
    parts: Vec<FieldPart>,
    /// How values were evaluated on the new mesh.
    pub evaluated: Vec<FieldChange>,
}

impl FieldChanges {
    /// Drops all fields.
    pub fn drop_all(catalog: &mut Catalog) -> Result<Self, StoreError> {
        let (dropped, parts) = (catalog.fields()?, catalog.field_parts()?);
        Ok(Self { dropped, parts, ..Self::default() })
    }

    /// Keeps the values of sub-domains that are the same mesh in another file.
    pub fn keep(catalog: &mut Catalog, rows: &[[SubdomainRow; 2]]) -> Result<Self, StoreError> {
        let mut changed = Vec::new();
        for part in catalog.field_parts()? {
            if let Some([_, new]) = rows.iter().find(|[old, _]| old.rank == part.rank) {
                let now = FieldPart { generation: new.generation, ..part.clone() };
                changed.push([part, now]);
            }
        }
        Ok(Self { changed, ..Self::default() })
    }

    /// Evaluates all fields on the new mesh of sub-domains within `memory` bytes.
    ///
    /// Old and new sub-domains fill the same space. Effects: writes files that no catalog lists. Errors: damage; the disk.
    pub fn evaluate(
        catalog: &mut Catalog,
        rows: &[[SubdomainRow; 2]],
        memory: u64,
        watch: &Watcher,
    ) -> Result<Self, PipelineError> {
        let (_, serial) = catalog.next_field()?;
        let fields: Vec<FieldTransfer> = (serial..)
            .zip(catalog.fields()?)
            .map(|(serial, old)| {
                let method = TransferMethod::default_at(old.place);
                FieldTransfer { new: old.clone(), old, method, serial }
            })
            .collect();
        if fields.is_empty() {
            return Ok(Self::default());
        }
        let [old, new] = [0, 1].map(|i| rows.iter().map(|row| row[i].clone()).collect::<Vec<_>>());
        let mut progress = |done, total| {
            watch(Event { stage: "fields", done, total: Some(total), unit: "values" });
        };
        let mesh = &*catalog;
        let done = transfer((mesh, &old), (mesh, &new), &fields, memory, &mut progress)?;
        let parts = catalog.field_parts()?;
        let mut changes = Self::default();
        for (field, values) in fields.into_iter().zip(done) {
            for part in &values.parts {
                let is_old = |old: &&FieldPart| (old.field, old.rank) == (part.field, part.rank);
                let old = parts.iter().find(is_old);
                changes.changed.extend(old.map(|old| [old.clone(), part.clone()]));
            }
            changes.evaluated.push(FieldChange { field: field.new, method: field.method, values });
        }
        Ok(changes)
    }

    /// Lists what was done.
    pub fn list(&self, step: &mut Step) {
        for [old, new] in &self.changed {
            step.set_field_part(new);
            if old.file() != new.file() {
                step.unlist_field_file(old);
            }
        }
        for field in &self.dropped {
            step.remove_field(field, &self.parts);
        }
    }
}
