//! Sorted records that are read beside another walk in the same order.

use std::iter::Peekable;

use tetdb_base::storage::{SortRecord, Sorted, StorageError};

/// Reads sorted records as far as a caller's own walk has come.
pub struct MergeReader<R: SortRecord>(Peekable<Sorted<R>>);

impl<R: SortRecord> MergeReader<R> {
    /// A reader at the first record.
    pub fn new(sorted: Sorted<R>) -> Self {
        Self(sorted.peekable())
    }

    /// Takes the next record if `is` holds for it. Errors: the disk.
    #[inline]
    pub fn next_if(&mut self, is: impl FnOnce(&R) -> bool) -> Result<Option<R>, StorageError> {
        self.0.next_if(|record| record.as_ref().map_or(true, is)).transpose()
    }

    /// Skips the records whose `order` is less, and takes the next one if its order is equal. Errors: the disk.
    pub fn find(
        &mut self,
        order: impl Fn(&R) -> std::cmp::Ordering,
    ) -> Result<Option<R>, StorageError> {
        while let Some(record) = self.next_if(|record| order(record).is_le())? {
            if order(&record).is_eq() {
                return Ok(Some(record));
            }
        }
        Ok(None)
    }

    /// Replaces `group` by the next record and those after it that are the `same`; returns false at the end. Errors: the disk.
    pub fn next_group(
        &mut self,
        group: &mut Vec<R>,
        same: impl Fn(&R, &R) -> bool,
    ) -> Result<bool, StorageError> {
        group.clear();
        let Some(first) = self.0.next().transpose()? else {
            return Ok(false);
        };
        group.push(first);
        while let Some(next) = self.next_if(|next| same(&first, next))? {
            group.push(next);
        }
        Ok(true)
    }
}

impl<R: SortRecord> Iterator for MergeReader<R> {
    type Item = Result<R, StorageError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.0.next()
    }
}
