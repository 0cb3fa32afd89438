//! Messages between ranks.
//!
//! One thread of each process calls MPI. It polls for messages with pauses, so that a waiting process does not occupy a core. It also
//! receives messages while it sends one, so that two processes that send to each other cannot deadlock.

use std::collections::{BTreeMap, VecDeque};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use mpi::Threading;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, Destination, MatchedReceiveVec, Source};
use serde_json::json;

use crate::api::Code;
use tetdb_base::storage::{RunContext, host_name};
use tetdb_io::write::Share;

/// Tag of jobs, of their answers and of the last message. The tags of orders are larger.
pub const CONTROL: i32 = 0;
/// Tag of messages about a file that all ranks write.
pub const FILE: i32 = 32_000;
/// First byte of a message that begins a job or reports success.
pub const DONE: u8 = 0;
/// First byte of the last message.
pub const END: u8 = 1;
/// First byte of an error.
const FAILED: u8 = 2;
/// Pauses between two polls: short while messages arrive, longer when none has arrived for a while.
const PAUSE_LEAST: Duration = Duration::from_micros(200);
pub const PAUSE_MOST: Duration = Duration::from_millis(20);

/// Received messages, by sender and tag.
type Boxes = BTreeMap<(i32, i32), VecDeque<Vec<u8>>>;

struct Message {
    to: i32,
    tag: i32,
    bytes: Vec<u8>,
}

#[derive(Default)]
struct Inbox {
    boxes: Mutex<Boxes>,
    arrived: Condvar,
}

/// Outgoing and received messages of this process.
pub struct Mailbox {
    /// Rank of this process.
    pub rank: i32,
    /// Number of processes.
    pub size: i32,
    /// `None` once the mailbox is closed.
    out: Mutex<Option<Sender<Message>>>,
    inbox: Arc<Inbox>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl Mailbox {
    /// Starts MPI. A process that was started without a launcher is rank 0 of 1.
    pub fn open() -> Self {
        let (out, outgoing) = channel();
        let (ready, started) = channel();
        let inbox = Arc::new(Inbox::default());
        let of_thread = inbox.clone();
        let thread = std::thread::spawn(move || carry(&ready, &outgoing, &of_thread));
        let [rank, size] = started.recv().unwrap_or([0, 1]);
        Self { rank, size, out: Mutex::new(Some(out)), inbox, thread: Mutex::new(Some(thread)) }
    }

    /// Ranks other than 0.
    pub fn others(&self) -> std::ops::Range<i32> {
        1..self.size
    }

    /// The share of this rank in work that is divided among all ranks.
    pub fn share(&self) -> Share {
        Share { number: self.rank as u32 + 1, of: self.size as u32 }
    }

    pub fn send(&self, to: i32, tag: i32, bytes: Vec<u8>) {
        let out = self.out.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(out) = &*out {
            // The thread lives until this sender is dropped.
            let _ = out.send(Message { to, tag, bytes });
        }
    }

    /// Waits for a message that `wanted` accepts. If `stops` is true, returns `None` once this run is cancelled.
    fn receive<T>(&self, stops: bool, wanted: impl Fn(&mut Boxes) -> Option<T>) -> Option<T> {
        let mut boxes = (self.inbox.boxes.lock()).unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(found) = wanted(&mut boxes) {
                return Some(found);
            }
            if stops && RunContext::is_current_cancelled() {
                return None;
            }
            let waited = self.inbox.arrived.wait_timeout(boxes, Duration::from_millis(100));
            boxes = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Waits for a message of one rank; `None` if the run is cancelled.
    pub fn receive_from(&self, rank: i32, tag: i32) -> Option<Vec<u8>> {
        self.receive(true, |boxes| boxes.get_mut(&(rank, tag))?.pop_front())
    }

    /// Waits for the next message of rank 0 and returns it with its tag. Orders come before the end.
    pub fn receive_any(&self) -> (i32, Vec<u8>) {
        let first = |boxes: &mut Boxes| {
            let mut full = boxes.iter_mut().filter(|(_, list)| !list.is_empty());
            // Orders have the larger tags.
            let (&(_, tag), list) = full.next_back()?;
            Some((tag, list.pop_front()?))
        };
        self.receive(false, first).unwrap_or((CONTROL, vec![END]))
    }

    /// Ends the thread, after the threads of all other ranks are ready to end.
    pub fn close(&self) {
        *self.out.lock().unwrap_or_else(PoisonError::into_inner) = None;
        let thread = (self.thread.lock()).unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            let _ = thread.join();
        }
    }
}

/// Encodes an error as a message, with the name of this machine.
pub fn failed(code: Code, message: &str) -> Vec<u8> {
    let text = json!({ "code": code, "message": format!("{message} (on {})", host_name()) });
    [vec![FAILED], text.to_string().into_bytes()].concat()
}

/// Sends and receives until the mailbox is closed.
fn carry(ready: &Sender<[i32; 2]>, outgoing: &Receiver<Message>, inbox: &Inbox) {
    // Dropped at the end of the thread, which waits for all other ranks to end.
    let Some((universe, _)) = mpi::initialize_with_threading(Threading::Funneled) else {
        return;
    };
    let world = universe.world();
    let _ = ready.send([world.rank(), world.size()]);
    let mut pause = PAUSE_LEAST;
    loop {
        let mut is_busy = receive_one(&world, inbox);
        match outgoing.recv_timeout(if is_busy { Duration::ZERO } else { pause }) {
            Ok(message) => {
                send_one(&world, &message, inbox);
                is_busy = true;
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        pause = match is_busy {
            true => PAUSE_LEAST,
            false => (2 * pause).min(PAUSE_MOST),
        };
    }
}

/// Moves an arrived message into the inbox. Returns whether there was one.
fn receive_one(world: &SimpleCommunicator, inbox: &Inbox) -> bool {
    let Some((message, status)) = world.any_process().immediate_matched_probe() else {
        return false;
    };
    let from = (status.source_rank(), status.tag());
    let (bytes, _) = (message, status).matched_receive_vec::<u8>();
    let mut boxes = inbox.boxes.lock().unwrap_or_else(PoisonError::into_inner);
    boxes.entry(from).or_default().push_back(bytes);
    inbox.arrived.notify_all();
    true
}

fn send_one(world: &SimpleCommunicator, message: &Message, inbox: &Inbox) {
    let to = world.process_at_rank(message.to);
    mpi::request::scope(|scope| {
        let mut request = to.immediate_send_with_tag(scope, &message.bytes[..], message.tag);
        while let Err(open) = request.test() {
            request = open;
            if !receive_one(world, inbox) {
                std::thread::sleep(PAUSE_LEAST);
            }
        }
    });
}
