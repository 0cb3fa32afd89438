//! Groups of faces: a label may stand for several.

use std::collections::{BTreeMap, BTreeSet};

use super::merged::Merged;
use super::names::set_names;
use tetdb_schema::labels;

impl Merged<'_> {
    /// Labels of the groups that faces of this label belong to; itself alone, unless it stands for several.
    pub fn label_members(&self, label: u32) -> Vec<u32> {
        labels::members(&self.label_sets, &label).to_vec()
    }

    /// The groups of each label that faces have, as [`Merged::label_members`].
    pub fn members(&self) -> BTreeMap<u32, Vec<u32>> {
        self.labels().into_keys().map(|label| (label, self.label_members(label))).collect()
    }

    /// Names of the groups the faces are in, ascending by label.
    pub fn groups(&self) -> BTreeMap<u32, String> {
        let members = self.labels().into_keys().flat_map(|label| self.label_members(label));
        members.map(|label| (label, self.label_name(label))).collect()
    }

    /// Names of the groups where faces are in several, and the labels whose faces each has; empty where none is.
    pub fn overlapping_groups(&self) -> Vec<(String, BTreeSet<u32>)> {
        let labels: BTreeSet<u32> = self.labels().into_keys().collect();
        if labels.iter().all(|&label| self.label_members(label).len() == 1) {
            return Vec::new();
        }
        let labels_of = |group: u32| {
            let own = labels.iter().copied();
            own.filter(|&label| self.label_members(label).contains(&group)).collect()
        };
        let names = set_names(&self.groups()).into_iter();
        names.map(|(group, name)| (format!("group_{name}"), labels_of(group))).collect()
    }
}
