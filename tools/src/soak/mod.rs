//! What `soak` does again and again.

mod flips;
mod kills;
mod races;
mod readers;
mod swaps;

use std::collections::BTreeMap;
use std::path::Path;

use crate::sim::{Case, End, Reference, Rng, Trouble, unclean};

/// What is meshed: samples that give two sub-domains and one, and a question to them.
pub struct Model {
    large: &'static str,
    small: &'static str,
    question: &'static str,
}

impl Model {
    /// `box`, or with sheets `faults`, or with sheets, edges and points `wells`; `None`: there is no such model.
    pub fn called(name: &str) -> Option<Self> {
        let (large, small, question) = match name {
            "box" => ("sample:box,h=0.05", "sample:box,h=0.1", "--where quality>2"),
            "faults" => (
                "sample:faults,count=4,cells=20",
                "sample:faults,count=3,cells=6",
                "--touching-sheet",
            ),
            "wells" => (
                "sample:wells,count=20,points=20,cells=18",
                "sample:wells,count=4,points=4,cells=6",
                "--label well-1",
            ),
            _ => return None,
        };
        Some(Self { large, small, question })
    }
}

/// Result of one item: counts by name, and what was wrong.
#[derive(Default)]
pub struct Item {
    pub counts: BTreeMap<&'static str, u64>,
    pub wrong: Vec<String>,
}

impl Item {
    fn count(&mut self, what: &'static str) {
        *self.counts.entry(what).or_default() += 1;
    }

    fn note<E: std::fmt::Display>(&mut self, context: &str, result: Result<(), E>) {
        if let Err(e) = result {
            self.wrong.push(format!("{context}: {e}"));
        }
    }
}

/// A campaign.
pub enum Mode {
    Kills(kills::Kills),
    /// Bits of a small store, and one in nine of a larger one.
    Flips([flips::Flips; 2]),
    /// Two writers at once.
    Races(races::Races),
    /// Many readers beside a writer.
    Readers(readers::Readers),
    /// Whole files and pages in the place of others.
    Swaps(swaps::Swaps),
    Images(Sim),
    /// Every call failing, one after the other.
    Faults(Sim),
    /// The end at every boundary, one after the other.
    Deaths(Sim),
    Space(Sim),
}

/// The fault case and its undisturbed run.
pub struct Sim {
    case: Case,
    reference: Reference,
}

/// Losses of power in one run, and how many of them are resumed.
const IMAGES: u64 = 100;
const RESUMED: u64 = 5;
/// Sizes of a disk that fills up.
const SPACES: u64 = 200;

impl Sim {
    fn new(case: Case) -> Self {
        let reference = case.reference();
        Self { case, reference }
    }

    fn end(&self, item: &mut Item, context: &str, end: &End) {
        item.count(match end {
            End::Done => "harmless",
            _ => "failed",
        });
        item.wrong.extend(unclean(end).map(|e| format!("{context}: {e}")));
    }

    fn images(&self, seed: u64, item: u64) -> Item {
        let mut rng = Rng(seed ^ item.wrapping_mul(0xD6E8_FEB8_6659_FD93));
        let mut done = Item::default();
        let mut crash_at: Vec<(u64, u64)> =
            (0..IMAGES).map(|_| (rng.below(self.reference.calls), rng.word())).collect();
        crash_at.sort_unstable_by(|a, b| b.cmp(a));
        let (disk, _) = self.case.troubled(Trouble { crash_at, ..Trouble::default() });
        for (i, wreck) in disk.take_wrecks().into_iter().enumerate() {
            let context = format!("power lost before call {}", wreck.call);
            done.count("images");
            done.note(&context, self.case.survives(&wreck, &self.reference));
            if (i as u64).is_multiple_of(IMAGES / RESUMED) {
                done.count("resumed");
                done.note(&context, self.case.resumed(&wreck.disk, &self.reference));
            }
        }
        done
    }

    fn fault(&self, call: u64) -> Item {
        let mut done = Item::default();
        let context = format!("call {call} failed");
        let (disk, end) = self.case.troubled(Trouble {
            fail_at: Some(call),
            // Disks that fail once, and disks that never come back.
            fails_on: call % 4 == 3,
            ..Trouble::default()
        });
        self.end(&mut done, &context, &end);
        if call.is_multiple_of(10) {
            done.count("resumed");
            done.note(&context, self.case.resumed(&disk, &self.reference));
        }
        done
    }

    fn death(&self, boundary: u64) -> Item {
        let mut done = Item::default();
        let context = format!("killed at boundary {boundary}");
        let (disk, end) =
            self.case.troubled(Trouble { die_at_boundary: Some(boundary), ..Trouble::default() });
        self.end(&mut done, &context, &end);
        done.count("resumed");
        done.note(&context, self.case.resumed(&disk, &self.reference));
        done
    }

    fn space(&self, item: u64) -> Item {
        let mut done = Item::default();
        let space = self.reference.bytes_peak * item / SPACES;
        let context = format!("{space} bytes of room");
        let (disk, end) = self.case.troubled(Trouble { space: Some(space), ..Trouble::default() });
        self.end(&mut done, &context, &end);
        if let End::Failed(_, text) = &end
            && !text.contains("no space left")
        {
            done.wrong.push(format!("{context}: {text}"));
        }
        done.count("resumed");
        done.note(&context, self.case.resumed(&disk, &self.reference));
        done
    }
}

impl Mode {
    /// `None`: there is no such mode. Kills, flips and swaps are of the model, the others of a box.
    pub fn new(mode: &str, program: &Path, model: &Model) -> Option<Self> {
        Some(match mode {
            "kills" => Self::Kills(kills::Kills::new(program, model)),
            "flips" => Self::Flips([
                flips::Flips::large(program, model),
                flips::Flips::small(program, model),
            ]),
            "races" => Self::Races(races::Races::new(program)),
            "readers" => Self::Readers(readers::Readers::new(program)),
            "swaps" => Self::Swaps(swaps::Swaps::new(program, model)),
            "images" => Self::Images(Sim::new(Case::small())),
            "faults" => Self::Faults(Sim::new(Case::tiny())),
            "deaths" => Self::Deaths(Sim::new(Case::tiny())),
            "space" => Self::Space(Sim::new(Case::tiny())),
            _ => return None,
        })
    }

    /// How many items there are.
    pub fn items(&self) -> u64 {
        match self {
            Self::Kills(_) | Self::Flips(_) | Self::Races(_) => u64::MAX,
            Self::Readers(_) | Self::Swaps(_) | Self::Images(_) => u64::MAX,
            Self::Faults(sim) => sim.reference.calls,
            Self::Deaths(sim) => sim.reference.boundaries,
            Self::Space(_) => SPACES,
        }
    }

    pub fn item(&mut self, seed: u64, item: u64) -> Item {
        match self {
            Self::Kills(kills) => kills.item(seed, item),
            Self::Flips(flips) => flips[usize::from(!item.is_multiple_of(9))].item(seed, item),
            Self::Races(races) => races.item(seed, item),
            Self::Readers(readers) => readers.item(item),
            Self::Swaps(swaps) => swaps.item(seed, item),
            Self::Images(sim) => sim.images(seed, item),
            Self::Faults(sim) => sim.fault(item),
            Self::Deaths(sim) => sim.death(item),
            Self::Space(sim) => sim.space(item),
        }
    }
}
