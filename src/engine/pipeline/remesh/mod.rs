//! Remeshing of sub-domains of a finished store, and older versions brought back.

mod coarse;
mod fields;
mod request;
mod resaturate;
mod restore;
mod run;
mod shell;
mod sizes;
mod summary;

pub use request::Resaturation;
pub use resaturate::{changed, forecast, recorded_request, resaturate};
pub use restore::{forget, previous, restore};
pub use shell::shells;
pub use sizes::{NewSizes, Recorded, Values, recorded_field, room};
pub use summary::{FieldChange, Forecast, ResaturateSummary, Resaturated};
