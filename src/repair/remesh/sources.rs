//! Where lengths come from: curvature of faces and of kept curves, thickness, curves near each other.

use tetdb_base::geom::{Aabb, IdSet, Point, mix};
use tetdb_base::storage::{ScratchSpace, check_cancelled};
use tetdb_base::surface::BoxTree;

use super::chains::Chain;
use super::envelope::Envelope;
use super::mesh::{Mesh, area_normal, cosine};
use super::settings::RemeshSettings;
use super::sizes::Source;

/// Share of the tolerance that a chord may be off a curve. Chords of triangles lie a third deeper than those of edges; above 0.9 most
/// changes are refused, and far below the triangles are needlessly small.
pub const CHORD: f64 = 0.8;
/// Lengths are at most this many thicknesses: above three, flat tetrahedra fill a plate, and below one they are needlessly many.
const THICKNESSES: f64 = 2.0;
/// Lengths are at most this many distances of one kept curve from another on the surface.
const STRIPS: f64 = 2.0;
/// Samples of the surface have this distance, as a share of the box diagonal.
const SPACING: f64 = 0.012;
/// Opposite sides and other curves are looked for up to this share of the box diagonal.
const REACH: f64 = 0.3;
/// Edges in a window at most; so many are all there is to know.
const WINDOW_MAX: usize = 3_000;

/// All sources for `mesh`, which is still the input.
pub fn sources(
    mesh: &Mesh,
    chains: &[Chain],
    envelope: &Envelope,
    settings: &RemeshSettings,
    scratch: &ScratchSpace,
) -> Vec<Source> {
    let diagonal = Aabb::around(mesh.points.iter().copied()).diagonal();
    let chord = CHORD * envelope.tolerance;
    let mut all = curvature(mesh, chord, diagonal, settings, scratch);
    all.extend(chains.iter().flat_map(|chain| {
        let of_chord = |(from, to): (f64, f64)| {
            let (a, b) = (chain.point(from), chain.point(to));
            let h = a.distance(b);
            [(a, h), (chain.point(0.5 * (from + to)), h), (b, h)]
        };
        let chords = chain.chords(chord);
        // The last chord is what was left over; a single one is a straight line.
        let n = if chords.len() > 1 { chords.len() - 1 } else { 0 };
        chords.into_iter().take(n).flat_map(of_chord).collect::<Vec<_>>()
    }));
    check_cancelled();
    all.extend(thickness(mesh, envelope, diagonal));
    check_cancelled();
    all.extend(strips(chains, envelope, diagonal, scratch));
    all
}

/// An edge between two triangles: its ends, its bend (positive outward) and the mean of the normals.
struct Bend {
    ends: [Point; 2],
    angle: f64,
    /// Width of the narrower triangle.
    width: f64,
    normal: Point,
}

fn bends(mesh: &Mesh) -> Vec<Bend> {
    let mut all = Vec::new();
    for key in mesh.edges() {
        if mesh.features.contains_key(&key) {
            continue;
        }
        let [s, t] = mesh.at_edge(key.0, key.1)[..] else { continue };
        let [x, y] = [s, t].map(|t| area_normal(mesh.corners(t)));
        let apex = mesh.points[mesh.apex(t, key.0, key.1) as usize];
        let ends = [key.0, key.1].map(|v| mesh.points[v as usize]);
        let angle = cosine(x, y).clamp(-1.0, 1.0).acos();
        let angle = if x.dot(apex - ends[0]) > 0.0 { -angle } else { angle };
        // An area does not say which of two needles is right.
        let normal = (x + y) / (x + y).length();
        if angle.abs() > 1e-3 && normal.is_finite() {
            let width = x.length().min(y.length()) / ends[0].distance(ends[1]);
            all.push(Bend { ends, angle, width, normal });
        }
    }
    all
}

/// Lengths from the curvature of faces: the bends of all edges in a window over its area, in the smallest window that the length fits.
///
/// Noise of slivers cancels in a window. Source: Cohen-Steiner and Morvan, "Restricted Delaunay triangulations and normal cycle" (2003).
fn curvature(
    mesh: &Mesh,
    chord: f64,
    diagonal: f64,
    settings: &RemeshSettings,
    scratch: &ScratchSpace,
) -> Vec<Source> {
    let bends = bends(mesh);
    if bends.is_empty() {
        return Vec::new();
    }
    let bounds = Aabb::around(mesh.points.iter().copied());
    let box_of = |i: u32| Aabb::around(bends[i as usize].ends);
    let tree = BoxTree::new(&bounds, bends.len() as u32, scratch, |_| true, box_of);
    let mut seen: IdSet<u64> = IdSet::default();
    let mut all = Vec::new();
    for bend in &bends {
        let [a, b] = bend.ends;
        let n = (a.distance(b) / (SPACING * diagonal)).ceil().max(1.0) as u32;
        for k in 0..n {
            let p = a + (b - a) * ((f64::from(k) + 0.5) / f64::from(n));
            if seen.insert(cell_of(p, bend.normal, 8.0 * chord)) {
                let h = length_at(p, bend.normal, &bends, &tree, chord, diagonal, settings);
                // Triangles narrower than the flat ones of the input gain nothing.
                all.extend(h.map(|h| (p, h.max(bend.width))));
            }
        }
        check_cancelled();
    }
    all
}

