//! Abaqus input: C3D4 elements, or C3D10 with the midpoints of edges, an element set per region, a surface and a node set per label; faces
//! of several groups are in those of each.
//!
//! Source: the Abaqus keywords reference; faces of C3D4 are S1 = 1 2 3, S2 = 1 4 2, S3 = 2 4 3, S4 = 3 4 1.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::Result;
use super::merged::Merged;
use super::midpoints::Midpoints;
use super::names::set_names;
use super::output_files::OutputFiles;
use super::sides::{ElementSide, SideSorter};
use super::stream::Stream;
use tetdb_base::storage::{Sorted, Sorter, sort_record};

/// The element's face opposite each of its nodes.
const SIDE_OPPOSITE: [u8; 4] = [3, 4, 2, 1];
/// Greatest number of numbers in a line of a set.
const PER_LINE: usize = 16;

sort_record! {
    /// A member of a set.
    struct Member {
        set: u32,
        number: u64,
    }
}

pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    midpoints: Option<&Midpoints>,
) -> Result<()> {
    let n_midpoints = midpoints.map_or(0, Midpoints::n);
    mesh.check_limits(out, i32::MAX as u64, n_midpoints)?;
    mesh.expect_passes(1, 1);
    let digits = u64::from(mesh.n_vertices().max(1).ilog10());
    let numbers = if n_midpoints > 0 { 11 } else { 5 };
    let bytes = 60 * (mesh.n_vertices() + n_midpoints) + numbers * (digits + 2) * mesh.n_tets();
    let path = outputs.create(out, bytes)?;
    let mut stream = Stream::open(&path)?;
    stream.text("*HEADING\nexported by tetdb\n*NODE, NSET=all_nodes\n");
    let mut put = |number: u64, point: [f64; 3]| {
        stream.integer(number + 1, b',');
        stream.doubles(point, b',', b'\n');
        stream.end()
    };
    mesh.vertices(|number, vertex| put(number, vertex.point))?;
    if let Some(midpoints) = midpoints {
        for (number, point) in (mesh.n_vertices()..).zip(midpoints.points()?) {
            put(number, point?)?;
        }
    }
    let regions = mesh.regions()?;
    let dir = mesh.dir().to_owned();
    let regions = regions.iter().map(|&r| (r, mesh.region_name(r)));
    let regions = set_names(&regions.collect());
    let sides = elements(mesh, &dir, &mut stream, &regions, midpoints)?;
    let names = set_names(&mesh.groups());
    surfaces(sides, &names, &mut stream)?;
    node_sets(mesh, &dir, &names, &mut stream, midpoints)?;
    embedded(mesh, &mut stream);
    stream.finish()
}

/// Writes elements and the sets of regions; returns the sides of the surfaces.
fn elements(
    mesh: &mut Merged,
    dir: &Path,
    stream: &mut Stream,
    regions: &BTreeMap<u32, String>,
    midpoints: Option<&Midpoints>,
) -> Result<Sorted<ElementSide>> {
    let kind = if midpoints.is_some() { "C3D10" } else { "C3D4" };
    // With one region its set is named with the elements, else sets follow.
    match regions.values().next() {
        Some(name) if regions.len() == 1 => {
            stream.text(&format!("*ELEMENT, TYPE={kind}, ELSET={name}\n"));
        }
        _ => stream.text(&format!("*ELEMENT, TYPE={kind}, ELSET=all_elements\n")),
    }
    let mut by_region = Sorter::new(dir, mesh.sorter_bytes() / 2);
    let mut sides = SideSorter::new(mesh, dir, SIDE_OPPOSITE)?;
    let mut number = 0u64;
    let first_midpoint = mesh.n_vertices() + 1;
    let mut edges = midpoints.map(Midpoints::tets).transpose()?;
    mesh.tets(|tet| {
        number += 1;
        sides.add(tet, number)?;
        if regions.len() > 1 {
            let set = tet.region;
            by_region.push(Member { set, number })?;
        }
        let edges = edges.as_mut().map(|edges| edges.next()).transpose()?;
        let midpoints = edges.into_iter().flatten().map(|edge| first_midpoint + edge);
        let nodes = tet.nodes.into_iter().map(|v| v + 1).chain(midpoints);
        stream.integer(number, b',');
        stream.integers(nodes, b',', b'\n');
        stream.end()
    })?;
    let head = |region: u32| format!("*ELSET, ELSET={}\n", regions[&region]);
    sets(by_region.finish()?, head, stream)?;
    sides.finish()
}

