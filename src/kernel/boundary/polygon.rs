//! Triangulates a polygon by dynamic programming, so that the worst triangle is best.
//!
//! Source: G. T. Klincsek, "Minimal triangulations of polygonal domains", Annals of Discrete Mathematics 9 (1980).

/// Triangles `[i, k, j]`, `i < k < j`, of the polygon `0..n`, so that the least value is greatest.
///
/// `value` is called once per triangle that may matter; `<= 0` forbids it. `chord` is called for the inner edges `i <
/// j` that could be used. `None` if nothing is allowed.
pub(super) fn triangulate(
    n: usize,
    mut chord: impl FnMut(usize, usize) -> bool,
    mut value: impl FnMut(usize, usize, usize) -> f64,
) -> Option<Vec<[usize; 3]>> {
    // best[i * n + j]: least value in the best triangulation of i..=j, and its middle vertex.
    let mut best = vec![(0.0f64, 0usize); n * n];
    for i in 0..n - 1 {
        best[i * n + i + 1] = (f64::INFINITY, 0);
    }
    for len in 2..n {
        for i in 0..n - len {
            let j = i + len;
            let mut top = (0.0, 0);
            for k in i + 1..j {
                let bound = best[i * n + k].0.min(best[k * n + j].0);
                if bound > top.0 {
                    let least = value(i, k, j).min(bound);
                    if least > top.0 {
                        top = (least, k);
                    }
                }
            }
            // Most are forbidden by the triangles already.
            if top.0 > 0.0 && (len == n - 1 || chord(i, j)) {
                best[i * n + j] = top;
            }
        }
    }
    if n < 3 || best[n - 1].0 <= 0.0 {
        return None;
    }
    let mut triangles = Vec::with_capacity(n - 2);
    let mut open = vec![(0, n - 1)];
    while let Some((i, j)) = open.pop() {
        if j - i >= 2 {
            let k = best[i * n + j].1;
            triangles.push([i, k, j]);
            open.push((i, k));
            open.push((k, j));
        }
    }
    Some(triangles)
}
