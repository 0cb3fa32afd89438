//! What rounds aim at, one aim after the other, and what they have done.

use tetdb_base::shape::INVERSE_QUALITY_WANTED;

/// What a round aims at.
#[derive(Clone, Copy)]
pub(super) struct RoundGoal {
    /// Tetrahedra below this goodness are attacked.
    pub(super) below: f64,
    /// Searches for a position stop here.
    pub(super) enough: f64,
    pub(super) means: Means,
}

/// What may be done, and what it is judged by.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Means {
    /// Connections change and vertices move where that raises the worst goodness.
    Connections,
    /// Vertices are removed and added, too.
    Vertices,
    /// All this where it lowers the sum of what is missing.
    Sum,
}

/// The first aim: every tetrahedron of q ≥ 2, without changing the vertices' number.
pub(super) const BAD: RoundGoal = RoundGoal {
    below: INVERSE_QUALITY_WANTED,
    enough: INVERSE_QUALITY_WANTED * 1.02,
    means: Means::Connections,
};

/// The second aim: what is still at q ≥ 3 after the first.
pub(super) const WORST: RoundGoal =
    RoundGoal { below: 1.0 / 3.0, enough: 0.5, means: Means::Vertices };

/// The third aim: what is still at q >= 2 after the others.
pub(super) const SHARE: RoundGoal =
    RoundGoal { below: INVERSE_QUALITY_WANTED, enough: INVERSE_QUALITY_WANTED, means: Means::Sum };

/// Accepted operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OperationCounts {
    /// Bad tetrahedra looked at, over all rounds.
    pub attacked: u64,
    /// Edges removed.
    pub edges_removed: u64,
    /// Faces swapped for edges.
    pub faces_swapped: u64,
    /// Vertices moved by smoothing.
    pub vertices_smoothed: u64,
    /// Edges collapsed.
    pub edges_collapsed: u64,
    /// Vertices inserted.
    pub vertices_inserted: u64,
    /// Rounds done.
    pub rounds: u32,
}

impl OperationCounts {
    /// Adds what was done in another part of the mesh.
    pub fn add(&mut self, other: &Self) {
        self.attacked += other.attacked;
        self.edges_removed += other.edges_removed;
        self.faces_swapped += other.faces_swapped;
        self.vertices_smoothed += other.vertices_smoothed;
        self.edges_collapsed += other.edges_collapsed;
        self.vertices_inserted += other.vertices_inserted;
        self.rounds = self.rounds.max(other.rounds);
    }

    /// Changes to the mesh.
    pub(super) fn changes(&self) -> u64 {
        self.edges_removed
            + self.faces_swapped
            + self.vertices_smoothed
            + self.edges_collapsed
            + self.vertices_inserted
    }
}