/// A number for the cell of a place and the side its normal looks to.
fn cell_of(p: Point, normal: Point, size: f64) -> u64 {
    let side = (normal * 1.5).round();
    let [x, y, z] = (p / size).floor().to_array();
    let [i, j, k] = side.to_array();
    [x, y, z, i, j, k].into_iter().fold(0, |hash, x| mix(hash ^ (x as i64 as u64)))
}

fn length_at(
    p: Point,
    normal: Point,
    bends: &[Bend],
    tree: &BoxTree,
    chord: f64,
    diagonal: f64,
    settings: &RemeshSettings,
) -> Option<f64> {
    let mut radius = (4.0 * chord).max(0.5 * settings.hmin);
    while radius < 0.1 * diagonal {
        let mut tensor = [0.0; 6];
        let mut n = 0;
        let reach = Point::splat(radius);
        tree.meeting(&Aabb { low: p - reach, high: p + reach }, |i| {
            let Bend { ends: [a, b], angle, normal: other, .. } = bends[i as usize];
            n += 1;
            if other.dot(normal) > 0.3 {
                let along = (b - a) / (b - a).length();
                let w = angle * length_within(a, b, p, radius);
                let Point { x, y, z } = along;
                for (sum, term) in tensor.iter_mut().zip([x * x, y * y, z * z, x * y, y * z, z * x])
                {
                    *sum += w * term;
                }
            }
        });
        let [xx, yy, zz, xy, yz, zx] = tensor;
        let size = (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)).sqrt();
        let curvature = size / (std::f64::consts::PI * radius * radius);
        let h = (8.0 * chord / curvature).sqrt();
        if h <= 2.0 * radius || n > WINDOW_MAX {
            return Some(h);
        }
        radius *= 1.6;
    }
    None
}

/// Length of the part of a segment in a ball.
fn length_within(a: Point, b: Point, p: Point, radius: f64) -> f64 {
    let along = b - a;
    let length = along.length();
    let unit = along / length;
    let foot = (p - a).dot(unit);
    let away = (p - a - unit * foot).length_squared();
    let half = (radius * radius - away).max(0.0).sqrt();
    ((foot + half).min(length) - (foot - half).max(0.0)).max(0.0)
}

/// Lengths from the distance to the opposite side, seen from samples of the surface.
fn thickness(mesh: &Mesh, envelope: &Envelope, diagonal: f64) -> Vec<Source> {
    let mut seen: IdSet<u64> = IdSet::default();
    let mut all = Vec::new();
    let spacing = SPACING * diagonal;
    for t in mesh.alive() {
        let [a, b, c] = mesh.corners(t);
        let normal = area_normal([a, b, c]);
        let normal = normal / normal.length();
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let n = (longest / spacing).ceil().clamp(1.0, 200.0) as u32;
        for i in 0..n {
            for j in 0..n - i {
                let at = |k: u32| (f64::from(k) + 1.0 / 3.0) / f64::from(n);
                let p = a + (b - a) * at(i) + (c - a) * at(j);
                if normal.is_finite() && seen.insert(cell_of(p, normal, 0.5 * spacing)) {
                    let found =
                        envelope.thickness(p, -normal, envelope.tolerance, REACH * diagonal);
                    all.extend(found.map(|d| (p, THICKNESSES * d)));
                }
            }
        }
    }
    all
}

/// Lengths from the distance between kept curves with surface in between.
fn strips(
    chains: &[Chain],
    envelope: &Envelope,
    diagonal: f64,
    scratch: &ScratchSpace,
) -> Vec<Source> {
    let spacing = 0.5 * SPACING * diagonal;
    // Chain, length along it, place.
    let mut samples: Vec<(usize, f64, Point)> = Vec::new();
    for (k, chain) in chains.iter().enumerate() {
        let n = (chain.length() / spacing).ceil().max(2.0);
        let at = |i: u32| (f64::from(i) + 0.5) / n * chain.length();
        samples.extend((0..n as u32).map(|i| (k, at(i), chain.point(at(i)))));
    }
    if samples.is_empty() {
        return Vec::new();
    }
    let bounds = Aabb::around(samples.iter().map(|s| s.2));
    let box_of = |i: u32| Aabb::around([samples[i as usize].2]);
    let tree = BoxTree::new(&bounds, samples.len() as u32, scratch, |_| true, box_of);
    let mut all = Vec::new();
    for &(k, at, p) in &samples {
        let mut radius = 2.0 * envelope.tolerance;
        while radius < REACH * diagonal {
            let reach = Point::splat(radius);
            let mut best: Option<(f64, u32)> = None;
            tree.meeting(&Aabb { low: p - reach, high: p + reach }, |i| {
                let (other, along, q) = samples[i as usize];
                let d = p.distance(q);
                let is_apart = match other == k {
                    true => {
                        let round = (along - at).abs();
                        let closed = chains[k].is_closed();
                        let round =
                            if closed { round.min(chains[k].length() - round) } else { round };
                        round > 3.0 * d
                    }
                    false => !chains[k].meets(&chains[other]),
                };
                if is_apart && d <= radius && best.is_none_or(|b| (d, i) < b) {
                    best = Some((d, i));
                }
            });
            if let Some((d, i)) = best {
                let middle = (p + samples[i as usize].2) * 0.5;
                let near = 0.1 * d + envelope.tolerance;
                if envelope.nearest(middle, near).is_some() {
                    all.push((p, STRIPS * d));
                }
                break;
            }
            radius *= 2.0;
        }
        check_cancelled();
    }
    all
}
