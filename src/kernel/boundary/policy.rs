//! Policies that choose filled volumes by the walls between them.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::error::BoundaryError;
use tetdb_base::surface::Wall;
use tetdb_schema::word::Word;

/// Walls between pairs of volumes, the lower-numbered one first.
pub type Walls = BTreeMap<(u32, u32), Wall>;

/// Which regions that the surface encloses are filled with tetrahedra.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RegionPolicy {
    /// Regions that an odd number of shells separates from the outside; all regions where shells contradict each other.
    #[default]
    Parity,
    /// Every bounded region.
    All,
    /// Regions that touch the outer shells from inside.
    Outer,
    /// Regions behind triangles whose front side looks away from them.
    ByOrientation,
    /// Regions with a seed; where only holes are given, all others.
    Seeds,
    /// Every bounded region without a hole. Holes outside change nothing.
    AllButHoles,
}

impl Word for RegionPolicy {
    const WORDS: &'static [(Self, &'static str)] = &[
        (Self::Parity, "parity"),
        (Self::All, "all"),
        (Self::Outer, "outer"),
        (Self::ByOrientation, "by-orientation"),
        (Self::Seeds, "seeds"),
        (Self::AllButHoles, "all-but-holes"),
    ];
}

/// The volumes a policy chooses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Filled {
    /// Numbers of the chosen volumes.
    pub volumes: BTreeSet<u32>,
    /// Names of chosen volumes, if they have one.
    pub names: BTreeMap<u32, String>,
    /// Parity was contradictory (shared walls), so all were chosen.
    pub all_instead_of_parity: bool,
}

impl RegionPolicy {
    /// Chooses among the volumes behind `outside`, up to `end`. Of seeds nothing is known here: none.
    ///
    /// Errors: [`BoundaryError::Orientation`] when orientation is contradictory.
    pub fn filled(&self, outside: u32, end: u32, walls: &Walls) -> Result<Filled, BoundaryError> {
        let all: BTreeSet<u32> = (outside + 1..end).collect();
        let mut all_instead_of_parity = false;
        let volumes = match self {
            Self::All | Self::AllButHoles => all,
            Self::Seeds => BTreeSet::new(),
            Self::Outer => {
                let outer = walls.keys().filter(|&&(low, _)| low == outside);
                outer.map(|&(_, high)| high).collect()
            }
            Self::Parity => {
                // A wall given once from each side, as two touching solids do, is crossed twice.
                let step = |w: &Wall| i64::from(w.front != w.back);
                match spread(outside, end, walls, step, 2) {
                    Some(depth) => {
                        all.into_iter().filter(|&v| depth[v as usize].rem_euclid(2) == 1).collect()
                    }
                    None => {
                        all_instead_of_parity = true;
                        all
                    }
                }
            }
            Self::ByOrientation => {
                let winding = winding(outside, end, walls)?;
                all.into_iter().filter(|&v| winding[v as usize] > 0).collect()
            }
        };
        Ok(Filled { volumes, names: BTreeMap::new(), all_instead_of_parity })
    }
}

fn winding(outside: u32, end: u32, walls: &Walls) -> Result<Vec<i64>, BoundaryError> {
    let two_ways = |w: &&Wall| w.front != 0 && w.back != 0 && w.front != w.back;
    if let Some(w) = walls.values().find(two_ways) {
        return Err(BoundaryError::Orientation {
            what: format!(
                "of the triangles between two volumes {} point one way and {} the other",
                w.front, w.back
            ),
        });
    }
    let sign = |w: &Wall| i64::from(w.front > w.back) - i64::from(w.back > w.front);
    spread(outside, end, walls, sign, 0).ok_or_else(|| {
        let inner = walls.keys().filter(|(low, _)| *low != outside).count();
        BoundaryError::Orientation {
            what: format!(
                "{inner} walls part two volumes that both lie inside, and a wall given once points out of one of its two volumes alone"
            ),
        }
    })
}

/// Carries a value from the outside through the walls; `None` when two ways disagree (modulo `modulus`, if not 0).
fn spread(
    outside: u32,
    end: u32,
    walls: &Walls,
    step: impl Fn(&Wall) -> i64,
    modulus: i64,
) -> Option<Vec<i64>> {
    let mut next: Vec<Vec<(u32, i64)>> = vec![Vec::new(); end as usize];
    for (&(low, high), wall) in walls {
        let step = step(wall);
        next[low as usize].push((high, step));
        next[high as usize].push((low, -step));
    }
    let mut value: Vec<Option<i64>> = vec![None; end as usize];
    value[outside as usize] = Some(0);
    let mut queue = VecDeque::from([outside]);
    while let Some(v) = queue.pop_front() {
        let here = value[v as usize].expect("queued with a value");
        for &(other, step) in &next[v as usize] {
            match value[other as usize] {
                None => {
                    value[other as usize] = Some(here + step);
                    queue.push_back(other);
                }
                Some(known) => {
                    let gap = known - here - step;
                    if gap != 0 && (modulus == 0 || gap.rem_euclid(modulus) != 0) {
                        return None;
                    }
                }
            }
        }
    }
    Some(value.into_iter().map(|v| v.unwrap_or(0)).collect())
}
