//! Labels of triangles in several groups: each combination of groups that occurs is a label of its own.

use std::collections::HashMap;

use super::Surface;
use tetdb_schema::labels::{self, LabelSet};

/// Stands between the names of the groups in the name of a label for several.
const TOGETHER: &str = "+";
/// Bytes a triangle takes while repeated ones are looked for.
pub(super) const JOIN_BYTES: u64 = 17;

impl Surface {
    /// Labels of the groups that triangles with this label belong to: itself, unless it stands for several.
    pub fn label_members<'a>(&'a self, label: &'a u32) -> &'a [u32] {
        labels::members(&self.label_sets, label)
    }

    /// Puts the triangles of a label into several groups, for each of these labels by its name. Effects: renumbers labels.
    pub fn divide_labels(&mut self, groups: &[(&str, &[&str])]) {
        let groups: HashMap<&str, &[&str]> = groups.iter().copied().collect();
        let old = std::mem::take(&mut self.label_names);
        let old_sets = std::mem::take(&mut self.label_sets);
        let (mut made, mut numbers) = (Self::default(), LabelNumbers::default());
        let mut known: HashMap<u32, u32> = HashMap::new();
        let mut new = |label: &mut u32| {
            *label = *known.entry(*label).or_insert_with(|| {
                let names =
                    labels::members(&old_sets, label).iter().map(|&m| old[m as usize].as_str());
                let names = match groups.get(old[*label as usize].as_str()) {
                    Some(groups) => groups.to_vec(),
                    None => names.collect(),
                };
                let labels: Vec<u32> =
                    names.iter().map(|name| numbers.label(&mut made, name)).collect();
                numbers.label_of_all(&mut made, &labels)
            });
        };
        self.labels.iter_mut().for_each(&mut new);
        self.embedded.edges.iter_mut().for_each(|[.., label]| new(label));
        self.embedded.points.iter_mut().for_each(|[.., label]| new(label));
        self.label_names = made.label_names;
        self.label_sets = made.label_sets;
        self.name_label_sets(0);
    }

    /// Puts the first triangle of each pair into the groups of the second one too.
    pub(super) fn join_labels(&mut self, pairs: &[[u32; 2]]) {
        let first = self.label_names.len() as u32;
        let mut numbers = LabelNumbers::default();
        for set in &self.label_sets {
            numbers.sets.insert(set.members.clone(), set.label);
        }
        for pair in pairs {
            let [a, b] = pair.map(|t| self.labels[t as usize]);
            self.labels[pair[0] as usize] = numbers.label_of_all(self, &[a, b]);
        }
        self.name_label_sets(first);
    }

    /// Adds sets of labels whose numbers count from `first`.
    pub(super) fn add_label_sets(&mut self, first: u32, sets: &[LabelSet]) {
        let moved = |set: &LabelSet| LabelSet {
            label: first + set.label,
            members: set.members.iter().map(|m| first + m).collect(),
        };
        self.label_sets.extend(sets.iter().map(moved));
        self.name_label_sets(first);
    }

    /// Names the labels for several from `first` on: the names of the groups, joined. One that has a `+` itself is quoted. A name that is
    /// taken gets a number.
    pub(super) fn name_label_sets(&mut self, first: u32) {
        for set in self.label_sets.iter().filter(|set| set.label >= first) {
            let name = |&member: &u32| match &self.label_names[member as usize] {
                name if name.contains(TOGETHER) => format!("\"{name}\""),
                name => name.clone(),
            };
            let wanted = set.members.iter().map(name).collect::<Vec<_>>().join(TOGETHER);
            self.label_names[set.label as usize].clear();
            let numbered = (2..).map(|n| format!("{wanted}~{n}"));
            let mut names = std::iter::once(wanted.clone()).chain(numbered);
            let free = names.find(|name| !self.label_names.contains(name));
            self.label_names[set.label as usize] = free.expect("one number is free");
        }
    }
}

/// The labels of a surface that is being built, by name and by members.
#[derive(Default)]
pub(super) struct LabelNumbers {
    ids: HashMap<String, u32>,
    sets: HashMap<Vec<u32>, u32>,
}

impl LabelNumbers {
    /// The label of that name, which is added if new.
    pub fn label(&mut self, surface: &mut Surface, name: &str) -> u32 {
        if let Some(&id) = self.ids.get(name) {
            return id;
        }
        let id = surface.label_names.len() as u32;
        surface.label_names.push(name.to_owned());
        self.ids.insert(name.to_owned(), id);
        id
    }

    /// The label of triangles in all groups of these labels. It gets its name when all names are known.
    pub fn label_of_all(&mut self, surface: &mut Surface, labels: &[u32]) -> u32 {
        let sets = &surface.label_sets;
        let mut members: Vec<u32> =
            labels.iter().flat_map(|label| labels::members(sets, label)).copied().collect();
        members.sort_unstable();
        members.dedup();
        if let [label] = members[..] {
            return label;
        }
        if let Some(&label) = self.sets.get(&members) {
            return label;
        }
        let label = surface.label_names.len() as u32;
        surface.label_names.push(String::new());
        surface.label_sets.push(LabelSet { label, members: members.clone() });
        self.sets.insert(members, label);
        label
    }

