//! Cubes that touch, cross, or lack a face: accepted and refused surfaces.

use super::*;
use crate::geom::Point;
use crate::storage::ScratchSpace;

/// Corners of the unit cube as bits x, y, z; two triangles for each side, seen from outside.
const CUBE: [[u32; 3]; 12] = [
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
];

fn corner(i: u32) -> Point {
    Point::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))
}

fn build(triangles: impl IntoIterator<Item = [Point; 3]>) -> Surface {
    let mut builder = SurfaceBuilder::new();
    builder.begin_file("made");
    let label = builder.label("made");
    for triangle in triangles {
        builder.triangle_at(triangle, label).unwrap();
    }
    builder.end_file().unwrap();
    builder.finish()
}

fn cube(map: impl Fn(Point) -> Point) -> Vec<[Point; 3]> {
    CUBE.iter().map(|t| t.map(|i| map(corner(i)))).collect()
}

fn two_cubes(map: impl Fn(Point) -> Point) -> Surface {
    build(cube(|p| p).into_iter().chain(cube(map)))
}

fn codes(surface: &Surface) -> Vec<&'static str> {
    let mut codes: Vec<_> = validate(surface).defects.iter().map(|d| d.code().as_str()).collect();
    codes.dedup();
    codes
}

fn kinds(surface: &Surface) -> Vec<ContactKind> {
    let found = validate(surface);
    let mut kinds: Vec<_> = found
        .defects
        .iter()
        .map(|d| match d {
            Defect::SelfIntersection { kind, .. } => *kind,
            other => panic!("{other}"),
        })
        .collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

#[test]
fn a_cube_is_valid_at_every_scale_and_place() {
    for scale in [1e-9, 1.0, 1e9] {
        for away in [0.0, 1e6 * scale] {
            let surface = build(cube(|p| p * scale + Point::splat(away)));
            let found = validate(&surface);
            assert!(found.is_valid(), "{:?}", found.defects);
            let c = &found.closedness;
            assert_eq!(
                (c.n_edges, c.n_components, c.n_inconsistent, c.n_nonmanifold),
                (18, 1, 0, 0)
            );
            assert_eq!((surface.n_vertices(), surface.n_triangles()), (8, 12));
        }
    }
}

#[test]
fn cubes_that_share_a_matching_side_are_valid() {
    // The mirrored cube has the same diagonal on the shared side, and inside out until turned round.
    let mirrored = cube(|p| Point::new(2.0 - p.x, p.y, p.z));
    let turned = mirrored.iter().map(|[a, b, c]| [*a, *c, *b]);
    let found = validate(&build(cube(|p| p).into_iter().chain(turned)));
    assert!(found.is_valid(), "{:?}", found.defects);
    assert_eq!(found.closedness.two_sided, [[10, 22], [11, 23]]);
    assert_eq!((found.closedness.n_nonmanifold, found.closedness.n_odd), (4, 4));
    let inside_out = build(cube(|p| p).into_iter().chain(mirrored));
    assert_eq!(codes(&inside_out), ["duplicate-triangle"]);
}

#[test]
fn touching_at_an_edge_or_a_vertex_is_valid() {
    for shift in [Point::new(1.0, 1.0, 0.0), Point::ONE] {
        let found = validate(&two_cubes(|p| p + shift));
        assert!(found.is_valid(), "{:?}", found.defects);
        assert_eq!(found.closedness.n_nonmanifold, usize::from(shift.z == 0.0));
    }
}

#[test]
fn an_open_cube_tells_its_rim() {
    let surface = build(cube(|p| p).into_iter().take(10));
    let found = validate(&surface);
    assert_eq!((found.closedness.open.len(), found.closedness.n_open_loops), (4, 1));
    assert_eq!(codes(&surface), ["open-surface"]);
    assert_eq!(found.accept().unwrap_err().code(), "open-surface");
    let two_holes = build(cube(|p| p).into_iter().skip(1).take(10));
    assert_eq!(validate(&two_holes).closedness.n_open_loops, 2);
}

#[test]
fn bad_triangles_are_named() {
    let whole = cube(|p| p);
    let repeated = build(whole.iter().copied().chain([whole[3]]));
    let found = validate(&repeated);
    assert_eq!(found.closedness.duplicates, [[3, 12]]);
    assert_eq!(codes(&repeated), ["duplicate-triangle"]);
    let [a, b, _] = whole[0];
    let collapsed = build(whole.iter().copied().chain([[a, b, b], [a, a.midpoint(b), b]]));
    assert_eq!(validate(&collapsed).closedness.degenerate, [(12, true), (13, false)]);
    assert_eq!(validate(&build([])).defects, [Defect::Empty]);
}

#[test]
fn a_wall_inside_is_valid_and_a_fin_is_open() {
    let wall = [[0, 3, 7], [0, 7, 4]].map(|t: [u32; 3]| t.map(corner));
    let surface = build(cube(|p| p).into_iter().chain(wall));
    // The wall's corners use edges 0-3 and 4-7, which are diagonals of two sides.
    let found = validate(&surface);
    assert!(found.is_valid(), "{:?}", found.defects);
    assert_eq!((found.closedness.n_nonmanifold, found.closedness.n_odd), (4, 4));
    let fin = build(cube(|p| p).into_iter().chain([wall[0]]));
    assert_eq!(codes(&fin), ["open-surface"]);
}

#[test]
fn crossing_and_overlapping_cubes_are_refused_by_kind() {
    let crossing = two_cubes(|p| p + Point::new(0.3, 0.4, 0.5));
    assert!(kinds(&crossing).contains(&ContactKind::Crossing));
    let overlap = two_cubes(|p| p + Point::new(1.0, 0.25, 0.25));
    assert!(kinds(&overlap).contains(&ContactKind::CoplanarOverlap));
    // Same corners, other diagonal: the shared side does not match.
    let other_diagonal = two_cubes(|p| Point::new(1.0 + p.x, 1.0 - p.y, p.z));
    assert_eq!(kinds(&other_diagonal), [ContactKind::CoplanarOverlap]);
    let inside = two_cubes(|p| p * 0.5 + Point::splat(0.25));
    assert!(validate(&inside).is_valid());
    // A corner of one cube just reaches a side of the other.
    let tip = |p: Point| {
        Point::new(1.0 + p.x + p.y + p.z, 0.4 + 0.01 * (p.y - p.z), 0.6 + 0.01 * (p.x - p.y))
    };
    assert_eq!(kinds(&two_cubes(tip)), [ContactKind::VertexOnFace]);
}

#[test]
fn a_t_junction_is_named() {
    // One triangle is split at the middle of an edge that its neighbor keeps whole.
    let mut triangles = cube(|p| p);
    let [a, b, c] = triangles[0];
    let m = b.midpoint(c);
    triangles[0] = [a, b, m];
    triangles.push([a, m, c]);
    let surface = build(triangles);
    let found = validate(&surface);
    assert_eq!(found.closedness.open.len(), 3);
    assert_eq!(found.n_of_kind(ContactKind::VertexOnEdge), 2);
}

#[test]
fn inverted_triangles_turn_back() {
    for wrong in [vec![4], vec![0, 1, 7], (0..9).collect()] {
        let mut triangles = cube(|p| p);
        for &t in &wrong {
            triangles[t].swap(1, 2);
        }
        let mut surface = build(triangles);
        assert!(closedness(&surface).n_inconsistent > 0);
        let done = orient_alike(&mut surface);
        assert_eq!((done.n_patches, done.n_unorientable), (1, 0));
        assert_eq!(done.flipped.len(), wrong.len().min(12 - wrong.len()));
        assert_eq!(closedness(&surface).n_inconsistent, 0);
    }
    // A Möbius strip of three quadrilaterals.
    let ring = |i: u32, up: f64| {
        let angle = f64::from(i) * std::f64::consts::TAU / 3.0;
        Point::new(angle.cos(), angle.sin(), up)
    };
    let mut strip = Vec::new();
    for i in 0..3 {
        let (low, high) = if i == 2 { (1.0, 0.0) } else { (0.0, 1.0) };
        let (a, b, c, d) =
            (ring(i, 0.0), ring((i + 1) % 3, low), ring((i + 1) % 3, high), ring(i, 1.0));
        strip.extend([[a, b, c], [a, c, d]]);
    }
    let mut strip = build(strip);
    let before = strip.clone();
    assert_eq!(orient_alike(&mut strip).n_unorientable, 1);
    assert_eq!(strip, before);
}

#[test]
fn contact_by_number_of_shared_vertices() {
    let p = [Point::ZERO, Point::X * 4.0, Point::Y * 4.0];
    let ids = [0, 1, 2];
    let at = |x: f64, y: f64, z: f64| Point::new(x, y, z);
    let kind = |q: [Point; 3], q_ids: [u32; 3]| contact(p, ids, q, q_ids).map(|c| c.kind);
    let apart = [3, 4, 5];
    use ContactKind::*;
    for (q, expected) in [
        ([at(1., 1., -1.), at(1., 1., 1.), at(9., 9., 0.5)], Some(Crossing)),
        ([at(1., 1., 0.), at(1., 1., 1.), at(1., 2., 1.)], Some(VertexOnFace)),
        ([at(2., 0., 0.), at(1., 1., 1.), at(1., 2., 1.)], Some(VertexOnEdge)),
        ([at(2., 0., -1.), at(2., 0., 1.), at(2., -1., 0.)], Some(EdgeOnEdge)),
        ([at(0., 0., -1.), at(0., 0., 1.), at(-1., -1., 0.)], Some(VertexOnEdge)),
        ([at(1., 1., 1e-300), at(1., 1., 1.), at(1., 2., 1.)], None),
        ([at(1., 1., 0.), at(2., 1., 0.), at(1., 2., 0.)], Some(CoplanarOverlap)),
        ([at(-9., -9., 0.), at(90., -9., 0.), at(-9., 90., 0.)], Some(CoplanarOverlap)),
        ([at(3., 3., 0.), at(2., 2., 0.), at(3., 2.5, 0.)], Some(VertexOnEdge)),
        ([at(3., 3., 0.), at(2.5, 2., 0.), at(3., 2.5, 0.)], None),
        ([at(-1., 1., 0.), at(5., 2., 0.), at(2., 3., 9.)], Some(EdgeOnEdge)),
    ] {
        assert_eq!(kind(q, apart), expected, "{q:?}");
        assert_eq!(contact(q, apart, p, ids).map(|c| c.kind), expected, "{q:?}");
        let turned = [q[1], q[0], q[2]];
        assert_eq!(kind(turned, apart), expected, "{q:?}");
    }
    for (q, expected) in [
        ([p[0], at(-1., 0., 0.), at(0., -1., 0.)], None),
        ([p[0], at(1., 1., 0.), at(-1., -1., 3.)], Some(VertexOnFace)),
        ([p[0], at(9., 9., 0.), at(-1., -1., 3.)], Some(EdgeOnEdge)),
        ([p[0], at(9., 0., 0.), at(0., -1., 3.)], Some(VertexOnEdge)),
        ([p[0], at(1., 1., 1.), at(1., 1., -1.)], Some(Crossing)),
        ([p[0], at(1., 1., 0.), at(-1., 1., 0.)], Some(CoplanarOverlap)),
        ([p[0], at(1., 0., 0.), at(1., -1., 0.)], Some(VertexOnEdge)),
        ([p[0], at(9., 0., 0.), at(1., -1., 0.)], Some(VertexOnEdge)),
        ([p[0], at(1., 2., 3.), at(2., 1., 3.)], None),
    ] {
        assert_eq!(kind(q, [0, 4, 5]), expected, "{q:?}");
        assert_eq!(kind([q[2], q[0], q[1]], [5, 0, 4]), expected, "{q:?}");
    }
    for (y, expected) in [
        (at(1., 1., 0.), Some(CoplanarOverlap)),
        (at(0., 1., 0.), Some(CoplanarOverlap)),
        (at(1., -1., 0.), None),
        (at(1., 1., 1e-12), None),
    ] {
        assert_eq!(kind([p[1], p[0], y], [1, 0, 9]), expected, "{y:?}");
        assert_eq!(kind([y, p[0], p[1]], [9, 0, 1]), expected, "{y:?}");
    }
    assert_eq!(kind([p[1], p[0], p[2]], [1, 0, 2]), None);
}

/// A cube whose sides do not quite meet: each is moved a little further than the one before.
fn cracked(step: f64) -> Surface {
    let sides = cube(|p| p).into_iter().enumerate();
    build(sides.map(|(t, corners)| corners.map(|p| p + Point::X * (step * (t / 2) as f64))))
}

#[test]
fn a_cracked_cube_closes_when_points_are_joined() {
    let surface = cracked(1e-7);
    let tried = closing(&surface);
    let last = tried.last().unwrap();
    assert_eq!((last.closes, last.share, last.defects_left), (true, 1e-6, Some(0)));
    assert!(tried.iter().rev().skip(1).all(|t| !t.closes && t.open_edges > 0));
    let mut joined = surface;
    let done = repair(&mut joined, Some(last.distance));
    assert_eq!(done.points_joined, last.points_joined);
    assert!(validate(&joined).is_valid());
    assert_eq!((joined.n_vertices(), joined.n_triangles()), (8, 12));
    // A side that is missing cannot be joined to anything.
    let open = build(cube(|p| p).into_iter().take(10));
    assert!(closing(&open).iter().all(|t| !t.closes));
}

#[test]
fn joined_points_do_not_run_together() {
    let tips = [0.0, 0.9, 1.8].map(|x| {
        let up = Point::new(x, 0.0, 5.0);
        [up, Point::new(x, 9.0, 9.0), Point::new(x, -9.0, 20.0)]
    });
    let mut surface = build(tips);
    assert_eq!(weld_near(&mut surface, 1.0), 3);
    assert_eq!(surface.triangles, [[0, 1, 2], [0, 1, 2], [3, 4, 5]]);
    assert_eq!(surface.points[3].x, 1.8);
}

#[test]
fn a_t_junction_is_divided() {
    let mut triangles = cube(|p| p);
    let [a, b, c] = triangles[0];
    let middles = [b.lerp(c, 0.25), b.lerp(c, 0.75)];
    triangles[0] = [a, b, middles[0]];
    triangles.extend([[a, middles[0], middles[1]], [a, middles[1], c]]);
    let mut surface = build(triangles.clone());
    let found = validate(&surface);
    assert_eq!(found.t_junctions.len(), 2);
    assert!(found.t_junctions.iter().all(|j| j.distance == 0.0));
    assert!(found.accept().unwrap_err().to_string().contains("T-junction"), "{:?}", found.accept());
    let done = repair(&mut surface, None);
    assert_eq!((done.divided, done.turned), (1, 0));
    assert!(validate(&surface).is_valid());
    assert_eq!(surface.n_triangles(), 16);
    // The seam closed by triangles without area: dropping them opens it, dividing closes it.
    triangles.extend([[b, middles[1], middles[0]], [b, c, middles[1]]]);
    let mut surface = build(triangles);
    assert_eq!(codes(&surface)[0], "degenerate-triangle");
    let done = repair(&mut surface, None);
    assert_eq!((done.collapsed_dropped, done.divided), (2, 1));
    assert!(validate(&surface).is_valid());
}

#[test]
fn near_a_t_junction_is_told_with_its_distance() {
    let mut triangles = cube(|p| p);
    let [a, b, c] = triangles[0];
    let m = b.midpoint(c) + Point::splat(1e-8);
    triangles[0] = [a, b, m];
    triangles.push([a, m, c]);
    let mut surface = build(triangles);
    let junctions = validate(&surface).t_junctions;
    assert_eq!(junctions.len(), 1);
    assert!(junctions[0].distance > 0.0 && junctions[0].distance < 2e-8);
    assert_eq!(repair(&mut surface.clone(), None).divided, 0);
    assert_eq!(repair(&mut surface, Some(1e-7)).divided, 1);
    assert!(validate(&surface).is_valid());
}

#[test]
fn files_and_labels_follow_a_repair() {
    let mut builder = SurfaceBuilder::new();
    for (name, extra) in [("one", true), ("two", false)] {
        builder.begin_file(name);
        let label = builder.label(name);
        let away = if extra { Point::ZERO } else { Point::splat(3.0) };
        let triangles = cube(|p| p + away);
        let repeated = extra.then_some(triangles[4]);
        for triangle in repeated.into_iter().chain(triangles) {
            builder.triangle_at(triangle, label).unwrap();
        }
        builder.end_file().unwrap();
    }
    let mut surface = builder.finish();
    let done = repair(&mut surface, None);
    let expected = Repair { repeated_dropped: 1, ..Repair::default() };
    assert_eq!(done, expected);
    assert_eq!(surface.source(12), Some(("two", 0)));
    assert_eq!(surface.source(11), Some(("one", 11)));
    assert_eq!((surface.label_name(11), surface.label_name(12)), ("one", "two"));
    assert!(validate(&surface).is_valid());
}

#[test]
fn holes_are_listed_the_longest_first() {
    let mut triangles = cube(|p| p);
    triangles.remove(11);
    triangles.drain(..2);
    let surface = build(triangles);
    let boundary_loops = boundary_loops(&surface, &closedness(&surface));
    let lengths: Vec<(usize, f64)> = boundary_loops.iter().map(|r| (r.n_edges, r.length)).collect();
    // The hole of two triangles and that of one meet in a corner or not at all.
    let total: f64 = lengths.iter().map(|l| l.1).sum();
    assert!((total - (4.0 + 2.0 + 2f64.sqrt())).abs() < 1e-12, "{lengths:?}");
    assert!(lengths.is_sorted_by(|a, b| a.1 >= b.1), "{lengths:?}");
}

#[test]
fn fitness_tells_needles_at_every_scale() {
    for scale in [1e-23, 1.0, 1e29] {
        let fitness = |surface: &Surface| fitness(surface, &closedness(surface));
        let found = fitness(&build(cube(|p| p * scale)));
        assert_eq!((found.small_angles, found.forcing_triangles), (0, 0));
        assert!((found.angle_least_degrees - 45.0).abs() < 1e-9);
        assert!((found.edge_min / scale - 1.0).abs() < 1e-12);
        let volume = found.volume.map(|v| v / scale.powi(3) - 1.0);
        assert!(volume.is_some_and(|off| off.abs() < 1e-12));
        assert!((found.area / scale.powi(2) - 6.0).abs() < 1e-12);
        let flat = fitness(&build(cube(|p| p * Point::new(scale, scale, scale / 50.0))));
        assert_eq!((flat.small_angles, flat.forcing_triangles), (8, 8));
        assert_eq!(flat.hopeless_triangles, 8);
    }
    let nothing = build([]);
    assert_eq!(fitness(&nothing, &closedness(&nothing)), Fitness::default());
}

#[test]
fn a_room_too_small_changes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let mut triangles = Vec::new();
    for k in 0..6000 {
        let at = [k % 20, k / 20 % 20, k / 400].map(|i| 3.0 * f64::from(i));
        // Every hundredth cube crosses the next one.
        let shift = if k % 100 == 0 { 2.5 } else { 0.0 };
        let low = Point::from_array(at) + Point::new(shift, 0.1 * shift, 0.0);
        let mut made = cube(|p| low + p * (1.0 + f64::from(k % 7) / 5.0));
        if k % 500 == 1 {
            made[3].swap(0, 1);
        }
        if k % 700 == 2 {
            made.push(made[5]);
        }
        triangles.extend(made);
    }
    let crossing = build(triangles.clone());
    let apart = build(triangles.into_iter().skip(12).take(12 * 99));
    for surface in [crossing, apart] {
        // The triangles alone take more than that.
        let narrow = ScratchSpace::new(16 << 10, dir.path());
        assert!(surface.bytes() as u64 > narrow.cap());
        let validation = validate(&surface);
        assert_eq!(validate_with(&surface, &narrow), validation);
        let (mut a, mut b) = (surface.clone(), surface);
        assert_eq!(orient_alike(&mut a), orient_alike_with(&mut b, &narrow));
        assert_eq!(a, b);
        let seeker = Seeker::with_filter(&a, &narrow, |_| true);
        let wide = Seeker::new(&a);
        assert_eq!(EnclosedVolumes::new_in(&seeker, &narrow), EnclosedVolumes::new(&wide));
        for k in 0..500 {
            let p = Point::new(f64::from(k * 7 % 61), f64::from(k * 11 % 61), 0.3);
            assert_eq!(seeker.distance(p, 9.0), wide.distance(p, 9.0));
            assert_eq!(seeker.above(p), wide.above(p));
        }
        drop(seeker);
        assert_eq!(narrow.available(), narrow.cap(), "all is given back");
    }
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}
