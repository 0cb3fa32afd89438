//! Missing facets in one plane that meet in missing segments: recovered as one part, their own segments afterwards.
//!
//! An edge pierces a flat part of the surface once, even if the part has many narrow facets. So points are put where
//! edges pierce the part, not where its segments cross faces. Its segments are recovered by turning edges.

use std::collections::BTreeMap;

use super::complex::TetComplex;
use super::walk::find_edge;

/// Facets in one plane that share missing segments.
#[derive(Clone, Debug, Default)]
pub(super) struct FlatPart {
    /// All turn the same way.
    pub facets: Vec<[u32; 3]>,
    /// Sides of facets where the part ends, in their direction.
    pub outline: Vec<(u32, u32)>,
    /// Missing segments between two of the facets.
    pub inner: Vec<(u32, u32)>,
}

impl FlatPart {
    fn one(f: [u32; 3]) -> Self {
        Self { facets: vec![f], outline: sides(f).to_vec(), inner: Vec::new() }
    }

    /// Returns whether `v` is a corner of one of its facets.
    pub fn has(&self, v: u32) -> bool {
        self.facets.iter().any(|f| f.contains(&v))
    }

    /// The same part with renamed vertices.
    pub fn renamed(&self, mut name: impl FnMut(u32) -> u32) -> Self {
        let facets = self.facets.iter().map(|f| f.map(&mut name)).collect();
        let mut pairs = |all: &[(u32, u32)]| all.iter().map(|&(a, b)| (name(a), name(b))).collect();
        Self { facets, outline: pairs(&self.outline), inner: pairs(&self.inner) }
    }
}

/// The three sides of a facet, in its direction.
pub(super) fn sides([a, b, c]: [u32; 3]) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)]
}

/// Each facet a part of its own.
pub(super) fn single_parts(facets: &[[u32; 3]]) -> Vec<FlatPart> {
    facets.iter().map(|&f| FlatPart::one(f)).collect()
}

/// The flat parts of `facets`, which are all there are at their missing segments, in the order of their first facets.
pub(super) fn flat_parts<S: TetComplex>(s: &mut S, facets: &[[u32; 3]]) -> Vec<FlatPart> {
    let mut at: BTreeMap<(u32, u32), Vec<usize>> = BTreeMap::new();
    for (i, &f) in facets.iter().enumerate() {
        for (a, b) in sides(f) {
            at.entry((a.min(b), a.max(b))).or_default().push(i);
        }
    }
    // Two facets in one plane share the segment, no other facet has it, and it is missing.
    let opposite = |i: usize, (a, b): (u32, u32)| facets[i].into_iter().find(|&v| v != a && v != b);
    at.retain(|&(a, b), owners| {
        let &[i, j] = owners.as_slice() else {
            return false;
        };
        let (Some(c), Some(d)) = (opposite(i, (a, b)), opposite(j, (a, b))) else {
            return false;
        };
        s.orient([a, b, c, d]) == 0.0 && find_edge(s, a, b).is_none()
    });
    let mut seen = vec![false; facets.len()];
    let mut parts = Vec::new();
    for first in 0..facets.len() {
        if seen[first] {
            continue;
        }
        seen[first] = true;
        let mut part = FlatPart::default();
        let mut queue = vec![(first, facets[first])];
        while let Some((i, f)) = queue.pop() {
            part.facets.push(f);
            for (a, b) in sides(f) {
                let Some(owners) = at.get(&(a.min(b), a.max(b))) else {
                    part.outline.push((a, b));
                    continue;
                };
                let j = if owners[0] == i { owners[1] } else { owners[0] };
                if seen[j] {
                    continue;
                }
                seen[j] = true;
                let mut next = facets[j];
                if sides(next).contains(&(a, b)) {
                    next.swap(1, 2);
                }
                queue.push((j, next));
            }
        }
        let mut inner: Vec<(u32, u32)> = part.facets.iter().copied().flat_map(sides).collect();
        inner.retain(|&(a, b)| a < b && at.contains_key(&(a, b)));
        inner.sort_unstable();
        part.inner = inner;
        parts.push(part);
    }
    parts
}
