//! The file of a field's values in one sub-domain: written once, read chunk by chunk.
//!
//! Chunk `i` has the values of chunk `i` of vertices or tetrahedra of the sub-domain, each component apart and cut into pieces that the
//! database holds. A field at vertices also has its range over each chunk of tetrahedra, by which questions skip chunks.

use std::sync::Arc;

use lru::LruCache;
use tetdb_schema::chunk::{
    ChunkAddress, ChunkRecord, FieldSummary, FieldWord, PackedChunk, Packer,
};
use tetdb_schema::field::{FieldPart, FieldPlace, FieldRange, FieldRow};
use tetdb_schema::row::guarded_bytes;

use super::batch::{Batch, cache_bytes};
use super::form::Loader;
use super::{SealedError, Subdomain};
use tetdb_base::storage::{DiskPath, StoreFile, check_cancelled};

/// Bytes of decoded columns while a file is written.
const COLUMNS_BYTES: usize = 4 << 20;

/// Numbers of the first value and of values in each chunk that a field lines up with.
fn chunks_of(place: FieldPlace, mesh: &Subdomain) -> Vec<[u32; 2]> {
    match place {
        FieldPlace::Tets => mesh.tet_summaries().iter().map(|s| [s.first, s.count]).collect(),
        FieldPlace::Vertices => {
            mesh.vertex_summaries().iter().map(|s| [s.first, s.count]).collect()
        }
    }
}

/// Writes the values of a field in one sub-domain.
pub struct FieldWriter {
    path: DiskPath,
    file: StoreFile,
    batch: Batch,
    field: FieldRow,
    chunks: Vec<[u32; 2]>,
    packer: Packer<FieldWord>,
    summaries: Vec<FieldSummary<false>>,
    part: FieldPart,
}

impl FieldWriter {
    /// Starts the file at `path`, which must not exist, for the sub-domain `mesh`; `serial` is the number in its name.
    ///
    /// Errors: the disk; more numbers than a file can count.
    pub fn create(
        path: DiskPath,
        field: &FieldRow,
        mesh: &Subdomain,
        serial: u32,
        memory_bytes: usize,
    ) -> Result<Self, SealedError> {
        let (rank, generation) = (mesh.row().rank, mesh.row().generation);
        let values = match field.place {
            FieldPlace::Tets => mesh.row().tets,
            FieldPlace::Vertices => mesh.row().vertices,
        };
        let io = |e| SealedError::io(path.path(), e);
        if values * u64::from(field.components) > u64::from(u32::MAX - 65_536) {
            let what = "one sub-domain has more numbers of a field than 32 bits can count";
            return Err(io(std::io::Error::other(what)));
        }
        let part = FieldPart {
            field: field.id,
            rank,
            generation,
            serial,
            values,
            pieces: 0,
            summaries: [0; 2],
            digest: 0,
            ranges: vec![FieldRange::EMPTY; field.components as usize],
            bytes: 0,
        };
        Ok(Self {
            file: StoreFile::create_unsynced(&path, cache_bytes(memory_bytes))?,
            batch: Batch::new(memory_bytes),
            packer: Packer::new(rank, serial).map_err(io)?,
            field: field.clone(),
            chunks: chunks_of(field.place, mesh),
            summaries: Vec::new(),
            part,
            path,
        })
    }

    /// Adds the values of the next chunk, value by value, as words of [`FieldNumber::pack`](tetdb_schema::field::FieldNumber::pack).
    ///
    /// Errors: the disk.
    pub fn push(&mut self, words: &[u64]) -> Result<(), SealedError> {
        check_cancelled();
        let n = self.field.components as usize;
        let [first, count] = self.chunks[self.summaries.len() / n];
        assert_eq!(
            words.len(),
            count as usize * n,
            "a chunk of a field has a value for each record"
        );
        for component in 0..n {
            let (piece, mut range) = (self.packer.chunks(), FieldRange::EMPTY);
            for &word in words.iter().skip(component).step_by(n) {
                range.add(self.field.number.unpack(word).to_f64());
                let cut = self.packer.push(FieldWord(word));
                let cut = cut.map_err(|e| SealedError::io(self.path.path(), e))?;
                self.put(cut)?;
            }
            while let Some(cut) =
                self.packer.cut().map_err(|e| SealedError::io(self.path.path(), e))?
            {
                self.put(Some(cut))?;
            }
            let pieces = self.packer.chunks() - piece;
            let FieldRange { low, high, nan } = range;
            let nan = nan as u32;
            self.summaries.push(FieldSummary { first, count, piece, pieces, nan, low, high });
            self.part.ranges[component].union(&range);
        }
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        // The checksum of a row, seeded with what came before.
        let sum = guarded_bytes(self.part.digest, &bytes);
        self.part.digest = u64::from_le_bytes(sum[..8].try_into().expect("eight bytes"));
        Ok(())
    }

