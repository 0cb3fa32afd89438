//! STL, text and binary.
//!
//! Binary: an 80-byte header of no meaning, a u32 count n, then n records of 50 bytes: normal, three
//! corners (f32 each, little-endian), two spare bytes. So a file of 84 + 50 n bytes is binary, whatever
//! its header says. Normals are not read: the order of corners gives the side.

use std::io::BufRead;

use super::feed::{self, Feed};
use super::{ReadError, ReadFault, Result, SurfaceSink};
use tetdb_base::geom::Point;
use tetdb_base::surface::NoteKind;

const HEADER: usize = 84;
const RECORD: u64 = 50;

pub(super) fn read<R: BufRead>(feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let (head, n_head, feed) = feed.with_head::<HEADER>()?;
    let n = u32::from_le_bytes([head[80], head[81], head[82], head[83]]);
    let expected = HEADER as u64 + RECORD * u64::from(n);
    if n_head == HEADER && feed.len == expected {
        return read_binary(feed, n, target);
    }
    let text = head[..n_head].trim_ascii_start();
    let solid = text.get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    // A text has no zero bytes; a header that says "solid" is often padded with them.
    if solid && !head[..n_head].contains(&0) {
        return read_text(feed, target);
    }
    // More bytes that are no records: other programs take them for a remark.
    if n > 0 && feed.len > expected && !(feed.len - expected).is_multiple_of(RECORD) {
        target.builder.note(NoteKind::TrailingBytes { n: feed.len - expected });
        return read_binary(feed, n, target);
    }
    Err(wrong_length(feed, n_head, n, expected))
}

fn wrong_length<R: BufRead>(mut feed: Feed<R>, n_head: usize, n: u32, expected: u64) -> ReadError {
    feed.at.is_binary = true;
    let found = format!("{} bytes", feed.len);
    if n_head < HEADER {
        let expected = format!("`solid`, or {HEADER} bytes of binary header");
        return feed.refuse(ReadFault::Truncated { expected, found });
    }
    if feed.len < expected {
        feed.at.offset = feed.len;
        let expected = format!("{expected} bytes for the {n} triangles declared at byte 80");
        return feed.refuse(ReadFault::Truncated { expected, found });
    }
    feed.at.offset = 80;
    let declared = format!("{n} ({expected} bytes)");
    feed.miscounted("triangles", declared, format!("the file has {found}"))
}

fn read_binary<R: BufRead>(mut feed: Feed<R>, n: u32, target: &mut SurfaceSink) -> Result<()> {
    feed.at.is_binary = true;
    feed.skip_bytes(HEADER as u64)?;
    let label = target.label("");
    for _ in 0..n {
        let record = feed.bytes::<50>()?;
        let mut x = [0.0f64; 9];
        for (i, value) in x.iter_mut().enumerate() {
            let at = 12 + 4 * i;
            let bits = [record[at], record[at + 1], record[at + 2], record[at + 3]];
            *value = feed.checked(f64::from(f32::from_le_bytes(bits)))?;
        }
        let corners = [0, 3, 6].map(|i| Point::new(x[i], x[i + 1], x[i + 2]));
        feed.placed(target.builder.triangle_at(corners, label))?;
    }
    feed.finish(target.builder)
}

fn read_text<R: BufRead>(mut feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let mut line = Vec::new();
    let mut pending = false; // a word is taken and not yet looked at
    while pending || feed.next_word()? {
        pending = false;
        if !feed.word().eq_ignore_ascii_case(b"solid") {
            return Err(feed.unexpected("`solid`", feed.word()));
        }
        line.clear();
        feed.read_line(&mut line)?;
        let mut name = feed::name(&line);
        if !feed.next_word()? {
            return Err(feed.truncated("`facet` or `endsolid`"));
        }
        // Some writers put the name on a line of its own.
        if name.is_empty() && !is(feed.word(), "facet") && !is(feed.word(), "endsolid") {
            line.clear();
            line.extend_from_slice(feed.word());
            feed.read_line(&mut line)?;
            name = feed::name(&line);
            feed.need_word("`facet` or `endsolid`")?;
        }
        let label = target.label(&name);
        loop {
            if is(feed.word(), "facet") {
                read_facet(&mut feed, label, target)?;
                if !feed.next_word()? {
                    target.builder.note(NoteKind::MissingEndsolid { line: feed.at.line });
                    break;
                }
            } else if is(feed.word(), "endsolid") {
                feed.skip_line()?;
                break;
            } else if is(feed.word(), "solid") {
                target.builder.note(NoteKind::MissingEndsolid { line: feed.at.line });
                pending = true;
                break;
            } else {
                return Err(feed.unexpected("`facet` or `endsolid`", feed.word()));
            }
        }
    }
    feed.finish(target.builder)
}

fn is(word: &[u8], keyword: &str) -> bool {
    word.eq_ignore_ascii_case(keyword.as_bytes())
}

/// One facet after its first word; the normal is passed over unread.
fn read_facet<R: BufRead>(feed: &mut Feed<R>, label: u32, target: &mut SurfaceSink) -> Result<()> {
    for _ in 0..4 {
        feed.need_word("a normal and `outer loop`")?;
    }
    feed.need_keyword("outer")?;
    feed.need_keyword("loop")?;
    let mut corners = [Point::ZERO; 3];
    for corner in &mut corners {
        feed.need_keyword("vertex")?;
        *corner = feed.point()?;
    }
    feed.need_keyword("endloop")?;
    feed.need_keyword("endfacet")?;
    feed.placed(target.builder.triangle_at(corners, label))
}
