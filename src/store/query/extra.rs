//! Variables of one store: its fields, and names of its regions as numbers.

use tetdb_schema::field::{FieldPlace, FieldRow, Scalar};
use tetdb_schema::record::SealedTet;

use super::session::OpenField;
use super::{QueryError, QuerySession};
use crate::sealed::FieldFile;
/// Memory of the open file of a field: half for redb, half for decoded columns.
const FILE_BYTES: u64 = 2 << 20;
/// Files of fields held open.
const FILES_MAX: usize = 12;
/// A variable beyond [`VARIABLES`](super::VARIABLES).
#[derive(Clone, Debug, PartialEq)]
pub enum ExtraVariable {
    /// A name that stands for a number.
    Number(f64),
    /// A component of a field. Of a field at vertices, the mean over the vertices of the tetrahedron.
    Field(FieldRow, u32),
}

/// Ranges of some variables in the chunks of a sub-domain, and whether some of their values are not numbers.
pub(super) struct ExtraRanges {
    n: usize,
    ranges: Vec<[f64; 2]>,
    nan: Vec<bool>,
}

impl ExtraRanges {
    /// The ranges in a chunk.
    pub fn of(&self, chunk: u32) -> (&[[f64; 2]], &[bool]) {
        let own = chunk as usize * self.n..(chunk as usize + 1) * self.n;
        (&self.ranges[own.clone()], &self.nan[own])
    }
}

impl QuerySession {
    /// The open values of a field in a sub-domain.
    pub(crate) fn field(
        &mut self,
        field: &FieldRow,
        rank: u32,
    ) -> Result<&mut FieldFile, QueryError> {
        let key = (field.id, rank);
        if !self.fields.contains(&key) {
            let is_full = |session: &Self| session.budget.available() < FILE_BYTES;
            while self.fields.len() >= FILES_MAX || !self.fields.is_empty() && is_full(self) {
                self.fields.pop_lru();
            }
            let lease = self.budget.lease(FILE_BYTES, "values of a field")?;
            self.part(rank)?;
            let part = self.parts.peek(&rank).expect("it was just opened");
            let file = self.store.open_field(field, &part.subdomain, FILE_BYTES as usize)?;
            self.fields.put(key, OpenField::new(file, lease));
        }
        Ok(&mut self.fields.get_mut(&key).expect("it was just put there").file)
    }

    /// The ranges of variables in all chunks of tetrahedra of a sub-domain.
    pub(super) fn extra_ranges(
        &mut self,
        rank: u32,
        variables: &[ExtraVariable],
    ) -> Result<ExtraRanges, QueryError> {
        let chunks = match variables.is_empty() {
            true => 0,
            false => self.part(rank)?.subdomain.tet_summaries().len(),
        };
        let n = variables.len();
        let (mut ranges, mut nan) = (vec![[0.0; 2]; n * chunks], vec![false; n * chunks]);
        for (i, variable) in variables.iter().enumerate() {
            for chunk in 0..chunks {
                let (range, has_nan) = match variable {
                    ExtraVariable::Number(x) => ([*x; 2], false),
                    ExtraVariable::Field(field, component) => {
                        let file = self.field(field, rank)?;
                        let (range, has_nan) = file.range_over(chunk as u32, *component);
                        (widened(range, field.place), has_nan)
                    }
                };
                (ranges[chunk * n + i], nan[chunk * n + i]) = (range, has_nan);
            }
        }
        Ok(ExtraRanges { n, ranges, nan })
    }

    /// The values of variables at tetrahedra of a sub-domain, given by number and vertices: for each all variables.
    pub(super) fn extra_values(
        &mut self,
        rank: u32,
        variables: &[ExtraVariable],
        tets: &[(u32, SealedTet)],
    ) -> Result<Vec<Scalar>, QueryError> {
        let n = variables.len();
        let mut values = vec![Scalar::Float(0.0); n * tets.len()];
        for (i, variable) in variables.iter().enumerate() {
            let (field, component) = match variable {
                ExtraVariable::Number(x) => {
                    values.iter_mut().skip(i).step_by(n).for_each(|v| *v = Scalar::Float(*x));
                    continue;
                }
                ExtraVariable::Field(field, component) => (field, *component),
            };
            let file = self.field(field, rank)?;
            for (value, (local, tet)) in values.iter_mut().skip(i).step_by(n).zip(tets) {
                *value = match field.place {
                    FieldPlace::Tets => field.number.unpack(file.word(*local, component)?),
                    FieldPlace::Vertices => {
                        let mut sum = 0.0;
                        for v in tet.nodes {
                            sum += field.number.unpack(file.word(v, component)?).to_f64() * 0.25;
                        }
                        Scalar::Float(sum)
                    }
                };
            }
        }
        Ok(values)
    }
}

/// Rounding may carry a mean out of the range of its values.
fn widened([low, high]: [f64; 2], place: FieldPlace) -> [f64; 2] {
    let most = low.abs().max(high.abs());
    match place {
        FieldPlace::Vertices if most.is_finite() => [low - 1e-15 * most, high + 1e-15 * most],
        _ => [low, high],
    }
}
