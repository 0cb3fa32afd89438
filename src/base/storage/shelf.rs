//! Numbered objects of any size under a byte limit: recent ones in memory, the others in a scratch file.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lru::LruCache;

use super::scratch::ScratchFile;
use super::{DiskPath, OrRaise, StorageError, raise};

/// Places in the file begin at multiples of this.
const UNIT: usize = 4096;

/// An object that can be kept in a file.
pub trait Shelved: Clone + Default {
    /// Bytes held in memory, about.
    fn bytes(&self) -> usize;
    /// Appends everything to `out`.
    fn write(&self, out: &mut Vec<u8>);
    /// Reads what [`Shelved::write`] appended.
    fn read(bytes: &[u8]) -> Self;
}

/// Objects with numbers from 0, each empty at first. Shared by threads.
///
/// An object that somebody holds stays in memory; what its holders use is not counted. A failing disk unwinds, as in the pager.
/// Threads read and write the file side by side: the lock is held for looking up alone.
pub struct Shelf<T> {
    inner: Mutex<Inner<T>>,
}

struct Inner<T> {
    places: Vec<ShelfPlace<T>>,
    /// Numbers of the objects in memory.
    order: LruCache<u32, ()>,
    bytes: usize,
    limit: usize,
    dir: Option<DiskPath>,
    file: Option<Arc<ScratchFile>>,
    /// Parts of the file that are free, by units. Somebody may still read what was there.
    free: BTreeMap<usize, Vec<Arc<FilePart>>>,
    end: usize,
}

struct ShelfPlace<T> {
    object: Option<Arc<T>>,
    /// Where the object is in the file, if that is up to date.
    stored: Option<Arc<FilePart>>,
}

/// An object that is to be written before it leaves memory.
struct Leaving<T> {
    number: u32,
    object: Arc<T>,
    file: Arc<ScratchFile>,
}

/// First unit and bytes.
#[derive(Clone, Copy)]
struct FilePart {
    unit: usize,
    n: usize,
}

