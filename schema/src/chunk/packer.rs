//! Cuts a stream of records into chunks that fill their place in the database.
//!
//! redb stores a large value in 4096 * 2^k bytes, so a chunk of half the size costs as much as a full one. The number of records
//! that fit is known only after compressing. The packer guesses it from chunks before and tries again after a miss. While the
//! guesses are good, several chunks are encoded at once, which threads can share. The result depends on the records alone.

use super::{CHUNK_BYTES_MAX, ChunkAddress, ChunkRecord, Encoder};

/// The fill that the guess aims at. Higher: more chunks overflow and are encoded again. Lower: bytes are wasted.
/// With 0.98 the chunks of a random Delaunay mesh come out 0.976 to 0.978 full.
const FILL_AIM: f64 = 0.98;
/// A chunk filled less than this is encoded again with more records, if there are any.
const FILL_LEAST: f64 = 0.95;
/// Attempts to fill a chunk better; attempts to make it fit are not limited.
const GROWTH_ATTEMPTS: u32 = 2;
/// Chunks encoded at once, at most.
const AT_ONCE_MAX: usize = 8;
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

/// A chunk of those that are encoded at once.
pub struct Part<'a, R> {
    address: ChunkAddress,
    first: u32,
    records: &'a [R],
    encoder: &'a mut Encoder<R>,
    /// Bytes of the value, or the error.
    length: std::io::Result<usize>,
}

impl<R: ChunkRecord> Part<'_, R> {
    /// Encodes the chunk.
    pub fn encode(&mut self) {
        let value = self.encoder.encode(self.address, self.first, self.records);
        self.length = value.map(<[u8]>::len);
    }
}

/// Collects records and cuts them into chunks.
pub struct Packer<R> {
    address: ChunkAddress,
    first: u32,
    guess: usize,
    /// Chunks to encode at once.
    at_once: usize,
    pending: Vec<R>,
    encoders: Vec<Encoder<R>>,
    encode_all: fn(&mut [Part<R>]),
}

impl<R: ChunkRecord> Packer<R> {
    /// A packer for the records of one sub-domain in one generation.
    ///
    /// Errors: zstd cannot allocate its context.
    pub fn new(subdomain: u32, generation: u32) -> std::io::Result<Self> {
        Ok(Self {
            address: ChunkAddress { kind: R::KIND, subdomain, generation, chunk: 0 },
            first: 0,
            guess: (CHUNK_BYTES_MAX / RECORD_BYTES_GUESS).min(R::COUNT_MAX),
            at_once: 1,
            pending: Vec::new(),
            encoders: vec![Encoder::new()?],
            encode_all: |parts| parts.iter_mut().for_each(Part::encode),
        })
    }

    /// Replaces the loop that calls [`Part::encode`] for each part, in any order, by one that shares them among threads.
    pub fn encoding_with(self, encode_all: fn(&mut [Part<R>])) -> Self {
        Self { encode_all, ..self }
    }

    /// Records taken so far.
    pub fn count(&self) -> u64 {
        u64::from(self.first) + self.pending.len() as u64
    }

    /// Chunks cut so far.
    pub fn chunks(&self) -> u32 {
        self.address.chunk
    }

    /// Takes a record; returns chunks when there is enough for them.
    ///
    /// Errors: those of zstd.
    #[inline]
    pub fn push(&mut self, record: R) -> std::io::Result<Vec<PackedChunk<R>>> {
        self.pending.push(record);
        // More records than guessed, so that a chunk that came out short can grow.
        let one = self.guess + self.guess / 8;
        let wanted = (self.at_once - 1) * self.guess + one.min(R::COUNT_MAX);
        match self.pending.len() < wanted {
            true => Ok(Vec::new()),
            false => self.cut_several(),
        }
    }

    /// Cuts as many chunks as are encoded at once, up to the first that is not well filled, or a single one.
    #[inline(never)]
    fn cut_several(&mut self) -> std::io::Result<Vec<PackedChunk<R>>> {
        let (n, at_once) = (self.guess, self.at_once);
        let mut cut = Vec::new();
        if at_once > 1 {
            while self.encoders.len() < at_once {
                self.encoders.push(Encoder::new()?);
            }
            let records = self.pending.chunks_exact(n).zip(&mut self.encoders).take(at_once);
            let part = |(k, (records, encoder))| Part {
                address: ChunkAddress { chunk: self.address.chunk + k, ..self.address },
                first: self.first + k * n as u32,
                records,
                encoder,
                length: Ok(0),
            };
            let mut parts: Vec<Part<R>> = (0..).zip(records).map(part).collect();
            (self.encode_all)(&mut parts);
            let mut bytes = 0;
            for part in parts {
                let length = part.length?;
                let is_full = length as f64 >= FILL_LEAST * CHUNK_BYTES_MAX as f64;
                if length > CHUNK_BYTES_MAX || !(is_full || n == R::COUNT_MAX) {
                    break;
                }
                bytes += length;
                let (records, value) = (part.records.to_vec(), part.encoder.last_value().to_vec());
                cut.push(PackedChunk {
                    address: part.address,
                    first: part.first,
                    value,
                    records,
                });
            }
            if !cut.is_empty() {
                self.guess = aim(cut.len() * n, bytes).clamp(1, R::COUNT_MAX);
            }
            self.pending.drain(..cut.len() * n);
            self.first += (cut.len() * n) as u32;
            self.address.chunk += cut.len() as u32;
        }
        match cut.len() {
            0 => {
                let (guess, chunks) = (self.guess, self.chunks());
                cut.extend(self.cut_some(false)?);
                // A chunk of as many records as guessed was well filled.
                let is_good = self.chunks() > chunks && cut[0].records.len() == guess;
                self.at_once = if is_good { 2 } else { 1 };
            }
            good if good == at_once => self.at_once = (2 * at_once).min(AT_ONCE_MAX),
            good => self.at_once = good,
        }
        Ok(cut)
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
            let length = self.encoders[0].encode(self.address, self.first, records)?.len();
            let aim = aim(n, length);
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
        let value = self.encoders[0].last_value().to_vec();
        let packed = PackedChunk { address: self.address, first: self.first, value, records };
        self.first += n as u32;
        self.address.chunk += 1;
        packed
    }
}

/// How many records fill a chunk as wanted, if `n` take `length` bytes.
fn aim(n: usize, length: usize) -> usize {
    (n as f64 * FILL_AIM * CHUNK_BYTES_MAX as f64 / length as f64) as usize
}
