//! Ranks of an MPI program share a mesh: rank 0 is the program as ever, the others do orders that come as messages.
//!
//! One thread of each process speaks MPI and looks for messages with pauses, so that who waits burns no core. A message is sent while others
//! are taken in, so that two processes that send to each other never wait for each other.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::collections::VecDeque;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tetdb_schema::code::Code;

use mpi::Threading;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, Destination, MatchedReceiveVec, Source};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::failure::Failure;
use super::tasks;
use tetdb_base::storage::{Budget, RemoteFailure, RunContext, host_name};
use tetdb_engine::api::verify_server::Server;
use tetdb_engine::api::{Error, Settings, guarded};
use tetdb_engine::pipeline::{self, Hands, Helpers, PipelineError, TaskSettings};
use tetdb_io::write::{Share, Writers};

/// Tag of what is no order: jobs, their answers, the end.
const CONTROL: i32 = 0;
/// Tag of what is said about a file that all write.
const FILE: i32 = 32_000;
/// First byte of a message that begins a job or says that something is done; of the end; of an error.
const DONE: u8 = 0;
const END: u8 = 1;
const FAILED: u8 = 2;
/// Pauses between two looks for messages: short while they come, longer when none has come for a while.
const PAUSE_LEAST: Duration = Duration::from_micros(200);
const PAUSE_MOST: Duration = Duration::from_millis(20);
/// How long files of other machines may be late.
const WAIT: Duration = Duration::from_secs(60);

static RANKS: OnceLock<Arc<Ranks>> = OnceLock::new();
static HELPERS: OnceLock<Arc<RankHelpers>> = OnceLock::new();

/// What a rank got from another, by sender and tag.
type Boxes = BTreeMap<(i32, i32), VecDeque<Vec<u8>>>;

struct Letter {
    to: i32,
    tag: i32,
    bytes: Vec<u8>,
}

#[derive(Default)]
struct Inbox {
    boxes: Mutex<Boxes>,
    arrived: Condvar,
}

/// This process among the others.
pub(super) struct Ranks {
    pub rank: i32,
    size: i32,
    /// `None` once it ends.
    out: Mutex<Option<Sender<Letter>>>,
    inbox: Arc<Inbox>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

/// The ranks of this program; `None` where no launcher of MPI has started it.
///
/// Errors: a launcher of another MPI has.
pub(super) fn begin() -> Result<Option<Arc<Ranks>>, Failure> {
    let Some(launched) = launched() else {
        return Ok(None);
    };
    let (out, outgoing) = channel();
    let (ready, started) = channel();
    let inbox = Arc::new(Inbox::default());
    let of_thread = inbox.clone();
    let thread = std::thread::spawn(move || speak(&ready, &outgoing, &of_thread));
    let [rank, size] = started.recv().unwrap_or([0, 1]);
    let ranks = Arc::new(Ranks {
        rank,
        size,
        out: Mutex::new(Some(out)),
        inbox,
        thread: Mutex::new(Some(thread)),
    });
    if size == 1 && launched > 1 {
        ranks.end();
        let message = format!(
            "the launcher has started {launched} processes, and the MPI that this program was built with sees one"
        );
        return Err(Failure::new(Code::Usage, message).help(
            "start it with the mpirun of the MPI it was built with, or build it with this one",
        ));
    }
    if size > 1 {
        let _ = RANKS.set(ranks.clone());
    }
    if size > 1 && rank == 0 {
        let _ = HELPERS.set(Arc::new(RankHelpers::of(&ranks)));
    }
    Ok(Some(ranks))
}

/// How many processes a launcher says it has started.
fn launched() -> Option<i32> {
    let number = |name| std::env::var(name).ok()?.parse().ok();
    let sizes = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"].map(number);
    let one = std::env::var_os("PMIX_RANK").map(|_| 1);
    sizes.into_iter().flatten().chain(one).max()
}

/// What this rank does of work that all ranks share; `None` where there are no others.
pub(super) fn share() -> Option<Share> {
    RANKS.get().map(|ranks| ranks.share())
}

/// Adds to what rank 0 did of such work what the others did; they send theirs. Errors: of any rank.
pub(super) fn gather<T: Serialize + DeserializeOwned>(
    mine: Result<T, Failure>,
    add: impl Fn(&mut T, T),
) -> Result<T, Failure> {
    let Some(ranks) = RANKS.get() else {
        return mine;
    };
    if ranks.rank > 0 {
        let bytes = match &mine {
            Ok(done) => [vec![DONE], json!(done).to_string().into_bytes()].concat(),
            Err(failure) => failed(failure.code, &failure.message),
        };
        ranks.send(0, CONTROL, bytes);
        return mine;
    }
    let helpers = RankHelpers::of(ranks);
    // All are heard, whatever one of them says, so that none sends to who is gone.
    let others: Vec<_> = (1..ranks.size).map(|rank| helpers.answer(rank, CONTROL)).collect();
    let mut all = mine?;
    for answer in others {
        let answer = answer.map_err(PipelineError::from)?;
        let theirs = serde_json::from_slice(&answer);
        add(&mut all, theirs.map_err(|e| Failure::new(Code::Internal, e))?);
    }
    Ok(all)
}

/// A file that all ranks write together, each its partitions.
pub(super) struct SharedFile {
    ranks: Arc<Ranks>,
    /// Whether rank 0 has announced it.
    is_announced: Cell<bool>,
}

impl SharedFile {
    /// `None` where there are no other ranks.
    pub fn new() -> Option<Self> {
        Some(Self { ranks: RANKS.get()?.clone(), is_announced: Cell::new(false) })
    }

