//! Components of tetrahedra between required faces.
//!
//! A flood from tetrahedron to tetrahedron would go to and fro between pages. So pages are scanned in order, three
//! times: for parts of components within each page; for contacts with parts of other pages; for sums over each
//! component.

use std::collections::BTreeSet;

use tetdb_schema::page::{SLOT_BITS, SLOT_MASK, SLOTS};

use crate::mesh::{Mesh, Scan, Tet, scan_parts, tets_of_page};
use tetdb_base::geom::orient;
use tetdb_base::storage::{Pages, kind};

/// The component that has the enclosing box.
pub(super) const OUTSIDE: u32 = 1;

/// Measures of one component.
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
    /// For each component one of a lower number that is the same volume, or itself.
    same: Vec<u32>,
}

/// Pages scanned before their results are written: a megabyte.
const BATCH: usize = 64;

impl Flood {
    /// Numbers every tetrahedron's component in its region attribute: the outside, then the others in the order of their first tetrahedra.
    pub fn run<P: Pages>(mesh: &mut Mesh<P>) -> Self {
        mesh.clear_scratch();
        let pages: Vec<u32> = (0..mesh.pages().n_pages::<{ kind::TETS }>()).collect();
        let mut n_parts = 0;
        for batch in pages.chunks(BATCH) {
            for page in scan_parts(mesh, batch, &PartsOfPage) {
                for &[t, part] in &page.tets {
                    let (_, flags) = mesh.tet_attribute(t);
                    mesh.set_tet_attribute(t, n_parts + part, flags);
                }
                // Each stands for itself so far.
                for _ in 0..page.n_parts {
                    mesh.set_scratch(n_parts, n_parts);
                    n_parts += 1;
                }
            }
        }
        for batch in pages.chunks(BATCH) {
            for [a, b] in scan_parts(mesh, batch, &AdjacentParts).into_iter().flatten() {
                let (a, b) = (root_of(mesh, a), root_of(mesh, b));
                mesh.set_scratch(a.max(b), a.min(b));
            }
        }
        let t = mesh.tet_of(0);
        let part = mesh.tet_attribute(t).0;
        let mut components = vec![Component::default(); 2];
        let outside = root_of(mesh, part);
        for part in 0..n_parts {
            // Its parent comes before it and already has the component's number.
            let on = mesh.scratch(part);
            let component = if part == outside {
                OUTSIDE
            } else if part == on {
                components.push(Component::default());
                components.len() as u32 - 1
            } else {
                mesh.scratch(on)
            };
            mesh.set_scratch(part, component);
        }
        for component in &mut components {
            component.side_first = u64::MAX;
        }
        for batch in pages.chunks(BATCH) {
            for page in scan_parts(mesh, batch, &SumsByComponent) {
                for (t, component) in page.tets {
                    let (_, flags) = mesh.tet_attribute(t);
                    mesh.set_tet_attribute(t, component, flags);
                }
                for (component, volume, tets) in page.sums {
                    let sum = &mut components[component as usize];
                    sum.volume += volume;
                    sum.tets += tets;
                }
            }
        }
        mesh.clear_scratch();
        let same = (0..components.len() as u32).collect();
        Self { components, same }
    }

