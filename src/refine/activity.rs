//! Which part of the mesh has changed since it was last examined.

use crate::mesh::{Mesh, dense};
use crate::storage::Pages;

/// Which pages have had new tetrahedra since they were last examined: one byte a page.
pub(super) struct Activity {
    pages: Vec<bool>,
}

impl Activity {
    pub fn all<P: Pages>(mesh: &Mesh<P>) -> Self {
        let pages = dense(mesh.tet_ids_end()).div_ceil(2046) as usize;
        Self {
            pages: vec![true; pages],
        }
    }

    pub fn touch(&mut self, tet: u32) {
        let page = (dense(tet) / 2046) as usize;
        if page >= self.pages.len() {
            self.pages.resize(page + 1, false);
        }
        self.pages[page] = true;
    }

    /// Whether any page of the dense range is active; clears them.
    pub fn take(&mut self, from: u32, to: u32) -> bool {
        let (first, end) = ((from / 2046) as usize, to.div_ceil(2046) as usize);
        let end = end.min(self.pages.len());
        let mut any = false;
        for page in &mut self.pages[first.min(end)..end] {
            any |= std::mem::take(page);
        }
        any
    }
}
