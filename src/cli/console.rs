//! Everything that is printed: data on stdout, talk on stderr.

use std::cell::RefCell;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use super::failure::Failure;
use crate::pipeline::Event;

/// Without a terminal, progress is one line in so much time.
const PLAIN_EVERY: Duration = Duration::from_secs(10);

/// The voice of one command.
pub struct Console {
    json: bool,
    /// Neither progress nor remarks.
    quiet: bool,
    terminal: bool,
    bar: ProgressBar,
    state: RefCell<State>,
}

struct State {
    stage: String,
    /// When the stage began.
    since: Instant,
    told: Instant,
}

impl Console {
    pub fn new(json: bool) -> Self {
        Self::with(json, false)
    }

    /// One that tells of warnings and errors alone, if `quiet`.
    pub fn with(json: bool, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal() && !json && !quiet;
        let bar = if terminal {
            ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10))
        } else {
            ProgressBar::hidden()
        };
        let now = Instant::now();
        Self {
            json,
            quiet,
            terminal,
            bar,
            state: RefCell::new(State {
                stage: String::new(),
                since: now,
                told: now,
            }),
        }
    }

    /// Whether the answer is JSON.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// A remark.
    pub fn note(&self, text: &str) {
        if !self.quiet {
            self.tell(text);
        }
    }

    /// A remark that is never left out.
    pub fn warn(&self, text: &str) {
        self.tell(&format!("warning: {text}"));
    }

    fn tell(&self, text: &str) {
        if self.json {
            self.stderr_json(&serde_json::json!({ "note": text }));
        } else {
            self.bar.suspend(|| eprintln!("{text}"));
        }
    }

    /// What an answer has cost, for programs.
    pub fn measures(&self, value: &serde_json::Value) {
        if self.json && !self.quiet {
            self.stderr_json(&serde_json::json!({ "measures": value }));
        }
    }

    /// One line of the answer.
    pub fn line(&self, text: &str) {
        // A closed stdout ends the answer quietly.
        let _ = writeln!(std::io::stdout(), "{text}");
    }

    /// The whole answer for programs.
    pub fn answer<T: Serialize>(&self, value: &T) {
        if let Ok(text) = serde_json::to_string(value) {
            self.line(&text);
        }
    }

    /// Progress; called often.
    pub fn progress(&self, event: Event) {
        if self.quiet {
            return;
        }
        let mut state = self.state.borrow_mut();
        let now = Instant::now();
        let new_stage = state.stage != event.stage;
        if new_stage {
            event.stage.clone_into(&mut state.stage);
            state.since = now;
        }
        if self.terminal {
            if new_stage {
                self.bar.reset();
                self.bar.set_style(style(event.total.is_some()));
                self.bar.set_message(event.stage.to_owned());
            }
            if let Some(total) = event.total {
                self.bar.set_length(total);
            }
            self.bar.set_position(event.done);
        } else if now - state.told >= PLAIN_EVERY {
            state.told = now;
            let seconds = (now - state.since).as_secs_f64();
            // Where several work side by side stages alternate, and a stage just begun has no rate.
            let rate = (seconds > 1.0).then(|| event.done as f64 / seconds);
            let eta = event
                .total
                .zip(rate)
                .filter(|_| event.done > 0)
                .map(|(t, rate)| t.saturating_sub(event.done) as f64 / rate);
            if self.json {
                self.stderr_json(&serde_json::json!({
                    "progress": { "stage": event.stage, "done": event.done, "total": event.total,
                        "unit": event.unit, "per_s": rate, "eta_s": eta }
                }));
            } else {
                let of = event.total.map_or(String::new(), |t| format!(" of {t}"));
                let eta = eta.map_or(String::new(), |s| format!(", {s:.0} s to go"));
                let rate = rate.map_or(String::new(), |r| format!(", {r:.0} per second"));
                eprintln!(
                    "{}: {}{of} {}{rate}{eta}",
                    event.stage, event.done, event.unit
                );
            }
        }
    }

    /// Takes the progress bar away.
    pub fn done(&self) {
        self.bar.finish_and_clear();
    }

    /// Tells an error and returns its exit code.
    pub fn fail(&self, failure: &Failure) -> u8 {
        self.done();
        let exit = failure.exit();
        if self.json {
            self.stderr_json(&serde_json::json!({
                "error": { "code": failure.code, "exit": exit, "message": failure.message,
                    "where": failure.place, "help": failure.help }
            }));
        } else {
            eprintln!("error[{}]: {}", failure.code, failure.message);
            if let Some(place) = &failure.place {
                eprintln!("  at: {place}");
            }
            if let Some(help) = &failure.help {
                eprintln!("help: {help}");
            }
        }
        exit
    }

    fn stderr_json(&self, value: &serde_json::Value) {
        eprintln!("{value}");
    }
}

fn style(known_total: bool) -> ProgressStyle {
    let template = if known_total {
        "{msg:24} [{bar:30}] {percent:>3} %  {per_sec}  {eta} to go"
    } else {
        "{msg:24} {pos}  {per_sec}  {elapsed}"
    };
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
