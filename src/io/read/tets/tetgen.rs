//! Meshes of TetGen: `.ele` with the `.node` file beside it, and labels from `.face` where it is there.

use std::io::BufRead;
use std::path::Path;

use super::raw::NodeNumbers;
use super::{Feed, RawMesh, Result};
use crate::read::open::{open, unpacked_name};
use tetdb_base::geom::Point;

pub fn read(path: &Path, limit: u64, mesh: &mut RawMesh) -> Result<()> {
    let beside = |ending| unpacked_name(path).with_extension(ending);
    let mut nodes = NodeNumbers::of("node");
    read_nodes(open(&beside("node"), limit)?, &mut nodes, mesh)?;
    let mut feed = open(path, limit)?;
    let [n, n_nodes, n_attributes] = head(&mut feed, "tetrahedra")?;
    if ![4, 10].contains(&n_nodes) {
        return Err(feed.unsupported(format!("tetrahedra of {n_nodes} nodes")));
    }
    mesh.n_curved += if n_nodes > 4 { n } else { 0 };
    for i in 0..n {
        feed.need_record("tetrahedra", n, i)?;
        feed.integer("the number of a tetrahedron")?;
        let mut corners = [0; 4];
        for k in 0..n_nodes as usize {
            let number = feed.integer("a node number")?;
            let node = nodes.find(number, &mesh.space, &feed)?;
            if let Some(corner) = corners.get_mut(k) {
                *corner = node;
            }
        }
        let region = match n_attributes {
            0 => 0,
            _ => attribute(&mut feed)?,
        };
        feed.skip_line()?;
        let region = mesh.regions.number(region);
        mesh.tet(corners, region, 0).map_err(|fault| feed.refuse(fault))?;
    }
    let faces = beside("face");
    if faces.is_file() {
        read_faces(open(&faces, limit)?, &mut nodes, mesh)?;
    }
    Ok(())
}

/// Three whole numbers of a first line; those that are missing are 0.
fn head<R: BufRead>(feed: &mut Feed<R>, what: &'static str) -> Result<[u64; 3]> {
    feed.comment = Some(b'#');
    let n = feed.integer(what)?;
    let mut numbers = [feed.check_count(what, n, 6)?, 0, 0];
    for number in &mut numbers[1..] {
        if feed.next_word_in_line()? {
            *number = feed.parse("a whole number")?;
        }
    }
    feed.skip_line()?;
    Ok(numbers)
}

/// A whole number, which may be written with a point.
fn attribute<R: BufRead>(feed: &mut Feed<R>) -> Result<i64> {
    feed.need_word("the attribute of a tetrahedron")?;
    match feed.parse::<f64>("the attribute of a tetrahedron")? {
        x if x.fract() == 0.0 && x.abs() < 1e15 => Ok(x as i64),
        _ => Err(feed.unexpected("a whole number as attribute", feed.word())),
    }
}

fn read_nodes<R: BufRead>(
    mut feed: Feed<R>,
    nodes: &mut NodeNumbers,
    mesh: &mut RawMesh,
) -> Result<()> {
    let [n, dimension, _] = head(&mut feed, "nodes")?;
    if dimension != 3 {
        return Err(feed.unsupported(format!("nodes of dimension {dimension}")));
    }
    for i in 0..n {
        feed.need_record("nodes", n, i)?;
        let number = feed.integer("the number of a node")?;
        let p = Point::new(feed.coordinate()?, feed.coordinate()?, feed.coordinate()?);
        feed.skip_line()?;
        nodes.push(number, &mesh.space);
        mesh.point(p);
    }
    Ok(())
}

/// Triangles with their markers as labels; those without markers are the boundary again.
fn read_faces<R: BufRead>(
    mut feed: Feed<R>,
    nodes: &mut NodeNumbers,
    mesh: &mut RawMesh,
) -> Result<()> {
    let [n, has_markers, _] = head(&mut feed, "faces")?;
    for i in 0..n {
        feed.need_record("faces", n, i)?;
        feed.integer("the number of a face")?;
        let mut corners = [0; 3];
        for corner in &mut corners {
            let number = feed.integer("a node number")?;
            *corner = nodes.find(number, &mesh.space, &feed)?;
        }
        if has_markers > 0 {
            let marker = feed.integer("the marker of a face")?;
            let label = mesh.labels.number(marker);
            mesh.triangle(corners, label);
        }
        feed.skip_line()?;
    }
    Ok(())
}
