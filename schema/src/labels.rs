//! Labels of triangles that belong to several groups.

use rkyv::{Archive, Deserialize, Serialize};

/// A label for triangles that belong to several groups: their groups are its members.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct LabelSet {
    /// Its position among the labels.
    pub label: u32,
    /// The labels of the groups, ascending: at least two, and none of them a set.
    pub members: Vec<u32>,
}

/// The labels of the groups of triangles with this label: itself alone, unless it is that of a set. `sets` ascend by label.
pub fn members<'a>(sets: &'a [LabelSet], label: &'a u32) -> &'a [u32] {
    match sets.binary_search_by_key(label, |set| set.label) {
        Ok(at) => &sets[at].members,
        Err(_) => std::slice::from_ref(label),
    }
}

/// Labels whose triangles belong to all groups of `label`: itself first, then sets.
pub fn labels_within(sets: &[LabelSet], label: u32) -> Vec<u32> {
    let wanted = members(sets, &label);
    let holds = |set: &&LabelSet| wanted.iter().all(|m| set.members.contains(m));
    let others = sets.iter().filter(holds).map(|set| set.label).filter(|&other| other != label);
    std::iter::once(label).chain(others).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_finds_the_sets_that_hold_its_groups() {
        let set = |label, members: &[u32]| LabelSet { label, members: members.to_vec() };
        let sets = [set(2, &[0, 1]), set(4, &[1, 3]), set(5, &[0, 1, 3])];
        assert_eq!(members(&sets, &5), [0, 1, 3]);
        assert_eq!(members(&sets, &3), [3]);
        assert_eq!(labels_within(&sets, 0), [0, 2, 5]);
        assert_eq!(labels_within(&sets, 1), [1, 2, 4, 5]);
        assert_eq!(labels_within(&sets, 2), [2, 5]);
        assert_eq!(labels_within(&sets, 6), [6]);
    }
}
