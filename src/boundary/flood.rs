//! Components of tetrahedra between required faces, found by flooding through pages.

use std::collections::BTreeSet;

use crate::geom::orient;
use crate::mesh::{Mesh, sparse};
use crate::store::{Pages, kind, stop_if_requested};
use tetdb_schema::page::{SLOT_BITS, u32_le};

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
        mesh.pages_mut().clear::<{ kind::SCRATCH }>();
        let mut flood = Self {
            components: vec![Component::default()],
        };
        let outside = mesh.tet_of(0);
        flood.fill(mesh, outside);
        let mut from = 0;
        while let Some((t, _)) = mesh.next_tet(from) {
            from = t + 1;
            if mesh.tet_attribute(t).0 == 0 {
                flood.fill(mesh, t);
            }
        }
        mesh.pages_mut().clear::<{ kind::SCRATCH }>();
        flood
    }

    fn fill<P: Pages>(&mut self, mesh: &mut Mesh<P>, first: u32) {
        let component = self.components.len() as u32;
        let mut found = Component {
            side_first: u64::MAX,
            ..Component::default()
        };
        let mut stack = Stack { len: 0 };
        enter(mesh, first, component, &mut stack);
        while let Some(t) = stack.pop(mesh) {
            if found.tets & 4095 == 0 {
                stop_if_requested();
            }
            let tet = mesh.tet(t);
            let [a, b, c, d] = mesh.points(&tet);
            found.volume += orient(a, b, c, d) / 6.0;
            found.tets += 1;
            for i in 0..4 {
                let across = tet.neighbor[i];
                if across.exists() && !tet.is_required(i) && mesh.tet_attribute(across.tet()).0 == 0
                {
                    enter(mesh, across.tet(), component, &mut stack);
                }
            }
        }
        self.components.push(found);
    }

    /// Facet `n` bounds component `c`.
    pub(super) fn touch(&mut self, c: u32, side: u64, label: u32) {
        let component = &mut self.components[c as usize];
        component.facets += 1;
        component.side_first = component.side_first.min(side);
        component.labels.insert(label);
    }
}

fn enter<P: Pages>(mesh: &mut Mesh<P>, t: u32, component: u32, stack: &mut Stack) {
    let (_, flags) = mesh.tet_attribute(t);
    mesh.set_tet_attribute(t, component, flags);
    stack.push(mesh, t);
}

/// A stack in scratch pages: a flood's front can be as large as the mesh.
struct Stack {
    len: u32,
}

impl Stack {
    fn push<P: Pages>(&mut self, mesh: &mut Mesh<P>, value: u32) {
        let record = sparse(self.len / 8);
        let pages = mesh.pages_mut();
        while record >> SLOT_BITS >= pages.n_pages::<{ kind::SCRATCH }>() {
            pages.append_page::<{ kind::SCRATCH }>();
        }
        pages.write::<{ kind::SCRATCH }>(record)[self.len as usize % 8] =
            u32_le::from_native(value);
        self.len += 1;
    }

    fn pop<P: Pages>(&mut self, mesh: &mut Mesh<P>) -> Option<u32> {
        self.len = self.len.checked_sub(1)?;
        let record = sparse(self.len / 8);
        let slot = mesh.pages_mut().read::<{ kind::SCRATCH }>(record);
        Some(slot[self.len as usize % 8].to_native())
    }
}
