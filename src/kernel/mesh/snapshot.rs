//! A working mesh as records to store, in its own order, without derived data.
//!
//! Left out are neighbors, which are matched again, and wanted lengths and `tet_of`, which are set anew by the next
//! step.

use tetdb_schema::record::{self, CoarseFace, CoarseTet, CoarseVertex};

use super::anatomy::{MARK, REQUIRED, VERTEX_MASK};
use super::cursor::Mesh;
use super::{FaceRef, MeshFacet, MeshInterfaceFace, Tet, Workspace, dense, sparse};
use tetdb_base::geom::orient;
use tetdb_base::storage::{Pages, Sorter, StorageError, check_cancelled, sort_record};

sort_record! {
    /// A face of a tetrahedron.
    struct SortedFace {
        /// Ascending.
        vertices: [u32; 3],
        /// A [`FaceRef`].
        place: u32,
        /// True if the order in which they turn is an odd one of the ascending.
        is_odd: bool,
    }
}

impl SortedFace {
    fn new(tet: &Tet, place: FaceRef) -> Self {
        let [a, b, c] = tet.face(place.face());
        let mut vertices = [a, b, c];
        vertices.sort_unstable();
        Self {
            vertices,
            place: place.0,
            // Each pair in the wrong order is one exchange.
            is_odd: (a > b) ^ (b > c) ^ (a > c),
        }
    }
}

impl<P: Pages> Mesh<P> {
    /// Returns whether ids have no gaps, as they have none after [`renumber`](super::renumber): only such a mesh can be kept.
    pub fn is_dense(&self) -> bool {
        dense(self.tet_ids_end()) == self.n_tets()
            && dense(self.vertex_ids_end()) == self.n_vertices()
    }

    /// Tetrahedron number `n` of a mesh without gaps.
    pub fn snapshot_tet(&mut self, n: u32) -> CoarseTet {
        let t = sparse(n);
        let tet = self.tet(t);
        let (region, flags) = self.tet_attribute(t);
        let mut bits = 0;
        for (i, word) in tet.node.into_iter().enumerate() {
            bits |= u8::from(word & REQUIRED != 0) << i | u8::from(word & MARK != 0) << (4 + i);
        }
        CoarseTet { nodes: tet.vertices().map(dense), bits, region, flags }
    }

    /// Vertex number `n` of a mesh without gaps.
    pub fn snapshot_vertex(&mut self, n: u32) -> CoarseVertex {
        let (point, (tag, owner)) = (self.point(sparse(n)), self.vertex_words(sparse(n)));
        CoarseVertex { point: point.to_array(), tag, owner }
    }

    /// Facet number `n`.
    pub fn snapshot_facet(&mut self, n: u32) -> record::WorkingFacet {
        let facet = self.facet(n);
        record::WorkingFacet {
            vertices: facet.vertices.map(dense),
            label: facet.label,
            triangle: facet.input,
            regions: facet.regions,
        }
    }

    /// Interface face number `n`.
    pub fn snapshot_face(&mut self, n: u32) -> CoarseFace {
        let face = self.interface_face(n);
        CoarseFace {
            vertices: face.vertices.map(dense),
            cut: face.cut,
            index: face.index,
            side: face.side,
        }
    }

    /// Adds a vertex as it was kept; whether it is fixed follows from its tag.
    pub fn add_snapshot_vertex(&mut self, vertex: &CoarseVertex) {
        let v = self.add_vertex(tetdb_base::geom::Point::from_array(vertex.point), 0.0);
        if (vertex.tag, vertex.owner) != (0, 0) {
            self.set_vertex_words(v, vertex.tag, vertex.owner);
        }
    }

    /// Adds a tetrahedron as it was kept, its neighbors unknown. Its vertices are there: `false` when one is not.
    pub fn add_snapshot_tet(&mut self, tet: &CoarseTet) -> bool {
        let n_vertices = self.n_vertices();
        if tet.nodes.iter().any(|&v| v >= n_vertices) {
            return false;
        }
        let t = self.take_tet();
        let bit = |i: usize, flag: u32| if tet.bits >> i & 1 != 0 { flag } else { 0 };
        let node = std::array::from_fn(|i| {
            sparse(tet.nodes[i]) & VERTEX_MASK | bit(i, REQUIRED) | bit(4 + i, MARK)
        });
        let neighbor = [FaceRef::NONE; 4];
        self.set_tet(t, Tet { node, neighbor });
        self.set_tet_attribute(t, tet.region, tet.flags);
        true
    }

    /// Adds a facet as it was kept.
    pub fn add_snapshot_facet(&mut self, facet: &record::WorkingFacet) {
        self.add_facet(MeshFacet {
            vertices: facet.vertices.map(sparse),
            label: facet.label,
            input: facet.triangle,
            regions: facet.regions,
        });
    }

    /// Adds an interface face as it was kept.
    pub fn add_snapshot_face(&mut self, face: &CoarseFace) {
        self.add_interface_face(MeshInterfaceFace {
            vertices: face.vertices.map(sparse),
            cut: face.cut,
            index: face.index,
            side: face.side,
        });
    }

    /// Makes neighbors of all pairs of tetrahedra with a common face.
    ///
    /// `false`: it is no mesh. A tetrahedron is not positive, or a face is of more than two, or of two on one side of it; flips rely on
    /// neither. Errors: the disk, while sorting.
    pub fn match_neighbors(&mut self, space: &Workspace) -> Result<bool, StorageError> {
        let mut faces = Sorter::new(space.dir, space.memory);
        let mut from = 0;
        while let Some((t, tet)) = self.next_tet(from) {
            from = t + 1;
            let [a, b, c, d] = self.points(&tet);
            if orient(a, b, c, d) <= 0.0 {
                return Ok(false);
            }
            for i in 0..4 {
                faces.push(SortedFace::new(&tet, FaceRef::new(t, i)))?;
            }
            if t & 1023 == 0 {
                check_cancelled();
            }
        }
        // The face before, and whether it has its neighbor.
        let mut last = None::<(SortedFace, bool)>;
        for face in faces.finish()? {
            let face = face?;
            let same = last.filter(|(before, _)| before.vertices == face.vertices);
            if let Some((before, is_linked)) = same {
                if is_linked || before.is_odd == face.is_odd {
                    return Ok(false);
                }
                self.link(FaceRef(before.place), FaceRef(face.place));
            }
            last = Some((face, same.is_some()));
        }
        Ok(true)
    }
}
