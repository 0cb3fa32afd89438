//! Ranks 1 and up as workers of rank 0.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde_json::Value;

use super::mailbox::{CONTROL, DONE, Mailbox};
use crate::api::Code;
use crate::pipeline::WorkerPool;
use tetdb_base::storage::RemoteFailure;

/// All ranks other than 0, as workers.
pub struct RankWorkers {
    mailbox: Arc<Mailbox>,
    /// For each worker: its rank, and its number within that rank.
    slots: Mutex<Vec<(i32, i32)>>,
}

impl RankWorkers {
    pub fn new(mailbox: Arc<Mailbox>) -> Self {
        Self { mailbox, slots: Mutex::default() }
    }

    fn slots(&self) -> MutexGuard<'_, Vec<(i32, i32)>> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn order(&self, rank: i32, tag: i32, message: Vec<u8>) -> Result<(), RemoteFailure> {
        if i32::try_from(message.len()).is_err() {
            let n = message.len();
            let message = format!("an order of {n} bytes is more than a message can hold");
            return Err(RemoteFailure { code: Code::Memory, message });
        }
        self.mailbox.send(rank, tag, message);
        Ok(())
    }

    /// Waits for the answers of all ranks, even if one of them is an error, so that no rank sends to a process that has ended.
    pub fn answers(&self, tag: i32) -> Vec<Result<Vec<u8>, RemoteFailure>> {
        self.mailbox.others().map(|rank| self.answer(rank, tag)).collect()
    }

    fn answer(&self, rank: i32, tag: i32) -> Result<Vec<u8>, RemoteFailure> {
        let failure = |code, message| RemoteFailure { code, message };
        let mut bytes = self.mailbox.receive_from(rank, tag).ok_or_else(|| {
            failure(Code::Stopped, "stopped while another rank was at work".to_owned())
        })?;
        match bytes.first() {
            Some(&DONE) => Ok(bytes.split_off(1)),
            _ => {
                let error: Value =
                    serde_json::from_slice(bytes.get(1..).unwrap_or_default()).unwrap_or_default();
                let text = |key| error[key].as_str().unwrap_or_default().to_owned();
                let code = text("code").parse().unwrap_or(Code::Internal);
                Err(failure(code, format!("rank {rank}: {}", text("message"))))
            }
        }
    }
}

impl WorkerPool for RankWorkers {
    fn begin(&self, job: &[u8]) -> Result<usize, RemoteFailure> {
        for rank in self.mailbox.others() {
            self.order(rank, CONTROL, [&[DONE], job].concat())?;
        }
        let mut slots = Vec::new();
        for (rank, answer) in self.mailbox.others().zip(self.answers(CONTROL)) {
            let n = answer?.first_chunk().map_or(0, |&n| u32::from_le_bytes(n));
            slots.extend((0..n as i32).map(|slot| (rank, slot)));
        }
        // Each rank gets one order before any rank gets a second.
        slots.sort_by_key(|&(rank, slot)| (slot, rank));
        let n = slots.len();
        *self.slots() = slots;
        Ok(n)
    }

    fn perform(&self, slot: usize, order: Vec<u8>) -> Result<Vec<u8>, RemoteFailure> {
        let found = self.slots().get(slot).copied();
        let (rank, of_rank) = found.ok_or_else(|| RemoteFailure {
            code: Code::Internal,
            message: "an order for a rank that has not begun".to_owned(),
        })?;
        self.order(rank, of_rank + 1, order)?;
        self.answer(rank, of_rank + 1)
    }
}
