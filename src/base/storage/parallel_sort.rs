//! Sorts in memory, on all free threads of the run.

use std::cmp::Ordering;

use super::{parallel, spare_threads};

/// Parts below this are sorted by one thread.
const PART: usize = 1 << 14;

/// Sorts items of which no two compare equal, or whose equals are the same: the result does not depend on threads.
///
/// Halves are parted by selection and sorted each for itself by the standard library, which takes half the instructions of rayon's sort.
pub fn sort_unstable_by<T: Send>(
    items: &mut [T],
    order: impl Fn(&T, &T) -> Ordering + Copy + Sync + Send,
) {
    let n_threads = spare_threads();
    if n_threads == 1 || items.len() <= PART {
        return items.sort_unstable_by(order);
    }
    // Two parts for each thread: they do not take the same time.
    let depth = n_threads.next_power_of_two().ilog2() + 1;
    parallel(|| sort_parts(items, order, depth));
}

fn sort_parts<T: Send>(
    items: &mut [T],
    order: impl Fn(&T, &T) -> Ordering + Copy + Sync + Send,
    depth: u32,
) {
    if depth == 0 || items.len() <= PART {
        return items.sort_unstable_by(order);
    }
    let (low, _, high) = items.select_nth_unstable_by(items.len() / 2, order);
    rayon::join(|| sort_parts(low, order, depth - 1), || sort_parts(high, order, depth - 1));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::mix;
    use crate::storage::{CancelToken, RunContext};

    #[test]
    fn items_are_sorted_by_any_number_of_threads() {
        let items: Vec<u64> = (0..5 * PART as u64).map(|k| mix(k) >> 50).collect();
        let mut expected = items.clone();
        expected.sort();
        for n in 1..5 {
            let mut items = items.clone();
            let run = RunContext::new(n, CancelToken::new());
            run.enter(|| sort_unstable_by(&mut items, u64::cmp));
            assert_eq!(items, expected, "{n} threads");
        }
    }
}
