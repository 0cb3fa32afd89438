//! What is held all through a run, and what is left to share out.

use super::{Options, PipelineError, Plan};
use crate::sizing::SizeField;
use crate::store::{Budget, Lease};
use crate::surface::Surface;

/// What the ledger has given to a run, and how it is shared out.
pub(super) struct Held {
    pub plan: Plan,
    surface: Option<Lease>,
    field: Lease,
    working: Lease,
}

impl Held {
    /// Errors: the ledger has too little.
    pub fn of(
        surface: &Surface,
        field: &SizeField,
        options: &Options,
        budget: &Budget,
    ) -> Result<Self, PipelineError> {
        let surface = budget.lease(surface.bytes() as u64, "the surface")?;
        let field = budget.lease(field.bytes() as u64, "the size field")?;
        let (plan, working) = Self::working(surface.bytes() + field.bytes(), options, budget)?;
        Ok(Self {
            plan,
            surface: Some(surface),
            field,
            working,
        })
    }

    fn working(
        held: u64,
        options: &Options,
        budget: &Budget,
    ) -> Result<(Plan, Lease), PipelineError> {
        let plan = match options.trial.plan {
            Some(plan) => plan,
            None => Plan::new(budget.cap(), held)?,
        };
        let bytes = plan.frames + plan.redb + plan.redb / 2 + plan.buffers;
        Ok((plan, budget.lease(bytes, "the working mesh")?))
    }

    /// Shares out what the surface took, too.
    pub fn without_surface(
        mut self,
        options: &Options,
        budget: &Budget,
    ) -> Result<Self, PipelineError> {
        self.surface = None;
        drop(self.working);
        let (plan, working) = Self::working(self.field.bytes(), options, budget)?;
        Ok(Self {
            plan,
            working,
            ..self
        })
    }
}
