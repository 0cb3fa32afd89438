//! Private changes over pages that several threads read.

use std::collections::HashMap;

use tetdb_schema::page::{NONE, SLOT_BITS, Slot, u32_le};

use super::pages::{Pages, SharedPages, kind};

/// Shared pages with private changes, and a list of the tetrahedra that were read.
///
/// Is not: for many changes. Each access looks among them first, when there are any.
pub struct DraftPages<'a> {
    base: SharedPages<'a>,
    /// By kind and id.
    changed: HashMap<(usize, u32), Slot>,
    /// Pages appended to each kind.
    appended: [u32; kind::ALL.len()],
    met: Vec<u32>,
    /// Tetrahedra met last, each in the slot of its id.
    met_last: Vec<u32>,
}

const ZERO: Slot = [u32_le::from_native(0); 8];
/// Slots for the ids read last: most repeated reads are among them.
const PLACES: usize = 1 << 10;

impl<'a> DraftPages<'a> {
    /// Nothing changed, nothing read.
    pub fn new(base: SharedPages<'a>) -> Self {
        Self {
            base,
            changed: HashMap::new(),
            appended: [0; kind::ALL.len()],
            met: Vec::new(),
            met_last: vec![NONE; PLACES],
        }
    }

    /// Drops all changes and the list of reads.
    pub fn restart(&mut self) {
        self.changed.clear();
        self.appended = [0; kind::ALL.len()];
        self.met.clear();
        self.met_last.fill(NONE);
    }

    /// Tetrahedra whose records were read, some more than once.
    pub fn tets_met(&self) -> &[u32] {
        &self.met
    }

    /// The pages as they are without the changes.
    pub fn base(&self) -> SharedPages<'a> {
        self.base
    }

    /// Returns whether all records are unchanged.
    pub fn is_unchanged(&self) -> bool {
        self.changed.iter().all(|(&(kind, id), slot)| {
            let base = &self.base;
            id >> SLOT_BITS < base.n_pages_of(kind) && base.read_of(kind, id) == slot
        })
    }

    #[inline(always)]
    fn current<const K: usize>(&self, id: u32) -> &Slot {
        if !self.changed.is_empty()
            && let Some(slot) = self.changed.get(&(K, id))
        {
            return slot;
        }
        if self.appended[K] > 0 && id >> SLOT_BITS >= self.base.n_pages_of(K) {
            return &ZERO;
        }
        self.base.read_of(K, id)
    }
}

impl Pages for DraftPages<'_> {
    #[inline(always)]
    fn read<const K: usize>(&mut self, id: u32) -> &Slot {
        if K == kind::TETS {
            let last = &mut self.met_last[id as usize % PLACES];
            if *last != id {
                *last = id;
                self.met.push(id);
            }
        }
        self.current::<K>(id)
    }

    #[inline(always)]
    fn read_four<const K: usize>(&mut self, ids: [u32; 4]) -> [&Slot; 4] {
        if self.changed.is_empty() && self.appended[K] == 0 {
            return self.base.read_four_of(K, ids);
        }
        let [a, b, c, d] = ids;
        [self.current::<K>(a), self.current::<K>(b), self.current::<K>(c), self.current::<K>(d)]
    }

    fn write<const K: usize>(&mut self, id: u32) -> &mut Slot {
        let slot = *self.current::<K>(id);
        self.changed.entry((K, id)).or_insert(slot)
    }

    fn n_pages<const K: usize>(&self) -> u32 {
        self.base.n_pages_of(K) + self.appended[K]
    }

    fn append_page<const K: usize>(&mut self) -> u32 {
        self.appended[K] += 1;
        self.n_pages::<K>() - 1
    }

    fn drop_front<const K: usize>(&mut self, _: u32) {
        unreachable!("a draft is of single records")
    }

    fn clear<const K: usize>(&mut self) {
        unreachable!("a draft is of single records")
    }
}

#[cfg(test)]
mod tests {
    use tetdb_schema::page::RECORDS;

    use super::*;
    use crate::storage::Pager;

    #[test]
    fn a_draft_changes_nothing_but_itself() {
        let mut pager = Pager::new(1 << 22, None);
        for page in 0..2 {
            assert_eq!(pager.append_page::<{ kind::TETS }>(), page);
        }
        for id in 0..RECORDS as u32 {
            pager.write::<{ kind::TETS }>(id)[0] = u32_le::from_native(id + 7);
        }
        let word = |slot: &Slot| slot[0].to_native();
        let mut draft = DraftPages::new(pager.shared().expect("all in memory"));
        for turn in 0..3 {
            // More than there are places, some at once again.
            for id in (0..1500).flat_map(|id| [id, id]) {
                assert_eq!(word(draft.read::<{ kind::TETS }>(id)), id + 7);
            }
            assert_eq!(draft.tets_met().len(), 1500);
            assert!(draft.is_unchanged());
            for id in 0..1200 {
                draft.write::<{ kind::TETS }>(id)[0] = u32_le::from_native(turn);
            }
            assert_eq!(word(draft.read::<{ kind::TETS }>(1199)), turn);
            assert_eq!(word(draft.read::<{ kind::TETS }>(1200)), 1207);
            assert!(!draft.is_unchanged());
            let page = draft.append_page::<{ kind::TETS }>();
            assert_eq!((page, draft.n_pages::<{ kind::TETS }>()), (2, 3));
            let new = page << SLOT_BITS;
            assert_eq!(word(draft.read::<{ kind::TETS }>(new)), 0);
            draft.write::<{ kind::TETS }>(new)[0] = u32_le::from_native(5);
            assert_eq!(word(draft.read::<{ kind::TETS }>(new)), 5);
            for id in 0..1200 {
                draft.write::<{ kind::TETS }>(id)[0] = u32_le::from_native(id + 7);
            }
            assert!(!draft.is_unchanged(), "a record more");
            draft.restart();
            assert!(draft.is_unchanged() && draft.tets_met().is_empty());
        }
        assert_eq!(word(pager.read::<{ kind::TETS }>(3)), 10);
    }
}
