//! Fills the volumes that the policy chooses among the components between required faces.

use std::collections::BTreeMap;

use super::complex::PagedComplex;
use super::error::BoundaryError;
use super::find::{SearchResult, find_face};
use super::flood::{Flood, OUTSIDE};
use super::map::face_at;
use super::policy::{Filled, Walls};
use super::recover::place;
use super::seeds::RegionRule;
use crate::delaunay::Kernel;
use crate::mesh::{Mesh, SHEET, VertexTag};
use tetdb_base::storage::{Pages, check_cancelled};
use tetdb_schema::page::NONE;

/// A volume enclosed by facets.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionSummary {
    /// Number of the region, from 1; 0 for one that stays empty.
    pub region: u32,
    /// Name of the region, if it has one.
    pub name: Option<String>,
    /// In cubed input units.
    pub volume: f64,
    /// Number of tetrahedra in it.
    pub tets: u32,
    /// Facets around it.
    pub facets: u32,
    /// Labels of those facets, ascending.
    pub labels: Vec<u32>,
}

/// The bounded volumes of a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeRegions {
    /// Ordered by the smallest facet around each, the one in front of it first.
    pub list: Vec<RegionSummary>,
    /// Parity was contradictory (shared walls), so all were filled.
    pub all_instead_of_parity: bool,
    /// Input numbers of facets with no filled region on either side, at most a thousand.
    pub loose_facets: Vec<u64>,
}

impl VolumeRegions {
    /// Names of region 1, 2, …, empty for one without; none at all when no region has one.
    pub fn names(&self) -> Vec<String> {
        let filled = self.list.iter().filter(|region| region.region > 0);
        let names: Vec<String> =
            (filled.map(|region| region.name.clone().unwrap_or_default())).collect();
        match names.iter().any(|name| !name.is_empty()) {
            true => names,
            false => Vec::new(),
        }
    }
}

/// Colors the volumes, deletes everything that is not filled, and the enclosing box.
///
/// Every facet must be a required face; those of sheets part nothing. Effects: faces to the outside have no neighbor, required bits stay; filled
/// tetrahedra carry their region as attribute; facets carry the regions in front and behind; `tet_of` is refreshed; vertices
/// without tetrahedra are removed unless they are the surface's.
///
/// Errors: [`BoundaryError::Orientation`] when orientation is contradictory, [`BoundaryError::Seed`] when a seed is outside or contradicts another.
pub fn fill_regions<P: Pages>(
    mesh: &mut Mesh<P>,
    rule: &RegionRule,
) -> Result<VolumeRegions, BoundaryError> {
    let mut flood = Flood::run(mesh);
    let walls = note_components(mesh, &mut flood)?;
    let mut regions = VolumeRegions::default();
    let filled = choose(mesh, &flood, &walls, rule)?;
    regions.all_instead_of_parity = filled.all_instead_of_parity;
    let mut order: Vec<u32> = flood.volumes().collect();
    order.sort_by_key(|&c| flood.components[c as usize].side_first);
    let mut number = vec![0u32; flood.components.len()];
    let mut n = 0;
    for &c in &order {
        if filled.volumes.contains(&c) {
            n += 1;
            number[c as usize] = n;
        }
        let component = &flood.components[c as usize];
        regions.list.push(RegionSummary {
            region: number[c as usize],
            name: filled.names.get(&c).cloned(),
            volume: component.volume,
            tets: component.tets,
            facets: component.facets,
            labels: component.labels.iter().copied().collect(),
        });
    }
    for c in 0..number.len() {
        number[c] = number[flood.volume(c as u32) as usize];
    }
    apply(mesh, &number, &mut regions);
    Ok(regions)
}

/// Gives every volume the region that `sides` names in front of and behind its facets, and deletes those of region 0 and the enclosing box.
///
/// No facet is of a sheet. Effects: as [`fill_regions`]. Returns false if two facets name different regions of one volume, or a region
/// outside. Errors: a facet is no face of the mesh.
pub fn fill_by_sides<P: Pages>(
    mesh: &mut Mesh<P>,
    sides: &dyn Fn(u32) -> [u32; 2],
) -> Result<bool, BoundaryError> {
    let mut flood = Flood::run(mesh);
    note_components(mesh, &mut flood)?;
    let mut number = vec![NONE; flood.components.len()];
    number[OUTSIDE as usize] = 0;
    for n in 0..mesh.n_facets() {
        for (component, region) in mesh.facet(n).regions.into_iter().zip(sides(n)) {
            let known = &mut number[component as usize];
            if ![NONE, region].contains(known) {
                return Ok(false);
            }
            *known = region;
        }
    }
    apply(mesh, &number, &mut VolumeRegions::default());
    Ok(true)
}

