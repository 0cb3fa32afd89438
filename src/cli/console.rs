//! Everything that is printed: the answer on stdout, progress and remarks on stderr.

use std::io::{IsTerminal, Write};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde::Serialize;

use super::failure::{Failure, in_flags};
use super::words;
use tetdb_engine::api::{Bytes, CancelToken, Code, Event, Settings, short};

/// Without a terminal, progress is printed as one line per this interval.
const PLAIN_EVERY: Duration = Duration::from_secs(10);

/// Colors of a terminal.
const RED: u8 = 31;
const GREEN: u8 = 32;
const YELLOW: u8 = 33;

/// Printer of everything that the program prints. Clones print to the same terminal.
#[derive(Clone)]
pub struct Console {
    json: bool,
    /// True if neither progress nor remarks are printed.
    quiet: bool,
    verbose: bool,
    /// True if errors and warnings are colored.
    colors: bool,
    terminal: bool,
    bar: ProgressBar,
    state: Arc<Mutex<State>>,
    answer: Arc<Mutex<Answer>>,
    cancel: CancelToken,
}

/// State of the standard output.
#[derive(Default)]
struct Answer {
    bytes: u64,
    refused: Option<std::io::Error>,
}

struct State {
    stage: String,
    /// Start of the stage, and what was done by then.
    since: Instant,
    first: u64,
    /// True if the total is known. Of some stages it is not at first.
    has_total: bool,
    /// Time at which progress was last printed.
    printed: Instant,
}

impl State {
    fn new(now: Instant) -> Self {
        Self { stage: String::new(), since: now, first: 0, has_total: false, printed: now }
    }
}

impl Console {
    pub fn new(json: bool) -> Self {
        Self::with(json, false, false)
    }

    /// A console that prints only warnings and errors if `quiet`, and also internals if `verbose`.
    pub fn with(json: bool, quiet: bool, verbose: bool) -> Self {
        let terminal = std::io::stderr().is_terminal() && !json && !quiet;
        let bar = if terminal {
            let target = ProgressDrawTarget::stderr_with_hz(10);
            ProgressBar::with_draw_target(None, target).with_style(style(false, ""))
        } else {
            ProgressBar::hidden()
        };
        let now = Instant::now();
        Self {
            json,
            quiet,
            verbose,
            colors: std::io::stderr().is_terminal()
                && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
                && std::env::var_os("TERM").is_none_or(|v| v != "dumb"),
            terminal,
            bar,
            state: Arc::new(Mutex::new(State::new(now))),
            answer: Arc::default(),
            cancel: CancelToken::new(),
        }
    }

    /// Token that ends the runs of this command.
    pub fn cancel(&self) -> &CancelToken {
        &self.cancel
    }

    /// Settings of a run that reports to this console, with the given memory and number of threads, or defaults.
    pub fn settings(&self, memory: Option<u64>, threads: Option<usize>) -> Settings {
        let console = self.clone();
        let mut settings = Settings::new().cancel(&self.cancel);
        if let Some(bytes) = memory {
            settings = settings.memory(Bytes(bytes));
        }
        if let Some(n) = threads {
            settings = settings.threads(n);
        }
        settings.progress(move |event| console.hear(event))
    }

    fn hear(&self, event: &Event) {
        match *event {
            Event::Progress { stage, done, total, unit } => self.progress(stage, done, total, unit),
            Event::Note(ref text) => self.note(text),
            Event::Warning(ref text) => self.warn(text),
            Event::SizeWarning(ref warning) => self.warn(&in_flags(warning)),
            Event::SurfaceMissing => self.note(
                "note: the surface is not where it was; the mesh is verified without it (give it with --against)",
            ),
            Event::StoreBegun(_) => super::signals::store_begins(),
            _ => {}
        }
    }

    /// Returns whether the answer is JSON.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Returns whether only the requested answer is printed.
    pub fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Returns whether internals are printed.
    pub fn is_verbose(&self) -> bool {
        self.verbose
    }