    /// Two components on the sides of a sheet are one volume.
    pub fn join(&mut self, a: u32, b: u32) {
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
    pub fn volume(&self, mut c: u32) -> u32 {
        while self.same[c as usize] != c {
            c = self.same[c as usize];
        }
        c
    }

    /// The components that stand for a volume, but for the outside.
    pub fn volumes(&self) -> impl Iterator<Item = u32> {
        (OUTSIDE + 1..self.components.len() as u32).filter(|&c| self.volume(c) == c)
    }

    /// Facet `n` bounds component `c`.
    pub fn touch(&mut self, c: u32, side: u64, label: u32) {
        let volume = self.volume(c);
        let component = &mut self.components[volume as usize];
        component.facets += 1;
        component.side_first = component.side_first.min(side);
        component.labels.insert(label);
    }
}

/// The first of the parts that hang together with `part`, which from now on hangs on it more directly.
fn root_of<P: Pages>(mesh: &mut Mesh<P>, mut part: u32) -> u32 {
    loop {
        let on = mesh.scratch(part);
        if on == part {
            return part;
        }
        let next = mesh.scratch(on);
        mesh.set_scratch(part, next);
        part = next;
    }
}

/// Tetrahedra before `t` in its component: no required face lies between.
fn before(t: u32, tet: &Tet) -> impl Iterator<Item = u32> {
    let open = (0..4).filter(|&i| tet.neighbor[i].exists() && !tet.is_required(i));
    let across = open.map(|i| tet.neighbor[i].tet());
    across.filter(move |&u| u < t)
}

/// The tetrahedra of a page, and which part of a component within the page each is in.
struct PartsOfPage;

struct PageParts {
    /// Tetrahedron, part.
    tets: Vec<[u32; 2]>,
    n_parts: u32,
}

impl Scan for PartsOfPage {
    type Part = u32;
    type Output = PageParts;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> PageParts {
        let first = page << SLOT_BITS;
        // By slot, one before it in the same part, or itself.
        let mut on: Vec<u16> = (0..SLOTS as u16).collect();
        let root = |on: &mut [u16], mut slot: u16| {
            while on[slot as usize] != slot {
                let next = on[on[slot as usize] as usize];
                on[slot as usize] = next;
                slot = next;
            }
            slot
        };
        let mut tets = Vec::with_capacity(SLOTS);
        tets_of_page(mesh, page, |_, t, tet| {
            let mut own = (t & SLOT_MASK) as u16;
            for u in before(t, &tet).filter(|&u| u >= first) {
                let other = root(&mut on, (u & SLOT_MASK) as u16);
                own = root(&mut on, own);
                let (low, high) = (own.min(other), own.max(other));
                on[high as usize] = low;
            }
            tets.push([t, 0]);
        });
        let mut number = vec![0; SLOTS];
        let mut n_parts = 0;
        for [t, part] in &mut tets {
            let slot = (*t & SLOT_MASK) as u16;
            let root = root(&mut on, slot);
            if root == slot {
                number[slot as usize] = n_parts;
                n_parts += 1;
            }
            *part = number[root as usize];
        }
        PageParts { tets, n_parts }
    }
}

/// Pairs of parts with a face between them that is not required, from the page of the later tetrahedron, once each.
struct AdjacentParts;

impl Scan for AdjacentParts {
    type Part = u32;
    type Output = Vec<[u32; 2]>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> Vec<[u32; 2]> {
        let first = page << SLOT_BITS;
        let mut met = Vec::new();
        tets_of_page(mesh, page, |mesh, t, tet| {
            for u in before(t, &tet).filter(|&u| u < first) {
                let pair = [t, u].map(|t| mesh.tet_attribute(t).0);
                if met.last() != Some(&pair) {
                    met.push(pair);
                }
            }
        });
        met.sort_unstable();
        met.dedup();
        met
    }
}

/// Components of a page's tetrahedra, and their sums.
struct SumsByComponent;

struct PageSums {
    /// Tetrahedron, component.
    tets: Vec<(u32, u32)>,
    /// Component, volume, tetrahedra, for a run of consecutive tetrahedra.
    sums: Vec<(u32, f64, u32)>,
}

impl Scan for SumsByComponent {
    type Part = u32;
    type Output = PageSums;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> PageSums {
        let mut tets = Vec::with_capacity(SLOTS);
        let mut sums: Vec<(u32, f64, u32)> = Vec::new();
        tets_of_page(mesh, page, |mesh, t, tet| {
            let part = mesh.tet_attribute(t).0;
            let component = mesh.scratch(part);
            let [a, b, c, d] = mesh.points(&tet);
            let volume = orient(a, b, c, d) / 6.0;
            tets.push((t, component));
            match sums.last_mut() {
                Some(sum) if sum.0 == component => {
                    sum.1 += volume;
                    sum.2 += 1;
                }
                _ => sums.push((component, volume, 1)),
            }
        });
        PageSums { tets, sums }
    }
}
