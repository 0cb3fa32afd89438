//! What is held all through a run, and what is left to share out.

use super::{Options, Plan};
use crate::pipeline::error::PipelineError;
use tetdb_base::storage::{Budget, Lease};
use tetdb_base::surface::Surface;
use tetdb_kernel::sizing::SizeField;

/// Share of the surface that stays with the process once it is dropped, as heap between what is still in use: with 50,000 grains 21 MB of 120
/// were still there while sub-domains were meshed, which a resumed run never held.
const LEFT_BEHIND: usize = 8;

/// What the ledger has given to a run, and how it is shared out.
pub struct Leases {
    pub plan: Plan,
    surface: Lease,
    surface_bytes: usize,
    field: Lease,
    working: Lease,
}

impl Leases {
    /// Errors: the ledger has too little.
    pub fn of(
        surface: &Surface,
        field: &SizeField,
        options: &Options,
        budget: &Budget,
    ) -> Result<Self, PipelineError> {
        let surface_bytes = surface.bytes();
        let surface = budget.lease(surface_bytes as u64, "the surface")?;
        let field = budget.lease(field.bytes() as u64, "the size field")?;
        let (plan, working) = Self::working(surface.bytes() + field.bytes(), options, budget)?;
        Ok(Self { plan, surface_bytes, surface, field, working })
    }

    fn working(
        held: u64,
        options: &Options,
        budget: &Budget,
    ) -> Result<(Plan, Lease), PipelineError> {
        let plan = match options.run.trial.plan {
            Some(plan) => plan,
            None => Plan::new(budget.cap(), held)?,
        };
        let bytes = plan.frames + plan.redb + plan.redb / 2 + plan.buffers;
        Ok((plan, budget.lease(bytes, "the working mesh")?))
    }

    /// Shares out what the surface took, too, but for what it leaves behind.
    pub fn without_surface(
        self,
        options: &Options,
        budget: &Budget,
    ) -> Result<Self, PipelineError> {
        drop((self.surface, self.working));
        let left = (self.surface_bytes / LEFT_BEHIND) as u64;
        let surface = budget.lease(left, "what the surface leaves behind")?;
        let (plan, working) = Self::working(left + self.field.bytes(), options, budget)?;
        Ok(Self { plan, surface, working, ..self })
    }
}
