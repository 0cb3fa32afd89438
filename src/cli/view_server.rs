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
use super::view_http::{self, Answer, Request};
use tetdb_engine::api::{CancelToken, Viewer};

/// Connections at a time; browsers open some ahead of their use.
const CONNECTIONS: usize = 32;
/// How often a waiting client is looked for.
const LOOK: Duration = Duration::from_millis(20);
/// Random bytes of a token, 192 bits.
const TOKEN_BYTES: usize = 24;

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
    jobs: Mutex<Sender<Job>>,
    n_jobs: AtomicU64,
    n_connections: AtomicUsize,
    workers: Vec<Worker>,
}

/// What a thread that answers is doing.
struct Worker {
    job: Mutex<Option<u64>>,
    cancel: CancelToken,
}

struct Job {
    id: u64,
    call: Call,
    /// True once nobody waits.
    is_vain: Arc<AtomicBool>,
    reply: Sender<Answer>,
}

impl Server {
    /// Listens to a port of the loopback device, 0 for any that is free; each viewer, with its token, answers on a thread of its own.
    ///
    /// Errors: the port is taken; the system has no random numbers or threads.
    pub fn start(port: u16, viewers: Vec<(Viewer, CancelToken)>) -> Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let (sender, receiver) = channel();
        let (viewers, tokens): (Vec<_>, Vec<_>) = viewers.into_iter().unzip();
        let worker = |cancel| Worker { job: Mutex::new(None), cancel };
        let shared = Arc::new(Shared {
            port: listener.local_addr()?.port(),
            token: random_token()?,
            opened: Mutex::new(Some(random_token()?)),
            jobs: Mutex::new(sender),
            n_jobs: AtomicU64::new(0),
            n_connections: AtomicUsize::new(0),
            workers: tokens.into_iter().map(worker).collect(),
        });
        let receiver = Arc::new(Mutex::new(receiver));
        for (number, mut viewer) in viewers.into_iter().enumerate() {
            let (shared, receiver) = (shared.clone(), receiver.clone());
            thread::Builder::new().name(format!("view {number}")).spawn(move || {
                shared.workers[number].work(&mut viewer, &receiver, &shared.token)
            })?;
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
    fn work(&self, viewer: &mut Viewer, jobs: &Mutex<Receiver<Job>>, token: &str) {
        loop {
            let next = locked(jobs).recv();
            let Ok(Job { id, call, is_vain, reply }) = next else {
                return;
            };
            {
                // Whoever gives up a job sets its mark first, then looks who is at it.
                let mut job = locked(&self.job);
                if is_vain.load(Ordering::SeqCst) {
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
            if self.n_connections.fetch_add(1, Ordering::SeqCst) >= CONNECTIONS {
                self.n_connections.fetch_sub(1, Ordering::SeqCst);
                drop(stream);
                continue;
            }
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
        let is_vain = Arc::new(AtomicBool::new(false));
        let job = Job { id, call, is_vain: is_vain.clone(), reply };
        let ended = || Answer::refusal(503, "the server ends");
        if locked(&self.jobs).send(job).is_err() {
            return Some(ended());
        }
        loop {
            match replied.recv_timeout(LOOK) {
                Ok(answer) => return Some(answer),
                Err(RecvTimeoutError::Disconnected) => return Some(ended()),
                Err(RecvTimeoutError::Timeout) if view_http::is_gone(stream) => {
                    is_vain.store(true, Ordering::SeqCst);
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

/// A random number of the system in hexadecimal digits.
pub fn random_token() -> Result<String> {
    let mut bytes = [0; TOKEN_BYTES];
    getrandom::fill(&mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