    /// Joins triangles from `first` on that have the same vertices and direction, and differ in their labels; one with all labels
    /// stays, in the first place. Memory: [`JOIN_BYTES`] for each.
    pub fn join_triangles(&mut self, surface: &mut Surface, first: usize) {
        let own = first..surface.triangles.len();
        let key = |t: usize| {
            let [a, b, c] = surface.triangles[t];
            let [a, b, c] = match a.min(b).min(c) {
                low if low == a => [a, b, c],
                low if low == b => [b, c, a],
                _ => [c, a, b],
            };
            [a, b, c, t as u32]
        };
        let mut keys: Vec<[u32; 4]> = own.map(key).collect();
        keys.sort_unstable();
        let mut is_gone = vec![false; surface.triangles.len()];
        let mut joined = Vec::new();
        for same in keys.chunk_by(|a, b| a[..3] == b[..3]).filter(|same| same.len() > 1) {
            let first = same[0][3] as usize;
            let mut labels = vec![surface.labels[first]];
            for &[.., t] in &same[1..] {
                let label = surface.labels[t as usize];
                // A triangle twice in one group is for validation to report.
                if !labels.contains(&label) {
                    labels.push(label);
                    is_gone[t as usize] = true;
                }
            }
            if labels.len() > 1 {
                joined.push((first, labels));
            }
        }
        joined.sort_unstable();
        for (first, labels) in joined {
            surface.labels[first] = self.label_of_all(surface, &labels);
        }
        let mut gone = is_gone.iter();
        surface.triangles.retain(|_| gone.next() == Some(&false));
        let mut gone = is_gone.iter();
        surface.labels.retain(|_| gone.next() == Some(&false));
    }
}

/// Keeps the labels that triangles have, and the members of those, in their order.
pub(super) fn drop_unused_labels(surface: &mut Surface) {
    let mut used = vec![false; surface.label_names.len()];
    for &label in &surface.labels {
        used[label as usize] = true;
    }
    surface.label_sets.retain(|set| used[set.label as usize]);
    for &member in surface.label_sets.iter().flat_map(|set| &set.members) {
        used[member as usize] = true;
    }
    if used.iter().all(|&u| u) {
        return;
    }
    let mut next = 0;
    let number = |&is_used: &bool| {
        next += u32::from(is_used);
        next - u32::from(is_used)
    };
    let new_ids: Vec<u32> = used.iter().map(number).collect();
    let mut keep = used.iter();
    surface.label_names.retain(|_| *keep.next().expect("one flag per label"));
    let sets = surface.label_sets.iter_mut();
    let of_sets = sets.flat_map(|set| std::iter::once(&mut set.label).chain(&mut set.members));
    for label in surface.labels.iter_mut().chain(of_sets) {
        *label = new_ids[*label as usize];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Point;
    use crate::surface::SurfaceBuilder;

    /// A tetrahedron whose sides are listed once for each of their groups.
    fn listed(sides: &[([u32; 3], &str)]) -> Surface {
        let mut builder = SurfaceBuilder::new();
        builder.begin_file("t");
        builder.join_groups_at_end();
        for p in [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]] {
            builder.vertex(Point::from_array(p)).unwrap();
        }
        for &(corners, name) in sides {
            let label = builder.label(name);
            builder.triangle(corners, label).unwrap();
        }
        builder.end_file().unwrap();
        builder.finish()
    }

    #[test]
    fn repeated_triangles_become_one_with_all_labels() {
        let all = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let mut sides: Vec<([u32; 3], &str)> = all.map(|t| (t, "walls")).to_vec();
        // Behind all others, and with another corner first.
        sides.extend([([1, 3, 0], "in"), ([0, 2, 1], "in"), ([0, 2, 1], "a+b")]);
        let surface = listed(&sides);
        assert_eq!(surface.triangles, all);
        assert_eq!(surface.label_names, ["walls", "in", "a+b", "walls+in+\"a+b\"", "walls+in"]);
        assert_eq!(surface.labels, [3, 4, 0, 0]);
        assert_eq!(surface.label_members(&3), [0, 1, 2]);
        // Twice in one group, and a wall of two directions, stay as they are.
        assert_eq!(listed(&[(all[0], "a"), (all[0], "a"), (all[1], "b")]).n_triangles(), 3);
        assert_eq!(listed(&[(all[0], "a"), ([0, 1, 2], "b")]).n_triangles(), 2);
    }

    #[test]
    fn names_that_are_taken_get_a_number_and_unused_labels_go() {
        let mut builder = SurfaceBuilder::new();
        builder.begin_file("t");
        let [a, b, c] = ["a", "b", "c"].map(|name| builder.label(name));
        let ab = builder.label_of_all(&[b, a, b]);
        assert_eq!(builder.label_of_all(&[ab, a]), ab);
        assert_eq!(builder.label_of_all(&[c, c]), c);
        builder.label_of_all(&[a, c]);
        let plain = builder.label("a+b");
        for label in [ab, plain] {
            builder.triangle_at([Point::ZERO, Point::X, Point::Y], label).unwrap();
        }
        builder.end_file().unwrap();
        let surface = builder.finish();
        assert_eq!(surface.label_names, ["a", "b", "a+b~2", "a+b"]);
        assert_eq!(surface.label_sets, [LabelSet { label: 2, members: vec![0, 1] }]);
        let mut whole = Surface::default();
        whole.embed(&surface, "s").unwrap();
        assert_eq!(whole.label_names, ["s:a", "s:b", "s:a+s:b", "s:a+b"]);
        assert_eq!(whole.labels, [2, 3]);
        whole.embed(&surface.part(false), "s").unwrap();
        assert_eq!(whole.label_members(&6), [4, 5]);
        let mut divided = surface.clone();
        divided.divide_labels(&[("a+b", &["z", "b"])]);
        assert_eq!(divided.label_names, ["a", "b", "a+b", "z", "b+z"]);
        assert_eq!((&divided.labels[..], divided.label_members(&4)), (&[2, 4][..], &[1, 3][..]));
        divided.divide_labels(&[]);
        assert_eq!(divided.label_names, ["a", "b", "a+b", "z", "b+z"]);
    }
}
