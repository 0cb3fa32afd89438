//! OFF: a header word, three counts, vertices, faces of any number of corners.
//!
//! Colors and normals after the coordinates of a vertex or the corners of a face are skipped. `#` begins a
//! comment.

use std::io::BufRead;

use super::feed::Feed;
use super::{Result, SurfaceSink};
use tetdb_base::geom::Point;

pub(super) fn read<R: BufRead>(mut feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    feed.comment = Some(b'#');
    feed.need_word("`OFF`")?;
    let header = feed.word().to_ascii_uppercase();
    match header.as_slice() {
        b"OFF" | b"COFF" | b"NOFF" | b"CNOFF" | b"NCOFF" | b"STOFF" | b"STCOFF" | b"STNOFF"
        | b"STCNOFF" => {}
        b"4OFF" | b"NNOFF" | b"C4OFF" => {
            return Err(feed.unsupported("OFF with other than three dimensions"));
        }
        _ => return Err(feed.unexpected("`OFF`", feed.word())),
    }
    feed.need_word("the number of vertices")?;
    if feed.word().eq_ignore_ascii_case(b"binary") {
        return Err(feed.unsupported("binary OFF"));
    }
    let n_vertices: i64 = feed.parse("the number of vertices")?;
    let n_vertices = feed.check_count("vertices", n_vertices, 6)?;
    let n_faces = feed.count("faces", 2)?;
    // The number of edges is often wrong and never needed, or left out.
    feed.skip_line()?;
    for i in 0..n_vertices {
        if !feed.next_word()? {
            return Err(feed.too_few("vertices", n_vertices, i));
        }
        let p = Point::new(feed.word_coordinate()?, feed.coordinate()?, feed.coordinate()?);
        feed.skip_line()?;
        feed.placed(target.builder.vertex(p))?;
    }
    let label = target.label("");
    let mut corners = Vec::new();
    for i in 0..n_faces {
        if !feed.next_word()? {
            return Err(feed.too_few("faces", n_faces, i));
        }
        let n: i64 = feed.parse("the number of corners")?;
        let n = feed.check_count("corners", n, 2)?;
        if n < 3 {
            return Err(feed.unexpected("a face of at least 3 corners", feed.word()));
        }
        corners.clear();
        for _ in 0..n {
            corners.push(feed.index(0, n_vertices)?);
        }
        feed.placed(target.builder.polygon(&corners, label))?;
        feed.skip_line()?;
    }
    feed.note_rest(target.builder)?;
    feed.finish(target.builder)
}
