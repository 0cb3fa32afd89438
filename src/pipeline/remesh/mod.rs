//! Sub-domains of a finished store meshed again, and the way back.

mod previous;
mod resaturate;
mod run;
mod sizes;

pub use previous::{forget, undo};
pub use resaturate::{
    Forecast, Remade, ResaturateSummary, Resaturation, asked, changed, forecast, resaturate,
};
pub use sizes::{NewSizes, Values};
