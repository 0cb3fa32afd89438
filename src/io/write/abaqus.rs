//! Abaqus input: C3D4 elements, an element set per region, a surface and a node set per label.
//!
//! Source: the Abaqus keywords reference; faces of C3D4 are S1 = 1 2 3, S2 = 1 4 2, S3 = 2 4 3, S4 = 3 4 1.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::draft::Draft;
use super::error::Result;
use super::merged::{Merged, Tet};
use super::stream::{Stream, word32, word64};
use crate::storage::{Sorted, Sorter};

/// The element's face opposite each of its nodes.
const SIDE_OPPOSITE: [u8; 4] = [3, 4, 2, 1];
/// Most numbers of a line of a set.
const PER_LINE: usize = 16;

pub(super) fn write(mesh: &mut Merged, draft: &mut Draft, out: &Path) -> Result<()> {
    mesh.check_limits(out, i32::MAX as u64)?;
    mesh.expect_passes(1, 1);
    let digits = u64::from(mesh.n_vertices().max(1).ilog10());
    let bytes = 60 * mesh.n_vertices() + (5 * digits + 10) * mesh.n_tets();
    let path = draft.create(out, bytes)?;
    let mut stream = Stream::open(&path)?;
    stream.text("*HEADING\nexported by tetdb\n*NODE, NSET=all_nodes\n");
    mesh.vertices(|number, vertex| {
        let [x, y, z] = vertex.point;
        stream.integer(number + 1, b',');
        stream.double(x, b',');
        stream.double(y, b',');
        stream.double(z, b'\n');
        stream.end()
    })?;
    let regions = mesh.regions()?;
    let dir = mesh.dir().to_owned();
    let sides = elements(mesh, &dir, &mut stream, &regions)?;
    let names = set_names(&mesh.labels());
    surfaces(sides, &names, &mut stream)?;
    node_sets(mesh, &dir, &names, &mut stream)?;
    stream.finish()
}

/// Writes elements and the sets of regions; returns (label, element, side) for the surfaces.
fn elements(
    mesh: &mut Merged,
    dir: &Path,
    stream: &mut Stream,
    regions: &BTreeSet<u32>,
) -> Result<Sorted<13>> {
    // With one region its set is named with the elements, else sets follow.
    match regions.iter().next() {
        Some(region) if regions.len() == 1 => {
            stream.text(&format!("*ELEMENT, TYPE=C3D4, ELSET=region_{region}\n"));
        }
        _ => stream.text("*ELEMENT, TYPE=C3D4, ELSET=all_elements\n"),
    }
    let mut by_region = Sorter::<12>::new(dir, mesh.sorter_bytes() / 2);
    let mut sides = Sorter::<13>::new(dir, mesh.sorter_bytes() / 2);
    let mut faces = faces_by_tet(mesh, dir)?.peekable();
    let mut number = 0u64;
    mesh.tets(|tet| {
        while let Some(face) =
            faces.next_if(|f| f.as_ref().map_or(true, |f| word64(f, 0) <= number))
        {
            let face = face?;
            let mut side = [0; 13];
            side[..4].copy_from_slice(&face[8..12]);
            side[4..12].copy_from_slice(&(number + 1).to_be_bytes());
            side[12] = SIDE_OPPOSITE[opposite(tet, &face)];
            sides.push(side)?;
        }
        number += 1;
        if regions.len() > 1 {
            let mut record = [0; 12];
            record[..4].copy_from_slice(&tet.region.to_be_bytes());
            record[4..].copy_from_slice(&number.to_be_bytes());
            by_region.push(record)?;
        }
        let [a, b, c, d] = tet.nodes.map(|v| v + 1);
        stream.integer(number, b',');
        stream.integer(a, b',');
        stream.integer(b, b',');
        stream.integer(c, b',');
        stream.integer(d, b'\n');
        stream.end()
    })?;
    let head = |region: u32| format!("*ELSET, ELSET=region_{region}\n");
    sets(by_region.finish()?, head, stream)?;
    Ok(sides.finish()?)
}

