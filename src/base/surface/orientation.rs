//! Turns triangles the same way, from neighbor to neighbor.

use super::Surface;
use super::edges::{Facets, Groups, same_direction};
use super::sheets::each_pair;
use crate::storage::ScratchSpace;

/// Result of [`orient_alike`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Orientation {
    /// Triangles turned round, in increasing order.
    pub flipped: Vec<u32>,
    /// Patches: triangles joined through edges with exactly two facets.
    pub n_patches: usize,
    /// Patches that cannot be turned one way (a Möbius strip is in them); they were left as they are.
    pub n_unorientable: usize,
}

/// Turns triangles so that the two at each manifold edge run along it in opposite directions.
///
/// Orientation passes only through edges with exactly two facets. In each patch the smaller group of triangles is
/// turned (on a tie those unlike the first), so that one inverted triangle is turned alone. A two-sided facet's second
/// triangle turns with its first. Effects: exchanges two corners of a turned triangle; ids, labels and vertices stay.
pub fn orient_alike(surface: &mut Surface) -> Orientation {
    orient_alike_with(surface, &ScratchSpace::boundless())
}

/// [`orient_alike`] within scratch space. A surface that needs no turning takes 5 bytes a triangle of memory.
///
/// A scratch file that fails unwinds.
pub fn orient_alike_with(surface: &mut Surface, scratch: &ScratchSpace) -> Orientation {
    let mut facets = Facets::new(surface, scratch);
    if let Some(n_patches) = patches_of_one_way(surface, &mut facets) {
        return Orientation { n_patches, ..Orientation::default() };
    }
    let links = links(surface, &mut facets);
    let n = surface.n_triangles();
    let mut turn: Vec<Option<bool>> = vec![None; n];
    let mut done = Orientation::default();
    let mut patch = Vec::new();
    for first in (0..n as u32).filter(|&t| !facets.is_left_out[t as usize]) {
        if turn[first as usize].is_some() {
            continue;
        }
        done.n_patches += 1;
        patch.clear();
        patch.push(first);
        turn[first as usize] = Some(false);
        let mut fits = true;
        let mut next = 0;
        while next < patch.len() {
            let t = patch[next] as usize;
            next += 1;
            for link in links[t].iter().flatten() {
                let wanted = turn[t].map(|turned| turned ^ link.is_unlike());
                match turn[link.triangle() as usize] {
                    None => {
                        turn[link.triangle() as usize] = wanted;
                        patch.push(link.triangle());
                    }
                    known => fits &= known == wanted,
                }
            }
        }
        choose_turned(&patch, fits, &mut turn, &mut done);
    }
    for &[first, second] in &facets.two_sided {
        if turn[first as usize] == Some(true) {
            turn[second as usize] = Some(true);
        }
    }
    done.flipped = (0..n as u32).filter(|&t| turn[t as usize] == Some(true)).collect();
    for &t in &done.flipped {
        surface.triangles[t as usize].swap(1, 2);
    }
    done
}

/// Number of patches when no two triangles at a manifold edge run along it in the same direction.
fn patches_of_one_way(surface: &Surface, facets: &mut Facets) -> Option<usize> {
    let mut patches = Groups::new(surface.n_triangles());
    let mut is_one_way = true;
    facets.each_edge(|uses| {
        each_pair(surface, uses, |a, b| {
            is_one_way &= !same_direction(surface, a, b);
            patches.join(a.triangle(), b.triangle());
        });
    });
    let roots = (0u32..).zip(&facets.is_left_out);
    let roots = roots.filter(|(t, left_out)| !**left_out && patches.root(*t) == *t);
    is_one_way.then(|| roots.count())
}

/// Decides which triangles of a patch turn.
fn choose_turned(patch: &[u32], fits: bool, turn: &mut [Option<bool>], done: &mut Orientation) {
    let n_turned = patch.iter().filter(|&&t| turn[t as usize] == Some(true)).count();
    let turn_others = 2 * n_turned > patch.len();
    done.n_unorientable += usize::from(!fits);
    for &t in patch {
        let turned = turn[t as usize] == Some(true);
        turn[t as usize] = Some(fits && turned != turn_others);
    }
}

/// A neighbor through a manifold edge: `2 * triangle + unlike`.
#[derive(Clone, Copy)]
struct NeighborLink(u32);

impl NeighborLink {
    fn triangle(self) -> u32 {
        self.0 >> 1
    }

    /// Returns whether the two run along their edge in the same direction.
    fn is_unlike(self) -> bool {
        self.0 & 1 == 1
    }
}

fn links(surface: &Surface, facets: &mut Facets) -> Vec<[Option<NeighborLink>; 3]> {
    let mut links = vec![[None; 3]; surface.n_triangles()];
    facets.each_edge(|uses| {
        each_pair(surface, uses, |a, b| {
            let unlike = u32::from(same_direction(surface, a, b));
            links[a.triangle() as usize][a.corner()] =
                Some(NeighborLink(b.triangle() << 1 | unlike));
            links[b.triangle() as usize][b.corner()] =
                Some(NeighborLink(a.triangle() << 1 | unlike));
        });
    });
    links
}
