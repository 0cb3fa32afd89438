//! Faces of an imported mesh: matched in pairs; those that are kept are the surface and the interfaces.

use super::BadMesh;
use super::place::{AT_ONCE, FileTriangles, Kept, Parts, Placed, Vertices};
use super::records::{FaceSide, PartTet, SharedVertex};
use crate::pipeline::error::PipelineError;
use crate::pipeline::progress::{Event, Watcher};
use tetdb_base::geom::{Point, counted};
use tetdb_base::storage::{ScratchSpace, Sorter, SpillVec, SpillVecBuilder, check_cancelled};
use tetdb_base::surface::SurfaceBuilder;
use tetdb_schema::page::NONE;
use tetdb_schema::record::{FACES, SealedTet};
use tetdb_store::sealed::{BitSet, FacePairs, Paired, sorted_face, sorted_faces};

pub const CONFORM_HELP: &str = "repair the mesh where it comes from: two tetrahedra share a whole face, an edge, a vertex or nothing";

/// Tetrahedra with their sub-domains, and what is collected while their faces are matched.
struct Matching<'a> {
    vertices: Vertices,
    tets: SpillVec<[u32; 6]>,
    parts_of: Parts,
    /// Vertices of the file's triangles.
    marked: BitSet,
    sides: Sorter<FaceSide>,
    order: Sorter<PartTet>,
    first_part: SpillVec<u32>,
    shared: Sorter<SharedVertex>,
    space: &'a ScratchSpace,
}

/// Matches the faces of all tetrahedra. Errors: a mesh that does not conform; too little memory for the surface.
pub fn match_faces(
    vertices: Vertices,
    tets: SpillVec<[u32; 6]>,
    parts_of: Parts,
    mut file: FileTriangles,
    space: &ScratchSpace,
    watch: &Watcher,
) -> Result<Placed, PipelineError> {
    let (n_vertices, cap) = (vertices.points.len(), space.cap());
    let mut matching = Matching {
        vertices,
        tets,
        parts_of,
        marked: BitSet::new(n_vertices as u64),
        sides: space.sorter_within(cap / 4),
        order: space.sorter_within(cap / 4),
        first_part: space.vec(n_vertices, NONE),
        shared: space.sorter_within(cap / 32),
        space,
    };
    let n_stray = matching.take_triangles(&mut file)?;
    matching.take_tets(watch)?;
    let kept = matching.keep(&mut file, n_stray)?;
    let Matching { vertices, tets, parts_of, order, first_part, shared, .. } = matching;
    let KeptFaces { kept, on_surface, surface } = kept;
    Ok(Placed {
        bounds: vertices.bounds,
        n_parts: parts_of.count(),
        surface,
        regions: file.regions,
        notes: file.notes,
        points: vertices.points,
        tets,
        order,
        first_part,
        shared,
        on_surface,
        kept: kept.finish(),
        values: file.values,
    })
}

struct KeptFaces {
    kept: SpillVecBuilder<Kept>,
    on_surface: SpillVec<u32>,
    surface: tetdb_base::surface::Surface,
}