/// (tetrahedron, label, three vertices), ascending.
fn faces_by_tet(mesh: &Merged, dir: &Path) -> Result<Sorted<36>> {
    let mut sorter = Sorter::new(dir, mesh.sorter_bytes());
    mesh.faces().each(|face| {
        let mut record = [0; 36];
        record[..8].copy_from_slice(&face.tet.to_be_bytes());
        record[8..12].copy_from_slice(&face.label.to_be_bytes());
        for (i, v) in face.vertices.into_iter().enumerate() {
            record[12 + 8 * i..20 + 8 * i].copy_from_slice(&v.to_be_bytes());
        }
        Ok(sorter.push(record)?)
    })?;
    Ok(sorter.finish()?)
}

/// The node of `tet` that is not in `face`.
fn opposite(tet: &Tet, face: &[u8; 36]) -> usize {
    let corners = [12, 20, 28].map(|at| word64(face, at));
    let outside = |v: &u64| !corners.contains(v);
    tet.nodes.iter().position(outside).unwrap_or(0)
}

/// Writes sorted (set, number) as sets, each after its head; equal records count once.
fn sets(sorted: Sorted<12>, head: impl Fn(u32) -> String, stream: &mut Stream) -> Result<()> {
    let mut last: Option<[u8; 12]> = None;
    let mut on_line = 0;
    for record in sorted {
        let record = record?;
        if last == Some(record) {
            continue;
        }
        if last.is_none_or(|l| l[..4] != record[..4]) {
            if last.is_some() {
                stream.text("\n");
            }
            stream.text(&head(word32(&record, 0)));
            on_line = 0;
        } else if on_line == PER_LINE {
            stream.text("\n");
            on_line = 0;
        } else {
            stream.text(",");
        }
        stream.text(&word64(&record, 4).to_string());
        stream.end()?;
        on_line += 1;
        last = Some(record);
    }
    if last.is_some() {
        stream.text("\n");
    }
    Ok(())
}

fn surfaces(sides: Sorted<13>, names: &BTreeMap<u32, String>, stream: &mut Stream) -> Result<()> {
    let mut last = None;
    for side in sides {
        let side = side?;
        let label = word32(&side, 0);
        if last != Some(label) {
            last = Some(label);
            stream.text(&format!("*SURFACE, TYPE=ELEMENT, NAME={}\n", names[&label]));
        }
        stream.text(&format!("{},S{}\n", word64(&side, 4), side[12]));
        stream.end()?;
    }
    Ok(())
}

fn node_sets(
    mesh: &Merged,
    dir: &Path,
    names: &BTreeMap<u32, String>,
    stream: &mut Stream,
) -> Result<()> {
    let mut sorter = Sorter::<12>::new(dir, mesh.sorter_bytes());
    mesh.faces().each(|face| {
        for v in face.vertices {
            let mut record = [0; 12];
            record[..4].copy_from_slice(&face.label.to_be_bytes());
            record[4..].copy_from_slice(&(v + 1).to_be_bytes());
            sorter.push(record)?;
        }
        Ok(())
    })?;
    let head = |label: u32| format!("*NSET, NSET={}\n", names[&label]);
    sets(sorter.finish()?, head, stream)
}

/// Names Abaqus takes: letters, digits, `_` and `-`, a letter first, at most 80, case not distinguished.
fn set_names(labels: &BTreeMap<u32, String>) -> BTreeMap<u32, String> {
    let mut taken = BTreeSet::new();
    let mut names = BTreeMap::new();
    for (&label, name) in labels {
        let letter = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let mut clean: String = name
            .chars()
            .map(|c| if letter(c) { c } else { '_' })
            .collect();
        if !clean.starts_with(|c: char| c.is_ascii_alphabetic()) {
            clean.insert_str(0, "label_");
        }
        clean.truncate(60);
        if !taken.insert(clean.to_ascii_lowercase()) {
            clean += &format!("_{label}");
            taken.insert(clean.to_ascii_lowercase());
        }
        names.insert(label, clean);
    }
    names
}