    fn put<R>(&mut self, cut: Option<PackedChunk<R>>) -> Result<(), SealedError> {
        match cut {
            Some(cut) => self.batch.push(&mut self.file, cut.address.key(), cut.value),
            None => Ok(()),
        }
    }

    fn put_summaries<R: ChunkRecord>(&mut self, summaries: &[R]) -> Result<u32, SealedError> {
        let path = self.path.clone();
        let io = |e| SealedError::io(path.path(), e);
        let mut packer = Packer::new(self.part.rank, self.part.serial).map_err(io)?;
        for &summary in summaries {
            let cut = packer.push(summary).map_err(io)?;
            self.put(cut)?;
        }
        while let Some(cut) = packer.cut().map_err(io)? {
            self.put(Some(cut))?;
        }
        Ok(packer.chunks())
    }

    /// Ends the file, which then has a value for each record of `mesh`. Errors: the disk; damage of the mesh.
    pub fn finish(mut self, mesh: &mut Subdomain) -> Result<FieldPart, SealedError> {
        let n = self.field.components as usize;
        assert_eq!(self.summaries.len(), self.chunks.len() * n, "all chunks were written");
        self.part.pieces = self.packer.chunks();
        let summaries = std::mem::take(&mut self.summaries);
        self.part.summaries[0] = self.put_summaries(&summaries)?;
        if self.field.place == FieldPlace::Vertices {
            self.batch.flush(&mut self.file)?;
            let part = self.part.clone();
            let mut own =
                FieldFile::new(self.file, self.field.clone(), part, summaries, Vec::new());
            let over_tets = own.over_tets(mesh)?;
            self.file = own.file;
            self.part.summaries[1] = self.put_summaries(&over_tets)?;
        }
        self.batch.flush(&mut self.file)?;
        self.file.compact()?;
        self.part.bytes = self.path.bytes()?;
        Ok(self.part)
    }
}

/// A chunk of one component.
pub type FieldColumn = Arc<[u64]>;

/// The values of a field in one sub-domain, open for reading.
pub struct FieldFile {
    file: StoreFile,
    field: FieldRow,
    part: FieldPart,
    summaries: Vec<FieldSummary<false>>,
    over_tets: Vec<FieldSummary<true>>,
    columns: LruCache<(u32, u32), FieldColumn>,
    columns_bytes: usize,
    columns_bytes_max: usize,
    /// The last column used of each component: its chunk, first value and numbers.
    last: Vec<(u32, u32, FieldColumn)>,
}

impl FieldFile {
    fn new(
        file: StoreFile,
        field: FieldRow,
        part: FieldPart,
        summaries: Vec<FieldSummary<false>>,
        over_tets: Vec<FieldSummary<true>>,
    ) -> Self {
        let last = vec![(0, 0, FieldColumn::from([])); field.components as usize];
        let columns = LruCache::unbounded();
        let columns_bytes_max = COLUMNS_BYTES;
        Self {
            file,
            field,
            part,
            summaries,
            over_tets,
            columns,
            columns_bytes: 0,
            columns_bytes_max,
            last,
        }
    }

