//! The tetrahedra of a selection, found by several threads, still in the order of their ids.

use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use tetdb_schema::ids::TetId;

use super::{Hit, QueryError, QuerySession, Selection};
use tetdb_base::storage::{RunContext, attempt};

/// Values that a thread hands over at a time, and how often it may do so before they are taken. With fewer, threads wait for each other.
const HANDED: usize = 512;
const WAITING: usize = 16;

type Batch<T> = Result<Vec<(TetId, T)>, QueryError>;

/// Calls `each` with `map` of every selected tetrahedron, in the order of their ids. Each session answers on a thread of its own.
///
/// Memory: some 8,000 values for each session but one. Errors: as [`QuerySession::select`]; sessions of different stores are not noticed.
pub fn shared_select<T: Send>(
    sessions: &mut [QuerySession],
    selection: &Selection,
    map: impl Fn(Hit) -> T + Sync,
    mut each: impl FnMut(T),
) -> Result<(), QueryError> {
    if let [session] = sessions {
        for hit in session.select(selection.clone())? {
            each(map(hit?));
        }
        return Ok(());
    }
    let of = sessions.len();
    let context = RunContext::current();
    thread::scope(|scope| {
        let map = &map;
        let mut streams = Vec::new();
        let mut threads = Vec::new();
        for (number, session) in sessions.iter_mut().enumerate() {
            let selection = Selection { share: Some([number, of]), ..selection.clone() };
            let (sender, receiver) = sync_channel(WAITING);
            let context = context.clone();
            threads.push(scope.spawn(move || match context {
                Some(context) => context.enter(|| send(session, selection, map, &sender)),
                None => send(session, selection, map, &sender),
            }));
            streams.push(Stream { receiver, ready: Vec::new().into_iter() });
        }
        let done = merge(&mut streams, &mut each);
        // Threads that still look end when nobody takes what they find.
        drop(streams);
        for thread in threads {
            thread.join().unwrap_or_else(|panic| resume_unwind(panic));
        }
        done
    })
}

/// Sends the values of one share until nobody takes them; ends with an error.
fn send<T>(
    session: &mut QuerySession,
    selection: Selection,
    map: &impl Fn(Hit) -> T,
    sender: &SyncSender<Batch<T>>,
) {
    let found = attempt(|| -> Result<(), QueryError> {
        let mut batch = Vec::with_capacity(HANDED);
        for hit in session.select(selection)? {
            let hit = hit?;
            batch.push((hit.id, map(hit)));
            if batch.len() == HANDED && sender.send(Ok(std::mem::take(&mut batch))).is_err() {
                return Ok(());
            }
        }
        // Without a receiver, nobody waits for the rest.
        let _ = sender.send(Ok(batch));
        Ok(())
    });
    let done = found.map_err(QueryError::from).and_then(|done| done);
    if let Err(error) = done {
        let _ = sender.send(Err(error));
    }
}

/// Values of one share as they arrive.
struct Stream<T> {
    receiver: Receiver<Batch<T>>,
    ready: std::vec::IntoIter<(TetId, T)>,
}

impl<T> Stream<T> {
    /// The id of the next value; `None` after the last.
    fn head(&mut self) -> Result<Option<TetId>, QueryError> {
        loop {
            if let Some((id, _)) = self.ready.as_slice().first() {
                return Ok(Some(*id));
            }
            match self.receiver.recv() {
                Ok(batch) => self.ready = batch?.into_iter(),
                Err(_) => return Ok(None),
            }
        }
    }
}

fn merge<T>(streams: &mut [Stream<T>], each: &mut impl FnMut(T)) -> Result<(), QueryError> {
    loop {
        let mut next: Option<(TetId, usize)> = None;
        for (number, stream) in streams.iter_mut().enumerate() {
            if let Some(id) = stream.head()? {
                next = Some(next.map_or((id, number), |least| least.min((id, number))));
            }
        }
        let Some((_, number)) = next else {
            return Ok(());
        };
        streams[number].ready.next().into_iter().for_each(|(_, value)| each(value));
    }
}
