//! What is in a file: blocks that copies share until one of them is written to.

use std::sync::Arc;

pub const BLOCK: usize = 4096;
/// What a disk writes whole or not at all.
pub const SECTOR: usize = 512;

/// Bytes of a file, with holes.
#[derive(Clone, Debug, Default)]
pub struct Content {
    len: u64,
    blocks: Vec<Option<Arc<[u8; BLOCK]>>>,
    /// How many of them are no holes.
    used: u64,
}

impl Content {
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Blocks that are no holes.
    pub fn blocks_used(&self) -> u64 {
        self.used
    }

    /// Blocks that writing `bytes` at `offset` would fill for the first time.
    pub fn blocks_new(&self, offset: u64, bytes: usize) -> u64 {
        let range = offset as usize / BLOCK..(offset as usize + bytes).div_ceil(BLOCK);
        let hole = |&b: &usize| self.blocks.get(b).is_none_or(Option::is_none);
        range.filter(hole).count() as u64
    }

    /// Reads what is within the file; returns how many bytes that is.
    pub fn read(&self, offset: u64, out: &mut [u8]) -> usize {
        let n = out.len().min(self.len.saturating_sub(offset).try_into().unwrap_or(0));
        let mut done = 0;
        while done < n {
            let at = offset as usize + done;
            let (block, from) = (at / BLOCK, at % BLOCK);
            let take = (BLOCK - from).min(n - done);
            let to = &mut out[done..done + take];
            match self.blocks.get(block) {
                Some(Some(b)) => to.copy_from_slice(&b[from..from + take]),
                _ => to.fill(0),
            }
            done += take;
        }
        n
    }

    pub fn write(&mut self, offset: u64, data: &[u8]) {
        self.len = self.len.max(offset + data.len() as u64);
        self.fit();
        let mut done = 0;
        while done < data.len() {
            let at = offset as usize + done;
            let (block, from) = (at / BLOCK, at % BLOCK);
            let take = (BLOCK - from).min(data.len() - done);
            let used = &mut self.used;
            let block = self.blocks[block].get_or_insert_with(|| {
                *used += 1;
                Arc::new([0; BLOCK])
            });
            Arc::make_mut(block)[from..from + take].copy_from_slice(&data[done..done + take]);
            done += take;
        }
    }

    pub fn set_len(&mut self, len: u64) {
        let shorter = len < self.len;
        self.len = len;
        self.fit();
        let from = len as usize % BLOCK;
        if let (true, 1.., Some(Some(last))) = (shorter, from, self.blocks.last_mut()) {
            Arc::make_mut(last)[from..].fill(0);
        }
    }

    fn fit(&mut self) {
        let n = (self.len as usize).div_ceil(BLOCK);
        let cut = self.blocks.iter().skip(n).flatten().count() as u64;
        self.used -= cut;
        self.blocks.resize(n, None);
    }

    /// Turns one bit around.
    pub fn flip(&mut self, offset: u64, bit: u8) {
        let mut byte = [0];
        self.read(offset, &mut byte);
        self.write(offset, &[byte[0] ^ 1 << bit]);
    }
}
