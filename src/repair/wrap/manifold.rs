//! The border of the inside made a 2-manifold: outside cells at vertices where it is none become inside, and so do pockets.

use std::collections::VecDeque;

use tetdb_base::storage::{check_cancelled, filled};

use super::delaunay::{Delaunay, N_FAR, NONE};

/// Fills cells until the border of the inside is a manifold without pockets; returns the number filled.
///
/// Around a vertex, the border is one closed fan of triangles exactly if the cells there fall into one connected set of outside and one of
/// inside: the two halves of a small sphere.
pub fn fill(mesh: &Delaunay, is_outside: &mut [bool]) -> u64 {
    let mut n_filled = pockets(mesh, is_outside);
    let mut queue: VecDeque<u32> = (0..mesh.points.len() as u32).collect();
    let mut is_queued = filled(mesh.points.len(), true);
    let mut star = Vec::new();
    let mut n = 0u64;
    while let Some(v) = queue.pop_front() {
        n += 1;
        if n.is_multiple_of(1 << 12) {
            check_cancelled();
        }
        is_queued[v as usize] = false;
        loop {
            mesh.star(v, &mut star);
            let cells = to_fill(mesh, is_outside, v, &star);
            for &t in &cells {
                is_outside[t as usize] = false;
                n_filled += 1;
                for w in mesh.tets[t as usize].vertices {
                    if w != v && !std::mem::replace(&mut is_queued[w as usize], true) {
                        queue.push_back(w);
                    }
                }
            }
            if cells.is_empty() {
                break;
            }
        }
        if queue.is_empty() {
            let new = pockets(mesh, is_outside);
            n_filled += new;
            if new > 0 {
                queue.extend(0..mesh.points.len() as u32);
                is_queued.fill(true);
            }
        }
    }
    n_filled
}

/// Outside cells at `v` to fill next; none where the border is a manifold there.
fn to_fill(mesh: &Delaunay, is_outside: &[bool], v: u32, star: &[u32]) -> Vec<u32> {
    let first = is_outside[star[0] as usize];
    if star.iter().all(|&t| is_outside[t as usize] == first) {
        return Vec::new();
    }
    let parts = parts(mesh, is_outside, v, star);
    let of = |wanted: bool| {
        let mut found: Vec<u32> = Vec::new();
        for (&t, &part) in star.iter().zip(&parts) {
            if is_outside[t as usize] == wanted && !found.contains(&part) {
                found.push(part);
            }
        }
        found
    };
    let (outside, inside) = (of(true), of(false));
    if outside.len() > 1 {
        // All but the part with most cells; one that reaches far stays.
        let weight = |part: u32| {
            let cells = star.iter().zip(&parts).filter(|(_, p)| **p == part).map(|(t, _)| *t);
            cells.fold((0, 0), |(far, n), t| (far + usize::from(is_far(mesh, t)), n + 1))
        };
        let kept = outside.iter().copied().max_by_key(|&part| (weight(part), u32::MAX - part));
        let cells = star.iter().zip(&parts);
        let gone = |(t, part): &(&u32, &u32)| is_outside[**t as usize] && Some(**part) != kept;
        return cells.filter(gone).map(|(t, _)| *t).collect();
    }
    if inside.len() > 1 {
        // One at a time, the shortest first, until the inside is connected.
        let cells = star.iter().copied().filter(|&t| is_outside[t as usize]);
        let key = |t: u32| (is_far(mesh, t), !touches_inside(mesh, is_outside, v, t));
        let shortest = cells.min_by(|&s, &t| {
            let by_length = longest(mesh, s).total_cmp(&longest(mesh, t));
            key(s).cmp(&key(t)).then(by_length).then(s.cmp(&t))
        });
        return shortest.into_iter().collect();
    }
    Vec::new()
}

/// For each cell of a star a number of its part: cells of one kind that are connected through faces at `v`.
fn parts(mesh: &Delaunay, is_outside: &[bool], v: u32, star: &[u32]) -> Vec<u32> {
    let mut parts = vec![NONE; star.len()];
    let mut stack = Vec::new();
    for first in 0..star.len() {
        if parts[first] != NONE {
            continue;
        }
        parts[first] = first as u32;
        stack.push(first);
        while let Some(k) = stack.pop() {
            let tet = mesh.tets[star[k] as usize];
            for i in (0..4).filter(|&i| tet.vertices[i] != v && tet.across[i] != NONE) {
                let other = tet.across[i] >> 2;
                if is_outside[other as usize] != is_outside[star[k] as usize] {
                    continue;
                }
                if let Some(j) = star.iter().position(|&t| t == other)
                    && parts[j] == NONE
                {
                    parts[j] = first as u32;
                    stack.push(j);
                }
            }
        }
    }
    parts
}

fn is_far(mesh: &Delaunay, t: u32) -> bool {
    mesh.tets[t as usize].vertices.iter().any(|v| *v < N_FAR)
}

fn touches_inside(mesh: &Delaunay, is_outside: &[bool], v: u32, t: u32) -> bool {
    let tet = mesh.tets[t as usize];
    let mut others = (0..4).filter(|&i| tet.vertices[i] != v && tet.across[i] != NONE);
    others.any(|i| !is_outside[tet.across[i] as usize >> 2])
}

fn longest(mesh: &Delaunay, t: u32) -> f64 {
    let c = mesh.corners(t);
    let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    pairs.into_iter().fold(0.0, |l, (i, j)| c[i].distance_squared(c[j]).max(l))
}

/// Fills what is outside but not connected to the hull.
fn pockets(mesh: &Delaunay, is_outside: &mut [bool]) -> u64 {
    let mut is_reached = filled(mesh.tets.len(), false);
    let mut stack: Vec<u32> = Vec::new();
    for t in 0..mesh.tets.len() as u32 {
        if mesh.is_live(t) && is_outside[t as usize] && mesh.tets[t as usize].across.contains(&NONE)
        {
            is_reached[t as usize] = true;
            stack.push(t);
        }
    }
    while let Some(t) = stack.pop() {
        for across in mesh.tets[t as usize].across {
            let other = across as usize >> 2;
            if across != NONE && is_outside[other] && !is_reached[other] {
                is_reached[other] = true;
                stack.push(other as u32);
            }
        }
    }
    let mut n = 0;
    for t in 0..mesh.tets.len() {
        if mesh.is_live(t as u32) && is_outside[t] && !is_reached[t] {
            is_outside[t] = false;
            n += 1;
        }
    }
    n
}
