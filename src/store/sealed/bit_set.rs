//! A set of numbers below a bound.

/// Shape: a bit for each number. Memory: an eighth of a byte for each.
#[derive(Clone, Debug)]
pub struct BitSet(Vec<u64>);

impl BitSet {
    /// The empty set of numbers below `n`.
    pub fn new(n: u64) -> Self {
        Self(vec![0; n.div_ceil(64) as usize])
    }

    /// Adds a number; returns whether it is new.
    #[inline]
    pub fn insert(&mut self, number: u64) -> bool {
        let (word, bit) = (&mut self.0[(number / 64) as usize], 1 << (number % 64));
        let is_new = *word & bit == 0;
        *word |= bit;
        is_new
    }

    /// Adds numbers.
    #[inline]
    pub fn insert_all(&mut self, numbers: impl IntoIterator<Item = u32>) {
        for number in numbers {
            self.insert(number.into());
        }
    }

    /// Returns whether a number is in the set.
    #[inline]
    pub fn contains(&self, number: u64) -> bool {
        self.0[(number / 64) as usize] >> (number % 64) & 1 == 1
    }

    /// The bits, 64 numbers to a word, the least first.
    pub fn words(&self) -> &[u64] {
        &self.0
    }

    /// The bits, to be changed.
    pub fn words_mut(&mut self) -> &mut [u64] {
        &mut self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_new_once() {
        let mut set = BitSet::new(130);
        let members = [0u32, 63, 64, 129];
        for number in members {
            assert!(!set.contains(number.into()));
            assert!(set.insert(number.into()) && !set.insert(number.into()));
        }
        set.insert_all([5, 64]);
        let found: Vec<u64> = (0..130).filter(|&number| set.contains(number)).collect();
        assert_eq!(found, [0, 5, 63, 64, 129]);
        assert_eq!(set.words().iter().map(|word| word.count_ones()).sum::<u32>(), 5);
    }
}
