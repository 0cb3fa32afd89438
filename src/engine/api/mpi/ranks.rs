//! The ranks of an MPI program.

use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::json;

use super::mailbox::{CONTROL, DONE, END, Mailbox, failed};
use super::rank_workers::RankWorkers;
use super::shared_file::{SharedFile, WAIT};
use crate::api::verify_server::Server;
use crate::api::{Code, Error, Settings, guarded};
use crate::pipeline::{self, PipelineError, RemoteWorkers, TaskSettings};
use tetdb_io::write::{Share, Writers};

/// The rank of this process in an MPI program. Clones stand for the same process.
///
/// Rank 0 meshes, resumes or verifies with [`Ranks::share_work`]; all other ranks call [`Ranks::serve`]. At the end, each rank calls
/// [`Ranks::end`].
#[derive(Clone)]
pub struct Ranks {
    mailbox: Arc<Mailbox>,
    workers: Arc<RankWorkers>,
}

impl Ranks {
    /// Starts MPI; `None` if this program was started without a launcher. Call it only once.
    ///
    /// Errors: `usage` if the launcher belongs to another MPI.
    pub fn begin() -> Result<Option<Self>, Error> {
        let Some(launched) = launched() else {
            return Ok(None);
        };
        let mailbox = Arc::new(Mailbox::open());
        if mailbox.size == 1 && launched > 1 {
            mailbox.close();
            let message = format!(
                "the launcher has started {launched} processes, and the MPI that this program was built with sees one"
            );
            return Err(Error::new(Code::Usage, message).with_help(
                "start it with the mpirun of the MPI it was built with, or build it with this one",
            ));
        }
        let workers = Arc::new(RankWorkers::new(mailbox.clone()));
        Ok(Some(Self { mailbox, workers }))
    }

    /// Returns whether this is rank 0.
    pub fn is_first(&self) -> bool {
        self.mailbox.rank == 0
    }

    /// Returns whether there are no other ranks.
    pub fn is_alone(&self) -> bool {
        self.mailbox.size == 1
    }

    /// The share of this rank in work divided among all ranks; see [`ExportOptions::share`](crate::api::ExportOptions::share).
    pub fn share(&self) -> Share {
        self.mailbox.share()
    }

    /// Lets a run of rank 0 with these settings use the other ranks, which must call [`serve`](Self::serve).
    pub fn share_work(&self, mut settings: Settings) -> Settings {
        if self.is_first() && !self.is_alone() {
            settings.remote = RemoteWorkers(Some(self.workers.clone()));
        }
        settings
    }

    /// A file that all ranks write together, for [`Store::export_together`](crate::api::Store::export_together).
    pub fn shared_file(&self) -> Box<dyn Writers> {
        Box::new(SharedFile::new(self.mailbox.clone(), self.workers.clone()))
    }

    /// Sends a result to rank 0. Returns the results of all other ranks, by rank, on rank 0, and an empty list on other ranks.
    ///
    /// `mine` may be an error with its message. Errors: an error of another rank, returned after all ranks have answered.
    pub fn gather<T: Serialize + DeserializeOwned>(
        &self,
        mine: Result<&T, (Code, &str)>,
    ) -> Result<Vec<T>, Error> {
        if !self.is_first() {
            let bytes = match mine {
                Ok(done) => [vec![DONE], json!(done).to_string().into_bytes()].concat(),
                Err((code, message)) => failed(code, message),
            };
            self.mailbox.send(0, CONTROL, bytes);
            return Ok(Vec::new());
        }
        let parse = |answer: Vec<u8>| {
            serde_json::from_slice(&answer).map_err(|e| Error::internal(e.to_string()))
        };
        let answers = self.workers.answers(CONTROL).into_iter();
        answers.map(|answer| parse(answer.map_err(PipelineError::from)?)).collect()
    }

    /// Performs the orders of rank 0 until it ends. `begin` returns the settings of each job, or an error with its message.
    ///
    /// Files are first written in `scratch`, a local folder. Default: the store's folder.
    pub fn serve(
        &self,
        scratch: Option<PathBuf>,
        begin: impl Fn() -> Result<Settings, (Code, String)>,
    ) {
        let how = TaskSettings { scratch, wait: WAIT };
        let (_, mut message) = self.mailbox.receive_any();
        while let Some((&DONE, job)) = message.split_first() {
            let done = begin().and_then(|settings| {
                let done = guarded(&settings, || self.serve_job(job, &how, &settings));
                done.map_err(|error| (error.code(), error.message().to_owned()))
            });
            message = done.unwrap_or_else(|(code, text)| {
                self.mailbox.send(0, CONTROL, failed(code, &text));
                self.mailbox.receive_any().1
            });
        }
    }

    /// Performs the orders of a job. Returns the message after the last of them.
    fn serve_job(
        &self,
        job: &[u8],
        how: &TaskSettings,
        settings: &Settings,
    ) -> Result<Vec<u8>, Error> {
        let started = |slots: usize| {
            let bytes = [vec![DONE], (slots as u32).to_le_bytes().to_vec()].concat();
            self.mailbox.send(0, CONTROL, bytes);
        };
        let mut end = vec![END];
        let mut next = || match self.mailbox.receive_any() {
            (CONTROL, message) => {
                end = message;
                None
            }
            (tag, order) => Some((tag as usize - 1, order)),
        };
        let answer = |slot: usize, done: Result<Vec<u8>, Error>| {
            let bytes = match done {
                Ok(receipt) => [vec![DONE], receipt].concat(),
                Err(error) => failed(error.code(), error.message()),
            };
            self.mailbox.send(0, slot as i32 + 1, bytes);
        };
        if let Some(server) = Server::begin(job, settings) {
            let server = server?;
            started(1);
            while let Some((slot, order)) = next() {
                answer(slot, server.perform(&order));
            }
            return Ok(end);
        }
        let answer = |slot, done: Result<_, PipelineError>| answer(slot, done.map_err(Error::from));
        pipeline::serve(job, how, &settings.budget()?, &|_| (), started, &mut next, &answer)?;
        Ok(end)
    }

    /// Ends this rank after all other ranks. Rank 0 lets the others end.
    pub fn end(&self) {
        if self.is_first() {
            self.mailbox.others().for_each(|rank| self.mailbox.send(rank, CONTROL, vec![END]));
        }
        self.mailbox.close();
    }
}

/// Number of processes, as reported by a launcher; `None` without a launcher.
fn launched() -> Option<i32> {
    let number = |name| std::env::var(name).ok()?.parse().ok();
    let sizes = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"].map(number);
    let one = std::env::var_os("PMIX_RANK").map(|_| 1);
    sizes.into_iter().flatten().chain(one).max()
}