    /// A word in a terminal color, if colors are used.
    fn colored(&self, color: u8, word: &str) -> String {
        match self.colors {
            true => format!("\x1b[1;{color}m{word}\x1b[0m"),
            false => word.to_owned(),
        }
    }

    /// Prints a remark.
    pub fn note(&self, text: &str) {
        if !self.quiet {
            self.print(text);
        }
    }

    /// Prints a remark that is never suppressed.
    pub fn warn(&self, text: &str) {
        let word = match self.json {
            true => "warning:".to_owned(),
            false => self.colored(YELLOW, "warning:"),
        };
        self.print(&format!("{word} {text}"));
    }

    fn print(&self, text: &str) {
        if self.json {
            self.stderr_json(&serde_json::json!({ "note": text }));
        } else {
            self.bar.suspend(|| say(text));
        }
    }

    /// Prints the cost of an answer, for programs.
    pub fn measures(&self, value: &serde_json::Value) {
        if self.json && !self.quiet {
            self.stderr_json(&serde_json::json!({ "measures": value }));
        }
    }

    /// Prints one line of the answer.
    pub fn line(&self, text: &str) {
        self.write(format!("{text}\n").as_bytes());
    }

    /// Prints bytes of the answer. Returns false once writing has failed, as when the reader is gone.
    pub fn write(&self, bytes: &[u8]) -> bool {
        let mut answer = self.answer.lock().unwrap_or_else(PoisonError::into_inner);
        if answer.refused.is_none() {
            match std::io::stdout().write_all(bytes) {
                Ok(()) => answer.bytes += bytes.len() as u64,
                Err(error) => answer.refused = Some(error),
            }
        }
        answer.refused.is_none()
    }

    /// Ends the answer. Errors: it could not be written, for another reason than that its reader has closed the pipe.
    pub fn end_answer(&self) -> Result<(), Failure> {
        let mut answer = self.answer.lock().unwrap_or_else(PoisonError::into_inner);
        if let (None, Err(error)) = (&answer.refused, std::io::stdout().flush()) {
            answer.refused = Some(error);
        }
        match answer.refused.take() {
            Some(error) => unwritten(&error, &format!("; of it {} bytes were", answer.bytes)),
            None => Ok(()),
        }
    }

    /// Prints the whole answer for programs.
    pub fn answer<T: Serialize>(&self, value: &T) {
        if let Ok(text) = serde_json::to_string(value) {
            self.line(&text);
        }
    }

