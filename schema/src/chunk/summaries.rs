//! Summaries: what a reader wants to know of a chunk before it decodes it.

use super::columns::{Columns, Malformed, Reader};
use super::{ChunkKind, ChunkRecord};

/// Of a chunk of tetrahedra; 128 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TetSummary {
    /// Box of its vertices: low corner, high corner.
    pub bounds: [[f64; 3]; 2],
    /// Sum of the volumes in order.
    pub volume: f64,
    /// Least and greatest quality q.
    pub quality: [f32; 2],
    /// Least and greatest region.
    pub regions: [u32; 2],
    /// Least and greatest vertex number.
    pub vertices: [u32; 2],
    /// Number of the first record.
    pub first: u32,
    /// How many records there are.
    pub count: u32,
    /// Faces without a partner in the chunk: shared with other chunks or on the boundary.
    pub open_faces: u32,
    /// Bytes of the stored value.
    pub bytes: u32,
    /// Not less than the length of any edge; 0 where that is not known.
    pub edge_max: f32,
}

/// Of a chunk of vertices; 64 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexSummary {
    /// Low and high corner of the box around its vertices.
    pub bounds: [[f64; 3]; 2],
    /// Number of the first record.
    pub first: u32,
    /// How many records there are.
    pub count: u32,
    /// Which cells of the box, divided in four along each axis, have vertices: bit x + 4 y + 16 z. 0: not known.
    pub cells: u64,
}

/// Of a chunk of facets or interface faces; 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RangeSummary<const INTERFACE: bool> {
    /// Number of the first record.
    pub first: u32,
    /// How many records there are.
    pub count: u32,
}

/// Takes fixed-width numbers from the front.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self.0.split_at(N);
        self.0 = rest;
        head.try_into().expect("N bytes were split off")
    }
    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }
    fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }
    fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }
    /// Errors: a box that holds nothing.
    fn bounds(&mut self) -> Result<[[f64; 3]; 2], Malformed> {
        let bounds = [(); 2].map(|()| [(); 3].map(|()| self.f64()));
        match is_box(&bounds) {
            true => Ok(bounds),
            false => Err(Malformed("a box is inverted or has no finite corners")),
        }
    }
    /// The rest is reserved and zero.
    fn finish(self) -> Result<(), Malformed> {
        if self.0.iter().all(|&b| b == 0) {
            Ok(())
        } else {
            Err(Malformed("a reserved byte is not zero"))
        }
    }
}

/// Whether a box has finite corners, the low one first.
pub fn is_box([low, high]: &[[f64; 3]; 2]) -> bool {
    let ends = low.iter().zip(high);
    ends.into_iter().all(|(low, high)| low.is_finite() && high.is_finite() && low <= high)
}

fn pad(columns: &mut Columns, start: usize, width: usize) {
    columns.bytes.resize(start + width, 0);
}

fn put_bounds(columns: &mut Columns, bounds: &[[f64; 3]; 2]) {
    for c in bounds.as_flattened() {
        columns.raw(&c.to_le_bytes());
    }
}

impl TetSummary {
    /// Bytes of a summary.
    pub const BYTES: usize = 128;

    /// Whether some chunk can have it.
    fn check(&self) -> Result<(), Malformed> {
        let [least, most] = self.quality;
        let is_sound = least <= most
            && self.regions[0] <= self.regions[1]
            && self.vertices[0] <= self.vertices[1]
            && self.edge_max >= 0.0
            && !self.volume.is_nan()
            && self.count > 0;
        match is_sound {
            true => Ok(()),
            false => Err(Malformed("a summary that no chunk can have")),
        }
    }
}

impl ChunkRecord for TetSummary {
    const KIND: ChunkKind = ChunkKind::TetSummaries;
    const COUNT_MAX: usize = 2048;
    const RAW_BYTES_MAX: usize = Self::BYTES;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        for s in records {
            let start = columns.bytes.len();
            put_bounds(columns, &s.bounds);
            columns.raw(&s.volume.to_le_bytes());
            for q in s.quality {
                columns.raw(&q.to_le_bytes());
            }
            let [[r0, r1], [v0, v1]] = [s.regions, s.vertices];
            for word in [r0, r1, v0, v1, s.first, s.count, s.open_faces, s.bytes] {
                columns.raw(&word.to_le_bytes());
            }
            columns.raw(&s.edge_max.to_le_bytes());
            pad(columns, start, Self::BYTES);
        }
    }

    fn decode(
        columns: &mut Reader<'_>,
        _first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed> {
        for _ in 0..count {
            let mut f = Fields(columns.raw(Self::BYTES)?);
            let summary = Self {
                bounds: f.bounds()?,
                volume: f.f64(),
                quality: [f.f32(), f.f32()],
                regions: [f.u32(), f.u32()],
                vertices: [f.u32(), f.u32()],
                first: f.u32(),
                count: f.u32(),
                open_faces: f.u32(),
                bytes: f.u32(),
                edge_max: f.f32(),
            };
            f.finish()?;
            summary.check()?;
            records.push(summary);
        }
        Ok(())
    }
}

