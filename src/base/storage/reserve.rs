//! Allocation of long arrays: refused memory is an error like a full disk, not the end of the process.

use super::{StorageError, raise};

/// Reserves memory for exactly `more` elements. Unwinds if the system has none.
pub fn reserve<T>(array: &mut Vec<T>, more: usize) {
    if array.try_reserve_exact(more).is_err() {
        let bytes = more.saturating_mul(size_of::<T>()) as u64;
        raise(StorageError::NoMemory { bytes });
    }
}

/// Adds an element at the end; an array that is full grows by half. Unwinds when the system has no memory for that.
#[inline]
pub fn push<T>(array: &mut Vec<T>, value: T) {
    if array.len() == array.capacity() {
        reserve(array, (array.len() / 2).max(64));
    }
    array.push(value);
}

/// `n` times `value`. Unwinds when the system has no memory for them.
pub fn filled<T: Clone>(n: usize, value: T) -> Vec<T> {
    let mut array = Vec::new();
    reserve(&mut array, n);
    array.resize(n, value);
    array
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::attempt;

    #[test]
    fn memory_that_nobody_has_is_an_error_with_the_number_of_bytes() {
        let refused = attempt(|| filled(1 << 60, 0u8));
        assert!(
            matches!(refused, Err(StorageError::NoMemory { bytes }) if bytes == 1 << 60),
            "{refused:?}"
        );
        let kept = attempt(|| {
            let mut array = filled(3, 7u8);
            (0..1000).for_each(|_| push(&mut array, 7));
            array
        });
        assert_eq!(kept.expect("a kilobyte"), vec![7; 1003]);
    }
}
