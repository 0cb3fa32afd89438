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
