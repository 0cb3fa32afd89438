//! What is in the files of the folder.

use rkyv::{Archive, Deserialize, Serialize};
use serde::{Deserialize as FromJson, Serialize as ToJson};

use crate::pipeline::work::{Order, Receipt};

/// What is the same for all tasks.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub(super) struct PlanRecord {
    /// Differs between any two plans: receipts of another one do not count.
    pub run: u64,
    pub recipe: u32,
    /// Sub-domains.
    pub n: u32,
    /// Tasks at once.
    pub tasks: u32,
    /// The box of the surface.
    pub bounds: [[f64; 3]; 2],
    /// The options of the job, as JSON.
    pub options: String,
}

/// What one task is to do.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub(super) struct TaskOrders {
    pub run: u64,
    pub task: u32,
    pub orders: Vec<Order>,
    /// Whether the cuts below those of the orders belong to them.
    pub below: bool,
}

/// What one task did.
#[derive(Archive, Serialize, Deserialize, Clone, Debug)]
pub(super) struct TaskReceipts {
    pub run: u64,
    pub task: u32,
    /// Names the folder of its files.
    pub attempt: String,
    /// Names and lengths.
    pub files: Vec<(String, u64)>,
    /// Cuts after those above them.
    pub receipts: Vec<Receipt>,
    pub seconds: f64,
}

/// Who is at a task, or was.
#[derive(ToJson, FromJson, Clone, Debug, PartialEq)]
pub(super) struct Mark {
    pub host: String,
    pub process: u32,
    /// Seconds since 1970.
    pub renewed: u64,
    /// Why it ended without a receipt.
    pub error: Option<String>,
}
