//! Parts of Gmsh files of all versions: numbers in text or binary, node tags, element types.

use std::collections::HashMap;
use std::io::BufRead;

use super::Result;
use super::feed::Feed;

/// Numbers of a section, in text or in binary of either byte order.
pub(super) struct GmshNumbers<R> {
    pub feed: Feed<R>,
    pub binary: bool,
    pub big: bool,
}

impl<R: BufRead> GmshNumbers<R> {
    /// An `int` of the format.
    pub fn int(&mut self) -> Result<i64> {
        if !self.binary {
            return self.feed.integer("a whole number");
        }
        let bytes = self.feed.bytes::<4>()?;
        Ok(i64::from(if self.big { i32::from_be_bytes(bytes) } else { i32::from_le_bytes(bytes) }))
    }

    /// A `size_t` of the format, of 8 bytes.
    pub fn size(&mut self) -> Result<i64> {
        if !self.binary {
            return self.feed.integer("a whole number");
        }
        let bytes = self.feed.bytes::<8>()?;
        Ok(if self.big { i64::from_be_bytes(bytes) } else { i64::from_le_bytes(bytes) })
    }

    /// A coordinate.
    pub fn double(&mut self) -> Result<f64> {
        if !self.binary {
            return self.feed.coordinate();
        }
        let bytes = self.feed.bytes::<8>()?;
        self.feed.checked(if self.big {
            f64::from_be_bytes(bytes)
        } else {
            f64::from_le_bytes(bytes)
        })
    }

    /// A number of any size, which may be infinite or none.
    pub fn value(&mut self) -> Result<f64> {
        if !self.binary {
            self.feed.need_word("a value")?;
            return self.feed.parse("a value");
        }
        let bytes = self.feed.bytes::<8>()?;
        Ok(if self.big { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) })
    }

    /// Compares a declared count with the bytes left, at `words` numbers of `bytes` each.
    pub fn check_count(
        &self,
        what: &'static str,
        declared: i64,
        words: u64,
        bytes: u64,
    ) -> Result<u64> {
        let bytes_min = if self.binary { words * bytes } else { words * 2 };
        self.feed.check_count(what, declared, bytes_min)
    }

    /// Refuses the end of a text section before record `found` of `declared`.
    pub fn need_record(&mut self, what: &'static str, declared: u64, found: u64) -> Result<()> {
        if !self.binary && (self.feed.at_end()? || self.feed.peek()? == Some(b'$')) {
            return Err(self.feed.too_few(what, declared, found));
        }
        Ok(())
    }

    /// Takes the word that ends a section.
    pub fn end(&mut self, keyword: &'static str) -> Result<()> {
        self.feed.need_keyword(keyword)?;
        self.feed.skip_line()
    }
}

/// From the tags of nodes to their positions in the file.
#[derive(Default)]
pub(super) struct NodeTags {
    first: i64,
    n: u32,
    /// Used once the tags turn out not to count up by one.
    sparse: Option<HashMap<i64, u32>>,
}

impl NodeTags {
    /// The next node of the file has this tag; false when another had it before.
    pub fn push(&mut self, tag: i64) -> bool {
        if self.n == 0 {
            self.first = tag;
        }
        let dense = self.first.checked_add(i64::from(self.n)) == Some(tag);
        if self.sparse.is_none() && !dense {
            let known = (0..self.n).map(|i| (self.first + i64::from(i), i));
            self.sparse = Some(known.collect());
        }
        let new = match &mut self.sparse {
            Some(map) => map.insert(tag, self.n).is_none(),
            None => true,
        };
        self.n += 1;
        new
    }

    /// The position of the node with this tag.
    pub fn get(&self, tag: i64) -> Option<u32> {
        match &self.sparse {
            Some(map) => map.get(&tag).copied(),
            None => {
                let i = u32::try_from(tag.checked_sub(self.first)?).ok()?;
                (i < self.n).then_some(i)
            }
        }
    }

    /// The position of a node an element names.
    pub fn find<R: BufRead>(&self, tag: i64, feed: &Feed<R>) -> Result<u32> {
        self.get(tag).ok_or_else(|| {
            let low = if self.sparse.is_some() { 1 } else { self.first };
            let high = match &self.sparse {
                Some(map) => map.keys().copied().max().unwrap_or(0),
                None => self.first + i64::from(self.n) - 1,
            };
            feed.out_of_range(tag, low, high)
        })
    }
}

/// The role of an element for a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Triangles and quadrilaterals.
    Face,
    Solid,
    /// Points and lines.
    Thin,
}

/// An element type: the number of its nodes and of its corners, which come first.
#[derive(Clone, Copy, Debug)]
pub(super) struct ElementType {
    pub n_nodes: usize,
    pub n_corners: usize,
    pub role: Role,
}

/// The element type of a number of the format.
fn element_type(kind: i64) -> Option<ElementType> {
    use Role::{Face, Solid, Thin};
    let (n_nodes, n_corners, role) = match kind {
        1 => (2, 2, Thin),
        2 => (3, 3, Face),
        3 => (4, 4, Face),
        4 => (4, 4, Solid),
        5 => (8, 8, Solid),
        6 => (6, 6, Solid),
        7 => (5, 5, Solid),
        8 => (3, 2, Thin),
        9 => (6, 3, Face),
        10 => (9, 4, Face),
        11 => (10, 4, Solid),
        12 => (27, 8, Solid),
        13 => (18, 6, Solid),
        14 => (14, 5, Solid),
        15 => (1, 1, Thin),
        16 => (8, 4, Face),
        17 => (20, 8, Solid),
        18 => (15, 6, Solid),
        19 => (13, 5, Solid),
        20 => (9, 3, Face),
        21 => (10, 3, Face),
        22 => (12, 3, Face),
        23 | 24 => (15, 3, Face),
        25 => (21, 3, Face),
        26 => (4, 2, Thin),
        27 => (5, 2, Thin),
        28 => (6, 2, Thin),
        29 => (20, 4, Solid),
        30 => (35, 4, Solid),
        31 => (56, 4, Solid),
        36 => (16, 4, Face),
        37 => (25, 4, Face),
        38 => (36, 4, Face),
        92 => (64, 8, Solid),
        93 => (125, 8, Solid),
        _ => return None,
    };
    Some(ElementType { n_nodes, n_corners, role })
}

/// As [`element_type`]. Errors: an unknown type.
pub(super) fn need_element_type<R: BufRead>(kind: i64, feed: &Feed<R>) -> Result<ElementType> {
    element_type(kind).ok_or_else(|| feed.unsupported(format!("element type {kind}")))
}
