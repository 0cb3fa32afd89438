//! Exodus II: an element block for each region, a side set for each group of faces, and one time step of variables.
//!
//! Elements are numbered block by block; `elem_num_map` has the numbers that other formats give the tetrahedra, from 1. A face of several groups is
//! in the side set of each; one with tetrahedra on both sides is a side of one of them. Fields are nodal and element variables, one for each
//! component; two more say the sub-domain and the quality of each element. Reading order: `plan` (names and places), this file (the arrays).
//! Source: the Exodus II manual (SAND92-2137) and the names of netCDF variables in its appendix; the midpoints have VTK's order.

mod plan;

use std::collections::BTreeMap;
use std::path::Path;

use super::array_file::ArrayFile;
use super::error::Result;
use super::merged::{Measured, Merged};
use super::merged_fields::to_doubles;
use super::midpoints::Midpoints;
use super::output_files::OutputFiles;
use super::sides::SideSorter;
use plan::Plan;
use tetdb_schema::field::FieldRow;

/// The element's side opposite each of its nodes.
const SIDE_OPPOSITE: [u8; 4] = [2, 3, 1, 4];

pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    midpoints: Option<&Midpoints>,
) -> Result<()> {
    mesh.check_limits(out, i32::MAX as u64, midpoints.map_or(0, Midpoints::n))?;
    mesh.expect_passes(1, 1);
    let fields = mesh.read_fields(midpoints.is_some(), true)?;
    let plan = Plan::new(mesh, midpoints, &fields)?;
    let layout = plan.file.plan();
    let path = outputs.create(out, layout.file_bytes)?;
    let mut places = layout.arrays;
    let map_at = places[plan.element_map][0];
    // Each block has its own share of the map, which the variable itself leaves to it.
    places[plan.element_map][1] = 0;
    places.extend(plan.blocks.values().map(|block| [map_at + 4 * block.first, 4 * block.n]));
    places.push([0, layout.head.len() as u64]);
    let mut arrays = ArrayFile::open(&path, layout.file_bytes, &places, mesh.memory / 8)?;
    arrays.put(places.len() - 1, &layout.head)?;
    for (variable, bytes) in &plan.fixed {
        arrays.put(*variable, bytes)?;
    }
    nodes(mesh, &mut arrays, &plan, (midpoints, &fields[0]))?;
    elements(mesh, &mut arrays, &plan, (midpoints, &fields[1]))?;
    arrays.finish()
}

/// Writes the nodes and their variables.
fn nodes(
    mesh: &mut Merged,
    arrays: &mut ArrayFile,
    plan: &Plan,
    (midpoints, fields): (Option<&Midpoints>, &[FieldRow]),
) -> Result<()> {
    let put = |arrays: &mut ArrayFile, number: u64, point: [f64; 3], words: &[u64]| -> Result<()> {
        for (&array, x) in plan.node_values.iter().zip(to_doubles(fields, words)) {
            arrays.put(array, &x.to_be_bytes())?;
        }
        for (&array, x) in plan.coordinates.iter().zip(point) {
            arrays.put(array, &x.to_be_bytes())?;
        }
        put_int(arrays, plan.node_map, number + 1)
    };
    mesh.vertices_with(fields, |number, vertex, words| put(arrays, number, vertex.point, words))?;
    if let Some(midpoints) = midpoints {
        for (number, row) in (mesh.n_vertices()..).zip(midpoints.rows(fields)?) {
            let (point, words) = row?;
            put(arrays, number, point, &words)?;
        }
    }
    Ok(())
}

/// Writes the elements, their variables, and the side sets.
fn elements(
    mesh: &mut Merged,
    arrays: &mut ArrayFile,
    plan: &Plan,
    (midpoints, fields): (Option<&Midpoints>, &[FieldRow]),
) -> Result<()> {
    let dir = mesh.dir().to_owned();
    let mut sides = SideSorter::new(mesh, &dir, SIDE_OPPOSITE)?;
    let first_midpoint = mesh.n_vertices();
    let mut edges = midpoints.map(Midpoints::tets).transpose()?;
    let (mut placed, mut number) = (BTreeMap::new(), 0);
    mesh.measured_tets(Measured::Quality, |tet| {
        number += 1;
        let n = placed.entry(tet.region).or_insert(0);
        *n += 1;
        let edges = edges.as_mut().map(|edges| edges.next()).transpose()?;
        let Some(block) = plan.blocks.get(&tet.region).filter(|block| *n <= block.n) else {
            return Ok(());
        };
        sides.add(tet, block.first + *n)?;
        put_int(arrays, block.map, number)?;
        let edges = edges.into_iter().flatten().map(|edge| first_midpoint + edge);
        for node in tet.nodes.into_iter().chain(edges) {
            put_int(arrays, block.nodes, node + 1)?;
        }
        let own = [f64::from(tet.subdomain), tet.quality].into_iter();
        for (&array, x) in block.values.iter().zip(own.chain(to_doubles(fields, &tet.fields))) {
            arrays.put(array, &x.to_be_bytes())?;
        }
        Ok(())
    })?;
    for (region, block) in &plan.blocks {
        let n = placed.remove(region).unwrap_or_default();
        mesh.expect_count(&format!("tetrahedra of region {region}"), block.n, n)?;
    }
    mesh.expect_count("tetrahedra of other regions", 0, placed.into_values().sum())?;
    let mut n_sides = 0;
    for side in sides.finish()? {
        let side = side?;
        let [elements, names] = plan.sets[&side.label];
        put_int(arrays, elements, side.element)?;
        put_int(arrays, names, side.side.into())?;
        n_sides += 1;
    }
    mesh.expect_count("sides", plan.n_sides, n_sides)
}

/// Writes a number of 31 bits.
fn put_int(arrays: &mut ArrayFile, array: usize, number: u64) -> Result<()> {
    arrays.put(array, &(number as u32).to_be_bytes())
}
