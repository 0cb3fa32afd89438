//! Cuts a stream of records into chunks that fill their place in the database.
//!
//! redb stores a large value in 4096 * 2^k bytes, so a chunk of half the size costs as much as a full one. The number of records
//! that fit is known only after compressing. The packer guesses it from the chunk before and tries again after a miss. The result
//! depends on the records alone.

use super::{CHUNK_BYTES_MAX, ChunkAddress, ChunkRecord, Encoder};

/// The fill that the guess aims at. Higher: more chunks overflow and are encoded again. Lower: bytes are wasted.
/// With 0.98 the chunks of a random Delaunay mesh come out 0.976 to 0.978 full.
const FILL_AIM: f64 = 0.98;
/// A chunk filled less than this is encoded again with more records, if there are any.
const FILL_LEAST: f64 = 0.95;
/// Attempts to fill a chunk better; attempts to make it fit are not limited.
const GROWTH_ATTEMPTS: u32 = 2;
/// First guess of the bytes a record takes.
const RECORD_BYTES_GUESS: usize = 8;

/// A chunk ready to be stored, and the records in it.
pub struct PackedChunk<R> {
    /// Where it belongs.
    pub address: ChunkAddress,
    /// Number of its first record in the sub-domain.
    pub first: u32,
    /// The bytes to store.
    pub value: Vec<u8>,
    /// Its records, in order.
    pub records: Vec<R>,
}

/// Collects records and cuts them into chunks.
pub struct Packer<R> {
    address: ChunkAddress,
    first: u32,
    guess: usize,
    pending: Vec<R>,
    encoder: Encoder<R>,
}

impl<R: ChunkRecord> Packer<R> {
    /// A packer for the records of one sub-domain in one generation.
    ///
    /// Errors: zstd cannot allocate its context.
    pub fn new(subdomain: u32, generation: u32) -> std::io::Result<Self> {
        Self::at(ChunkAddress { kind: R::KIND, subdomain, generation, chunk: 0 }, 0)
    }

    fn at(address: ChunkAddress, first: u32) -> std::io::Result<Self> {
        Ok(Self {
            address,
            first,
            guess: (CHUNK_BYTES_MAX / RECORD_BYTES_GUESS).min(R::COUNT_MAX),
            pending: Vec::new(),
            encoder: Encoder::new()?,
        })
    }

    /// A packer that goes on after the chunks that were cut so far, and knows nothing of them: what it cuts depends on its own records alone.
    ///
    /// Errors: as [`Packer::new`].
    pub fn next(&self) -> std::io::Result<Self> {
        self.beyond(0)
    }

    /// [`Packer::next`] after `n` more records. Its chunks get their numbers by [`Packer::adopt`].
    ///
    /// Errors: as [`Packer::new`].
    pub fn beyond(&self, n: usize) -> std::io::Result<Self> {
        Self::at(self.address, self.first + n as u32)
    }

    /// Takes over the next chunk from a packer [beyond](Packer::beyond) and numbers it.
    pub fn adopt(&mut self, mut chunk: PackedChunk<R>) -> PackedChunk<R> {
        assert!(self.pending.is_empty() && chunk.first == self.first, "chunks follow each other");
        chunk.address.chunk = self.address.chunk;
        super::codec::renumber(&mut chunk.value, chunk.address.chunk);
        self.first += chunk.records.len() as u32;
        self.address.chunk += 1;
        chunk
    }

    /// Records taken so far, with those before it.
    pub fn count(&self) -> u64 {
        u64::from(self.first) + self.pending.len() as u64
    }

    /// Chunks cut so far, with those before it.
    pub fn chunks(&self) -> u32 {
        self.address.chunk
    }

    /// Takes a record; returns a chunk when there is enough for one.
    ///
    /// Errors: those of zstd.
    #[inline]
    pub fn push(&mut self, record: R) -> std::io::Result<Option<PackedChunk<R>>> {
        self.pending.push(record);
        // More records than guessed, so that a chunk that came out short can grow.
        if self.pending.len() < (self.guess + self.guess / 8).min(R::COUNT_MAX) {
            return Ok(None);
        }
        self.cut_some(false)
    }

    /// Cuts the next chunk from what is left; `None` when nothing is.
    ///
    /// Errors: those of zstd.
    pub fn cut(&mut self) -> std::io::Result<Option<PackedChunk<R>>> {
        self.cut_some(true)
    }

    #[inline(never)]
    fn cut_some(&mut self, last: bool) -> std::io::Result<Option<PackedChunk<R>>> {
        let most = self.pending.len().min(R::COUNT_MAX);
        if most == 0 {
            return Ok(None);
        }
        let mut n =
            if most <= self.guess + self.guess / 16 { most } else { self.guess.clamp(1, most) };
        // `fits` records are known to fit, `bursts` records are known not to fit.
        let (mut fits, mut bursts) = (0, most + 1);
        let mut growths = 0;
        loop {
            let records = &self.pending[..n];
            let length = self.encoder.encode(self.address, self.first, records)?.len();
            let aim = (n as f64 * FILL_AIM * CHUNK_BYTES_MAX as f64 / length as f64) as usize;
            if length > CHUNK_BYTES_MAX {
                bursts = n;
                n = aim.clamp(fits.max(1), (bursts - 1).max(1));
                if bursts == 1 {
                    return Err(std::io::Error::other("one record exceeds a chunk"));
                }
                continue;
            }
            fits = n;
            let full = length as f64 >= FILL_LEAST * CHUNK_BYTES_MAX as f64;
            let larger = aim.min(bursts - 1);
            if !last && !full && n == most && most < R::COUNT_MAX {
                self.guess = aim.clamp(1, R::COUNT_MAX);
                return Ok(None);
            }
            if full || larger <= fits || growths == GROWTH_ATTEMPTS {
                self.guess = aim.clamp(1, R::COUNT_MAX);
                return Ok(Some(self.take(n)));
            }
            growths += 1;
            n = larger;
        }
    }

    /// Takes the first `n` records, whose value the encoder wrote last.
    fn take(&mut self, n: usize) -> PackedChunk<R> {
        let records: Vec<R> = self.pending.drain(..n).collect();
        let value = self.encoder.last_value().to_vec();
        let packed = PackedChunk { address: self.address, first: self.first, value, records };
        self.first += n as u32;
        self.address.chunk += 1;
        packed
    }
}
