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
    file: Option<ScratchFile>,
    /// Units of the file that are free, by how many there are together.
    free: BTreeMap<usize, Vec<usize>>,
    end: usize,
    buffer: Vec<u8>,
}

struct ShelfPlace<T> {
    object: Option<Arc<T>>,
    /// Where the object is in the file, if that is up to date: first unit and bytes.
    stored: Option<(usize, usize)>,
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
                buffer: Vec::new(),
            }),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Inner<T>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The object of a number.
    pub fn get(&self, number: u32) -> Arc<T> {
        let mut inner = self.lock();
        let object = inner.get(number);
        inner.keep_limit();
        object
    }

    /// The objects of several numbers.
    pub fn get_all(&self, numbers: &[u32]) -> Vec<Arc<T>> {
        let mut inner = self.lock();
        let objects = numbers.iter().map(|&number| inner.get(number)).collect();
        inner.keep_limit();
        objects
    }

    /// Replaces objects.
    pub fn put_all(&self, objects: impl IntoIterator<Item = (u32, Arc<T>)>) {
        let mut inner = self.lock();
        for (number, object) in objects {
            inner.put(number, object);
        }
        inner.keep_limit();
    }

    /// Changes an object.
    pub fn change<R>(&self, number: u32, change: impl FnOnce(&mut T) -> R) -> R {
        let mut inner = self.lock();
        let mut object = inner.get(number);
        inner.forget(number);
        let done = change(Arc::make_mut(&mut object));
        inner.put(number, object);
        inner.keep_limit();
        done
    }

    /// Takes an object out, an empty one is left.
    pub fn take(&self, number: u32) -> Arc<T> {
        let mut inner = self.lock();
        let object = inner.get(number);
        inner.put(number, Arc::default());
        object
    }

    /// Changes the limit.
    pub fn limit(&self, bytes: usize) {
        let mut inner = self.lock();
        inner.limit = bytes;
        inner.keep_limit();
    }
}

impl<T: Shelved> Inner<T> {
    fn get(&mut self, number: u32) -> Arc<T> {
        if let Some(object) = &self.places[number as usize].object {
            let object = Arc::clone(object);
            self.order.put(number, ());
            return object;
        }
        let (unit, n) = self.places[number as usize].stored.expect("it is in the file");
        let file = self.file.as_ref().expect("something is in it");
        self.buffer.resize(n, 0);
        file.read((unit * UNIT) as u64, &mut self.buffer).or_raise();
        let object = Arc::new(T::read(&self.buffer));
        self.bytes += object.bytes();
        self.places[number as usize].object = Some(Arc::clone(&object));
        self.order.put(number, ());
        object
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
        if let Some(old) = place.object.take() {
            // Those never put are not counted.
            self.bytes = self.bytes.saturating_sub(old.bytes());
        }
        if let Some((unit, n)) = place.stored.take() {
            self.free.entry(n.div_ceil(UNIT)).or_default().push(unit);
        }
    }

    fn keep_limit(&mut self) {
        if self.dir.is_none() {
            return;
        }
        while self.bytes > self.limit {
            let Some((number, ())) = self.order.pop_lru() else {
                return;
            };
            let Some(object) = self.places[number as usize].object.take() else {
                continue;
            };
            self.bytes -= object.bytes();
            if self.places[number as usize].stored.is_none() {
                let stored = self.store(&object).unwrap_or_else(|e| raise(e));
                self.places[number as usize].stored = Some(stored);
            }
        }
    }

    fn store(&mut self, object: &T) -> Result<(usize, usize), StorageError> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        object.write(&mut buffer);
        let units = buffer.len().div_ceil(UNIT);
        let unit = match self.free.get_mut(&units).and_then(Vec::pop) {
            Some(unit) => unit,
            None => {
                self.end += units;
                self.end - units
            }
        };
        if self.file.is_none() {
            let dir = self.dir.as_ref().expect("only then anything is stored");
            self.file = Some(ScratchFile::create(dir)?);
        }
        let file = self.file.as_ref().expect("it is there now");
        file.write((unit * UNIT) as u64, &buffer)?;
        let n = buffer.len();
        self.buffer = buffer;
        Ok((unit, n))
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
}
