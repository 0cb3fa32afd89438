//! Memory leases held throughout a run, and the plan for the remaining bytes.

use super::{Options, Plan};
use crate::pipeline::error::PipelineError;
use tetdb_base::storage::{Budget, Lease};
use tetdb_base::surface::Surface;
use tetdb_kernel::sizing::SizeField;

/// Divisor for the part of the surface's memory that the process keeps after the surface is dropped: heap between blocks still in
/// use. With 50,000 grains, 21 MB of 120 remained while sub-domains were meshed; a resumed run never held them.
const LEFT_BEHIND: usize = 8;

/// The leases of a run, and the plan that divides the bytes of the working mesh.
pub struct Leases {
    pub plan: Plan,
    surface: Lease,
    surface_bytes: usize,
    field: Lease,
    working: Lease,
}

impl Leases {
    /// Takes the leases of a run and plans its memory. Errors: the budget is too small.
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

    /// Drops the surface's lease and replans the memory with its bytes, except those that stay behind in the heap.
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
