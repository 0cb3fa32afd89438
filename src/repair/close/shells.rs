//! Shells that are seen from inside are turned, before winding numbers are added up: those of two overlapping shells would cancel.

use super::patches::connected;
use super::winding::{WindingTree, area_normal};
use tetdb_base::geom::Point;
use tetdb_base::surface::Surface;

/// Places of a shell where it is found whether others go around it.
const PLACES: usize = 64;

/// Turns shells that are seen from inside, unless others go around them: those are cavities. Returns the number of triangles turned.
///
/// A surface that encloses a negative volume is turned as a whole first.
pub fn turn_shells(surface: &mut Surface) -> usize {
    let shells = connected(&surface.triangles);
    let mut volumes: Vec<f64> = shells.iter().map(|shell| volume(surface, shell)).collect();
    let is_all = volumes.iter().sum::<f64>() < 0.0;
    if is_all {
        volumes.iter_mut().for_each(|v| *v = -*v);
    }
    let mut is_turned = vec![is_all; surface.n_triangles()];
    if shells.len() > 1 && volumes.iter().any(|v| *v < 0.0) {
        let all = WindingTree::new(surface, |_| true);
        for (shell, _) in shells.iter().zip(&volumes).filter(|(_, v)| **v < 0.0) {
            let own = WindingTree::of(surface, shell.iter().map(|&t| t as u32).collect());
            let places = shell.iter().step_by(shell.len().div_ceil(PLACES));
            let around = places.clone().filter(|&&t| {
                let [a, b, c] = surface.corners(t as u32);
                let at = (a + b + c) / 3.0;
                (all.at(at) - own.at(at)).abs() > 0.5
            });
            if 2 * around.count() < places.count() {
                shell.iter().for_each(|&t| is_turned[t] = !is_all);
            }
        }
    }
    let turned = surface.triangles.iter_mut().zip(&is_turned).filter(|(_, turned)| **turned);
    turned.map(|(triangle, _)| triangle.swap(1, 2)).count()
}

/// Volume that a shell encloses, seen from its middle; of an open one, with the cone over its boundary.
fn volume(surface: &Surface, shell: &[usize]) -> f64 {
    let corners = |&t: &usize| surface.corners(t as u32);
    let middle = shell.iter().map(corners).map(|[a, b, c]| a + b + c).sum::<Point>()
        / (3 * shell.len()) as f64;
    let cone = |corners: [Point; 3]| area_normal(corners).dot(corners[0] - middle) / 6.0;
    shell.iter().map(corners).map(cone).sum()
}
