//! A server on this machine alone: threads that read requests, and a few that answer them one after the other.

use std::io::Result;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use subtle::ConstantTimeEq;

use super::view_answers::Call;
use super::view_http::{self, Answer, Request, random_token};
use tetdb_engine::api::{CancelToken, Viewer};

/// Connections at a time; browsers open some ahead of their use.
const CONNECTIONS: usize = 32;
/// How often a waiting client is looked for.
const LOOK: Duration = Duration::from_millis(20);

/// The tokens of an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Secret {
    /// The one that is printed, good until the server ends.
    Printed,
    /// The one for the browser that is started, good once: other users of the machine see the words that start a program.
    Opened,
}

/// A running server. It ends with the process.
pub struct Server(Arc<Shared>);

struct Shared {
    port: u16,
    token: String,
    /// `None` once it was used.
    opened: Mutex<Option<String>>,
    n_jobs: AtomicU64,
    n_connections: AtomicUsize,
    workers: Vec<Worker>,
}

/// A thread that answers: what waits for it, and what it is doing.
struct Worker {
    queue: Mutex<Sender<Job>>,
    job: Mutex<Option<u64>>,
    cancel: CancelToken,
}

struct Job {
    id: u64,
    call: Call,
    /// True once nobody waits.
    is_abandoned: Arc<AtomicBool>,
    reply: Sender<Answer>,
}

impl Server {
    /// Listens to a port of the loopback device, 0 for any that is free; each viewer, with its token, answers on a thread of its own.
    ///
    /// Errors: the port is taken; the system has no random numbers or threads.
    pub fn start(port: u16, viewers: Vec<(Viewer, CancelToken)>) -> Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let (mut workers, mut own) = (Vec::new(), Vec::new());
        for (viewer, cancel) in viewers {
            let (sender, receiver) = channel();
            workers.push(Worker { queue: Mutex::new(sender), job: Mutex::new(None), cancel });
            own.push((viewer, receiver));
        }
        let shared = Arc::new(Shared {
            port: listener.local_addr()?.port(),
            token: random_token()?,
            opened: Mutex::new(Some(random_token()?)),
            n_jobs: AtomicU64::new(0),
            n_connections: AtomicUsize::new(0),
            workers,
        });
        for (number, (mut viewer, jobs)) in own.into_iter().enumerate() {
            let shared = shared.clone();
            let work = move || shared.workers[number].work(&mut viewer, &jobs, &shared.token);
            thread::Builder::new().name(format!("view {number}")).spawn(work)?;
        }
        let accepting = shared.clone();
        thread::Builder::new().name("view".into()).spawn(move || accepting.accept(&listener))?;
        Ok(Self(shared))
    }

    /// The address of the page.
    pub fn address(&self, secret: Secret) -> String {
        let token = match secret {
            Secret::Printed => self.0.token.clone(),
            Secret::Opened => locked(&self.0.opened).clone().unwrap_or_default(),
        };
        format!("http://127.0.0.1:{}/?token={token}", self.0.port)
    }

    /// Cancels all that is under way.
    pub fn stop(&self) {
        self.0.workers.iter().for_each(|worker| worker.cancel.cancel());
    }
}

impl Worker {
    /// Answers one job after the other.
    fn work(&self, viewer: &mut Viewer, jobs: &Receiver<Job>, token: &str) {
        for Job { id, call, is_abandoned, reply } in jobs {
            {
                // Whoever gives up a job sets its mark first, then looks who is at it.
                let mut job = locked(&self.job);
                if is_abandoned.load(Ordering::SeqCst) {
                    continue;
                }
                *job = Some(id);
                self.cancel.reset();
            }
            let answer = call.answer(viewer, token);
            *locked(&self.job) = None;
            // A client that is gone needs no answer.
            let _ = reply.send(answer);
        }
    }
}

impl Shared {
    fn accept(self: &Arc<Self>, listener: &TcpListener) {
        for stream in listener.incoming() {
            let Ok(mut stream) = stream else {
                // Too many open files, for example: some will be closed soon.
                thread::sleep(LOOK);
                continue;
            };
            // The system keeps others waiting meanwhile.
            while self.n_connections.load(Ordering::SeqCst) >= CONNECTIONS {
                thread::sleep(LOOK);
            }
            self.n_connections.fetch_add(1, Ordering::SeqCst);
            let shared = self.clone();
            let attended = thread::Builder::new().spawn(move || {
                shared.attend(&mut stream);
                shared.n_connections.fetch_sub(1, Ordering::SeqCst);
            });
            if attended.is_err() {
                self.n_connections.fetch_sub(1, Ordering::SeqCst);
            }
        }
    }

    /// Reads a request and answers it.
    fn attend(&self, stream: &mut TcpStream) {
        let answer = match view_http::read(stream, self.port) {
            Ok(request) => match self.admit(&request) {
                Ok(call) => self.ask(call, stream),
                Err(refusal) => Some(refusal),
            },
            Err(refusal) => refusal,
        };
        if let Some(answer) = answer {
            view_http::send(stream, &answer);
        }
    }

    /// The call of a request that has the token: for the page in the address, for all else in a header, which no other site can send.
    fn admit(&self, request: &Request) -> std::result::Result<Call, Answer> {
        let is_page = request.path == "/";
        let token = match is_page {
            true => match &request.parameters[..] {
                [(name, token)] if name == "token" => Some(token),
                _ => None,
            },
            false => request.token.as_ref(),
        };
        if !token.is_some_and(|token| self.knows(token, is_page)) {
            let why = "the token is missing or wrong; take the address that `tetdb view` printed";
            return Err(Answer::refusal(403, why));
        }
        Call::parse(&request.path, &request.parameters)
    }

    fn knows(&self, token: &str, is_page: bool) -> bool {
        let is_equal = |known: &str| bool::from(known.as_bytes().ct_eq(token.as_bytes()));
        let mut opened = locked(&self.opened);
        let is_opened = is_page && opened.as_deref().is_some_and(is_equal);
        if is_opened {
            *opened = None;
        }
        is_opened || is_equal(&self.token)
    }

    /// Has a call answered; `None` if the client does not wait for it.
    fn ask(&self, call: Call, stream: &TcpStream) -> Option<Answer> {
        let id = self.n_jobs.fetch_add(1, Ordering::SeqCst);
        let (reply, replied) = channel();
        let is_abandoned = Arc::new(AtomicBool::new(false));
        let job = Job { id, call, is_abandoned: is_abandoned.clone(), reply };
        let ended = || Answer::refusal(503, "the server ends");
        // What is soon done waits for nothing that takes long. Sections meet the chunks that the same worker has decoded.
        let worker = match job.call.is_long() {
            true => self.workers.last(),
            false => self.workers.first(),
        };
        if worker.is_none_or(|worker| locked(&worker.queue).send(job).is_err()) {
            return Some(ended());
        }
        loop {
            match replied.recv_timeout(LOOK) {
                Ok(answer) => return Some(answer),
                Err(RecvTimeoutError::Disconnected) => return Some(ended()),
                Err(RecvTimeoutError::Timeout) if view_http::is_gone(stream) => {
                    is_abandoned.store(true, Ordering::SeqCst);
                    for worker in &self.workers {
                        let job = locked(&worker.job);
                        if *job == Some(id) {
                            worker.cancel.cancel();
                        }
                    }
                    return None;
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
