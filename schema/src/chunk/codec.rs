//! One chunk: columns, zstd, head, checksum.

use std::marker::PhantomData;

use xxhash_rust::xxh3::xxh3_64;
use zstd::bulk::{Compressor, Decompressor};

use super::columns::{ColumnReader, ColumnWriter};
use super::{CHUNK_BYTES_MAX, ChunkAddress, ChunkDamage, ChunkError, ChunkRecord, HEAD_BYTES};
use crate::page::FORMAT_VERSION;

const MAGIC: u32 = u32::from_le_bytes(*b"TETC");
/// Level 3 saves 0.3 % more and takes 1.4 times as long.
const LEVEL: i32 = 1;
/// Bytes that dictionaries and lengths of a payload may take in addition to its records.
const RAW_SLACK: usize = 32 * 1024;

/// Encodes chunks of one kind of record.
pub struct Encoder<R> {
    columns: ColumnWriter,
    value: Vec<u8>,
    zstd: Compressor<'static>,
    record: PhantomData<R>,
}

impl<R: ChunkRecord> Encoder<R> {
    /// An encoder with buffers of its own.
    ///
    /// Errors: zstd cannot allocate its context.
    pub fn new() -> std::io::Result<Self> {
        Ok(Self {
            columns: ColumnWriter::default(),
            value: Vec::new(),
            zstd: Compressor::new(LEVEL)?,
            record: PhantomData,
        })
    }

    /// The value to store for `records`, the first of which has number `first`.
    ///
    /// A value longer than [`CHUNK_BYTES_MAX`] cannot be stored: the caller tries fewer records.
    /// Errors: those of zstd, which has none for a buffer of sufficient length.
    pub fn encode(
        &mut self,
        address: ChunkAddress,
        first: u32,
        records: &[R],
    ) -> std::io::Result<&[u8]> {
        self.columns.bytes.clear();
        R::encode(records, first, &mut self.columns);
        let raw = &self.columns.bytes;
        self.value.resize(HEAD_BYTES + zstd::zstd_safe::compress_bound(raw.len()), 0);
        let packed = self.zstd.compress_to_buffer(raw, &mut self.value[HEAD_BYTES..])?;
        self.value.truncate(HEAD_BYTES + packed);
        write_head(
            &mut self.value,
            address,
            [first, records.len() as u32, packed as u32, raw.len() as u32],
        );
        Ok(&self.value)
    }

    /// The value written by the last call of [`Encoder::encode`].
    pub fn last_value(&self) -> &[u8] {
        &self.value
    }
}

fn write_head(value: &mut [u8], address: ChunkAddress, numbers: [u32; 4]) {
    let [first, count, packed, raw] = numbers;
    let version_kind = u32::from(FORMAT_VERSION) | (address.kind as u32) << 16;
    let words = [
        MAGIC,
        version_kind,
        address.subdomain,
        address.chunk,
        address.generation,
        first,
        count,
        packed,
        raw,
        0,
    ];
    for (bytes, word) in value[8..HEAD_BYTES].chunks_exact_mut(4).zip(words) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    seal(value);
}

/// Writes the checksum.
fn seal(value: &mut [u8]) {
    let sum = xxh3_64(&value[8..]);
    value[..8].copy_from_slice(&sum.to_le_bytes());
}

/// Changes the number of the chunk in the head of a value.
pub(super) fn renumber(value: &mut [u8], chunk: u32) {
    value[8 + 4 * 3..][..4].copy_from_slice(&chunk.to_le_bytes());
    seal(value);
}

/// Decodes chunks of one kind of record.
pub struct Decoder<R> {
    raw: Vec<u8>,
    zstd: Decompressor<'static>,
    record: PhantomData<R>,
}

impl<R: ChunkRecord> Decoder<R> {
    /// A decoder with a buffer of its own.
    ///
    /// Errors: zstd cannot allocate its context.
    pub fn new() -> std::io::Result<Self> {
        Ok(Self { raw: Vec::new(), zstd: Decompressor::new()?, record: PhantomData })
    }

    /// Replaces `records` by those of a stored value; returns the number of the first.
    ///
    /// Errors: any difference in length, checksum or head, and payloads no encoder writes. Then
    /// `records` holds nothing of use.
    pub fn decode(
        &mut self,
        value: &[u8],
        address: ChunkAddress,
        records: &mut Vec<R>,
    ) -> Result<u32, ChunkError> {
        records.clear();
        self.decode_inner(value, address, records).map_err(|reason| ChunkError { address, reason })
    }

    fn decode_inner(
        &mut self,
        value: &[u8],
        address: ChunkAddress,
        records: &mut Vec<R>,
    ) -> Result<u32, ChunkDamage> {
        let [first, count, raw] = read_head::<R>(value, address)?;
        let count = count as usize;
        self.raw.resize(raw as usize, 0);
        let unpacked = self.zstd.decompress_to_buffer(&value[HEAD_BYTES..], &mut self.raw[..]);
        if unpacked.ok() != Some(raw as usize) {
            return Err(ChunkDamage::Compression);
        }
        let mut columns = ColumnReader::new(&self.raw);
        R::decode(&mut columns, first, count, records)?;
        columns.finish()?;
        Ok(first)
    }
}

/// Checks all of a head; returns first, count and raw bytes.
fn read_head<R: ChunkRecord>(value: &[u8], address: ChunkAddress) -> Result<[u32; 3], ChunkDamage> {
    if !(HEAD_BYTES..=CHUNK_BYTES_MAX).contains(&value.len()) {
        return Err(ChunkDamage::Length { found: value.len() });
    }
    let word = |i: usize| {
        let bytes = value[8 + 4 * i..][..4].try_into();
        u32::from_le_bytes(bytes.expect("four bytes"))
    };
    let found = u64::from_le_bytes(value[..8].try_into().expect("eight bytes"));
    let expected = xxh3_64(&value[8..]);
    if expected != found {
        return Err(ChunkDamage::Checksum { expected, found });
    }
    let version_kind = u32::from(FORMAT_VERSION) | (address.kind as u32) << 16;
    let packed = (value.len() - HEAD_BYTES) as u32;
    for (field, expected, found) in [
        ("magic", MAGIC, word(0)),
        ("version and kind", version_kind, word(1)),
        ("sub-domain", address.subdomain, word(2)),
        ("chunk", address.chunk, word(3)),
        ("generation", address.generation, word(4)),
        ("payload bytes", packed, word(7)),
        ("reserved bytes", 0, word(9)),
    ] {
        if expected != found {
            return Err(ChunkDamage::Head { field, expected, found });
        }
    }
    let [first, count, raw] = [word(5), word(6), word(8)];
    let raw_max = count as usize * R::RAW_BYTES_MAX + RAW_SLACK;
    for (field, most, found) in [
        ("a count of", R::COUNT_MAX as u32, count),
        ("raw bytes", raw_max as u32, raw),
        ("a first record of", u32::MAX - R::COUNT_MAX as u32, first),
    ] {
        if found > most {
            return Err(ChunkDamage::Head { field, expected: most, found });
        }
    }
    Ok([first, count, raw])
}
