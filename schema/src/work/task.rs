//! Tasks of a batch scheduler: the plan, and the orders and receipts of each task.

use rkyv::{Archive, Deserialize, Serialize};

use super::{Receipt, WorkOrder};

/// The file `plan`: parameters common to all tasks.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub struct PlanRecord {
    /// Identifies the plan. Receipts of another plan do not count.
    pub run: u64,
    /// Version of the recipe.
    pub recipe: u32,
    /// Number of sub-domains.
    pub n: u32,
    /// Tasks at once.
    pub tasks: u32,
    /// The box of the surface: low corner, high corner.
    pub bounds: [[f64; 3]; 2],
    /// The options of the job, as JSON.
    pub options: String,
}

/// Parameters common to all orders of a run without a plan; a message.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub struct RunRecord {
    /// Version of the recipe.
    pub recipe: u32,
    /// Absolute path of the store.
    pub store: String,
    /// The box of the surface: low corner, high corner.
    pub bounds: [[f64; 3]; 2],
    /// The options of the job, as JSON.
    pub options: String,
}

/// The file `task-00017.orders`: the work of one task.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub struct TaskOrders {
    /// The plan, see [`PlanRecord::run`].
    pub run: u64,
    /// Number of the task.
    pub task: u32,
    /// Its orders.
    pub orders: Vec<WorkOrder>,
    /// True if the cuts below those of the orders belong to them.
    pub below: bool,
}

/// The file `task-00017.receipts`: the results of one task.
#[derive(Archive, Serialize, Deserialize, Clone, Debug)]
pub struct TaskReceipts {
    /// The plan, see [`PlanRecord::run`].
    pub run: u64,
    /// Number of the task.
    pub task: u32,
    /// Names the folder of its files.
    pub attempt: String,
    /// Names and lengths of its files.
    pub files: Vec<(String, u64)>,
    /// Receipts; each cut comes after the cuts above it.
    pub receipts: Vec<Receipt>,
    /// Seconds it took.
    pub seconds: f64,
}

/// The file `task-00017.mark`, as JSON: the process that performs a task, or the last one that did.
#[derive(serde::Serialize, serde::Deserialize, Clone, Debug, PartialEq)]
pub struct TaskMark {
    /// Name of its machine.
    pub host: String,
    /// Its number there.
    pub process: u32,
    /// Seconds since 1970.
    pub renewed: u64,
    /// The reason why it ended without a receipt.
    pub error: Option<String>,
}
