//! Shells of sealed sub-domains: the faces that stay whatever the inside becomes.

use std::collections::BTreeSet;

use crate::pipeline::error::PipelineError;
use tetdb_base::geom::Point;
use tetdb_base::storage::{ScratchSpace, StorageError, check_cancelled};
use tetdb_base::surface::{Surface, VertexTable};
use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::page::NONE;
use tetdb_schema::record::{InterfaceFace, SealedFacet, SealedVertex};
use tetdb_store::sealed::{SealedError, Subdomain, sorted_face};
use tetdb_store::store::Catalog;

/// Bytes held for each face and its vertices, those of the lists from which it is read included.
const FACE_BYTES: u64 = 200;

/// The fixed faces of a sub-domain, each once.
///
/// Triangles are all facets, then the faces of interfaces that are no facets.
pub struct Shell {
    /// In the order of the sub-domain.
    pub vertices: Vec<SealedVertex>,
    /// Vertices are those of the shell.
    pub facets: Vec<SealedFacet>,
    /// All faces of interfaces. Vertices are those of the shell.
    pub faces: Vec<InterfaceFace>,
    /// Triangle of each face of an interface.
    pub triangle_of: Vec<u32>,
    /// Shape: as many as facets and other faces.
    pub triangles: Vec<[u32; 3]>,
}

impl Shell {
    /// Memory that a shell takes while it is read, in bytes.
    pub fn bytes(row: &SubdomainRow) -> u64 {
        FACE_BYTES * (row.facets + row.interface_faces)
    }

    /// Reads the shell of a sub-domain. Errors: damage.
    pub fn read(part: &mut Subdomain) -> Result<Self, PipelineError> {
        let mut facets = part.facets().collect::<Result<Vec<_>, _>>()?;
        let mut faces = part.interfaces().collect::<Result<Vec<_>, _>>()?;
        let corners = facets.iter().map(|f| f.vertices).chain(faces.iter().map(|f| f.vertices));
        let mut numbers: Vec<u32> = corners.flatten().collect();
        numbers.sort_unstable();
        numbers.dedup();
        let (mut vertices, mut next) = (Vec::with_capacity(numbers.len()), 0);
        for chunk in part.vertex_chunks() {
            let chunk = chunk?;
            let end = chunk.first + chunk.records.len() as u32;
            while let Some(&v) = numbers.get(next).filter(|&&v| v < end) {
                vertices.push(chunk.records[(v - chunk.first) as usize]);
                next += 1;
            }
        }
        if next < numbers.len() {
            return Err(part
                .damaged("a face of its shell names a vertex that is not there")
                .into());
        }
        let on_shell = |v: u32| numbers.partition_point(|&w| w < v) as u32;
        facets.iter_mut().for_each(|f| f.vertices = f.vertices.map(on_shell));
        faces.iter_mut().for_each(|f| f.vertices = f.vertices.map(on_shell));
        let mut triangles: Vec<[u32; 3]> = facets.iter().map(|f| f.vertices).collect();
        let sorted = |&corners: &[u32; 3]| sorted_face(corners).0;
        let mut at: Vec<([u32; 3], u32)> = triangles.iter().map(sorted).zip(0..).collect();
        at.sort_unstable();
        let mut triangle_of = Vec::with_capacity(faces.len());
        for face in &faces {
            let known = at.binary_search_by_key(&sorted(&face.vertices), |at| at.0);
            triangle_of.push(match known {
                Ok(known) => at[known].1,
                Err(_) => {
                    triangles.push(face.vertices);
                    triangles.len() as u32 - 1
                }
            });
        }
        Ok(Self { vertices, facets, faces, triangle_of, triangles })
    }

    /// Positions of the vertices.
    pub fn points(&self) -> Vec<Point> {
        self.vertices.iter().map(|v| Point::from_array(v.point)).collect()
    }

    /// Regions of the sub-domain in front of and behind each triangle; 0 where it is not. Errors: damage.
    pub fn sides(&self, part: &mut Subdomain) -> Result<Vec<[u32; 2]>, SealedError> {
        let here =
            |f: &SealedFacet| [0, 1].map(|i| if f.tets[i] == NONE { 0 } else { f.regions[i] });
        let mut sides: Vec<[u32; 2]> = self.facets.iter().map(here).collect();
        sides.resize(self.triangles.len(), [0; 2]);
        let own = self.triangle_of.iter().zip(&self.faces);
        let own = own.filter(|(t, _)| **t as usize >= self.facets.len());
        let mut own: Vec<[u32; 2]> = own.map(|(&t, face)| [face.tet, t]).collect();
        own.sort_unstable();
        let mut own = own.into_iter().peekable();
        for chunk in part.tet_chunks() {
            let chunk = chunk?;
            let end = chunk.first + chunk.records.len() as u32;
            while let Some([tet, triangle]) = own.next_if(|[tet, _]| *tet < end) {
                let region = chunk.records[(tet - chunk.first) as usize].region;
                sides[triangle as usize] = [0, region];
            }
        }
        match own.next() {
            None => Ok(sides),
            Some(_) => Err(part.damaged("a face of an interface has no tetrahedron")),
        }
    }
}

/// The shells of all sub-domains as one surface, each face once; those between sub-domains have a label of their own.
///
/// It does not change when sub-domains are meshed again. Errors: damage; more faces than `room` holds.
pub fn shells(catalog: &mut Catalog, room: &ScratchSpace) -> Result<Surface, PipelineError> {
    let rows = catalog.subdomains()?;
    let needed = rows.iter().map(Shell::bytes).sum();
    if needed > room.available() {
        let (what, available) = ("the faces of all sub-domains", room.available());
        return Err(StorageError::Budget { what, needed, available }.into());
    }
    let _held = room.lease(needed as usize);
    let (mut label_names, label_sets) = (catalog.labels()?, catalog.label_sets()?);
    let between = label_names.len() as u32;
    label_names.push("between sub-domains".to_owned());
    let mut surface = Surface { label_names, label_sets, ..Surface::default() };
    let mut table = VertexTable::default();
    for row in rows {
        check_cancelled();
        let mut part = catalog.open_subdomain(row.rank, (room.available() / 4) as usize)?;
        let shell = Shell::read(&mut part)?;
        let mut add = |corners: [u32; 3], label| {
            let mut corner = |v: u32| {
                let p = Point::from_array(shell.vertices[v as usize].point);
                table.find_or_add(p, &mut surface.points)
            };
            surface.triangles.push(corners.map(&mut corner));
            surface.labels.push(label);
        };
        // A facet between two sub-domains is in both.
        let is_first = |f: &&SealedFacet| f.tets[1] != NONE || f.regions[1] == 0;
        shell.facets.iter().filter(is_first).for_each(|f| add(f.vertices, f.label));
        for (face, &triangle) in shell.faces.iter().zip(&shell.triangle_of) {
            if row.rank < face.other && triangle as usize >= shell.facets.len() {
                add(face.vertices, between);
            }
        }
    }
    Ok(surface)
}

/// Ranks of `ranks` without a coarse snapshot. Errors: a sub-domain that does not exist; damage.
pub fn without_snapshot(
    catalog: &mut Catalog,
    ranks: &BTreeSet<u32>,
) -> Result<Vec<SubdomainRow>, PipelineError> {
    let mut rows = Vec::new();
    for &rank in ranks {
        let row = catalog.subdomain(rank)?;
        if catalog.coarse_snapshot(rank)?.is_none() {
            rows.push(row);
        }
    }
    Ok(rows)
}
