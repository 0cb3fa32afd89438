//! Fields of one store evaluated on the mesh of another.

use std::time::Instant;

use serde::Serialize;

use super::field_spec::bad;
use super::fields::{field_called, fields_of, journal};
use super::{Error, Field, Store};
use crate::pipeline::FieldChange;
use tetdb_schema::field::FieldRow;
use tetdb_schema::word::Word;
use tetdb_store::store::Catalog;
use tetdb_store::transfer::{FieldTransfer, TransferMethod, transfer};

/// A field that was evaluated on another mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TransferredField {
    /// The field as it is now.
    #[serde(flatten)]
    pub field: Field,
    /// How its values were evaluated.
    pub method: TransferMethod,
    /// Vertices outside of the old mesh, which have the value of its nearest point; tetrahedra that share nothing with it, which have the
    /// value of its nearest tetrahedron. A vertex counts in each of its sub-domains.
    pub from_outside: u64,
    /// Share of the new mesh's volume that the old mesh covers; of values by overlap.
    pub covered: Option<f64>,
    /// Sums of value times volume, before and after, for each component; of values at tetrahedra that are no integers. Of sub-domains that
    /// were meshed again, over these alone.
    pub integrals: Option<[Vec<f64>; 2]>,
}

impl Store {
    /// Adds fields of another store, evaluated on the mesh of this one, in one step. A stopped call leaves the store as it was.
    ///
    /// `names` are the fields; none means all. Without a method, values at vertices are linear in the old tetrahedra, and values at
    /// tetrahedra are means by volume; see [`TransferMethod`].
    ///
    /// ```
    /// # use tetdb_engine::api as tetdb;
    /// # let dir = tempfile::tempdir()?;
    /// # let (old, new) = (dir.path().join("old.tetdb"), dir.path().join("new.tetdb"));
    /// # let mesh = |h, path: &_| tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.5")?).sizes(
    /// #     tetdb::Sizes::interior(tetdb::Length::units(h))).create(path);
    /// # let (mut old, mut new) = (mesh(0.3, &old)?, mesh(0.2, &new)?);
    /// use tetdb::{FieldPlace, FieldSource, NewField};
    ///
    /// let heat = NewField::new("heat", FieldPlace::Tets);
    /// old.add_field_from(&heat, &FieldSource::Expression("1 + x".to_owned()))?;
    /// let added = new.transfer_from(&old, &[], None)?;
    /// let [before, after] = added[0].integrals.as_ref().expect("values at tetrahedra");
    /// assert!((before[0] - after[0]).abs() < 1e-12 * before[0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    /// Errors: `no-such-part` for a field that the other store lacks; `bad-field` for one that this store has already, or that the method is not for;
    /// `busy`; damage; the disk.
    pub fn transfer_from(
        &mut self,
        from: &Self,
        names: &[&str],
        method: Option<TransferMethod>,
    ) -> Result<Vec<TransferredField>, Error> {
        let clock = Instant::now();
        let evaluated = self.change_fields(|catalog, settings| {
            let mut old = from.catalog_shared();
            let fields = chosen(&mut old, names, method, catalog)?;
            let (old_rows, rows) = (old.subdomains()?, catalog.subdomains()?);
            let mut progress = |done, total| settings.count("transfer", done, total, "values");
            let ends = ((&old, &*old_rows), (&*catalog, &*rows));
            let done = transfer(ends.0, ends.1, &fields, settings.cap()?, &mut progress)?;
            let state = catalog.state()?;
            catalog.commit(|step| {
                for (field, values) in fields.iter().zip(&done) {
                    step.set_field(&field.new);
                    values.parts.iter().for_each(|part| step.set_field_part(part));
                    step.append_journal(&journal(state, "transfer", clock));
                }
                Ok(())
            })?;
            let evaluated = fields.into_iter().zip(done).map(|(field, values)| {
                let FieldTransfer { new: field, method, .. } = field;
                FieldChange { field, method, values }
            });
            Ok(evaluated.collect())
        })?;
        self.transferred(evaluated)
    }

    /// The reports of fields that were evaluated on the mesh of this store.
    pub(super) fn transferred(
        &self,
        evaluated: Vec<FieldChange>,
    ) -> Result<Vec<TransferredField>, Error> {
        let fields = self.fields()?;
        let found = evaluated.into_iter().filter_map(|FieldChange { field, method, values }| {
            Some(TransferredField {
                field: fields.iter().find(|known| known.name == field.name)?.clone(),
                method,
                from_outside: values.outside,
                covered: values.covered,
                integrals: values.integrals,
            })
        });
        Ok(found.collect())
    }
}

/// The fields to bring from one store to another.
fn chosen(
    old: &mut Catalog,
    names: &[&str],
    method: Option<TransferMethod>,
    new: &mut Catalog,
) -> Result<Vec<FieldTransfer>, Error> {
    let mut fields: Vec<FieldRow> = Vec::new();
    for name in names {
        if !fields.iter().any(|field| field.name == *name) {
            fields.push(field_called(old, name)?);
        }
    }
    if names.is_empty() {
        fields = old.fields()?;
    }
    if fields.is_empty() {
        let message = format!("{} has no fields", old.dir().display());
        return Err(bad(message).with_help("add a field to it first"));
    }
    let known = fields_of(new)?;
    let (id, serial) = new.next_field()?;
    let mut evaluated = Vec::new();
    for (i, old) in (0..).zip(fields) {
        if known.iter().any(|field| field.name == old.name) {
            let message = format!("there is a field {} already", old.name);
            return Err(bad(message).with_help("drop it first, or name the other fields"));
        }
        let method = method.unwrap_or(TransferMethod::default_at(old.place));
        if !method.is_for(old.place) {
            let (word, place) = (method.word(), old.place.word());
            let message = format!("{word} is no method for {}, a field at {place}", old.name);
            return Err(bad(message)
                .with_help("linear is for fields at vertices, overlap for fields at tetrahedra"));
        }
        let row = FieldRow { id: id + i, ..old.clone() };
        evaluated.push(FieldTransfer { old, new: row, method, serial: serial + i });
    }
    Ok(evaluated)
}