    /// Shows progress; called often.
    pub fn progress(&self, stage: &'static str, done: u64, total: Option<u64>, unit: &'static str) {
        if self.quiet {
            return;
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        let new_stage = state.stage != stage || state.has_total != total.is_some();
        if new_stage {
            stage.clone_into(&mut state.stage);
            (state.since, state.first, state.has_total) = (now, done, total.is_some());
        }
        if self.terminal {
            if new_stage {
                // Resetting draws the bar.
                self.bar.set_style(style(total.is_some(), unit));
                self.bar.set_message(stage.to_owned());
                self.bar.reset();
            }
            if let Some(total) = total {
                self.bar.set_length(total);
            }
            self.bar.set_position(done);
        } else if now - state.printed >= PLAIN_EVERY {
            state.printed = now;
            let seconds = (now - state.since).as_secs_f64();
            // A stage that has just begun has no meaningful rate.
            let rate = (seconds > 1.0).then(|| done.saturating_sub(state.first) as f64 / seconds);
            let eta = total
                .zip(rate)
                .filter(|&(_, rate)| rate > 0.0)
                .map(|(t, rate)| t.saturating_sub(done) as f64 / rate);
            if self.json {
                self.stderr_json(&serde_json::json!({
                    "progress": { "stage": stage, "done": done, "total": total,
                        "unit": unit, "per_s": rate, "eta_s": eta }
                }));
            } else {
                say(&plain_progress(stage, (done, total, unit), (rate, eta)));
            }
        }
    }

    /// Removes the progress bar.
    pub fn done(&self) {
        self.bar.finish_and_clear();
    }

    /// Prints an error and returns its exit code.
    pub fn fail(&self, failure: &Failure) -> u8 {
        self.done();
        let exit = failure.exit();
        let message = words::shortened(&failure.message);
        let place = failure.place.as_deref().map(words::shortened);
        let help = failure.help.as_deref().map(words::shortened);
        if self.json {
            self.stderr_json(&serde_json::json!({
                "error": { "code": failure.code, "exit": exit, "message": message, "where": place, "help": help }
            }));
        } else {
            let word = self.colored(RED, &format!("error[{}]:", failure.code));
            say(&format!("{word} {message}"));
            if let Some(place) = &place {
                say(&format!("  at: {place}"));
            }
            if let Some(help) = &help {
                say(&format!("{} {help}", self.colored(GREEN, "help:")));
            }
        }
        exit
    }

    fn stderr_json(&self, value: &serde_json::Value) {
        say(&value.to_string());
    }
}

/// Prints a line to stderr. A closed stderr is no reason to end.
fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Handles a failed write to the standard output; `written` says how much was written. A reader that closed the pipe is no error.
pub(super) fn unwritten(error: &std::io::Error, written: &str) -> Result<(), Failure> {
    use std::io::ErrorKind::{BrokenPipe, StorageFull};
    let code = match error.kind() {
        BrokenPipe => return Ok(()),
        StorageFull => Code::DiskFull,
        _ => Code::Io,
    };
    let message =
        format!("the answer could not be written to the standard output: {error}{written}");
    Err(Failure::new(code, message).help("send it to a disk with more space"))
}

/// A line of progress, with counts in a unit, work per second and seconds to go.
fn plain_progress(
    stage: &str,
    (done, total, unit): (u64, Option<u64>, &str),
    (rate, eta): (Option<f64>, Option<f64>),
) -> String {
    let count = match total {
        None if done == 0 => return stage.to_owned(),
        Some(100) if unit == "%" => format!("{done} %"),
        Some(total) => format!("{done} of {total} {unit}"),
        None => format!("{done} {unit}"),
    };
    let rate = rate.filter(|_| unit != "%");
    let rate = rate.map_or(String::new(), |r| format!(", {r:.0} per second"));
    let eta = eta.map_or(String::new(), |s| format!(", {s:.0} s to go"));
    format!("{stage}: {count}{rate}{eta}")
}

/// The line of a stage on a terminal: with a bar if the total is known, with counts and a rate if there is a unit to count in.
fn style(known_total: bool, unit: &str) -> ProgressStyle {
    let template = match (known_total, unit) {
        (true, "%") => "{msg:24} [{bar:30}] {percent:>3} %  {eta} to go".to_owned(),
        (true, unit) => {
            format!("{{msg:24}} [{{bar:30}}] {{percent:>3}} %  {{rate}} {unit}/s  {{eta}} to go")
        }
        (false, "") => "{msg:24} {elapsed}".to_owned(),
        (false, unit) => format!("{{msg:24}} {{pos}} {unit}  {{rate}}/s  {{elapsed}}"),
    };
    let style = ProgressStyle::with_template(&template);
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    style.with_key("rate", |state: &ProgressState, out: &mut dyn std::fmt::Write| {
        let _ = write!(out, "{}", short(state.per_sec()));
    })
}

#[cfg(test)]
mod tests {
    use super::plain_progress;

    #[test]
    fn lines_of_progress_name_what_they_count() {
        let none = (None, None);
        assert_eq!(plain_progress("validate", (0, None, "steps"), none), "validate");
        assert_eq!(plain_progress("read", (7, None, "bytes"), none), "read: 7 bytes");
        let known = plain_progress("seal", (20, Some(80), "records"), (Some(10.0), Some(6.0)));
        assert_eq!(known, "seal: 20 of 80 records, 10 per second, 6 s to go");
        let share = plain_progress("mend", (40, Some(100), "%"), (Some(2.0), Some(30.0)));
        assert_eq!(share, "mend: 40 %, 30 s to go");
    }
}
