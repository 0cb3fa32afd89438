//! Tetrahedra that other partitions see: those that share a vertex with one of theirs.

use std::path::PathBuf;

use super::super::error::Result;
use super::super::merged::{Merged, Opened};
use super::super::stream::{Records, scratch};
use super::out::Out;

/// Writes them to a scratch file, in the words of the format; returns how many.
pub(super) fn gather(mesh: &mut Merged, which: &[usize], ascii: bool) -> Result<u64> {
    let path = place(mesh);
    scratch(&path)?.finish()?;
    let mut out = Out::open(&path, ascii)?;
    let mut sharers = mesh.sharers()?.peekable();
    let mut n = 0;
    for &p in which {
        // Vertices of this sub-domain, ascending, and who else has them; both as places among all.
        let mut shared: Vec<(u32, u32)> = Vec::new();
        while let Some(sharer) =
            sharers.next_if(|s| s.as_ref().map_or(true, |s| s.part as usize <= p))
        {
            let sharer = sharer?;
            if sharer.part as usize == p {
                shared.push((sharer.local, sharer.other));
            }
        }
        let Opened {
            mut part,
            first_tet,
            ..
        } = mesh.open_part(p)?;
        let first = mesh.n_faces() + first_tet + 1;
        let mut others = Vec::new();
        for tet in part.tets() {
            let (id, tet) = tet?;
            others.clear();
            for v in tet.nodes {
                let from = shared.partition_point(|s| s.0 < v);
                let of_vertex = shared[from..].iter().take_while(|s| s.0 == v);
                others.extend(of_vertex.map(|s| s.1));
            }
            others.sort_unstable();
            others.dedup();
            if others.is_empty() {
                continue;
            }
            n += 1;
            out.size(first + u64::from(id.local()));
            out.int(p as u32 + 1);
            out.size(others.len() as u64);
            others.iter().for_each(|&other| out.int(other + 1));
            out.end()?;
        }
    }
    out.finish()?;
    Ok(n)
}

fn place(mesh: &Merged) -> PathBuf {
    mesh.dir().join("ghosts")
}

/// Copies what was gathered behind its number.
pub(super) fn write(mesh: &Merged, out: &mut Out, n: u64) -> Result<()> {
    out.size(n);
    out.end()?;
    let mut bytes = Records::<1>::open(&place(mesh), 0)?;
    while let Some(byte) = bytes.next()? {
        out.stream.bytes(&byte);
        out.stream.end()?;
    }
    Ok(())
}
