//! A size field as bytes, for storing.
//!
//! | offset | bytes | content, little endian |
//! |---|---|---|
//! | 0 | 8 | `TETDBSZ2` |
//! | 8 | 24 | low corner of the cube, 3 × f64 |
//! | 32 | 8 | side of the cube, f64 |
//! | 40 | 8 | slope bound, f64 |
//! | 48 | 4 | cells of the octree, those with children too: C |
//! | 52 | 4 | leaves L |
//! | 56 | 4 | values V |
//! | 60 | 4 | zero |
//! | 64 | … | zstd frame of C + L + 4 V bytes |
//!
//! In the frame: for each cell, depth first and octants in order, 1 for a leaf and 0 for one with children; for each
//! leaf a byte whose bit `i` says that the value at corner `i` is new; the new values, f32. A value that is not new
//! equals that of the last leaf with this corner, if a table of [`REMEMBERED`] corners still has it. Neighbors have
//! corners in common, so that a leaf takes about 5 bytes instead of 37.

use std::fmt::Display;
use std::io::{Read, Write};

use super::SizingError;
use super::field::SizeField;
use super::seeds::OctreeFrame;
use super::tree::{DEPTH, LEAF, Leaf, Tree};
use tetdb_base::geom::{Point, mix};
use tetdb_base::storage::{FrozenSpillVec, ScratchSpace, SpillVecBuilder};

const MAGIC: &[u8; 8] = b"TETDBSZ2";
const HEADER_BYTES: usize = 64;
/// Corners remembered, a power of two: a megabyte.
const REMEMBERED: usize = 1 << 16;

/// The last value seen at some corners.
struct Memory {
    slots: Vec<([u32; 3], f32)>,
}

impl Memory {
    fn new() -> Self {
        // No corner of the lattice is there, and no size is zero.
        let nowhere = ([u32::MAX; 3], 0.0);
        Self { slots: vec![nowhere; REMEMBERED] }
    }

    fn slot(&mut self, corner: [u32; 3]) -> &mut ([u32; 3], f32) {
        let [x, y, z] = corner.map(u64::from);
        let n = mix(x | y << 21 | z << 42) as usize % REMEMBERED;
        &mut self.slots[n]
    }
}

impl SizeField {
    /// The field as bytes; equal fields give equal bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let n_cells = (self.tree.blocks.len() + self.values.len()) as u32;
        let mut n_values = 0;
        self.each_leaf(|_, news| n_values += news.len() as u32);
        let mut bytes = Vec::with_capacity(HEADER_BYTES);
        bytes.extend(MAGIC);
        let OctreeFrame { low, side } = self.frame;
        for x in [low.x, low.y, low.z, side, self.beta] {
            bytes.extend(x.to_le_bytes());
        }
        for n in [n_cells, self.values.len() as u32, n_values, 0] {
            bytes.extend(n.to_le_bytes());
        }
        // Three passes through the octree, so that only packed data is held.
        let packed = (|| {
            let mut frame = zstd::Encoder::new(bytes, 1)?;
            for (number, _) in self.tree.cells() {
                frame.write_all(&[u8::from(number.is_some())])?;
            }
            let mut done = Ok(());
            self.each_leaf(|new, _| {
                if done.is_ok() {
                    done = frame.write_all(&[new]);
                }
            });
            self.each_leaf(|_, news| {
                for value in news {
                    if done.is_ok() {
                        done = frame.write_all(&value.to_le_bytes());
                    }
                }
            });
            done?;
            frame.finish()
        })();
        packed.expect("memory is all it takes")
    }

    /// Calls `visit` with the byte of each leaf and its new values.
    fn each_leaf(&self, mut visit: impl FnMut(u8, &[f32])) {
        let mut memory = Memory::new();
        for (number, cell) in self.tree.cells() {
            let Some(number) = number else { continue };
            let (mut new, mut values, mut n) = (0, [0.0; 8], 0);
            let corners = self.values.get(number as usize);
            for (i, value) in corners.into_iter().enumerate() {
                let slot = memory.slot(cell.corner(i));
                let seen = (cell.corner(i), value);
                if *slot != seen {
                    *slot = seen;
                    new |= 1 << i;
                    values[n] = value;
                    n += 1;
                }
            }
            visit(new, &values[..n]);
        }
    }

    /// [`SizeField::from_bytes_in`] in memory.
    #[cfg(test)]
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SizingError> {
        Self::from_bytes_in(bytes, &ScratchSpace::boundless())
    }

    /// Reads the output of [`SizeField::to_bytes`] and checks all of it. Values go to a scratch file if their share of
    /// `scratch` is too small.
    ///
    /// # Errors
    /// [`SizingError::Damaged`] names the damage. A scratch file that fails unwinds.
    pub fn from_bytes_in(bytes: &[u8], scratch: &ScratchSpace) -> Result<Self, SizingError> {
        if bytes.len() < HEADER_BYTES {
            return Err(damaged("length", bytes.len(), "at least 64"));
        }
        if &bytes[..8] != MAGIC {
            return Err(damaged("magic", format!("{:x?}", &bytes[..8]), "TETDBSZ2"));
        }
        let number = |i: usize| f64::from_le_bytes(array(&bytes[8 + 8 * i..]));
        let count = |i: usize| u32::from_le_bytes(array(&bytes[48 + 4 * i..])) as usize;
        let low = Point::new(number(0), number(1), number(2));
        let (side, beta) = (number(3), number(4));
        if !low.is_finite() || !side.is_normal() || side < 0.0 {
            return Err(damaged("cube", format!("{low} {side}"), "finite, side above zero"));
        }
        if !(beta > 0.0 && beta.is_finite()) {
            return Err(damaged("slope", beta, "above zero"));
        }
        let [n_cells, n_leaves, n_values] = [0, 1, 2].map(count);
        let expected = n_cells + n_leaves + 4 * n_values;
        let mut body = Vec::new();
        // Grows with the data read, not with the number in a damaged header.
        let read = zstd::Decoder::with_buffer(&bytes[HEADER_BYTES..])
            .and_then(|frame| frame.take(expected as u64 + 1).read_to_end(&mut body));
        if read.is_err() || body.len() != expected {
            return Err(damaged("length of the octree", body.len(), expected));
        }
        let (cells, rest) = body.split_at(n_cells);
        let (news, values) = rest.split_at(n_leaves);
        let leaves = scratch.builder_within(Self::share_of(scratch.cap()));
        let (tree, values) = read_tree(cells, news, values, leaves)?;
        Ok(Self::from_parts(OctreeFrame { low, side }, beta, tree, values))
    }
}

