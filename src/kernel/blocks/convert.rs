//! Bricks from the pages of a coarse mesh, and pages from bricks.

use std::sync::Arc;

use tetdb_schema::page::NONE;

use super::brick::{Brick, Bricks, SLOT_BITS, SLOT_MASK};
use super::flat::Vertex;
use super::partition::Partition;
use crate::mesh::anatomy::{MARK, VERTEX_MASK};
use crate::mesh::{FaceRef, Mesh, Tet, dense, sparse};
use tetdb_base::storage::{Pages, StorageError, raise};

/// Where the vertices of the coarse mesh are: reference by dense id.
type Places = Vec<(u32, u32)>;

/// The bricks of a mesh, whose coarse vertices keep their number in their note.
pub(super) fn to_bricks<P: Pages>(mesh: &mut Mesh<P>, partition: &Partition) -> Bricks {
    let mut bricks = vec![Brick::default(); partition.n_bricks()];
    let n = dense(mesh.tet_ids_end());
    let vertices = place_vertices(mesh, n, partition, &mut bricks);
    let mut places: Places = vec![(NONE, 0); n as usize];
    let mut counts = vec![0u32; bricks.len()];
    for k in 0..n {
        let tet = mesh.tet(sparse(k));
        if tet.is_live() {
            let of = |v: u32| vertices[dense(v) as usize].0;
            let [a, b, c, d] = tet.vertices().map(of);
            let brick = a.min(b).min(c.min(d));
            let count = &mut counts[brick as usize];
            places[k as usize] = (brick, *count);
            *count += 1;
        }
    }
    let too_many = |n: usize| n > SLOT_MASK as usize;
    if counts.iter().any(|&n| too_many(n as usize))
        || bricks.iter().any(|b| too_many(b.vertices.len()))
    {
        raise(StorageError::TooMany { what: "tetrahedra in a part of a block" });
    }
    let mut stamps = vec![(NONE, 0u32); bricks.len()];
    let mut order: Vec<u32> = (0..n).filter(|&k| places[k as usize].0 != NONE).collect();
    order.sort_by_key(|&k| places[k as usize]);
    for k in order {
        let number = places[k as usize].0;
        let brick = &mut bricks[number as usize];
        let mut refer = |to: u32, slot: u32| {
            let stamp = &mut stamps[to as usize];
            if stamp.0 != number {
                *stamp = (number, brick.near.len() as u32);
                brick.near.push(to);
            }
            stamp.1 << SLOT_BITS | slot
        };
        let mut tet = mesh.tet(sparse(k));
        for node in &mut tet.node {
            let (to, slot) = vertices[dense(*node & VERTEX_MASK) as usize];
            *node = *node & !(VERTEX_MASK | MARK) | refer(to, slot);
        }
        for face in &mut tet.neighbor {
            if face.exists() {
                let (to, slot) = places[dense(face.tet()) as usize];
                *face = FaceRef::new(refer(to, slot), face.face());
            }
        }
        brick.tets.push(tet);
        brick.attributes.push(mesh.tet_attribute(sparse(k)));
        brick.unexamined += 1;
    }
    bricks.into_iter().map(Arc::new).collect()
}

fn place_vertices<P: Pages>(
    mesh: &mut Mesh<P>,
    n_tets: u32,
    partition: &Partition,
    bricks: &mut [Brick],
) -> Places {
    // Ids given back have no tetrahedron.
    let mut places = vec![(NONE, 0); dense(mesh.vertex_ids_end()) as usize];
    for tet in (0..n_tets).map(sparse) {
        let tet = mesh.tet(tet);
        if tet.is_live() {
            tet.vertices().into_iter().for_each(|v| places[dense(v) as usize].0 = 0);
        }
    }
    for v in mesh.vertex_ids() {
        let place = &mut places[dense(v) as usize];
        if place.0 == NONE {
            continue;
        }
        let (point, h) = mesh.point_and_size(v);
        let number = partition.find(point);
        let vertices = &mut bricks[number as usize].vertices;
        *place = (number, vertices.len() as u32);
        vertices.push(Vertex::new(point, h, mesh.is_fixed(v), v));
    }
    places
}

/// Writes the bricks back: coarse vertices under their numbers, others behind; tetrahedra in the order of the bricks.
pub(super) fn to_pages<P: Pages>(bricks: &Bricks, mesh: &mut Mesh<P>) {
    let mut vertices: Vec<Vec<u32>> = Vec::with_capacity(bricks.len());
    let mut firsts = Vec::with_capacity(bricks.len());
    let mut n_tets = 0u32;
    let mut ids: Vec<Vec<u32>> = Vec::with_capacity(bricks.len());
    for brick in bricks {
        let mut numbers = Vec::with_capacity(brick.vertices.len());
        for vertex in &brick.vertices {
            if vertex.note == NONE {
                numbers.push(mesh.add_vertex(vertex.point, vertex.h()));
            } else {
                if !vertex.is_fixed() {
                    mesh.set_point(vertex.note, vertex.point);
                }
                numbers.push(vertex.note);
            }
        }
        vertices.push(numbers);
        firsts.push(n_tets);
        let mut in_brick = Vec::with_capacity(brick.tets.len());
        for tet in &brick.tets {
            in_brick.push(n_tets);
            n_tets += u32::from(tet.is_live());
        }
        ids.push(in_brick);
    }
    mesh.clear_tets();
    mesh.take_tets(n_tets);
    for (brick, in_brick) in bricks.iter().zip(&ids) {
        for ((tet, &attribute), &id) in brick.tets.iter().zip(&brick.attributes).zip(in_brick) {
            if !tet.is_live() {
                continue;
            }
            let at = |reference: u32| {
                let number = brick.near[(reference >> SLOT_BITS) as usize];
                (number as usize, (reference & SLOT_MASK) as usize)
            };
            let mut out = Tet { ..*tet };
            for node in &mut out.node {
                let (number, slot) = at(*node & VERTEX_MASK);
                *node = *node & !(VERTEX_MASK | MARK) | vertices[number][slot];
            }
            for face in &mut out.neighbor {
                if face.exists() {
                    let (number, slot) = at(face.tet());
                    *face = FaceRef::new(sparse(ids[number][slot]), face.face());
                }
            }
            mesh.place_tet(sparse(id), out);
            if attribute != (0, 0) {
                mesh.set_tet_attribute(sparse(id), attribute.0, attribute.1);
            }
        }
    }
}
