//! Remeshing of sub-domains of a finished store, and its undo.

mod fields;
mod previous;
mod request;
mod resaturate;
mod run;
mod sizes;
mod summary;

pub use previous::{forget, undo};
pub use request::Resaturation;
pub use resaturate::{Forecast, changed, forecast, recorded_request, resaturate};
pub use run::{recorded_field, room};
pub use sizes::{NewSizes, Recorded, Values};
pub use summary::{FieldChange, ResaturateSummary, Resaturated};