impl Matching<'_> {
    fn point(&mut self, v: u32) -> Point {
        Point::from_array(self.vertices.points.get(v as usize))
    }

    /// Sends the triangles of the file to the sort; returns how many have a vertex of no tetrahedron.
    fn take_triangles(&mut self, file: &mut FileTriangles) -> Result<u64, PipelineError> {
        let (mut n_stray, known) = (0, self.vertices.new_of.len());
        for i in 0..file.triangles.len() {
            let [corners @ .., label] = file.triangles.get(i);
            if let Some(v) = corners.into_iter().find(|&v| v as usize >= known) {
                let what =
                    format!("a triangle names vertex {}, and there are {known}", u64::from(v) + 1);
                let help = "write the file again from the program it comes from";
                return Err(BadMesh::new(what, help).at("triangle", i as u64, &[]).into());
            }
            let vertices = corners.map(|v| self.vertices.new_of.get(v as usize));
            let (face, _) = sorted_face(vertices);
            if vertices.contains(&NONE) || face[0] == face[1] || face[1] == face[2] {
                n_stray += 1;
                continue;
            }
            self.marked.insert_all(face);
            self.sides.push(FaceSide { face, is_tet: false, odd: false, of: label })?;
        }
        // The table is not needed any more.
        self.vertices.new_of = self.space.vec(0, 0);
        Ok(n_stray)
    }

    /// Sets the sub-domain of each tetrahedron and matches the faces within some thousands at a time; the others go to the sort.
    fn take_tets(&mut self, watch: &Watcher) -> Result<(), PipelineError> {
        let (n, is_whole) = (self.tets.len(), self.parts_of.count() == 1);
        if is_whole {
            self.first_part.fill(0);
        }
        let mut pairs = FacePairs::new(AT_ONCE);
        let mut some = Vec::new();
        for from in (0..n).step_by(AT_ONCE) {
            check_cancelled();
            let done = from as u64;
            watch(Event { stage: "match faces", done, total: Some(n as u64), unit: "tetrahedra" });
            pairs.clear();
            some.clear();
            for t in from..n.min(from + AT_ONCE) {
                let [a, b, c, d, region, group] = self.tets.get(t);
                let nodes = [a, b, c, d];
                let points = &mut self.vertices.points;
                let corners = || nodes.map(|v| Point::from_array(points.get(v as usize)));
                let part = self.parts_of.of(group, corners);
                if part != group {
                    self.tets.set(t, [a, b, c, d, region, part]);
                }
                some.push((nodes, region, part));
                let rotated = SealedTet { nodes, region }.rotated().nodes;
                self.order.push(PartTet { part, nodes: rotated, region, tet: t as u32 })?;
                // Of a single sub-domain nothing is shared.
                for v in nodes.into_iter().filter(|_| !is_whole) {
                    match self.first_part.get(v as usize) {
                        NONE => self.first_part.set(v as usize, part),
                        first if first == part => {}
                        _ => self.shared.push(SharedVertex { vertex: v, part })?,
                    }
                }
                for (i, face, odd) in sorted_faces(nodes) {
                    let side = FaceSide { face, is_tet: true, odd, of: (t << 2 | i) as u32 };
                    if face.into_iter().all(|v| self.marked.contains(v.into())) {
                        self.sides.push(side)?;
                        continue;
                    }
                    match pairs.add(face, odd, ((t - from) << 2 | i) as u32) {
                        Paired::Open => {}
                        Paired::With(other) => {
                            let (_, region_b, part_b) = some[other as usize >> 2];
                            if (region_b, part_b) != (region, part) {
                                let of = other + ((from as u32) << 2);
                                self.sides.push(side)?;
                                self.sides.push(FaceSide { odd: !odd, of, ..side })?;
                            }
                        }
                        Paired::Same(_) | Paired::Third => return Err(self.crowded(face, t as u32)),
                    }
                }
            }
            for (face, odd, reference) in pairs.open() {
                let of = reference + ((from as u32) << 2);
                self.sides.push(FaceSide { face, is_tet: true, odd, of })?;
            }
        }
        Ok(())
    }

    fn crowded(&mut self, face: [u32; 3], tet: u32) -> PipelineError {
        let corners = face.map(|v| self.point(v));
        let what = "two tetrahedra lie on one side of a face";
        BadMesh::new(what, CONFORM_HELP).at("tetrahedron", tet.into(), &corners).into()
    }

    /// Reads the sorted sides face by face, and keeps the faces on the boundary, between regions or sub-domains, and of the file.
    fn keep(
        &mut self,
        file: &mut FileTriangles,
        mut n_stray: u64,
    ) -> Result<KeptFaces, PipelineError> {
        let empty = self.space.sorter_within(0);
        let mut sides = std::mem::replace(&mut self.sides, empty).finish()?.peekable();
        let mut builder = SurfaceBuilder::within(self.space.cap() / 2);
        builder.begin_file(&file.stem);
        let mut on_surface = self.space.vec(self.vertices.points.len(), NONE);
        let mut kept = self.space.builder();
        let (mut labels, mut tets) = (Vec::new(), Vec::new());
        while let Some(first) = sides.next() {
            let first: FaceSide = first?;
            labels.clear();
            tets.clear();
            let mut next = Some(first);
            while let Some(side) = next {
                match side.is_tet {
                    true => tets.push(side),
                    false => labels.push(side.of),
                }
                let is_here = |s: &Result<FaceSide, _>| {
                    s.as_ref().map_or(true, |s: &FaceSide| s.face == first.face)
                };
                next = sides.next_if(is_here).transpose()?;
            }
            let [behind, front] = match tets[..] {
                [] => {
                    n_stray += labels.len() as u64;
                    continue;
                }
                [one] => [one.of, NONE],
                // Sorted: the even side comes first.
                [even, odd] if even.odd != odd.odd => [even.of, odd.of],
                [.., last] => return Err(self.crowded(first.face, last.of >> 2)),
            };
            let front = if front == NONE { NONE } else { front >> 2 };
            let (is_wall, is_interface) = self.role(behind >> 2, front);
            let is_surface = is_wall || !labels.is_empty();
            if !is_surface && !is_interface {
                continue;
            }
            let [a, b, c, d, ..] = self.tets.get(behind as usize >> 2);
            let face = FACES[behind as usize & 3].map(|k| [a, b, c, d][k]);
            let mut triangle = NONE;
            if is_surface {
                triangle = builder.n_file_triangles() as u32;
                let corners = self.on_surface(face, &mut builder, &mut on_surface)?;
                let label = label_of(&mut builder, &mut labels, file);
                builder.triangle(corners, label)?;
            }
            let [a, b, c] = face;
            kept.push([a, b, c, behind >> 2, front, triangle]);
        }
        if n_stray > 0 {
            let text = "[triangle is no face of a tetrahedron and was|triangles are no faces of tetrahedra and were] left out";
            file.notes.push(counted(n_stray, text));
        }
        builder.end_file()?;
        Ok(KeptFaces { kept, on_surface, surface: builder.finish() })
    }

    /// Returns whether a face is on the boundary or between regions, and whether it is between sub-domains.
    fn role(&mut self, behind: u32, front: u32) -> (bool, bool) {
        if front == NONE {
            return (true, false);
        }
        let [a, b] = [behind, front].map(|tet| self.tets.get(tet as usize));
        (a[4] != b[4], a[5] != b[5])
    }

    /// The numbers in the surface of a face's vertices; new ones are added.
    fn on_surface(
        &mut self,
        face: [u32; 3],
        builder: &mut SurfaceBuilder,
        on_surface: &mut SpillVec<u32>,
    ) -> Result<[u32; 3], PipelineError> {
        let mut corners = [0; 3];
        for (corner, v) in corners.iter_mut().zip(face) {
            *corner = on_surface.get(v as usize);
            if *corner == NONE {
                *corner = builder.n_file_vertices() as u32;
                builder.vertex(self.point(v))?;
                on_surface.set(v as usize, *corner);
            }
        }
        Ok(corners)
    }
}

/// The label of a face that these triangles of the file are on.
fn label_of(builder: &mut SurfaceBuilder, labels: &mut Vec<u32>, file: &FileTriangles) -> u32 {
    labels.sort_unstable();
    labels.dedup();
    let name = |&label: &u32| match &file.labels.list[label as usize] {
        (0, name) if name.is_empty() => file.stem.clone(),
        (number, name) if name.is_empty() => number.to_string(),
        (_, name) => name.clone(),
    };
    let ids: Vec<u32> = labels.iter().map(|label| builder.label(&name(label))).collect();
    match ids[..] {
        [] => builder.label(&file.stem),
        [one] => one,
        _ => builder.label_of_all(&ids),
    }
}
