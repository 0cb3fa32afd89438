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
pub use run::{recorded_field, room};
pub use shell::shells;
pub use sizes::{NewSizes, Recorded, Values};
pub use summary::{FieldChange, Forecast, ResaturateSummary, Resaturated};
