//! Which part of the mesh has changed since it was last examined.

use crate::mesh::{Mesh, dense};
use tetdb_base::storage::Pages;
use tetdb_schema::page::RECORDS;

/// Tetrahedra of a page.
const PAGE: u32 = RECORDS as u32;

/// Which pages have had new tetrahedra since they were last examined: a byte a page.
pub(super) struct Activity {
    pages: Vec<State>,
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    /// Examined since.
    Idle,
    Active,
    /// Points may go nowhere near any of its tetrahedra.
    Far,
}

impl Activity {
    pub fn all<P: Pages>(mesh: &Mesh<P>) -> Self {
        let mut all = Self { pages: Vec::new() };
        all.again(mesh);
        all
    }

    /// Makes all pages active but those far away.
    pub fn again<P: Pages>(&mut self, mesh: &Mesh<P>) {
        let pages = dense(mesh.tet_ids_end()).div_ceil(PAGE) as usize;
        self.pages.resize(pages, State::Active);
        for page in &mut self.pages {
            if *page == State::Idle {
                *page = State::Active;
            }
        }
    }

    /// Says that a page is far away, until one of its tetrahedra is replaced.
    pub fn set_far(&mut self, page: u32) {
        if let Some(state) = self.pages.get_mut(page as usize) {
            *state = State::Far;
        }
    }

    /// Whether a page is still far away.
    pub fn is_far(&self, page: u32) -> bool {
        self.pages.get(page as usize) == Some(&State::Far)
    }

    pub fn touch(&mut self, tet: u32) {
        let page = (dense(tet) / PAGE) as usize;
        if page >= self.pages.len() {
            self.pages.resize(page + 1, State::Idle);
        }
        self.pages[page] = State::Active;
    }

    /// Whether any page of the dense range is active; clears them.
    pub fn take(&mut self, from: u32, to: u32) -> bool {
        let (first, end) = ((from / PAGE) as usize, to.div_ceil(PAGE) as usize);
        let end = end.min(self.pages.len());
        let mut any = false;
        for page in &mut self.pages[first.min(end)..end] {
            if *page == State::Active {
                *page = State::Idle;
                any = true;
            }
        }
        any
    }
}