impl VertexSummary {
    /// Bytes of a summary.
    pub const BYTES: usize = 64;

    /// The bits of the cells of a box that some points in it are in.
    pub fn cells_of(bounds: &[[f64; 3]; 2], points: impl Iterator<Item = [f64; 3]>) -> u64 {
        let cell = |axis: usize, x: f64| {
            let [low, high] = [bounds[0][axis], bounds[1][axis]];
            let share = (x - low) / (high - low);
            // A box without extent gives no number, which becomes 0.
            (share * 4.0).clamp(0.0, 3.0) as u32
        };
        points.fold(0, |cells, p| {
            cells | 1 << (cell(0, p[0]) + 4 * cell(1, p[1]) + 16 * cell(2, p[2]))
        })
    }

    /// Boxes that hold all its vertices: of the cells that have some, a little larger than they are; or of the whole.
    pub fn cells(&self) -> impl Iterator<Item = [[f64; 3]; 2]> + '_ {
        /// More than what rounding moves a border by, in extents of the box.
        const SLACK: f64 = 1e-9;
        let whole = (self.cells == 0).then_some(self.bounds);
        let bits = (0..64u32).filter(|i| self.cells >> i & 1 == 1);
        let [low, high] = self.bounds;
        whole.into_iter().chain(bits.map(move |i| {
            let place = [i & 3, i >> 2 & 3, i >> 4].map(f64::from);
            [0.0, 1.0].map(|end| {
                std::array::from_fn(|axis| {
                    let share = (place[axis] + end) / 4.0 + (2.0 * end - 1.0) * SLACK;
                    let x = low[axis] + share * (high[axis] - low[axis]);
                    x.clamp(low[axis], high[axis])
                })
            })
        }))
    }
}

impl ChunkRecord for VertexSummary {
    const KIND: ChunkKind = ChunkKind::VertexSummaries;
    const COUNT_MAX: usize = 4096;
    const RAW_BYTES_MAX: usize = Self::BYTES;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        for s in records {
            let start = columns.bytes.len();
            put_bounds(columns, &s.bounds);
            columns.raw(&s.first.to_le_bytes());
            columns.raw(&s.count.to_le_bytes());
            columns.raw(&s.cells.to_le_bytes());
            debug_assert_eq!(columns.bytes.len(), start + Self::BYTES);
        }
    }

    fn decode(
        columns: &mut Reader<'_>,
        _first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed> {
        for _ in 0..count {
            let mut f = Fields(columns.raw(Self::BYTES)?);
            records.push(Self {
                bounds: f.bounds()?,
                first: f.u32(),
                count: f.u32(),
                cells: u64::from_le_bytes(f.take()),
            });
            f.finish()?;
        }
        Ok(())
    }
}

impl<const INTERFACE: bool> RangeSummary<INTERFACE> {
    /// Bytes of a summary.
    pub const BYTES: usize = 16;
}

impl<const INTERFACE: bool> ChunkRecord for RangeSummary<INTERFACE> {
    const KIND: ChunkKind =
        if INTERFACE { ChunkKind::InterfaceSummaries } else { ChunkKind::FacetSummaries };
    const COUNT_MAX: usize = 16_384;
    const RAW_BYTES_MAX: usize = Self::BYTES;

    fn encode(records: &[Self], _first: u32, columns: &mut Columns) {
        for s in records {
            let start = columns.bytes.len();
            columns.raw(&s.first.to_le_bytes());
            columns.raw(&s.count.to_le_bytes());
            pad(columns, start, Self::BYTES);
        }
    }

    fn decode(
        columns: &mut Reader<'_>,
        _first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed> {
        for _ in 0..count {
            let mut f = Fields(columns.raw(Self::BYTES)?);
            records.push(Self { first: f.u32(), count: f.u32() });
            f.finish()?;
        }
        Ok(())
    }
}
