//! Components of tetrahedra between required faces, found by flooding through pages.

use std::collections::BTreeSet;

use crate::geom::orient;
use crate::mesh::Mesh;
use crate::storage::{Pages, check_cancelled};

/// The component that has the enclosing box.
pub(super) const OUTSIDE: u32 = 1;

/// What is known of one component.
#[derive(Clone, Debug, Default)]
pub(super) struct Component {
    pub volume: f64,
    pub tets: u32,
    pub facets: u32,
    /// The first side of a facet at it: twice the facet, and one more for its back.
    pub side_first: u64,
    pub labels: BTreeSet<u32>,
}

/// Components by number; 0 is none, 1 the outside.
pub(super) struct Flood {
    pub components: Vec<Component>,
    /// Of each component one of a lower number that is the same volume, or itself.
    same: Vec<u32>,
}

impl Flood {
    /// Numbers every tetrahedron's component in its region attribute.
    pub(super) fn run<P: Pages>(mesh: &mut Mesh<P>) -> Self {
        let mut from = 0;
        while let Some((t, _)) = mesh.next_tet(from) {
            from = t + 1;
            let (_, flags) = mesh.tet_attribute(t);
            mesh.set_tet_attribute(t, 0, flags);
        }
        mesh.clear_scratch();
        let mut flood = Self {
            components: vec![Component::default()],
            same: Vec::new(),
        };
        let mut stack = Stack::default();
        let outside = mesh.tet_of(0);
        flood.fill(mesh, outside, &mut stack);
        let mut from = 0;
        while let Some((t, _)) = mesh.next_tet(from) {
            from = t + 1;
            if mesh.tet_attribute(t).0 == 0 {
                flood.fill(mesh, t, &mut stack);
            }
        }
        mesh.clear_scratch();
        flood.same = (0..flood.components.len() as u32).collect();
        flood
    }

    fn fill<P: Pages>(&mut self, mesh: &mut Mesh<P>, first: u32, stack: &mut Stack) {
        let component = self.components.len() as u32;
        let mut found = Component {
            side_first: u64::MAX,
            ..Component::default()
        };
        let (_, flags) = mesh.tet_attribute(first);
        mesh.set_tet_attribute(first, component, flags);
        stack.push(mesh, first);
        while let Some(t) = stack.pop(mesh) {
            if found.tets & 4095 == 0 {
                check_cancelled();
            }
            let tet = mesh.tet(t);
            let [a, b, c, d] = mesh.points(&tet);
            found.volume += orient(a, b, c, d) / 6.0;
            found.tets += 1;
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                if !across.exists() || tet.is_required(i) {
                    continue;
                }
                if let (0, flags) = mesh.tet_attribute(across.tet()) {
                    mesh.set_tet_attribute(across.tet(), component, flags);
                    stack.push(mesh, across.tet());
                }
            }
        }
        self.components.push(found);
    }

    /// Two components on the sides of a sheet are one volume.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.volume(a), self.volume(b));
        let (low, high) = (a.min(b), a.max(b));
        if low == high {
            return;
        }
        self.same[high as usize] = low;
        let gone = std::mem::take(&mut self.components[high as usize]);
        let kept = &mut self.components[low as usize];
        kept.volume += gone.volume;
        kept.tets += gone.tets;
        kept.facets += gone.facets;
        kept.side_first = kept.side_first.min(gone.side_first);
        kept.labels.extend(gone.labels);
    }

    /// The component that stands for the volume of component `c`.
    pub(super) fn volume(&self, mut c: u32) -> u32 {
        while self.same[c as usize] != c {
            c = self.same[c as usize];
        }
        c
    }

    /// The components that stand for a volume, but for the outside.
    pub(super) fn volumes(&self) -> impl Iterator<Item = u32> {
        (OUTSIDE + 1..self.components.len() as u32).filter(|&c| self.volume(c) == c)
    }

    /// Facet `n` bounds component `c`.
    pub(super) fn touch(&mut self, c: u32, side: u64, label: u32) {
        let volume = self.volume(c);
        let component = &mut self.components[volume as usize];
        component.facets += 1;
        component.side_first = component.side_first.min(side);
        component.labels.insert(label);
    }
}

/// Numbers that move between memory and scratch pages at a time.
const BLOCK: usize = 1 << 14;

/// A stack whose top is in memory and the rest in scratch pages: a flood's front can be as large as the mesh.
#[derive(Default)]
struct Stack {
    top: Vec<u32>,
    /// Numbers in scratch pages: a multiple of [`BLOCK`].
    n_below: u32,
}

impl Stack {
    #[inline]
    fn push<P: Pages>(&mut self, mesh: &mut Mesh<P>, value: u32) {
        if self.top.len() == 2 * BLOCK {
            for value in self.top.drain(..BLOCK) {
                mesh.set_scratch(self.n_below, value);
                self.n_below += 1;
            }
        }
        self.top.push(value);
    }

    #[inline]
    fn pop<P: Pages>(&mut self, mesh: &mut Mesh<P>) -> Option<u32> {
        if self.top.is_empty() && self.n_below > 0 {
            let first = self.n_below - BLOCK as u32;
            self.top
                .extend((first..self.n_below).map(|n| mesh.scratch(n)));
            self.n_below = first;
        }
        self.top.pop()
    }
}
