//! Vertices of a sealed sub-domain by number, from a bounded set of decoded chunks.

use lru::LruCache;
use tetdb_schema::chunk::{ChunkAddress, ChunkKind};
use tetdb_schema::digest::vertex_mix;
use tetdb_schema::ids::{Owner, VertexId};
use tetdb_schema::record::SealedVertex;

use super::Form;
use super::SealedError;
use super::form::Loader;
use tetdb_base::geom::Point;
use tetdb_base::storage::StoreFile;

/// Chunks kept with any budget: a tetrahedron needs four at once.
const CHUNKS_LEAST: usize = 4;
const NOT_RESIDENT: u32 = u32::MAX;

/// A decoded vertex.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// Position.
    pub point: Point,
    /// Mix of the position in the digest.
    pub mix: u64,
    /// Lasting id as a number.
    pub id: u64,
    /// One of [`tag`](tetdb_schema::record::tag).
    pub tag: u32,
    /// Wanted edge length; 0 where there is none.
    pub h: f32,
}

impl Corner {
    /// Number of the vertex in the input; `None` for a vertex that is not the input's.
    #[inline]
    pub fn input_index(&self) -> Option<u32> {
        input_index(self.id)
    }
}

/// The number in the input of the vertex with this lasting id; `None` for a vertex that is not the input's.
#[inline]
pub fn input_index(id: u64) -> Option<u32> {
    let id = VertexId::from_number(id)?;
    (id.owner == Owner::Surface).then_some(id.index)
}

/// All vertices of a sub-domain, for several threads.
pub(super) struct AllVertices<'a> {
    firsts: &'a [u32],
    chunks: Vec<&'a [Corner]>,
}

impl AllVertices<'_> {
    /// A reader for one thread.
    pub fn reader(&self) -> VertexReader<'_> {
        VertexReader { all: self, last: [(0, &[]); 2] }
    }
}

/// Finds vertices by number.
pub(super) struct VertexReader<'a> {
    all: &'a AllVertices<'a>,
    /// The last two chunks used: first vertex and vertices.
    last: [(u32, &'a [Corner]); 2],
}

impl VertexReader<'_> {
    /// The corners of a tetrahedron; `None` if there is no such vertex.
    #[inline(always)]
    pub fn corners(&mut self, [a, b, c, d]: [u32; 4]) -> Option<[Corner; 4]> {
        Some([self.corner(a)?, self.corner(b)?, self.corner(c)?, self.corner(d)?])
    }

    #[inline(always)]
    fn corner(&mut self, v: u32) -> Option<Corner> {
        for (first, chunk) in self.last {
            if let Some(&corner) = chunk.get(v.wrapping_sub(first) as usize) {
                return Some(corner);
            }
        }
        let at = self.all.firsts.partition_point(|&first| first <= v).checked_sub(1)?;
        self.last = [(self.all.firsts[at], self.all.chunks[at]), self.last[0]];
        self.all.chunks[at].get((v - self.all.firsts[at]) as usize).copied()
    }
}

/// The vertices of a resident chunk.
#[derive(Clone, Copy)]
struct ResidentChunk {
    chunk: u32,
    /// First vertex, and one after the last.
    first: u32,
    end: u32,
    /// Place in `resident`.
    place: u32,
}

impl ResidentChunk {
    const EMPTY: Self = Self { chunk: NOT_RESIDENT, first: 0, end: 0, place: 0 };
}

/// Decoded vertex chunks within a budget.
///
/// Using a chunk other than the last two sets its reference bit. The `lru` crate orders the chunks when one is missed, and a chunk
/// whose bit is set is kept a second time. Shape: `firsts[i]` = number of the first vertex of chunk `i`.
pub struct VertexCache {
    subdomain: u32,
    generation: u32,
    firsts: Vec<u32>,
    n_vertices: u32,
    /// Chunk to place in `resident`, or [`NOT_RESIDENT`].
    places: Vec<u32>,
    resident: Vec<Vec<Corner>>,
    vacant: Vec<u32>,
    referenced: Vec<bool>,
    order: LruCache<u32, ()>,
    loader: Loader<SealedVertex>,
    scratch: Vec<SealedVertex>,
    /// The last two chunks used: corners of close tetrahedra are in one or two.
    last: [ResidentChunk; 2],
    bytes: usize,
    bytes_max: usize,
    /// By chunk, whether it was ever read.
    is_read: Vec<bool>,
}

impl VertexCache {
    /// A cache for a sub-domain of this form whose vertex chunks start at `firsts`.
    ///
    /// Errors: the decoder cannot be created.
    pub fn new(
        form: Form,
        (subdomain, generation): (u32, u32),
        firsts: Vec<u32>,
        n_vertices: u32,
        bytes_max: usize,
    ) -> std::io::Result<Self> {
        Ok(Self {
            subdomain,
            generation,
            places: vec![NOT_RESIDENT; firsts.len()],
            referenced: vec![false; firsts.len()],
            is_read: vec![false; firsts.len()],
            firsts,
            n_vertices,
            resident: Vec::new(),
            vacant: Vec::new(),
            order: LruCache::unbounded(),
            loader: Loader::new(form, (subdomain, generation))?,
            scratch: Vec::new(),
            last: [ResidentChunk::EMPTY; 2],
            bytes: 0,
            bytes_max,
        })
    }

