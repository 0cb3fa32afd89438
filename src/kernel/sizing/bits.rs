//! A bit for each of many things.

/// `n` bits.
#[derive(Clone)]
pub(super) struct Bits(Vec<u64>);

impl Bits {
    pub fn new(n: usize) -> Self {
        Self(vec![0; n.div_ceil(64)])
    }

    #[inline]
    pub fn get(&self, i: u32) -> bool {
        self.0[i as usize / 64] >> (i % 64) & 1 != 0
    }

    /// Sets a bit; says whether it was set before.
    #[inline]
    pub fn set(&mut self, i: u32) -> bool {
        let word = &mut self.0[i as usize / 64];
        let was = *word >> (i % 64) & 1 != 0;
        *word |= 1 << (i % 64);
        was
    }

    pub fn set_all(&mut self) {
        self.0.fill(u64::MAX);
    }

    pub fn clear(&mut self) {
        self.0.fill(0);
    }
}
