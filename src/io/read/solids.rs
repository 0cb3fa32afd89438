//! Solid elements of a mesh file: each connected part of them marks a region, with the name of its group.

use std::collections::{HashMap, HashSet};

use super::SurfaceSink;
use tetdb_base::surface::{NoteKind, Seed, SeedKind, SurfaceError, VolumePoints};

/// Bytes held for a tetrahedron while parts are searched.
const TET_BYTES: u64 = 40;

/// Tetrahedra of a file, by vertices of the file; other solid elements are cut into them.
#[derive(Default)]
pub(super) struct Solids {
    /// Corners, and the position of the name.
    tets: Vec<([u32; 4], u32)>,
    names: Vec<String>,
    ids: HashMap<String, u32>,
    n: u64,
}

impl Solids {
    /// Adds a tetrahedron, pyramid, prism or hexahedron by its 4, 5, 6 or 8 corners; no name is the empty one.
    pub fn add(
        &mut self,
        corners: &[u32],
        name: &str,
        target: &SurfaceSink,
    ) -> Result<(), SurfaceError> {
        let id = match self.ids.get(name) {
            Some(&id) => id,
            None => {
                self.names.push(name.to_owned());
                self.ids.insert(name.to_owned(), self.names.len() as u32 - 1);
                self.names.len() as u32 - 1
            }
        };
        let cut: &[[usize; 4]] = match corners.len() {
            5 => &[[0, 1, 2, 4], [0, 2, 3, 4]],
            6 => &[[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]],
            8 => &[
                [0, 1, 2, 6],
                [0, 2, 3, 6],
                [0, 3, 7, 6],
                [0, 7, 4, 6],
                [0, 4, 5, 6],
                [0, 5, 1, 6],
            ],
            _ => &[[0, 1, 2, 3]],
        };
        self.tets.extend(cut.iter().map(|t| (t.map(|k| corners[k]), id)));
        self.n += 1;
        match self.tets.len() == self.tets.capacity() {
            true => target.builder.check_more(TET_BYTES * self.tets.len() as u64),
            false => Ok(()),
        }
    }

    /// Number of elements.
    pub fn len(&self) -> u64 {
        self.n
    }

    /// The tetrahedra, as vertices of the file.
    pub fn tets(&self) -> impl Iterator<Item = [u32; 4]> {
        self.tets.iter().map(|(corners, _)| *corners)
    }

    /// Notes that the elements are left out, and adds a seed for each connected part of them, where any has a name. Parts end at the
    /// triangles of the file. Call before the file ends.
    pub fn finish(self, what: &'static str, target: &mut SurfaceSink) {
        if self.n == 0 {
            return;
        }
        target.builder.note(NoteKind::SkippedElements { what, n: self.n });
        if self.names.iter().all(String::is_empty) {
            return;
        }
        let (mut n_mixed, mut n) = (0, 0);
        for (tet, names) in self.parts(target) {
            let Some(point) = target.builder.middle(self.tets[tet].0) else {
                continue;
            };
            n += 1;
            n_mixed += u64::from(names.len() > 1);
            match names.first() {
                Some(&name) if names.len() == 1 => {
                    drop(target.region(point, &self.names[name as usize]))
                }
                _ => target.builder.seed(Seed { point, kind: SeedKind::Region(None) }),
            }
        }
        target.note_points(VolumePoints::Regions, n);
        if n_mixed > 0 {
            target.builder.note(NoteKind::MixedRegions { n: n_mixed });
        }
    }

    /// For each part, in the order of its first tetrahedron, its largest one and the names in it.
    fn parts(&self, target: &SurfaceSink) -> Vec<(usize, Vec<u32>)> {
        let vert = |v: u32| target.builder.welded(v).unwrap_or(u32::MAX);
        let key = |t: [u32; 3]| {
            let mut key = t.map(vert);
            key.sort_unstable();
            key
        };
        let walls: HashSet<[u32; 3]> = target.builder.file_triangles().map(|t| key(*t)).collect();
        let on_wall: HashSet<u32> = walls.iter().flatten().copied().collect();
        let mut parent: Vec<u32> = (0..self.tets.len() as u32).collect();
        let mut at_vertex: HashMap<u32, u32> = HashMap::new();
        let mut at_face: HashMap<[u32; 3], u32> = HashMap::new();
        for (t, (corners, _)) in (0..).zip(&self.tets) {
            for v in corners.map(vert).into_iter().filter(|v| !on_wall.contains(v)) {
                join(&mut parent, t, *at_vertex.entry(v).or_insert(t));
            }
            let [a, b, c, d] = *corners;
            // A face with an inner vertex is shared through that vertex.
            for face in [[b, c, d], [a, c, d], [a, b, d], [a, b, c]].map(key) {
                if face.iter().all(|v| on_wall.contains(v)) && !walls.contains(&face) {
                    join(&mut parent, t, *at_face.entry(face).or_insert(t));
                }
            }
        }
        let mut parts: Vec<(usize, Vec<u32>)> = Vec::new();
        let mut sizes: Vec<f64> = Vec::new();
        let mut of_root: HashMap<u32, usize> = HashMap::new();
        for (t, (corners, name)) in self.tets.iter().enumerate() {
            let root = find(&mut parent, t as u32);
            let part = *of_root.entry(root).or_insert(parts.len());
            if part == parts.len() {
                parts.push((t, Vec::new()));
                sizes.push(-1.0);
            }
            let size = target.builder.volume(*corners).unwrap_or(0.0);
            if size > sizes[part] {
                (parts[part].0, sizes[part]) = (t, size);
            }
            let names = &mut parts[part].1;
            if !self.names[*name as usize].is_empty() && !names.contains(name) {
                names.push(*name);
            }
        }
        parts
    }
}

fn find(parent: &mut [u32], mut t: u32) -> u32 {
    while parent[t as usize] != t {
        parent[t as usize] = parent[parent[t as usize] as usize];
        t = parent[t as usize];
    }
    t
}

fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parent, a), find(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}