    /// Opens the values of `field` in the sub-domain `mesh` with `memory_bytes` for redb and decoded columns.
    ///
    /// Errors: damage; values of another generation of the mesh.
    pub fn open(
        path: &DiskPath,
        (field, part): (FieldRow, FieldPart),
        mesh: &Subdomain,
        memory_bytes: usize,
    ) -> Result<Self, SealedError> {
        let damaged = |what: &str| {
            SealedError::content(path.path(), part.rank, format!("field {}: {what}", field.name))
        };
        if part.generation != mesh.row().generation {
            return Err(damaged("its values belong to another generation of the mesh"));
        }
        if !path.is_file() {
            return Err(damaged("its file is missing"));
        }
        let file = StoreFile::open_repaired(path, memory_bytes / 2, false)?;
        let mut open = Self::new(file, field.clone(), part.clone(), Vec::new(), Vec::new());
        open.columns_bytes_max = memory_bytes / 2;
        open.summaries = open.blocks(part.summaries[0])?;
        open.over_tets = open.blocks(part.summaries[1])?;
        let n = field.components as usize;
        let expected = chunks_of(field.place, mesh);
        let found = open.summaries.chunks(n).map(|of| of.first().map(|s| [s.first, s.count]));
        let counts = match field.place {
            FieldPlace::Vertices => mesh.tet_summaries().len() * n,
            FieldPlace::Tets => 0,
        };
        let fits = open.summaries.len() == expected.len() * n && open.over_tets.len() == counts;
        if !fits || !found.eq(expected.into_iter().map(Some)) {
            return Err(damaged("its chunks are not those of the mesh"));
        }
        Ok(open)
    }

    /// The field.
    pub fn field(&self) -> &FieldRow {
        &self.field
    }

    /// The row of the values.
    pub fn part(&self) -> &FieldPart {
        &self.part
    }

    /// Number of chunks.
    pub fn n_chunks(&self) -> u32 {
        (self.summaries.len() / self.field.components as usize) as u32
    }

    /// Summary of a component in a chunk.
    pub fn summary(&self, chunk: u32, component: u32) -> &FieldSummary<false> {
        &self.summaries[(chunk * self.field.components + component) as usize]
    }

    /// Least and greatest value of a component over the tetrahedra of a chunk, or their vertices; and whether some is not a number.
    pub fn range_over(&self, tet_chunk: u32, component: u32) -> ([f64; 2], bool) {
        let i = (tet_chunk * self.field.components + component) as usize;
        match self.field.place {
            FieldPlace::Tets => {
                let s = &self.summaries[i];
                ([s.low, s.high], s.nan > 0)
            }
            FieldPlace::Vertices => {
                let s = &self.over_tets[i];
                ([s.low, s.high], s.nan > 0)
            }
        }
    }

    /// All numbers of a component in a chunk, as words. Errors: damage.
    pub fn column(&mut self, chunk: u32, component: u32) -> Result<FieldColumn, SealedError> {
        if let Some(column) = self.columns.get(&(chunk, component)) {
            return Ok(Arc::clone(column));
        }
        let summary = *self.summary(chunk, component);
        let mut loader =
            Loader::<FieldWord>::chunks().map_err(|e| SealedError::io(self.file.path(), e))?;
        let (mut words, mut piece) = (Vec::with_capacity(summary.count as usize), Vec::new());
        for number in summary.piece..summary.piece.saturating_add(summary.pieces) {
            let address = self.address::<FieldWord>(number);
            let loaded = loader.load(&mut self.file, address, &mut piece);
            loaded.map_err(|e| self.name(e, chunk))?;
            words.extend(piece.iter().map(|word| word.0));
        }
        if words.len() != summary.count as usize {
            let what = format!("it holds {} numbers, not {}", words.len(), summary.count);
            return Err(self.damaged(chunk, &what));
        }
        let column = FieldColumn::from(words);
        self.columns_bytes += column.len() * 8;
        self.columns.put((chunk, component), Arc::clone(&column));
        while self.columns_bytes > self.columns_bytes_max && self.columns.len() > 1 {
            if let Some((_, old)) = self.columns.pop_lru() {
                self.columns_bytes -= old.len() * 8;
            }
        }
        Ok(column)
    }

    /// All values of a chunk, value by value, as words. Errors: damage.
    pub fn chunk(&mut self, chunk: u32) -> Result<Vec<u64>, SealedError> {
        let n = self.field.components;
        let columns = (0..n).map(|component| self.column(chunk, component));
        let columns = columns.collect::<Result<Vec<_>, _>>()?;
        let rows = 0..columns[0].len();
        Ok(rows.flat_map(|row| columns.iter().map(move |column| column[row])).collect())
    }

