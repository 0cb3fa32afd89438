//! The ledger of memory: memory that grows with the work is leased here first.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::StorageError;

struct Ledger {
    cap: u64,
    used: AtomicU64,
    high_water: AtomicU64,
}

/// Bytes a run may hold, shared by all its workers.
#[derive(Clone)]
pub struct Budget {
    ledger: Arc<Ledger>,
}

/// Bytes taken from a [`Budget`]; given back when dropped.
pub struct Lease {
    ledger: Arc<Ledger>,
    bytes: u64,
}

impl Budget {
    /// A ledger of `cap` bytes.
    pub fn new(cap: u64) -> Self {
        Self {
            ledger: Arc::new(Ledger {
                cap,
                used: AtomicU64::new(0),
                high_water: AtomicU64::new(0),
            }),
        }
    }

    /// The cap in bytes.
    pub fn cap(&self) -> u64 {
        self.ledger.cap
    }

    /// Bytes not leased at the moment.
    pub fn available(&self) -> u64 {
        self.ledger.cap - self.ledger.used.load(Ordering::Relaxed)
    }

    /// Most bytes ever leased at once.
    pub fn high_water(&self) -> u64 {
        self.ledger.high_water.load(Ordering::Relaxed)
    }

    /// Takes `bytes` for `what`; never waits.
    ///
    /// Errors: [`StorageError::Budget`] when fewer are left.
    pub fn lease(&self, bytes: u64, what: &'static str) -> Result<Lease, StorageError> {
        let ledger = &self.ledger;
        let taken = ledger.used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |used| {
            used.checked_add(bytes).filter(|&sum| sum <= ledger.cap)
        });
        match taken {
            Ok(before) => {
                ledger.high_water.fetch_max(before + bytes, Ordering::Relaxed);
                Ok(Lease { ledger: Arc::clone(ledger), bytes })
            }
            Err(used) => {
                Err(StorageError::Budget { what, needed: bytes, available: ledger.cap - used })
            }
        }
    }
}

impl Lease {
    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        self.ledger.used.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leases_never_exceed_the_cap_and_come_back() {
        let budget = Budget::new(100);
        let a = budget.lease(60, "a").expect("60 of 100");
        assert!(matches!(budget.lease(41, "b"), Err(StorageError::Budget { available: 40, .. })));
        let b = budget.lease(40, "b").expect("40 of 40");
        assert_eq!(budget.available(), 0);
        drop((a, b));
        assert_eq!((budget.available(), budget.high_water()), (100, 100));
    }
}
