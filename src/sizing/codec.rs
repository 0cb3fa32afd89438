//! A size field as bytes, so that a store can keep it.
//!
//! | offset | bytes | content, little endian |
//! |---|---|---|
//! | 0 | 8 | `TETDBSZ1` |
//! | 8 | 24 | low corner of the cube, 3 × f64 |
//! | 32 | 8 | side of the cube, f64 |
//! | 40 | 8 | slope bound, f64 |
//! | 48 | 4 | root entry |
//! | 52 | 4 | number of blocks B |
//! | 56 | 4 | number of leaves L |
//! | 60 | 4 | zero |
//! | 64 | 32 B | blocks, 8 × u32 entries each |
//! | 64 + 32 B | 32 L | values at the leaves' corners, 8 × f32 each |

use super::SizingError;
use super::field::SizeField;
use super::seeds::Frame;
use super::tree::{DEPTH, LEAF, Tree};
use crate::geom::Point;
use std::fmt::Display;

const MAGIC: &[u8; 8] = b"TETDBSZ1";
const HEADER_BYTES: usize = 64;

impl SizeField {
    /// The field as bytes; equal fields give equal bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let n_words = self.tree.blocks.len() + self.values.len();
        let mut bytes = Vec::with_capacity(HEADER_BYTES + 32 * n_words);
        bytes.extend(MAGIC);
        let Frame { low, side } = self.frame;
        for x in [low.x, low.y, low.z, side, self.beta] {
            bytes.extend(x.to_le_bytes());
        }
        let counts = [self.tree.root, self.tree.blocks.len() as u32];
        for n in counts.into_iter().chain([self.values.len() as u32, 0]) {
            bytes.extend(n.to_le_bytes());
        }
        for entry in self.tree.blocks.iter().flatten() {
            bytes.extend(entry.to_le_bytes());
        }
        for value in self.values.iter().flatten() {
            bytes.extend(value.to_le_bytes());
        }
        bytes
    }

    /// Reads what [`SizeField::to_bytes`] wrote, checking all of it.
    ///
    /// # Errors
    /// [`SizingError::Damaged`] names what is wrong.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SizingError> {
        if bytes.len() < HEADER_BYTES {
            return Err(damaged("length", bytes.len(), "at least 64"));
        }
        if &bytes[..8] != MAGIC {
            return Err(damaged("magic", format!("{:x?}", &bytes[..8]), "TETDBSZ1"));
        }
        let number = |i: usize| f64::from_le_bytes(eight(&bytes[8 + 8 * i..]));
        let count = |i: usize| u32::from_le_bytes(four(&bytes[48 + 4 * i..]));
        let low = Point::new(number(0), number(1), number(2));
        let (side, beta) = (number(3), number(4));
        if !low.is_finite() || !side.is_normal() || side < 0.0 {
            return Err(damaged(
                "cube",
                format!("{low} {side}"),
                "finite, side above zero",
            ));
        }
        if !(beta > 0.0 && beta.is_finite()) {
            return Err(damaged("slope", beta, "above zero"));
        }
        let (root, n_blocks, n_leaves) = (count(0), count(1) as usize, count(2) as usize);
        let expected = HEADER_BYTES + 32 * (n_blocks + n_leaves);
        if bytes.len() != expected {
            return Err(damaged("length", bytes.len(), expected));
        }
        let (blocks, values) = bytes[HEADER_BYTES..].split_at(32 * n_blocks);
        let blocks: Vec<[u32; 8]> = words(blocks, u32::from_le_bytes);
        let values: Vec<[f32; 8]> = words(values, f32::from_le_bytes);
        let good = |h: f32| h.is_finite() && h > 0.0;
        if let Some(h) = values.iter().flatten().find(|&&h| !good(h)) {
            return Err(damaged("a size", h, "finite and above zero"));
        }
        let tree = Tree { root, blocks };
        check_tree(&tree, n_leaves)?;
        Ok(Self::from_parts(Frame { low, side }, beta, tree, values))
    }
}

/// Blocks and leaves are met once each, in depth-first order, and no deeper than the lattice.
fn check_tree(tree: &Tree, n_leaves: usize) -> Result<(), SizingError> {
    let (mut blocks, mut leaves) = (0, 0);
    let mut stack = vec![(tree.root, 0u32)];
    while let Some((entry, level)) = stack.pop() {
        let (next, limit) = if entry & LEAF != 0 {
            leaves += 1;
            (LEAF | (leaves - 1), n_leaves as u32)
        } else {
            blocks += 1;
            (blocks - 1, tree.blocks.len() as u32)
        };
        if entry != next || (next & !LEAF) >= limit || level > DEPTH {
            return Err(damaged("an octree entry", entry, next));
        }
        if entry & LEAF == 0 {
            if level == DEPTH {
                return Err(damaged("the octree's depth", level + 1, DEPTH));
            }
            let block = tree.blocks[entry as usize];
            stack.extend(block.iter().rev().map(|&child| (child, level + 1)));
        }
    }
    if (blocks as usize, leaves as usize) != (tree.blocks.len(), n_leaves) {
        return Err(damaged("number of leaves", leaves, n_leaves));
    }
    Ok(())
}

fn damaged(what: &'static str, found: impl Display, expected: impl Display) -> SizingError {
    SizingError::Damaged {
        what,
        found: found.to_string(),
        expected: expected.to_string(),
    }
}

fn four(bytes: &[u8]) -> [u8; 4] {
    std::array::from_fn(|i| bytes[i])
}

fn eight(bytes: &[u8]) -> [u8; 8] {
    std::array::from_fn(|i| bytes[i])
}

fn words<T: Copy>(bytes: &[u8], word: impl Fn([u8; 4]) -> T) -> Vec<[T; 8]> {
    bytes
        .chunks_exact(32)
        .map(|chunk| std::array::from_fn(|i| word(four(&chunk[4 * i..]))))
        .collect()
}
