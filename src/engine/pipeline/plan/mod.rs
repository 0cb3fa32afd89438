//! Decisions before anything is written: options, the size field, the estimate from it, the number of sub-domains, and shares of
//! the memory cap.

pub(super) mod estimate;
mod forecast;
pub(super) mod leases;
mod memory;
mod option_text;
mod options;
mod recipe;
mod regions;
pub(super) mod subdomains;

pub use estimate::{Estimate, Prepared, REFUSED_BELOW, least_for, prepare};
pub use memory::{MEMORY_MIN, Plan};
pub use option_text::OptionsText;
pub use options::{EmbedOutside, MeshOptions, Options, RunOptions, SizeFile, Subdomains, Trial};
pub use recipe::{RECIPE, recipe_of, record_recipe};
pub use regions::{OuterEmbedded, outer_embedded, refuse_outer};
pub use subdomains::TETS_PER_SUBDOMAIN;