    /// One number of a value, by the number of its vertex or tetrahedron. Errors: damage; no such value.
    pub fn word(&mut self, value: u32, component: u32) -> Result<u64, SealedError> {
        let (_, first, column) = &self.last[component as usize];
        if let Some(&word) = value.checked_sub(*first).and_then(|at| column.get(at as usize)) {
            return Ok(word);
        }
        let n = self.field.components as usize;
        let (mut low, mut high) = (0, self.summaries.len() / n);
        while low + 1 < high {
            let middle = usize::midpoint(low, high);
            match self.summaries[middle * n].first <= value {
                true => low = middle,
                false => high = middle,
            }
        }
        let column = self.column(low as u32, component)?;
        let first = self.summaries[low * n].first;
        let word = column.get((value - first) as usize).copied();
        self.last[component as usize] = (low as u32, first, column);
        word.ok_or_else(|| self.damaged(low as u32, &format!("there is no value {value}")))
    }

    /// Reads and compares everything. Errors: damage, named by chunk.
    pub fn check(&mut self) -> Result<(), SealedError> {
        let mut ranges = vec![FieldRange::EMPTY; self.field.components as usize];
        for chunk in 0..self.n_chunks() {
            check_cancelled();
            for component in 0..self.field.components {
                let column = self.column(chunk, component)?;
                let mut range = FieldRange::EMPTY;
                column.iter().for_each(|&word| range.add(self.field.number.unpack(word).to_f64()));
                let s = self.summary(chunk, component);
                if (range.low, range.high, range.nan) != (s.low, s.high, u64::from(s.nan)) {
                    return Err(self.damaged(chunk, "its summary is another's"));
                }
                ranges[component as usize].union(&range);
            }
        }
        match ranges == self.part.ranges {
            true => Ok(self.file.check()?),
            false => Err(self.damaged(0, "its row gives another range")),
        }
    }

    /// The range of each component over the vertices of each chunk of tetrahedra.
    fn over_tets(&mut self, mesh: &mut Subdomain) -> Result<Vec<FieldSummary<true>>, SealedError> {
        let mut all = Vec::new();
        for chunk in 0..mesh.tet_summaries().len() as u32 {
            check_cancelled();
            let tets = mesh.tet_chunk(chunk)?;
            let mut vertices: Vec<u32> = tets.records.iter().flat_map(|tet| tet.nodes).collect();
            vertices.sort_unstable();
            vertices.dedup();
            for component in 0..self.field.components {
                let mut range = FieldRange::EMPTY;
                for &v in &vertices {
                    let word = self.word(v, component)?;
                    range.add(self.field.number.unpack(word).to_f64());
                }
                let FieldRange { low, high, nan } = range;
                let (first, count) = (tets.first, tets.records.len() as u32);
                let nan = nan as u32;
                all.push(FieldSummary { first, count, piece: 0, pieces: 0, nan, low, high });
            }
        }
        Ok(all)
    }

    fn address<R: ChunkRecord>(&self, chunk: u32) -> ChunkAddress {
        let FieldPart { rank: subdomain, serial: generation, .. } = self.part;
        ChunkAddress { kind: R::KIND, subdomain, generation, chunk }
    }

    fn blocks<R: ChunkRecord>(&mut self, n: u32) -> Result<Vec<R>, SealedError> {
        let mut loader = Loader::chunks().map_err(|e| SealedError::io(self.file.path(), e))?;
        let (mut all, mut block) = (Vec::new(), Vec::new());
        for chunk in 0..n {
            let address = self.address::<R>(chunk);
            let loaded = loader.load(&mut self.file, address, &mut block);
            loaded.map_err(|e| self.name(e, chunk))?;
            all.append(&mut block);
        }
        Ok(all)
    }

    fn damaged(&self, chunk: u32, what: &str) -> SealedError {
        let what = format!("field {}, chunk {chunk}: {what}", self.field.name);
        SealedError::content(self.file.path(), self.part.rank, what)
    }

    /// Adds the name of the field and the chunk to damage.
    fn name(&self, error: SealedError, chunk: u32) -> SealedError {
        match error {
            SealedError::Chunk { source, .. } => self.damaged(chunk, &source.reason.to_string()),
            SealedError::Content { what, .. } => self.damaged(chunk, &what),
            other => other,
        }
    }
}