/// Embedded edges as sets of T3D2 elements, points as sets of nodes.
fn embedded(mesh: &Merged, stream: &mut Stream) {
    let embedded = mesh.embedded();
    let labels = embedded.edge_labels().into_iter().chain(embedded.point_labels());
    let names = labels.map(|(label, _)| (label, mesh.label_name(label)));
    let names = set_names(&names.collect());
    let mut last = None;
    for (number, ([a, b], label)) in (mesh.n_tets() + 1..).zip(&embedded.edges) {
        if last.replace(label) != Some(label) {
            stream.text(&format!("*ELEMENT, TYPE=T3D2, ELSET=edges_{}\n", names[label]));
        }
        stream.text(&format!("{number},{},{}\n", a + 1, b + 1));
    }
    let mut last = None;
    for point in &embedded.points {
        if last.replace(point.label) != Some(point.label) {
            stream.text(&format!("*NSET, NSET=points_{}\n", names[&point.label]));
        }
        stream.text(&format!("{}\n", point.vertex + 1));
    }
}

/// Writes sorted members as sets, each after its head; equal records count once.
fn sets(sorted: Sorted<Member>, head: impl Fn(u32) -> String, stream: &mut Stream) -> Result<()> {
    let mut last: Option<Member> = None;
    let mut on_line = 0;
    for record in sorted {
        let record = record?;
        if last == Some(record) {
            continue;
        }
        if last.is_none_or(|l| l.set != record.set) {
            if last.is_some() {
                stream.text("\n");
            }
            stream.text(&head(record.set));
            on_line = 0;
        } else if on_line == PER_LINE {
            stream.text("\n");
            on_line = 0;
        } else {
            stream.text(",");
        }
        stream.text(&record.number.to_string());
        stream.end()?;
        on_line += 1;
        last = Some(record);
    }
    if last.is_some() {
        stream.text("\n");
    }
    Ok(())
}

fn surfaces(
    sides: Sorted<ElementSide>,
    names: &BTreeMap<u32, String>,
    stream: &mut Stream,
) -> Result<()> {
    let mut last = None;
    for side in sides {
        let side = side?;
        let label = side.label;
        if last != Some(label) {
            last = Some(label);
            stream.text(&format!("*SURFACE, TYPE=ELEMENT, NAME={}\n", names[&label]));
        }
        stream.text(&format!("{},S{}\n", side.element, side.side));
        stream.end()?;
    }
    Ok(())
}

fn node_sets(
    mesh: &Merged,
    dir: &Path,
    names: &BTreeMap<u32, String>,
    stream: &mut Stream,
    midpoints: Option<&Midpoints>,
) -> Result<()> {
    let groups = mesh.members();
    let mut sorter = Sorter::new(dir, mesh.sorter_bytes());
    let mut edges = midpoints.map(Midpoints::faces).transpose()?;
    mesh.faces().each(|face| {
        let edges = edges.as_mut().map(|edges| edges.next()).transpose()?;
        let midpoints = edges.into_iter().flatten().map(|edge| mesh.n_vertices() + edge);
        let nodes: Vec<u64> = face.vertices.into_iter().chain(midpoints).collect();
        for &set in &groups[&face.label] {
            for node in &nodes {
                sorter.push(Member { set, number: node + 1 })?;
            }
        }
        Ok(())
    })?;
    let head = |label: u32| format!("*NSET, NSET={}\n", names[&label]);
    sets(sorter.finish()?, head, stream)
}