    /// Chunks read so far.
    pub fn chunks_read(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.is_read).filter(|(_, is_read)| **is_read).map(|(chunk, _)| chunk)
    }

    /// The chunk vertex `v` is in; of a number no vertex has, the last one.
    pub fn chunk_of(&self, v: u32) -> usize {
        self.firsts.partition_point(|&f| f <= v).saturating_sub(1)
    }

    /// Vertex `v`, read from `file` when its chunk is not resident.
    ///
    /// Errors: a damaged chunk; a number no vertex has.
    #[inline(always)]
    pub fn corner(&mut self, file: &mut StoreFile, v: u32) -> Result<Corner, SealedError> {
        let [a, b] = &self.last;
        let within = |w: &ResidentChunk| w.first <= v && v < w.end;
        let w = if within(a) {
            *a
        } else if within(b) {
            *b
        } else {
            self.turn_to(file, v)?
        };
        match self.resident[w.place as usize].get((v - w.first) as usize) {
            Some(&corner) => Ok(corner),
            None => Err(self.no_such_vertex(file, v)),
        }
    }

    /// Makes the chunk of `v` resident and the latest of the last two.
    #[inline(never)]
    fn turn_to(&mut self, file: &mut StoreFile, v: u32) -> Result<ResidentChunk, SealedError> {
        if v >= self.n_vertices {
            return Err(self.no_such_vertex(file, v));
        }
        let chunk = self.chunk_of(v);
        if self.places[chunk] == NOT_RESIDENT {
            self.load(file, chunk)?;
        }
        self.referenced[chunk] = true;
        let window = ResidentChunk {
            chunk: chunk as u32,
            first: self.firsts[chunk],
            end: self.firsts.get(chunk + 1).copied().unwrap_or(self.n_vertices),
            place: self.places[chunk],
        };
        self.last = [window, self.last[0]];
        Ok(window)
    }

    /// The corners of a tetrahedron or face.
    #[inline(always)]
    pub fn corners<const N: usize>(
        &mut self,
        file: &mut StoreFile,
        vertices: [u32; N],
    ) -> Result<[Corner; N], SealedError> {
        let mut corners = [Corner { point: Point::ZERO, mix: 0, id: 0, tag: 0, h: 0.0 }; N];
        for (corner, v) in corners.iter_mut().zip(vertices) {
            *corner = self.corner(file, v)?;
        }
        Ok(corners)
    }

    /// All vertices, if the budget has room for them.
    ///
    /// Errors: a damaged chunk.
    pub(super) fn all(
        &mut self,
        file: &mut StoreFile,
    ) -> Result<Option<AllVertices<'_>>, SealedError> {
        if self.n_vertices as usize * size_of::<Corner>() > self.bytes_max {
            return Ok(None);
        }
        for chunk in 0..self.firsts.len() {
            if self.places[chunk] == NOT_RESIDENT {
                self.load(file, chunk)?;
            }
        }
        let chunks = self.places.iter().map(|&place| &self.resident[place as usize][..]);
        Ok(Some(AllVertices { firsts: &self.firsts, chunks: chunks.collect() }))
    }

    #[cold]
    fn no_such_vertex(&self, file: &StoreFile, v: u32) -> SealedError {
        let what = format!("vertex {v} is named, there are {}", self.n_vertices);
        SealedError::content(file.path(), self.subdomain, what)
    }

    #[cold]
    fn load(&mut self, file: &mut StoreFile, chunk: usize) -> Result<(), SealedError> {
        let address = ChunkAddress {
            kind: ChunkKind::Vertices,
            subdomain: self.subdomain,
            generation: self.generation,
            chunk: chunk as u32,
        };
        let first = self.loader.load(file, address, &mut self.scratch)?;
        self.is_read[chunk] = true;
        if first != self.firsts[chunk] {
            let expected = self.firsts[chunk];
            let what = format!("vertex chunk {chunk} starts at {first}, expected {expected}");
            return Err(SealedError::content(file.path(), self.subdomain, what));
        }
        let needed = self.scratch.len() * size_of::<Corner>();
        while self.bytes + needed > self.bytes_max && self.order.len() >= CHUNKS_LEAST {
            self.evict();
        }
        let place = self.vacant.pop().unwrap_or_else(|| {
            self.resident.push(Vec::new());
            self.resident.len() as u32 - 1
        });
        self.resident[place as usize] = self
            .scratch
            .iter()
            .map(|v| Corner {
                point: Point::from_array(v.point),
                mix: vertex_mix(v.point),
                id: v.id,
                tag: v.tag,
                h: v.h,
            })
            .collect();
        self.bytes += needed;
        self.places[chunk] = place;
        self.order.put(chunk as u32, ());
        Ok(())
    }

    fn evict(&mut self) {
        while let Some((chunk, ())) = self.order.pop_lru() {
            if std::mem::take(&mut self.referenced[chunk as usize]) {
                self.order.put(chunk, ());
                continue;
            }
            // The chunk is read again when it is next needed.
            for window in &mut self.last {
                if window.chunk == chunk {
                    *window = ResidentChunk::EMPTY;
                }
            }
            let place = std::mem::replace(&mut self.places[chunk as usize], NOT_RESIDENT);
            let corners = std::mem::take(&mut self.resident[place as usize]);
            self.bytes -= corners.len() * size_of::<Corner>();
            self.vacant.push(place);
            return;
        }
    }
}