    fn announce_to_all(&self, letter: &[u8]) {
        self.is_announced.set(true);
        (1..self.ranks.size).for_each(|rank| self.ranks.send(rank, FILE, letter.to_vec()));
    }
}

impl Writers for SharedFile {
    fn share(&self) -> Share {
        self.ranks.share()
    }

    fn announce(&self, file: &Path) {
        self.announce_to_all(&[&[DONE], file.as_os_str().as_bytes()].concat());
    }

    fn hear(&self) -> Option<PathBuf> {
        let letter = self.ranks.receive_from(0, FILE)?;
        let path = PathBuf::from(OsStr::from_bytes(letter.strip_prefix(&[DONE])?));
        // A file of another machine may be late.
        let begun = Instant::now();
        while !path.exists() && begun.elapsed() < WAIT {
            std::thread::sleep(PAUSE_MOST);
        }
        Some(path)
    }

    fn say(&self, done: Result<(), RemoteFailure>) {
        let letter = match done {
            Ok(()) => vec![DONE],
            Err(failure) => failed(failure.code, &failure.message),
        };
        self.ranks.send(0, FILE, letter);
    }

    fn wait(&self) -> Result<(), RemoteFailure> {
        let helpers = RankHelpers::of(&self.ranks);
        // All are heard: none writes any more when the file goes.
        let others: Vec<_> = (1..self.ranks.size).map(|rank| helpers.answer(rank, FILE)).collect();
        others.into_iter().try_for_each(|done| done.map(drop))
    }
}

impl Drop for SharedFile {
    /// Where rank 0 failed before there was a file, the others wait for none.
    fn drop(&mut self) {
        if self.ranks.rank == 0 && !self.is_announced.get() {
            self.announce_to_all(&[END]);
        }
    }
}

/// The other ranks, for a run of this process.
pub(super) fn hands() -> Hands {
    Hands(HELPERS.get().map(|helpers| helpers.clone() as Arc<dyn Helpers>))
}

fn speak(ready: &Sender<[i32; 2]>, outgoing: &Receiver<Letter>, inbox: &Inbox) {
    // Dropped at the end of the thread, which waits for all others to end.
    let Some((universe, _)) = mpi::initialize_with_threading(Threading::Funneled) else {
        return;
    };
    let world = universe.world();
    let _ = ready.send([world.rank(), world.size()]);
    let mut pause = PAUSE_LEAST;
    loop {
        let mut is_busy = take_in(&world, inbox);
        match outgoing.recv_timeout(if is_busy { Duration::ZERO } else { pause }) {
            Ok(letter) => {
                send(&world, &letter, inbox);
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

/// Takes in what has come; whether anything has.
fn take_in(world: &SimpleCommunicator, inbox: &Inbox) -> bool {
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

fn send(world: &SimpleCommunicator, letter: &Letter, inbox: &Inbox) {
    let to = world.process_at_rank(letter.to);
    mpi::request::scope(|scope| {
        let mut request = to.immediate_send_with_tag(scope, &letter.bytes[..], letter.tag);
        while let Err(open) = request.test() {
            request = open;
            if !take_in(world, inbox) {
                std::thread::sleep(PAUSE_LEAST);
            }
        }
    });
}

impl Ranks {
    fn share(&self) -> Share {
        Share { number: self.rank as u32 + 1, of: self.size as u32 }
    }

    fn send(&self, to: i32, tag: i32, bytes: Vec<u8>) {
        let out = self.out.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(out) = &*out {
            // The thread lives until this is gone.
            let _ = out.send(Letter { to, tag, bytes });
        }
    }

    /// Waits for what `wanted` finds; `None` once this run is to stop, where `stops` says that this counts.
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

    /// From one rank, or `None` when the run is to stop.
    fn receive_from(&self, rank: i32, tag: i32) -> Option<Vec<u8>> {
        self.receive(true, |boxes| boxes.get_mut(&(rank, tag))?.pop_front())
    }

    /// Whatever rank 0 has sent.
    fn receive_any(&self) -> (i32, Vec<u8>) {
        let first = |boxes: &mut Boxes| {
            let mut full = boxes.iter_mut().filter(|(_, list)| !list.is_empty());
            // Orders before the end: they have the higher tags.
            let (&(_, tag), list) = full.next_back()?;
            Some((tag, list.pop_front()?))
        };
        self.receive(false, first).unwrap_or((CONTROL, vec![END]))
    }

    /// Lets all end, and waits for them.
    pub fn end(&self) {
        if self.rank == 0 {
            (1..self.size).for_each(|rank| self.send(rank, CONTROL, vec![END]));
        }
        *self.out.lock().unwrap_or_else(PoisonError::into_inner) = None;
        let thread = (self.thread.lock()).unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            let _ = thread.join();
        }
    }

    /// Does what rank 0 asks for, until it says that this is the end; `begin` tells how the command runs.
    pub fn serve(&self, begin: impl Fn() -> Result<Settings, Failure>) -> u8 {
        let (_, mut letter) = self.receive_any();
        while let Some((&DONE, job)) = letter.split_first() {
            let done = begin().and_then(|settings| {
                let done = guarded(&settings, || self.serve_job(job, &settings));
                done.map_err(Failure::from)
            });
            letter = done.unwrap_or_else(|failure| {
                self.send(0, CONTROL, failed(failure.code, &failure.message));
                self.receive_any().1
            });
        }
        0
    }

    /// Does orders of a job; what came after the last of them.
    fn serve_job(&self, job: &[u8], settings: &Settings) -> Result<Vec<u8>, Error> {
        let started = |slots: usize| {
            let bytes = [vec![DONE], (slots as u32).to_le_bytes().to_vec()].concat();
            self.send(0, CONTROL, bytes);
        };
        let mut end = vec![END];
        let mut next = || match self.receive_any() {
            (CONTROL, letter) => {
                end = letter;
                None
            }
            (tag, order) => Some((tag as usize - 1, order)),
        };
        let answer = |slot: usize, done: Result<Vec<u8>, Error>| {
            let bytes = match done {
                Ok(receipt) => [vec![DONE], receipt].concat(),
                Err(error) => failed(error.code(), error.message()),
            };
            self.send(0, slot as i32 + 1, bytes);
        };
        if let Some(server) = Server::begin(job, settings) {
            let server = server?;
            started(1);
            while let Some((slot, order)) = next() {
                answer(slot, server.perform(&order));
            }
            return Ok(end);
        }
        let how = TaskSettings { scratch: tasks::scratch_of_machine(), wait: WAIT };
        let answer = |slot, done: Result<_, PipelineError>| answer(slot, done.map_err(Error::from));
        let budget = Budget::new(settings.cap()?);
        pipeline::serve(job, &how, &budget, &|_| (), started, &mut next, &answer)?;
        Ok(end)
    }
}

/// An error as a message, with the name of this machine.
fn failed(code: Code, message: &str) -> Vec<u8> {
    let text = json!({ "code": code, "message": format!("{message} (on {})", host_name()) });
    [vec![FAILED], text.to_string().into_bytes()].concat()
}

/// Ranks 1 and up as helpers of rank 0.
struct RankHelpers {
    ranks: Arc<Ranks>,
    /// Of each order at once: the rank, and which of its own it is.
    slots: Mutex<Vec<(i32, i32)>>,
}

impl RankHelpers {
    fn of(ranks: &Arc<Ranks>) -> Self {
        Self { ranks: ranks.clone(), slots: Mutex::default() }
    }

    fn slots(&self) -> MutexGuard<'_, Vec<(i32, i32)>> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn ask(&self, rank: i32, tag: i32, message: Vec<u8>) -> Result<(), RemoteFailure> {
        if i32::try_from(message.len()).is_err() {
            return Err(RemoteFailure {
                code: Code::Memory,
                message: format!(
                    "an order of {} bytes is more than a message can hold",
                    message.len()
                ),
            });
        }
        self.ranks.send(rank, tag, message);
        Ok(())
    }

    fn answer(&self, rank: i32, tag: i32) -> Result<Vec<u8>, RemoteFailure> {
        let failure =
            |code: Code, message: &str| RemoteFailure { code, message: message.to_owned() };
        let bytes = self.ranks.receive_from(rank, tag);
        let mut bytes = bytes
            .ok_or_else(|| failure(Code::Stopped, "stopped while another rank was at work"))?;
        match bytes.first() {
            Some(&DONE) => Ok(bytes.split_off(1)),
            _ => {
                let error: Value =
                    serde_json::from_slice(bytes.get(1..).unwrap_or_default()).unwrap_or_default();
                let text = |key| error[key].as_str().unwrap_or_default().to_owned();
                Err(failure(
                    text("code").parse().unwrap_or(Code::Internal),
                    &format!("rank {rank}: {}", text("message")),
                ))
            }
        }
    }
}

impl Helpers for RankHelpers {
    fn begin(&self, job: &[u8]) -> Result<usize, RemoteFailure> {
        let others = 1..self.ranks.size;
        for rank in others.clone() {
            self.ask(rank, CONTROL, [&[DONE], job].concat())?;
        }
        // All are heard, whatever one of them says.
        let answers: Vec<_> = others.map(|rank| (rank, self.answer(rank, CONTROL))).collect();
        let mut slots = Vec::new();
        for (rank, answer) in answers {
            let answer = answer?;
            let n = answer.first_chunk().map_or(0, |&n| u32::from_le_bytes(n));
            slots.extend((0..n as i32).map(|slot| (rank, slot)));
        }
        // One order of each rank before the second of any.
        slots.sort_by_key(|&(rank, slot)| (slot, rank));
        let n = slots.len();
        *self.slots() = slots;
        Ok(n)
    }

    fn perform(&self, slot: usize, order: Vec<u8>) -> Result<Vec<u8>, RemoteFailure> {
        let found = self.slots().get(slot).copied();
        let (rank, of_rank) = found.ok_or_else(|| RemoteFailure {
            code: Code::Internal,
            message: "an order for a rank that has not begun".to_owned(),
        })?;
        self.ask(rank, of_rank + 1, order)?;
        self.answer(rank, of_rank + 1)
    }
}
