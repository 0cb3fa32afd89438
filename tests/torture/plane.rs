//! Triangulation of a polygon in the plane by ear clipping.

/// Twice the signed area of three points.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Triangles of a simple polygon, in its direction. The signs of turns must be exact in doubles.
pub fn triangulated(polygon: &[[f64; 2]]) -> Vec<[usize; 3]> {
    let n = polygon.len();
    let area: f64 = (1..n - 1).map(|i| turn(polygon[0], polygon[i], polygon[i + 1])).sum();
    let mut left: Vec<usize> = (0..n).collect();
    if area < 0.0 {
        left.reverse();
    }
    let mut triangles = Vec::new();
    while left.len() >= 3 {
        let m = left.len();
        let ear = (0..m).find(|&i| {
            let t = [(i + m - 1) % m, i, (i + 1) % m].map(|k| left[k]);
            let [a, b, c] = t.map(|k| polygon[k]);
            turn(a, b, c) > 0.0
                && left.iter().filter(|k| !t.contains(k)).all(|&k| {
                    let p = polygon[k];
                    turn(a, b, p) < 0.0 || turn(b, c, p) < 0.0 || turn(c, a, p) < 0.0
                })
        });
        let i = ear.expect("a simple polygon has an ear");
        triangles.push([left[(i + m - 1) % m], left[i], left[(i + 1) % m]]);
        left.remove(i);
    }
    if area < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    triangles
}
