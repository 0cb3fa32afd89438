//! Assignment of work to tasks; it depends on the numbers of sub-domains and tasks alone.

use tetdb_schema::tree::RankRange;

/// Largest number of tasks in one stage: batch schedulers have arrays of 1,000 by default.
pub const TASKS_MAX: u32 = 1000;

/// The kind of work of a stage's tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StageKind {
    /// One cut per task, at the top of the tree, where there are fewer subtrees than tasks.
    Cuts,
    /// All cuts of a subtree.
    Subtrees,
    /// Sub-domains.
    Subdomains,
}

/// Tasks that depend on all earlier stages, but not on each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    /// The kind of work.
    pub kind: StageKind,
    /// Number of the first task. Tasks are numbered through all stages, from 1.
    pub first: u32,
    /// The subtree, or range of sub-domains, of each task.
    pub parts: Vec<RankRange>,
}

impl Stage {
    /// Numbers of the stage's tasks.
    pub fn tasks(&self) -> std::ops::Range<u32> {
        self.first..self.first + self.parts.len() as u32
    }

    /// Returns the subtree, or range of sub-domains, of a task of this stage.
    pub fn part(&self, task: u32) -> Option<RankRange> {
        let at = task.checked_sub(self.first)?;
        self.parts.get(at as usize).copied()
    }
}

/// Returns the stages of a mesh of `n` sub-domains for about `tasks` tasks at once.
pub fn stages(n: u32, tasks: u32) -> Vec<Stage> {
    let tasks = tasks.clamp(1, TASKS_MAX);
    let mut stages: Vec<Stage> = Vec::new();
    let mut add = |kind, parts: Vec<RankRange>| {
        let first = stages.last().map_or(1, |stage| stage.tasks().end);
        stages.push(Stage { kind, first, parts });
    };
    let is_wide = |part: &RankRange| part.count > 1;
    let mut level = vec![RankRange { first: 0, count: n }];
    while level.iter().any(is_wide) {
        let wide: Vec<RankRange> = level.iter().copied().filter(is_wide).collect();
        let enough = level.len() >= tasks as usize || 2 * level.len() > TASKS_MAX as usize;
        if enough {
            add(StageKind::Subtrees, wide);
            break;
        }
        add(StageKind::Cuts, wide);
        let children = |part: RankRange| match part.count {
            1 => vec![part],
            _ => part.children().to_vec(),
        };
        level = level.into_iter().flat_map(children).collect();
    }
    let batches = tasks.min(n);
    let at = |k: u32| (u64::from(n) * u64::from(k) / u64::from(batches)) as u32;
    let batch = |k| RankRange { first: at(k), count: at(k + 1) - at(k) };
    add(StageKind::Subdomains, (0..batches).map(batch).collect());
    stages
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cut_and_every_sub_domain_has_one_task() {
        for n in [1, 2, 3, 7, 64, 1000, 4096] {
            for tasks in [1, 2, 5, 64, 1000, 5000] {
                let stages = stages(n, tasks);
                let mut next = 1;
                let mut cuts: Vec<u32> = Vec::new();
                let mut ranks: Vec<u32> = Vec::new();
                for stage in &stages {
                    assert_eq!(stage.first, next);
                    next = stage.tasks().end;
                    assert!(stage.parts.len() <= TASKS_MAX as usize, "{n} by {tasks}");
                    for part in &stage.parts {
                        let ends = part.ranks();
                        match stage.kind {
                            StageKind::Cuts => cuts.push(part.cut()),
                            StageKind::Subtrees => cuts.extend(ends.skip(1)),
                            StageKind::Subdomains => ranks.extend(ends),
                        }
                    }
                }
                cuts.sort_unstable();
                assert_eq!(cuts, (1..n).collect::<Vec<_>>(), "{n} by {tasks}");
                assert_eq!(ranks, (0..n).collect::<Vec<_>>(), "{n} by {tasks}");
            }
        }
    }
}
