//! Regions and labels of a store by name.

use super::{Error, Summary};
use tetdb_store::query::{QueryError, regions_called};

impl Summary {
    /// Numbers of the regions named `name`. Errors: `no-such-part`.
    pub fn regions_called(&self, name: &str) -> Result<Vec<u32>, Error> {
        Ok(regions_called(&self.region_names, name)?)
    }

    /// Number of the label named `name`. If no label has this name, `name` is parsed as a number.
    ///
    /// Errors: `no-such-part`.
    pub fn label_called(&self, name: &str) -> Result<u32, Error> {
        label_among(&self.labels, name)
    }
}

/// Number of the label named `name`, or with this number. Errors: `no-such-part`.
pub(super) fn label_among(labels: &[String], name: &str) -> Result<u32, Error> {
    let by_name = labels.iter().position(|label| label == name);
    let by_number = || name.parse().ok().filter(|&n| n < labels.len());
    let number = by_name
        .or_else(by_number)
        .ok_or_else(|| QueryError::NoLabel { name: name.to_owned(), known: labels.to_vec() })?;
    Ok(number as u32)
}