impl<T: Shelved> Shelf<T> {
    /// `n` empty objects, `limit` bytes of which stay in memory. Without `dir` all do.
    pub fn new(n: usize, limit: usize, dir: Option<DiskPath>) -> Self {
        let empty = Arc::new(T::default());
        let place = || ShelfPlace { object: Some(Arc::clone(&empty)), stored: None };
        Self {
            inner: Mutex::new(Inner {
                places: std::iter::repeat_with(place).take(n).collect(),
                order: LruCache::unbounded(),
                bytes: 0,
                limit,
                dir,
                file: None,
                free: BTreeMap::new(),
                end: 0,
            }),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Inner<T>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The object of a number.
    pub fn get(&self, number: u32) -> Arc<T> {
        let object = self.load(number, &mut Vec::new());
        self.keep_limit();
        object
    }

    /// The objects of several numbers.
    pub fn get_all(&self, numbers: &[u32]) -> Vec<Arc<T>> {
        let mut objects: Vec<_> = {
            let mut inner = self.lock();
            numbers.iter().map(|&number| inner.get(number)).collect()
        };
        let mut buffer = Vec::new();
        for (object, &number) in objects.iter_mut().zip(numbers) {
            if object.is_none() {
                *object = Some(self.load(number, &mut buffer));
            }
        }
        self.keep_limit();
        objects.into_iter().flatten().collect()
    }

    /// Replaces objects.
    pub fn put_all(&self, objects: impl IntoIterator<Item = (u32, Arc<T>)>) {
        let mut inner = self.lock();
        for (number, object) in objects {
            inner.put(number, object);
        }
        drop(inner);
        self.keep_limit();
    }

    /// Changes an object. Nobody else may have it in use.
    pub fn change<R>(&self, number: u32, change: impl FnOnce(&mut T) -> R) -> R {
        let mut object = self.load(number, &mut Vec::new());
        let mut inner = self.lock();
        inner.forget(number);
        let done = change(Arc::make_mut(&mut object));
        inner.put(number, object);
        let is_over = inner.is_over();
        drop(inner);
        if is_over {
            self.keep_limit();
        }
        done
    }

    /// Takes an object out, an empty one is left.
    pub fn take(&self, number: u32) -> Arc<T> {
        let object = self.load(number, &mut Vec::new());
        self.lock().put(number, Arc::default());
        object
    }

    /// Changes the limit.
    pub fn limit(&self, bytes: usize) {
        self.lock().limit = bytes;
        self.keep_limit();
    }

    /// Lowers the limit by so many bytes, but by half of it at most.
    pub fn make_room(&self, bytes: usize) {
        let limit = self.lock().limit;
        self.limit(limit.saturating_sub(bytes).max(limit / 2));
    }

    /// The object of a number, which is read without keeping others waiting.
    fn load(&self, number: u32, buffer: &mut Vec<u8>) -> Arc<T> {
        loop {
            let (file, part) = {
                let mut inner = self.lock();
                if let Some(object) = inner.get(number) {
                    return object;
                }
                let file = inner.file.as_ref().expect("something is in it");
                let part =
                    inner.places[number as usize].stored.as_ref().expect("it is in the file");
                (Arc::clone(file), Arc::clone(part))
            };
            buffer.resize(part.n, 0);
            file.read((part.unit * UNIT) as u64, buffer).or_raise();
            let object = Arc::new(T::read(buffer));
            let mut inner = self.lock();
            let place = &mut inner.places[number as usize];
            let is_recent = place.stored.as_ref().is_some_and(|now| Arc::ptr_eq(now, &part));
            if is_recent && place.object.is_none() {
                place.object = Some(Arc::clone(&object));
                inner.bytes += object.bytes();
                inner.order.put(number, ());
                return object;
            }
        }
    }

    /// Writes the objects used longest ago, one at a time and without keeping others waiting, until the rest is within the limit.
    fn keep_limit(&self) {
        let mut buffer = Vec::new();
        loop {
            let next = self.lock().next_to_write().unwrap_or_else(|e| raise(e));
            let Some(Leaving { number, object, file }) = next else {
                return;
            };
            buffer.clear();
            object.write(&mut buffer);
            let part = self.lock().part(buffer.len());
            file.write((part.unit * UNIT) as u64, &buffer).or_raise();
            self.lock().written(number, &object, part);
        }
    }
}

impl<T: Shelved> Inner<T> {
    /// The object, if it is in memory.
    fn get(&mut self, number: u32) -> Option<Arc<T>> {
        let object = Arc::clone(self.places[number as usize].object.as_ref()?);
        if self.order.put(number, ()).is_none() {
            // It was about to leave, or was never put.
            self.bytes += object.bytes();
        }
        Some(object)
    }

    fn put(&mut self, number: u32, object: Arc<T>) {
        self.forget(number);
        self.bytes += object.bytes();
        self.places[number as usize].object = Some(object);
        self.order.put(number, ());
    }

    /// Forgets an object and its place in the file.
    fn forget(&mut self, number: u32) {
        let place = &mut self.places[number as usize];
        if let Some(old) = place.object.take()
            && self.order.pop(&number).is_some()
        {
            self.bytes -= old.bytes();
        }
        if let Some(part) = place.stored.take() {
            self.free.entry(part.n.div_ceil(UNIT)).or_default().push(part);
        }
    }

    fn is_over(&self) -> bool {
        self.dir.is_some() && self.bytes > self.limit
    }

    /// The object used longest ago, if it has to leave memory and is not in the file. Those that are in the file leave at once.
    fn next_to_write(&mut self) -> Result<Option<Leaving<T>>, StorageError> {
        while self.is_over() {
            let Some((number, ())) = self.order.pop_lru() else {
                break;
            };
            let place = &mut self.places[number as usize];
            let object = place.object.clone().expect("what is in order is in memory");
            self.bytes -= object.bytes();
            if place.stored.is_some() {
                place.object = None;
                continue;
            }
            if self.file.is_none() {
                let dir = self.dir.as_ref().expect("only then anything leaves");
                self.file = Some(Arc::new(ScratchFile::create(dir)?));
            }
            let file = Arc::clone(self.file.as_ref().expect("it is there now"));
            return Ok(Some(Leaving { number, object, file }));
        }
        Ok(None)
    }

    /// A part of the file for `n` bytes.
    fn part(&mut self, n: usize) -> FilePart {
        let units = n.div_ceil(UNIT);
        if let Some(free) = self.free.get_mut(&units)
            && let Some(at) = free.iter().rposition(|part| Arc::strong_count(part) == 1)
        {
            return FilePart { unit: free.swap_remove(at).unit, n };
        }
        self.end += units;
        FilePart { unit: self.end - units, n }
    }

    /// The object was written. It leaves, unless somebody has used or replaced it meanwhile.
    fn written(&mut self, number: u32, object: &Arc<T>, part: FilePart) {
        let place = &mut self.places[number as usize];
        let is_same = place.object.as_ref().is_some_and(|now| Arc::ptr_eq(now, object));
        let part = Arc::new(part);
        if is_same && place.stored.is_none() {
            place.stored = Some(part);
        } else {
            self.free.entry(part.n.div_ceil(UNIT)).or_default().push(part);
        }
        if is_same && !self.order.contains(&number) {
            place.object = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Shelved for Vec<u8> {
        fn bytes(&self) -> usize {
            self.len()
        }
        fn write(&self, out: &mut Vec<u8>) {
            out.extend_from_slice(self);
        }
        fn read(bytes: &[u8]) -> Self {
            bytes.to_vec()
        }
    }

    #[test]
    fn what_leaves_memory_comes_back() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let shelf = Shelf::<Vec<u8>>::new(50, 20_000, Some(dir.path().into()));
        let content = |k: u32, turn: u8| vec![turn ^ k as u8; 100 * k as usize + usize::from(turn)];
        for turn in 0..3 {
            shelf.put_all((0..50).map(|k| (k, Arc::new(content(k, turn)))));
            for k in (0..50).rev() {
                assert_eq!(*shelf.get(k), content(k, turn));
            }
        }
        let bytes = shelf.lock().bytes;
        let units = shelf.lock().end;
        assert!(
            bytes <= 20_000 && units * UNIT > 100_000,
            "{bytes} in memory, {units} in the file"
        );
        shelf.change(7, |all| all.push(1));
        assert_eq!(shelf.take(7).len(), 703);
        assert!(shelf.get(7).is_empty());
        shelf.limit(0);
        assert_eq!(shelf.lock().bytes, 0);
        assert_eq!(*shelf.get(9), content(9, 2));
    }

    /// Each thread has objects of its own, which it changes, and reads those of others.
    #[test]
    fn threads_read_and_write_side_by_side() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let shelf = Shelf::<Vec<u8>>::new(64, 30_000, Some(dir.path().into()));
        let work = |thread: u32| {
            for turn in 1..200u32 {
                let own = thread * 16 + turn * 7 % 16;
                let n = 500 + (turn as usize * 97 + own as usize) % 9_000;
                shelf.put_all([(own, Arc::new(vec![own as u8; n]))]);
                let others: Vec<u32> = (0..64).filter(|k| k % 5 == turn % 5).collect();
                for (k, object) in others.iter().zip(shelf.get_all(&others)) {
                    assert!(object.iter().all(|&byte| byte == *k as u8), "object {k}");
                }
                assert_eq!(shelf.get(own).len(), n);
            }
        };
        std::thread::scope(|scope| {
            for thread in 0..4 {
                let work = &work;
                scope.spawn(move || work(thread));
            }
        });
        let in_memory = |inner: &Inner<Vec<u8>>| -> usize {
            inner.places.iter().flat_map(|place| &place.object).map(|object| object.len()).sum()
        };
        let inner = shelf.lock();
        assert_eq!(inner.bytes, in_memory(&inner));
        assert!(inner.bytes <= 30_000, "{}", inner.bytes);
    }
}
