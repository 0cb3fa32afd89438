//! Changes of one's own over pages that several threads read.

use tetdb_schema::page::{RECORDS, SLOT_BITS, Slot, u32_le};

use super::pages::{Pages, SharedPages, kind};

/// Shared pages with changes that nobody else sees, and a list of the tetrahedra that were read.
///
/// Is not: fast. Each access looks the record up among the changes first, when there are any.
pub struct DraftPages<'a> {
    base: SharedPages<'a>,
    /// Where each changed record is among the slots, by kind and id.
    places: Table,
    slots: Vec<Slot>,
    /// Pages appended to each kind.
    appended: [u32; kind::ALL.len()],
    is_met: Table,
    met: Vec<u32>,
}

const ZERO: Slot = [u32_le::from_native(0); 8];

impl<'a> DraftPages<'a> {
    /// Nothing changed, nothing read.
    pub fn new(base: SharedPages<'a>) -> Self {
        Self {
            base,
            places: Table::default(),
            slots: Vec::new(),
            appended: [0; kind::ALL.len()],
            is_met: Table::default(),
            met: Vec::new(),
        }
    }

    /// Forgets changes and what was read.
    pub fn restart(&mut self) {
        self.places.clear();
        self.slots.clear();
        self.appended = [0; kind::ALL.len()];
        self.is_met.clear();
        self.met.clear();
    }

    /// Tetrahedra whose records were read, each once.
    pub fn tets_met(&self) -> &[u32] {
        &self.met
    }

    /// The pages as they are without the changes.
    pub fn base(&self) -> SharedPages<'a> {
        self.base
    }

    /// Whether all records are what they were.
    pub fn is_unchanged(&self) -> bool {
        let is_same = |key: u64, slot: &Slot| {
            let (base, kind, id) = (&self.base, (key >> 32) as usize, key as u32);
            id >> SLOT_BITS < base.n_pages_of(kind) && base.read_of(kind, id) == slot
        };
        (self.places.entries()).all(|(key, at)| is_same(key, &self.slots[at as usize]))
    }

    #[inline(always)]
    fn changed<const K: usize>(&self, id: u32) -> Option<&Slot> {
        if self.slots.is_empty() {
            return None;
        }
        let at = self.places.find(key::<K>(id))?;
        Some(&self.slots[at as usize])
    }

    #[inline(always)]
    fn current<const K: usize>(&self, id: u32) -> &Slot {
        if let Some(slot) = self.changed::<K>(id) {
            return slot;
        }
        if self.appended[K] > 0 && id >> SLOT_BITS >= self.base.n_pages_of(K) {
            return &ZERO;
        }
        self.base.read_of(K, id)
    }
}

#[inline(always)]
fn key<const K: usize>(id: u32) -> u64 {
    (K as u64) << 32 | u64::from(id)
}

impl Pages for DraftPages<'_> {
    #[inline(always)]
    fn read<const K: usize>(&mut self, id: u32) -> &Slot {
        if K == kind::TETS && self.is_met.add(key::<K>(id), 0) {
            self.met.push(id);
        }
        self.current::<K>(id)
    }

    #[inline(always)]
    fn read_four<const K: usize>(&mut self, ids: [u32; 4]) -> [&Slot; 4] {
        let [a, b, c, d] = ids;
        if self.slots.is_empty() && self.appended[K] == 0 {
            return self.base.read_four_of(K, ids);
        }
        [
            self.current::<K>(a),
            self.current::<K>(b),
            self.current::<K>(c),
            self.current::<K>(d),
        ]
    }

    fn write<const K: usize>(&mut self, id: u32) -> &mut Slot {
        let at = self.places.find(key::<K>(id)).unwrap_or_else(|| {
            let (at, slot) = (self.slots.len() as u32, *self.current::<K>(id));
            self.slots.push(slot);
            self.places.add(key::<K>(id), at);
            at
        });
        &mut self.slots[at as usize]
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

/// Numbers by key, all forgotten at once.
struct Table {
    /// Turn and key, and the number. A place of another turn is empty.
    places: Vec<(u64, u32)>,
    turn: u64,
    n: usize,
}

/// Kinds and ids take fewer bits.
const KEY_BITS: u32 = 36;
const KEY_MASK: u64 = (1 << KEY_BITS) - 1;
const PLACES_MIN: usize = 1 << 10;

impl Default for Table {
    fn default() -> Self {
        Self {
            places: vec![(0, 0); PLACES_MIN],
            turn: 1,
            n: 0,
        }
    }
}

impl Table {
    fn clear(&mut self) {
        (self.turn, self.n) = (self.turn + 1, 0);
        if self.turn == 1 << (64 - KEY_BITS) {
            self.places.fill((0, 0));
            self.turn = 1;
        }
    }

    /// Where the key is, or the empty place where it would be.
    #[inline(always)]
    fn at(&self, key: u64) -> (usize, bool) {
        let mask = self.places.len() - 1;
        let wanted = self.turn << KEY_BITS | key;
        let mut at = (key.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as usize & mask;
        loop {
            let found = self.places[at].0;
            if found == wanted {
                return (at, true);
            }
            if found >> KEY_BITS != self.turn {
                return (at, false);
            }
            at = (at + 1) & mask;
        }
    }

    #[inline(always)]
    fn find(&self, key: u64) -> Option<u32> {
        let (at, is_there) = self.at(key);
        is_there.then(|| self.places[at].1)
    }

    /// Adds a key that is new; `false`, with nothing changed, when it is not.
    #[inline(always)]
    fn add(&mut self, key: u64, number: u32) -> bool {
        let (at, is_there) = self.at(key);
        if !is_there {
            self.places[at] = (self.turn << KEY_BITS | key, number);
            self.n += 1;
            if 2 * self.n > self.places.len() {
                self.grow();
            }
        }
        !is_there
    }

    #[cold]
    fn grow(&mut self) {
        let entries: Vec<(u64, u32)> = self.entries().collect();
        self.places = vec![(0, 0); 2 * self.places.len()];
        self.n = 0;
        for (key, number) in entries {
            self.add(key, number);
        }
    }

    fn entries(&self) -> impl Iterator<Item = (u64, u32)> + '_ {
        let used = (self.places.iter()).filter(|place| place.0 >> KEY_BITS == self.turn);
        used.map(|&(word, number)| (word & KEY_MASK, number))
    }
}

const _: () = assert!(RECORDS < 1 << SLOT_BITS && kind::ALL.len() <= 1 << (KEY_BITS - 32));

#[cfg(test)]
mod tests {
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
            // Twice the same, and enough for the tables to grow.
            for id in (0..1500).chain(0..1500) {
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
            assert!(!draft.is_unchanged(), "a page more");
            draft.restart();
            assert!(draft.is_unchanged() && draft.tets_met().is_empty());
        }
        assert_eq!(word(pager.read::<{ kind::TETS }>(3)), 10);
    }
}