/// Notes on both sides of every facet which component lies there.
fn note_components<P: Pages>(
    mesh: &mut Mesh<P>,
    flood: &mut Flood,
) -> Result<Walls, BoundaryError> {
    let mut walls: Walls = BTreeMap::new();
    let none = tetdb_base::geom::IdSet::default();
    for n in 0..mesh.n_facets() {
        if n & 1023 == 0 {
            check_cancelled();
        }
        let mut facet = mesh.facet(n);
        let known = face_at(mesh, &facet).map(SearchResult::Face);
        let found = || find_face(&mut PagedComplex(mesh, &none), facet.vertices);
        let SearchResult::Face(face) = known.unwrap_or_else(found) else {
            return Err(BoundaryError::NotRecovered {
                facets: vec![place(mesh, n)],
                reason: "it is not a face of the mesh",
                nearness: None,
            });
        };
        let tet = mesh.tet(face.tet());
        let here = mesh.tet_attribute(face.tet()).0;
        let there = mesh.tet_attribute(tet.neighbor[face.face()].tet()).0;
        // The normal of a face points out of its tetrahedron, which is then behind the facet.
        let [a, b, c] = facet.vertices;
        let f = tet.face(face.face());
        let behind = f == [a, b, c] || f == [b, c, a] || f == [c, a, b];
        let is_sheet = facet.regions[1] == SHEET;
        facet.regions = if behind { [there, here] } else { [here, there] };
        mesh.set_facet(n, facet);
        let [front, back] = facet.regions;
        if is_sheet {
            flood.join(front, back);
            continue;
        }
        flood.touch(front, 2 * u64::from(n), facet.label);
        if front != back {
            flood.touch(back, 2 * u64::from(n) + 1, facet.label);
            let wall = walls.entry((front.min(back), front.max(back))).or_default();
            if front < back {
                wall.front += 1;
            } else {
                wall.back += 1;
            }
        }
    }
    Ok(between_volumes(&walls, flood))
}

/// The walls of volumes, from those of components.
fn between_volumes(walls: &Walls, flood: &Flood) -> Walls {
    let mut joined = Walls::new();
    for (&(a, b), wall) in walls {
        let (low, high) = (flood.volume(a), flood.volume(b));
        // Between other components the lower number may be on the other side.
        let (low, high, front, back) = match low <= high {
            true => (low, high, wall.front, wall.back),
            false => (high, low, wall.back, wall.front),
        };
        if low != high {
            let sum = joined.entry((low, high)).or_default();
            sum.front += front;
            sum.back += back;
        }
    }
    joined
}

fn choose<P: Pages>(
    mesh: &mut Mesh<P>,
    flood: &Flood,
    walls: &Walls,
    rule: &RegionRule,
) -> Result<Filled, BoundaryError> {
    let end = flood.components.len() as u32;
    let chosen = rule.policy.filled(OUTSIDE, end, walls)?;
    let mut kernel = Kernel::default();
    rule.apply(chosen, OUTSIDE, end, |p| {
        let start = mesh.tet_of(0);
        match kernel.locate(mesh, p, start) {
            Ok(found) => flood.volume(mesh.tet_attribute(found.tet).0),
            Err(_) => OUTSIDE,
        }
    })
}

/// Deletes unfilled components and writes the region numbers of the others.
fn apply<P: Pages>(mesh: &mut Mesh<P>, number: &[u32], regions: &mut VolumeRegions) {
    use crate::mesh::FaceRef;
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        if number[mesh.tet_attribute(t).0 as usize] != 0 {
            continue;
        }
        for across in tet.neighbor.into_iter().filter(|n| n.exists()) {
            if number[mesh.tet_attribute(across.tet()).0 as usize] != 0 {
                mesh.set_neighbor(across, FaceRef::NONE);
            }
        }
        mesh.free_tet(t);
    }
    let mut from = 0;
    while let Some((t, _)) = mesh.next_tet(from) {
        from = t + 1;
        let (component, flags) = mesh.tet_attribute(t);
        mesh.set_tet_attribute(t, number[component as usize], flags);
    }
    for n in 0..mesh.n_facets() {
        let mut facet = mesh.facet(n);
        facet.regions = facet.regions.map(|c| number[c as usize]);
        mesh.set_facet(n, facet);
        if facet.regions == [0, 0] && regions.loose_facets.len() < 1000 {
            regions.loose_facets.push(facet.input);
        }
    }
    let mut n = 0;
    let mut v = 0;
    while v < mesh.vertex_ids_end() {
        mesh.set_tet_of(v, NONE);
        n += 1;
        v = crate::mesh::sparse(n);
    }
    mesh.refresh_tet_of();
    for k in 0..n {
        let v = crate::mesh::sparse(k);
        if mesh.tet_of(v) == NONE {
            let (tag, _) = mesh.vertex_attribute(v);
            if matches!(tag, VertexTag::Steiner | VertexTag::EnclosingBox) {
                mesh.free_vertex(v);
                mesh.set_vertex_attribute(v, VertexTag::Free, 0);
            }
        }
    }
}
