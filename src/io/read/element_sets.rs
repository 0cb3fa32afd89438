//! Named sets of elements, which are groups of their faces.

use std::collections::HashMap;

/// Scope of the sets of an assembly; others are those of a part.
pub(super) const ASSEMBLY: u32 = u32::MAX;

/// Sets of elements by name.
#[derive(Default)]
pub(super) struct ElementSets {
    names: Vec<String>,
    /// Sets by scope and name in small letters; several where names differ in case alone.
    ids: HashMap<(u32, String), Vec<u32>>,
    /// Set, part, first, last and step of element numbers.
    ranges: Vec<(u32, u32, [i64; 3])>,
    /// For each set those that have all its elements.
    parents: HashMap<u32, Vec<u32>>,
}

impl ElementSets {
    /// The set of that very name, which is added if new.
    pub fn exact(&mut self, scope: u32, name: &str) -> u32 {
        let alike = self.ids.entry((scope, name.to_lowercase())).or_default();
        let known = alike.iter().find(|&&id| self.names[id as usize] == name).copied();
        known.unwrap_or_else(|| {
            self.names.push(name.to_owned());
            alike.push(self.names.len() as u32 - 1);
            self.names.len() as u32 - 1
        })
    }

    /// The first set of that name without regard to case, which is added if new.
    pub fn any_case(&mut self, scope: u32, name: &str) -> u32 {
        let known = self.ids.get(&(scope, name.to_lowercase()));
        let known = known.and_then(|alike| alike.first()).copied();
        known.unwrap_or_else(|| self.exact(scope, name))
    }

    pub fn name(&self, set: u32) -> &str {
        &self.names[set as usize]
    }

    /// Adds elements of a part by first number, last number and step.
    pub fn add(&mut self, set: u32, part: u32, [first, last, step]: [i64; 3]) {
        if let Some((of, in_part, range)) = self.ranges.last_mut()
            && (*of, *in_part, step, first) == (set, part, 1, range[1].saturating_add(1))
            && range[2] == 1
        {
            range[1] = last;
            return;
        }
        self.ranges.push((set, part, [first, last, step.max(1)]));
    }

    /// Adds all elements of the sets called `name` in a scope; returns whether there is one.
    pub fn add_set(&mut self, set: u32, scope: u32, name: &str) -> bool {
        let named = self.ids.get(&(scope, name.to_lowercase())).cloned().unwrap_or_default();
        for &child in &named {
            self.parents.entry(child).or_default().push(set);
        }
        !named.is_empty()
    }

    /// The sets of each of these elements, given by part and number, and the number of sets with other elements.
    pub fn by_element(&self, wanted: &[(u32, i64)]) -> (HashMap<(u32, i64), Vec<u32>>, u64) {
        let mut of: HashMap<(u32, i64), Vec<u32>> = HashMap::new();
        if !self.ranges.is_empty() {
            of = wanted.iter().map(|&element| (element, Vec::new())).collect();
        }
        let mut with_others = Vec::new();
        for &(set, part, [first, last, step]) in &self.ranges {
            let n = (last.saturating_sub(first) / step).saturating_add(1);
            let mut n_found = 0;
            let mut add = |sets: &mut Vec<u32>| {
                n_found += 1;
                if sets.last() != Some(&set) {
                    sets.push(set);
                }
            };
            if n > of.len() as i64 {
                let from_first = |id: i64| i128::from(id) - i128::from(first);
                let is_here =
                    |id| (first..=last).contains(&id) && from_first(id) % i128::from(step) == 0;
                of.iter_mut()
                    .filter(|((p, id), _)| *p == part && is_here(*id))
                    .for_each(|e| add(e.1));
            } else {
                let ids = (0..n).map(|k| first + k * step);
                ids.for_each(|id| of.get_mut(&(part, id)).into_iter().for_each(&mut add));
            }
            if n_found < n && with_others.last() != Some(&set) {
                with_others.push(set);
            }
        }
        with_others.sort_unstable();
        with_others.dedup();
        (of, with_others.len() as u64)
    }

    /// Adds to sets those that have all their elements.
    pub fn with_parents(&self, sets: &mut Vec<u32>) {
        let mut k = 0;
        while let Some(set) = sets.get(k) {
            let parents = self.parents.get(set).into_iter().flatten();
            let new: Vec<u32> = parents.copied().filter(|p| !sets.contains(p)).collect();
            sets.extend(new);
            k += 1;
        }
        sets.sort_unstable();
        sets.dedup();
    }
}
