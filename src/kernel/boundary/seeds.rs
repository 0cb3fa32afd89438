//! Seeds of volumes: filled volumes, holes, names.

use std::collections::{BTreeMap, BTreeSet};

use super::error::BoundaryError;
use super::policy::{Filled, RegionPolicy};
use tetdb_base::geom::Point;
use tetdb_base::surface::{Seed, SeedKind};

/// Which regions are filled, and their names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RegionRule {
    /// The rule without seeds.
    pub policy: RegionPolicy,
    /// Seeds of the user. Each must lie in a region that it can fill, name or empty.
    pub seeds: Vec<Seed>,
    /// Named seeds of the surface's files; those that lie in no filled region are ignored.
    pub names: Vec<Seed>,
    /// The policy was asked for; else seeds of the surface's files may decide it.
    pub is_given: bool,
}

impl From<RegionPolicy> for RegionRule {
    fn from(policy: RegionPolicy) -> Self {
        let (seeds, names) = (Vec::new(), Vec::new());
        Self { policy, seeds, names, is_given: true }
    }
}

impl RegionRule {
    /// Fills, empties and names the volumes `outside + 1 .. end` on top of the policy's choice; `volume_of` returns the
    /// volume around a point.
    ///
    /// Errors: [`BoundaryError::Seed`] names the seed.
    pub fn apply(
        &self,
        mut filled: Filled,
        outside: u32,
        end: u32,
        mut volume_of: impl FnMut(Point) -> u32,
    ) -> Result<Filled, BoundaryError> {
        let mut holes: BTreeMap<u32, &Seed> = BTreeMap::new();
        let mut regions: BTreeMap<u32, &Seed> = BTreeMap::new();
        for seed in &self.seeds {
            let volume = volume_of(seed.point);
            if volume == outside {
                if (self.policy, &seed.kind) == (RegionPolicy::AllButHoles, &SeedKind::Hole) {
                    continue;
                }
                return Err(wrong(seed, "lies outside of all volumes"));
            }
            let of_kind = match seed.kind {
                SeedKind::Hole => &mut holes,
                SeedKind::Region(_) => &mut regions,
            };
            let known = *of_kind.entry(volume).or_insert(seed);
            if known.kind != seed.kind {
                let what = format!("lies in the same region as {known}, which has another name");
                return Err(wrong(seed, &what));
            }
        }
        if let Some((volume, seed)) = regions.iter().find(|(v, _)| holes.contains_key(v)) {
            let what = format!("lies in the same region as the hole {}", holes[volume]);
            return Err(wrong(seed, &what));
        }
        if self.policy == RegionPolicy::Seeds {
            filled.volumes = match (regions.is_empty(), holes.is_empty()) {
                (true, true) => return Err(BoundaryError::NoSeed),
                (true, false) => (outside + 1..end).collect(),
                _ => regions.keys().copied().collect(),
            };
        }
        filled.volumes.retain(|v| !holes.contains_key(v));
        if let Some((_, seed)) = (regions.iter()).find(|(v, _)| !filled.volumes.contains(v)) {
            return Err(wrong(seed, "lies in a region that stays empty under the chosen rule"));
        }
        filled.names = names(&regions);
        self.take_names(&mut filled, volume_of);
        Ok(filled)
    }

    /// Adds names from the surface's files to volumes without one; contradictory names are dropped.
    fn take_names(&self, filled: &mut Filled, mut volume_of: impl FnMut(Point) -> u32) {
        let mut found: BTreeMap<u32, BTreeSet<&str>> = BTreeMap::new();
        for seed in &self.names {
            if let SeedKind::Region(Some(name)) = &seed.kind {
                found.entry(volume_of(seed.point)).or_default().insert(name);
            }
        }
        for (volume, all) in found {
            if let (1, true) = (all.len(), filled.volumes.contains(&volume)) {
                let name = all.into_iter().next().unwrap_or_default();
                filled.names.entry(volume).or_insert_with(|| name.to_owned());
            }
        }
    }
}

fn names(regions: &BTreeMap<u32, &Seed>) -> BTreeMap<u32, String> {
    let name = |(&volume, seed): (&u32, &&Seed)| match &seed.kind {
        SeedKind::Region(Some(name)) => Some((volume, name.clone())),
        _ => None,
    };
    regions.iter().filter_map(name).collect()
}

fn wrong(seed: &Seed, what: &str) -> BoundaryError {
    let seed_word = match seed.kind {
        SeedKind::Hole => "hole",
        SeedKind::Region(_) => "region seed",
    };
    BoundaryError::Seed { message: format!("the {seed_word} {seed} {what}"), point: seed.point }
}