/// The octree and the values at its leaves' corners.
fn read_tree(
    cells: &[u8],
    news: &[u8],
    values: &[u8],
    mut leaves: SpillVecBuilder<[f32; 8]>,
) -> Result<(Tree, FrozenSpillVec<[f32; 8]>), SizingError> {
    let mut values = values.chunks_exact(4).map(|b| f32::from_le_bytes(array(b)));
    let mut tree =
        Tree { root: LEAF, blocks: Vec::with_capacity(cells.len() - news.len().min(cells.len())) };
    let mut memory = Memory::new();
    // A cell, and the block and octant whose entry it is.
    let mut stack = vec![(Leaf::ROOT, None)];
    for &is_leaf in cells {
        let Some((cell, place)) = stack.pop() else {
            return Err(damaged("number of cells", cells.len(), "fewer"));
        };
        let entry =
            if is_leaf == 0 { tree.blocks.len() as u32 } else { LEAF | leaves.len() as u32 };
        match place {
            None => tree.root = entry,
            Some((block, octant)) => {
                let block: &mut [u32; 8] = &mut tree.blocks[block as usize];
                block[octant] = entry;
            }
        }
        if is_leaf == 0 {
            if cell.level == DEPTH {
                return Err(damaged("the octree's depth", DEPTH + 1, DEPTH));
            }
            tree.blocks.push([LEAF; 8]);
            stack.extend((0..8).rev().map(|i| (cell.child(i), Some((entry, i)))));
            continue;
        }
        let Some(&new) = news.get(leaves.len()) else {
            return Err(damaged("number of leaves", leaves.len() + 1, news.len()));
        };
        let mut corners = [0.0; 8];
        for (i, value) in corners.iter_mut().enumerate() {
            let corner = cell.corner(i);
            let slot = memory.slot(corner);
            if new >> i & 1 != 0 {
                let h = values.next().unwrap_or(f32::NAN);
                if !(h.is_finite() && h > 0.0) {
                    return Err(damaged("a size", h, "finite and above zero"));
                }
                *slot = (corner, h);
            } else if slot.0 != corner {
                return Err(damaged("a corner", format!("{corner:?}"), "seen before"));
            }
            *value = slot.1;
        }
        leaves.push(corners);
    }
    if !stack.is_empty() || leaves.len() != news.len() || values.next().is_some() {
        return Err(damaged("number of leaves", leaves.len(), news.len()));
    }
    Ok((tree, leaves.finish().freeze()))
}

fn damaged(what: &'static str, found: impl Display, expected: impl Display) -> SizingError {
    SizingError::Damaged { what, found: found.to_string(), expected: expected.to_string() }
}

/// The first bytes, which must exist.
fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    std::array::from_fn(|i| bytes[i])
}
