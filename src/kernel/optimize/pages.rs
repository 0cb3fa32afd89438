//! Which pages of tetrahedra still have something to look at: one flag a page, nothing per tetrahedron.
//!
//! A tetrahedron that resisted every operation carries the mark "examined" until something near
//! it changes. Pages without news are not read again.

use tetdb_schema::page::{SLOT_BITS, SLOTS};

use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::anatomy::{MARK, VERTEX_MASK};
use crate::mesh::{Mesh, Tet};
use tetdb_base::storage::Pages;

/// Which way a pass goes through the pages.
///
/// A pass that begins where the one before it ended finds those pages still in memory. When all go the same way and one frame is missing, each
/// reads every page again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    Up,
    Down,
}

impl Way {
    pub(super) fn turned(self) -> Self {
        match self {
            Self::Up => Self::Down,
            Self::Down => Self::Up,
        }
    }

    /// The numbers of `n` pages.
    pub(super) fn pages(self, n: u32) -> impl Iterator<Item = u32> {
        (0..n).map(move |i| match self {
            Self::Up => i,
            Self::Down => n - 1 - i,
        })
    }

    /// The pages of tetrahedra, as many as there are now.
    pub(super) fn tet_pages<P: Pages>(self, mesh: &Mesh<P>) -> impl Iterator<Item = u32> + use<P> {
        self.pages(mesh.tet_ids_end().div_ceil(SLOTS as u32))
    }
}

/// Flags per page of tetrahedra.
#[derive(Clone, Default)]
pub(super) struct PageFlags {
    flags: Vec<bool>,
}

impl PageFlags {
    /// All pages of the mesh flagged.
    pub(super) fn all<P: Pages>(mesh: &Mesh<P>) -> Self {
        let n = (mesh.tet_ids_end() as usize).div_ceil(SLOTS);
        Self { flags: vec![true; n] }
    }

    /// Flags the page of `t`.
    #[inline]
    pub(super) fn raise(&mut self, t: u32) {
        self.raise_page(t >> SLOT_BITS);
    }

    /// Flags a page.
    pub(super) fn raise_page(&mut self, page: u32) {
        let page = page as usize;
        if page >= self.flags.len() {
            self.flags.resize(page + 1, false);
        }
        self.flags[page] = true;
    }

    /// Flags of pages that are flagged here or in `other`.
    pub(super) fn or(mut self, other: &Self) -> Self {
        for page in (0..).zip(&other.flags).filter_map(|(page, &f)| f.then_some(page)) {
            self.raise_page(page);
        }
        self
    }

    /// All flagged pages, in order; their flags are taken down.
    pub(super) fn take_all(&mut self) -> Vec<u32> {
        let flags = std::mem::take(&mut self.flags);
        (0..).zip(flags).filter_map(|(page, f)| f.then_some(page)).collect()
    }

    /// The first flagged page from `from` on; its flag is taken down.
    pub(super) fn take_next(&mut self, from: u32) -> Option<u32> {
        let skipped = self.flags.get(from as usize..)?.iter().position(|&f| f)?;
        let page = from as usize + skipped;
        self.flags[page] = false;
        Some(page as u32)
    }
}

/// Whether every operation has failed on this tetrahedron since something near it changed.
#[inline]
pub(super) fn is_examined(tet: &Tet) -> bool {
    tet.node[EXAMINED] & MARK != 0
}

/// Says that `t`, near which something changed, is worth another look if it is a bad one.
pub(super) fn reopen<P: Pages>(mesh: &mut Mesh<P>, flags: &mut PageFlags, t: u32) {
    let tet = mesh.tet(t);
    if tet.is_live() && is_examined(&tet) {
        mesh.set_mark(t, EXAMINED, false);
        flags.raise(t);
    }
}

/// Takes all marks of a tetrahedron down.
#[inline]
pub(super) fn clear_marks<P: Pages>(mesh: &mut Mesh<P>, t: u32, tet: &Tet) {
    for i in 0..4 {
        if tet.node[i] & MARK != 0 {
            mesh.set_mark(t, i, false);
        }
    }
}

const _: () = assert!(VERTEX_MASK & MARK == 0);
