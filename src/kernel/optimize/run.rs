//! The schedule.

use super::goals::{BAD, OperationCounts, SHARE, WORST};
use super::lawson::{Lawson, LawsonStats};
use super::mend::{MendCounts, Mender};
use super::odt;
use super::pages::{PageFlags, Way, clear_marks};
use super::rounds::Rounds;
use crate::mesh::{Mesh, dense, sparse};
use tetdb_base::storage::Pages;
use tetdb_schema::word::Word;

/// How far tetrahedra are improved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Only flips that restore the constrained Delaunay mesh.
    None,
    /// Free vertices move too. The mesh stays Delaunay wherever no constraint forbids it.
    Delaunay,
    /// The worst qualities are raised as well, at the price of about one face in a hundred that is not locally Delaunay.
    #[default]
    Full,
}

impl Word for Mode {
    const WORDS: &'static [(Self, &'static str)] =
        &[(Self::None, "none"), (Self::Delaunay, "delaunay"), (Self::Full, "full")];
}

/// Choices of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// How much is done.
    pub mode: Mode,
    /// Most sweeps of smoothing; 0 in mode `None`. From 86 % of q < 2, two take it to 94, three to 95.6, six to 97 %; what is
    /// still bad then costs one face that is not locally Delaunay each: 2.95, 2.2 and 1.5 % of the faces after `Full`.
    pub odt_sweeps: u32,
}

impl Settings {
    /// The usual choices of a mode.
    pub fn of(mode: Mode) -> Self {
        let odt_sweeps = match mode {
            Mode::None => 0,
            Mode::Delaunay => 6,
            Mode::Full => 7,
        };
        Self { mode, odt_sweeps }
    }
}

/// Where a run is: the name of the stage, and how much of it is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Name of the stage.
    pub stage: &'static str,
    /// How much is done, in `unit`.
    pub done: u32,
    /// How much there is, in `unit`.
    pub total: u32,
    /// Unit of both; `%` if nothing can be counted.
    pub unit: &'static str,
}

/// What a run did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OptimizeReport {
    /// What the flips towards the Delaunay mesh did.
    pub flips: LawsonStats,
    /// Vertices moved by the sweeps of smoothing, over all sweeps.
    pub odt_moves: u64,
    /// Vertices that could not move because a tetrahedron would not stay positive, over all sweeps.
    pub odt_held: u64,
    /// Operations on bad tetrahedra.
    pub operations: OperationCounts,
    /// What lift and mend did.
    pub mended: MendCounts,
}

/// Optimizes the whole mesh with the usual choices of `mode`.
///
/// Effects: ids of tetrahedra are used again and freed; vertices may be added and freed (mode `Full`, few);
/// `tet_of` is right for every vertex afterwards. All marks are down.
pub fn run<P: Pages>(
    mesh: &mut Mesh<P>,
    mode: Mode,
    progress: &dyn Fn(Progress),
) -> OptimizeReport {
    run_with(mesh, Settings::of(mode), progress)
}

/// [`run`] with choices of one's own.
pub fn run_with<P: Pages>(
    mesh: &mut Mesh<P>,
    settings: Settings,
    progress: &dyn Fn(Progress),
) -> OptimizeReport {
    let mut report = OptimizeReport::default();
    let tell = |stage, unit, done, total| progress(Progress { stage, done, total, unit });
    tell("delaunay", "sweeps", 0, settings.odt_sweeps + 1);
    prepare(mesh);
    let mut lawson = Lawson::default();
    let mut way = Way::Up;
    lawson.sweep(mesh, way);
    for sweep in 0..settings.odt_sweeps {
        tell("smooth", "sweeps", sweep, settings.odt_sweeps);
        way = way.turned();
        let moves = odt::sweep(mesh, way);
        report.odt_moves += moves.moved;
        report.odt_held += moves.held;
        tell("delaunay", "sweeps", sweep + 1, settings.odt_sweeps + 1);
        lawson.sweep(mesh, way);
    }
    report.flips = lawson.stats;
    if settings.mode == Mode::Full {
        let mut rounds = Rounds::new(PageFlags::all(mesh));
        rounds.run(mesh, BAD, &mut |done, total| tell("quality", "pages", done, total));
        let bad = rounds.finish(mesh);
        rounds.flags.clone_from(&bad);
        rounds.run(mesh, WORST, &mut |done, total| tell("improve the worst", "pages", done, total));
        rounds.finish(mesh);
        rounds.flags = bad;
        rounds.run(mesh, SHARE, &mut |done, total| {
            tell("improve low qualities", "pages", done, total)
        });
        let mut bad = rounds.finish(mesh);
        report.operations = rounds.counts;
        report.mended = mended(mesh, &mut bad, progress);
    }
    report
}

fn mended<P: Pages>(
    mesh: &mut Mesh<P>,
    bad: &mut PageFlags,
    progress: &dyn Fn(Progress),
) -> MendCounts {
    let mut mender = Mender::default();
    mender.run(mesh, bad, &mut |share| {
        let done = (100.0 * share) as u32;
        progress(Progress { stage: "mend", done, total: 100, unit: "%" });
    });
    mender.counts()
}

/// Mends what rounds have left, and nothing else; effects as of [`run`].
pub fn mend<P: Pages>(mesh: &mut Mesh<P>, progress: &dyn Fn(Progress)) -> MendCounts {
    prepare(mesh);
    let mut all = PageFlags::all(mesh);
    mended(mesh, &mut all, progress)
}

/// Rounds for tetrahedra that need them, but for those listed, whose turn is another time. `tet_of` must be right, all marks down; so are
/// they afterwards. Also returns the pages that may still hold bad tetrahedra.
pub fn improve_all_but<P: Pages>(
    mesh: &mut Mesh<P>,
    others: &[u32],
) -> (OperationCounts, Vec<u32>) {
    let mut rounds = Rounds::new(PageFlags::all(mesh));
    rounds.pass_over(mesh, others);
    rounds.run(mesh, BAD, &mut |_, _| ());
    let bad = rounds.finish(mesh);
    let mut left = PageFlags::default();
    for goal in [WORST, SHARE] {
        rounds.flags.clone_from(&bad);
        rounds.pass_over(mesh, others);
        rounds.run(mesh, goal, &mut |_, _| ());
        left = rounds.finish(mesh);
    }
    (rounds.counts, left.take_all())
}

/// Takes the marks down that refinement leaves, and points each vertex to its tetrahedron of smallest id.
fn prepare<P: Pages>(mesh: &mut Mesh<P>) {
    for t in (0..dense(mesh.tet_ids_end())).rev().map(sparse) {
        let tet = mesh.tet(t);
        if tet.is_live() {
            clear_marks(mesh, t, &tet);
            tet.vertices().into_iter().for_each(|v| mesh.set_tet_of(v, t));
        }
    }
}
