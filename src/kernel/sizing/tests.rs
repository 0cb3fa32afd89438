//! The field is continuous, graded, near the surface's edges, and the same for any number of threads.

use super::*;
use crate::samples::SampleSpec;
use tetdb_base::geom::Point;
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::{EnclosedVolumes, Seeker, Surface};

/// A small generator for test points; failures print the seed.
struct Dice(u64);

impl Dice {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn point(&mut self) -> Point {
        Point::new(self.unit(), self.unit(), self.unit())
    }
}

/// Walls of the unit cube, each a grid whose lines stand at `at(0) = 0, …, at(n) = 1`.
fn cube(n: usize, at: impl Fn(usize) -> f64) -> (Vec<Point>, Vec<[u32; 3]>) {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for wall in [0.0, 1.0] {
            let first = points.len() as u32;
            let m = n as u32 + 1;
            for j in 0..=n {
                for i in 0..=n {
                    let mut p = Point::splat(wall);
                    p[(axis + 1) % 3] = at(i);
                    p[(axis + 2) % 3] = at(j);
                    points.push(p);
                }
            }
            for j in 0..n as u32 {
                for i in 0..n as u32 {
                    let a = first + j * m + i;
                    triangles.push([a, a + 1, a + m]);
                    triangles.push([a + 1, a + m + 1, a + m]);
                }
            }
        }
    }
    (points, triangles)
}

/// Edges from `1` to `ratio` times the smallest, growing from the corner at the origin.
fn graded(ratio: f64, n: usize) -> (Vec<Point>, Vec<[u32; 3]>) {
    let step = |i: usize| ratio.powf(i as f64 / (n - 1) as f64);
    let total: f64 = (0..n).map(step).sum();
    cube(n, |i| (0..i).map(step).sum::<f64>() / total)
}

fn options(hsiz: Option<&str>, hmin: Option<&str>, hmax: Option<&str>) -> SizeOptions {
    SizeOptions::parse(hsiz, hmin, hmax, None).unwrap()
}

fn formula(text: &str) -> SizeOptions {
    SizeOptions { formula: Some(Formula::parse(text).unwrap()), ..SizeOptions::default() }
}

fn build(surface: &(Vec<Point>, Vec<[u32; 3]>), options: &SizeOptions) -> SizeField {
    SizeField::build(&surface.0, &surface.1, options).unwrap()
}

/// Fields of several kinds on surfaces of several kinds.
fn fields() -> Vec<(&'static str, SizeField)> {
    let even = cube(20, |i| i as f64 / 20.0);
    let steep = graded(50.0, 60);
    vec![
        ("even", build(&even, &SizeOptions::default())),
        ("even, small inside", build(&even, &options(Some("0.02"), None, None))),
        ("even, large inside", build(&even, &options(Some("0.3"), None, None))),
        ("steep", build(&steep, &SizeOptions::default())),
        ("steep, hmax", build(&steep, &options(None, None, Some("0.02")))),
        ("steep, hmin", build(&steep, &options(None, Some("2%"), None))),
        ("even, a valley", build(&even, &formula("0.01+0.4*abs(x-y)"))),
        ("even, a step", build(&even, &formula("if(x+2*z<1.1,0.01,1)"))),
        ("steep, hsiz", build(&steep, &options(Some("0.04"), None, None))),
    ]
}

#[test]
fn slopes_stay_within_the_gradation() {
    for (name, field) in fields() {
        let mut dice = Dice(1);
        let mut worst = 0.0f64;
        for i in 0..200_000 {
            let a = dice.point();
            let reach = 0.5f64.powi(i % 14);
            let b = a + (dice.point() - Point::splat(0.5)) * reach;
            let b = b.clamp(Point::ZERO, Point::ONE);
            let slope = (field.h(a) - field.h(b)).abs() / a.distance(b).max(1e-300);
            worst = worst.max(slope / field.beta());
        }
        println!("{name}: worst slope {worst:.3} of beta, {} leaves", field.n_leaves());
        assert!(worst < 3f64.sqrt(), "{name}: {worst}");
    }
}

#[test]
fn no_jump_across_leaves() {
    for (name, field) in fields() {
        let mut dice = Dice(2);
        for _ in 0..100_000 {
            // Points on lattice planes, where leaves meet, seen from both sides.
            let mut p = dice.point();
            let (axis, level) = ((dice.unit() * 3.0) as usize, 1 + (dice.unit() * 9.0) as i32);
            let lattice = 2f64.powi(level);
            let frame = field.frame;
            p[axis] = ((p[axis] * lattice).floor() / lattice) * frame.side + frame.low[axis];
            let mut q = p;
            p[axis] -= 1e-9;
            q[axis] += 1e-9;
            let (a, b) = (field.h(p), field.h(q));
            assert!((a - b).abs() < 1e-6 * a + 1e-8, "{name}: {p} {a} {b}");
        }
    }
}

#[test]
fn even_surfaces_give_one_size() {
    for scale in [1e-9, 1.0, 1e9] {
        let (mut points, triangles) = cube(20, |i| i as f64 / 20.0);
        points.iter_mut().for_each(|p| *p *= scale);
        let field = SizeField::build(&points, &triangles, &SizeOptions::default()).unwrap();
        let mut dice = Dice(3);
        let mean = 0.05 * (2.0 + 2f64.sqrt()) / 3.0;
        for _ in 0..1000 {
            let h = field.h(dice.point() * scale) / scale;
            assert!((h / mean - 1.0).abs() < 0.1, "{h} {mean}");
        }
        assert!(field.n_leaves() < 100, "{}", field.n_leaves());
    }
}

#[test]
fn interior_size_is_joined_to_the_surface() {
    let even = cube(40, |i| i as f64 / 40.0);
    let surface_h = build(&even, &SizeOptions::default()).h(Point::splat(0.5));
    for (text, inside) in [("0.01", 0.01), ("0.06", 0.06)] {
        let field = build(&even, &options(Some(text), None, None));
        let center = field.h(Point::splat(0.5));
        assert!((center / inside - 1.0).abs() < 0.02, "{center}");
        let wall = field.h(Point::new(0.0, 0.5, 0.5));
        assert!((wall / surface_h - 1.0).abs() < 0.2, "{wall} {surface_h}");
        // Half way of the ramp, within the smear of one cell.
        let depth = 0.5 * (inside - surface_h).abs() / field.beta();
        let ramp = field.h(Point::new(depth, 0.5, 0.5));
        let wanted = 0.5 * (inside + surface_h);
        assert!((ramp / wanted - 1.0).abs() < 0.25, "{ramp} {wanted}");
    }
}

fn surface_seeds<'a>(
    surface: &'a (Vec<Point>, Vec<[u32; 3]>),
    options: &SizeOptions,
) -> seeds::Seeds<'a> {
    let (points, triangles) = surface;
    let (frame, bounds) = seeds::octree_frame(points, triangles);
    let targets = options.resolve(bounds.diagonal()).unwrap();
    let scaled = targets.scaled(1.0 / frame.side);
    let scratch = ScratchSpace::boundless();
    gather::surface_seeds(points, triangles, frame, &scaled, None, &scratch).unwrap()
}

fn sample(text: &str) -> (Vec<Point>, Vec<[u32; 3]>) {
    let sample = SampleSpec::parse(text).unwrap().make().unwrap();
    (sample.points, sample.triangles)
}

/// Tetrahedra to expect of everything a surface bounds.
fn expected(surface: &(Vec<Point>, Vec<[u32; 3]>), field: &SizeField) -> f64 {
    let surface =
        Surface { points: surface.0.clone(), triangles: surface.1.clone(), ..Surface::default() };
    let seeker = Seeker::with_filter(&surface, &ScratchSpace::boundless(), |_| true);
    let volumes = EnclosedVolumes::new(&seeker);
    let mut filled = vec![true; volumes.n_volumes as usize];
    filled[tetdb_base::surface::OUTSIDE as usize] = false;
    let domain = Domain { seeker: &seeker, volumes: &volumes, filled: &filled };
    field.counts(&domain).tets()
}

#[test]
fn a_low_step_asks_for_what_its_vertices_need_and_for_no_bands() {
    for step in ["1e-3", "1e-5", "1e-7", "1e-8"] {
        let slab = sample(&format!("steps,step={step}"));
        let tets = expected(&slab, &build(&slab, &SizeOptions::default()));
        assert!(tets < 20_000.0, "{step}: {tets}");
    }
}

#[test]
fn even_surfaces_have_no_sizes_but_their_vertices() {
    for text in ["box,h=0.1", "balls,count=20", "sphere", "knot"] {
        let surface = sample(text);
        let seeds = surface_seeds(&surface, &SizeOptions::default());
        assert!(!seeds.has_slope_factors(), "{text}");
        assert_eq!(seeds.all().count(), surface.0.len(), "{text}");
    }
}

#[test]
fn a_gradation_that_is_asked_for_is_kept_next_to_needles() {
    let needles = sample("needles,count=40");
    let steepest = |options: &SizeOptions| {
        let field = build(&needles, options);
        let mut dice = Dice(6);
        let mut most = 0.0f64;
        for i in 0..200_000 {
            let p = field.frame.low + dice.point() * field.frame.side;
            let q = p + (dice.point() - Point::splat(0.5)) * 0.5f64.powi(i % 10);
            most = most.max((field.h(p) - field.h(q)).abs() / p.distance(q).max(1e-300));
        }
        most
    };
    let asked = SizeOptions::parse(None, None, None, Some("1.3")).unwrap();
    let (asked, free) = (steepest(&asked), steepest(&SizeOptions::default()));
    assert!(asked < 3f64.sqrt() * 1.3f64.ln(), "{asked}");
    assert!(free > 1.2 * asked && free < 3f64.sqrt() * 2f64.ln(), "{free} {asked}");
}

#[test]
fn steep_surfaces_are_followed() {
    let steep = graded(50.0, 60);
    let field = build(&steep, &SizeOptions::default());
    let seeds = surface_seeds(&steep, &SizeOptions::default());
    let all: Vec<u32> = seeds.vertices().collect();
    let side = field.frame.side;
    let (mut near, mut ratio_low, mut ratio_high) = (0, f64::INFINITY, 0.0f64);
    for &v in &all {
        let ratio = field.h(field.frame.low + seeds.at(v) * side) / (seeds.h(v) * side);
        ratio_low = ratio_low.min(ratio);
        ratio_high = ratio_high.max(ratio);
        near += usize::from((0.7..1.4).contains(&ratio));
    }
    println!("ratio {ratio_low:.3} to {ratio_high:.3}, {near} of {}", all.len());
    // Grid lines give long thin triangles, whose vertices differ in size more than any gradation allows, and whose long edges ask for more
    // than their ends.
    assert!(near * 4 > all.len() * 3, "{near} of {}", all.len());
    assert!(ratio_low > 0.08 && ratio_high < 4.0, "{ratio_low} {ratio_high}");
    let (low, high) = field.range();
    let smallest = all.iter().fold(f64::INFINITY, |low, &v| low.min(seeds.h(v) * side));
    assert!(low > 0.95 * smallest && low < 1.5 * smallest && high > 0.03, "{low} {high}");
}

#[test]
fn formulas_are_followed_as_far_as_the_gradation_allows() {
    let even = cube(20, |i| i as f64 / 20.0);
    let surface_h = build(&even, &SizeOptions::default()).h(Point::splat(0.5));
    let valley = build(&even, &formula("0.01+0.4*abs(x-0.4)"));
    let mut dice = Dice(8);
    for _ in 0..10_000 {
        let p = dice.point();
        // Steeper than the field may be: it rises with its own slope.
        let wanted = (0.01 + valley.beta() * (p.x - 0.4).abs()).min(surface_h);
        let ratio = valley.h(p) / wanted;
        assert!((0.85..1.3).contains(&ratio), "{p} {ratio}");
    }
    // A ball a tenth of the cube wide, far from everything else.
    let ball = "if((x-0.3)^2+(y-0.6)^2+(z-0.45)^2<0.0025,0.004,9)";
    let ball = build(&even, &formula(ball));
    let center = ball.h(Point::new(0.3, 0.6, 0.45));
    assert!((center / 0.004 - 1.0).abs() < 0.01, "{center}");
    assert!(ball.h(Point::splat(0.9)) > 0.9 * surface_h);
    // No size goes below --hmin.
    let mut floored = formula("0.004");
    floored.hmin = Some(Length::Units(0.03));
    let h = build(&even, &floored).h(Point::splat(0.5));
    assert!((h / 0.03 - 1.0).abs() < 1e-5, "{h}");
}

#[test]
fn formulas_that_give_no_size_are_refused() {
    let even = cube(4, |i| i as f64 / 4.0);
    for text in ["x-0.5", "1/0", "0/0", "-1", "sqrt(x-0.9)", "0"] {
        let found = SizeField::build(&even.0, &even.1, &formula(text)).unwrap_err();
        assert!(matches!(found, SizingError::NoSize { .. }), "{text} {found}");
        assert!(found.to_string().contains(text), "{found}");
    }
    // Outside the surface's box the constraint is not sampled.
    let inside = "if(min(x,min(y,z))<-1e-9 or max(x,max(y,z))>1.000000001,0/0,0.1)";
    assert!(SizeField::build(&even.0, &even.1, &formula(inside)).is_ok());
    for text in ["x +", "w", "x > 0", ""] {
        let found = Formula::parse(text).unwrap_err();
        assert!(matches!(found, SizingError::BadFormula { .. }), "{found}");
    }
}

#[test]
fn equal_bits_in_a_room_too_small() {
    let dir = tempfile::tempdir().unwrap();
    let even = cube(40, |i| i as f64 / 40.0);
    let steep = graded(20.0, 40);
    let mut sampled = Dice(5);
    for (surface, options) in [
        (&steep, options(None, None, None)),
        (&even, options(Some("2%"), None, None)),
        (&steep, options(Some("5%"), Some("0.5%"), Some("9%"))),
        (&even, formula("0.02 + 0.1*abs(x - 0.4)")),
    ] {
        let [wide, narrow] = [ScratchSpace::boundless(), ScratchSpace::new(1 << 16, dir.path())]
            .map(|scratch| {
                let (points, triangles) = surface;
                let extra = ExtraSizes::default();
                SizeField::build_with(points, triangles, &options, &extra, &scratch).unwrap()
            });
        assert!(narrow.0.bytes() > 0 && wide.1.n_leaves > 1000, "{}", wide.1.n_leaves);
        assert_eq!(wide.0.to_bytes(), narrow.0.to_bytes());
        assert_eq!(wide.1.to_string(), narrow.1.to_string());
        for _ in 0..1000 {
            let p = sampled.point();
            assert_eq!(wide.0.h(p).to_bits(), narrow.0.h(p).to_bits());
        }
        let read =
            SizeField::from_bytes_in(&wide.0.to_bytes(), &ScratchSpace::new(1 << 16, dir.path()));
        assert_eq!(read.unwrap().to_bytes(), wide.0.to_bytes());
    }
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn equal_bits_for_any_number_of_threads() {
    let steep = graded(20.0, 120);
    let bytes = [1, 2, 3].map(|n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        let mut asked = options(None, None, Some("0.05"));
        asked.formula = formula("0.02+x*y").formula;
        pool.install(|| build(&steep, &asked).to_bytes())
    });
    assert!(bytes[0] == bytes[1] && bytes[0] == bytes[2]);
}

#[test]
fn bytes_are_read_back_and_damage_is_named() {
    let field = build(&graded(10.0, 20), &SizeOptions::default());
    let bytes = field.to_bytes();
    let read = SizeField::from_bytes(&bytes).unwrap();
    let mut dice = Dice(4);
    for _ in 0..1000 {
        let p = dice.point();
        assert_eq!(field.h(p).to_bits(), read.h(p).to_bits());
    }
    assert!(SizeField::from_bytes(&bytes[..63]).is_err());
    assert!(SizeField::from_bytes(&bytes[..bytes.len() - 1]).is_err());
    for at in 0..bytes.len().min(4000) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x80;
        // A flip may leave a valid field, but never a panic, here or later.
        if let Ok(field) = SizeField::from_bytes(&damaged) {
            field.h(Point::splat(0.3));
        }
    }
}

/// The cube's surface with its size options.
fn with_domain<T>(surface: &(Vec<Point>, Vec<[u32; 3]>), ask: impl FnOnce(&Domain) -> T) -> T {
    // Walls are welded: each grid has its own points.
    let mut welded = Surface::default();
    let mut number = std::collections::BTreeMap::new();
    let ids: Vec<u32> = (surface.0.iter())
        .map(|p| {
            let next = number.len() as u32;
            // Two zeros are one.
            let key = p.to_array().map(|x| (x + 0.0).to_bits());
            *number.entry(key).or_insert_with(|| {
                welded.points.push(*p);
                next
            })
        })
        .collect();
    welded.triangles = surface.1.iter().map(|t| t.map(|v| ids[v as usize])).collect();
    let seeker = Seeker::new(&welded);
    let volumes = EnclosedVolumes::new(&seeker);
    let filled: Vec<bool> = (0..volumes.n_volumes).map(|v| v > 0).collect();
    assert_eq!(filled, [false, true]);
    ask(&Domain { seeker: &seeker, volumes: &volumes, filled: &filled })
}

#[test]
fn loads_are_integrals() {
    let shape = "0.5,0.5,0.5,0.1,0.01".to_owned();
    let sphere = SizeOptions {
        sources: vec![SizeSource::parse_sphere(&shape).unwrap()],
        ..SizeOptions::default()
    };
    let even = cube(20, |i| i as f64 / 20.0);
    for (surface, options, n) in [
        (&even, &SizeOptions::default(), 50),
        (&graded(20.0, 60), &SizeOptions::default(), 80),
        (&even, &sphere, 100),
    ] {
        let field = build(surface, options);
        // One point anywhere in each cell of a grid.
        let mut dice = Dice(7);
        let points: Vec<Point> = (0..n * n * n)
            .map(|i| Point::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64))
            .map(|cell| (cell + dice.point()) / n as f64)
            .collect();
        for skin in [0.0, 0.5] {
            let inside = |p: &&Point| p.min(Point::ONE - **p).min_element() > skin * field.h(**p);
            let sum: f64 = points.iter().filter(inside).map(|&p| field.h(p).powi(-3)).sum();
            let expected = sum / points.len() as f64;
            let skin = SurfaceSkin { triangles: skin, vertices: 0.0 };
            let load = with_domain(surface, |domain| field.load(domain, skin));
            assert!((load / expected - 1.0).abs() < 0.03, "{load} {expected}");
        }
    }
}

#[test]
fn vertices_that_nearly_touch_have_a_bounded_load() {
    // A triangle divided at a point next to one of its corners, at the limit of doubles, in the middle of a wall.
    let whole = cube(4, |i| i as f64 / 4.0);
    let mut twin = whole.clone();
    let t = twin.1.len() / 2;
    let [a, b, c] = twin.1[t];
    let [p, q, r] = [a, b, c].map(|v| twin.0[v as usize]);
    let d = twin.0.len() as u32;
    twin.0.push(p + ((q - p) * 2.0 + (r - p)) * (4.0 * f64::EPSILON));
    assert_ne!(twin.0[d as usize], p);
    twin.1[t] = [a, b, d];
    twin.1.extend([[b, c, d], [c, a, d]]);
    let told = [&whole, &twin].map(|s| {
        let field = build(s, &SizeOptions::default());
        with_domain(s, |domain| field.counts(domain).tets())
    });
    // Sizes that grow from nothing: each doubling of the distance to the point costs as much as the last, twenty times.
    assert!(told[0] < 1e4 && told[1] < told[0] + 3e5, "{told:?}");
}

#[test]
fn bad_values_are_named() {
    for (result, parts) in [
        (Length::parse("hsiz", "0"), ["hsiz 0", "above zero"]),
        (Length::parse("hmin", "-1%"), ["hmin -1%", "above zero"]),
        (Length::parse("hmax", "big"), ["hmax big", "1%"]),
        (Length::parse("hsiz", "inf"), ["hsiz inf", "above zero"]),
    ] {
        let message = result.unwrap_err().to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
    let error = SizeOptions::parse(None, None, None, Some("1")).unwrap_err();
    assert!(error.to_string().contains("hgrad 1:"), "{error}");
    let (points, triangles) = cube(2, |i| i as f64 / 2.0);
    let crossed = options(None, Some("2"), Some("1"));
    let error = SizeField::build(&points, &triangles, &crossed).unwrap_err();
    assert!(matches!(error, SizingError::Crossed { .. }));
    let error = SizeField::build(&points, &[], &SizeOptions::default()).unwrap_err();
    assert_eq!(error, SizingError::NoEdges);
}

#[test]
fn summaries_say_where_sizes_came_from() {
    let (points, triangles) = cube(20, |i| i as f64 / 20.0);
    let asked = options(Some("1%"), None, None);
    let (_, summary) = SizeField::build_with(
        &points,
        &triangles,
        &asked,
        &ExtraSizes::default(),
        &ScratchSpace::boundless(),
    )
    .unwrap();
    let text = summary.to_string();
    assert!(text.contains("hsiz 1% = 0.0173") && text.contains("hgrad 1.3"), "{text}");
    assert_eq!(summary.warnings.len(), 1);
    assert!(summary.warnings[0].to_string().contains("hsiz 0.0173"));
    assert!((summary.surface.median / 0.0557 - 1.0).abs() < 0.05, "{summary:?}");
}

#[test]
fn shapes_count_in_the_summary_and_are_warned_about_on_the_surface_alone() {
    let (points, triangles) = cube(20, |i| i as f64 / 20.0);
    let summary = |asked: &SizeOptions| {
        let (extra, scratch) = (ExtraSizes::default(), ScratchSpace::boundless());
        SizeField::build_with(&points, &triangles, asked, &extra, &scratch).unwrap().1
    };
    let plain = summary(&SizeOptions::default());
    let shape = |source| SizeOptions { sources: vec![source], ..SizeOptions::default() };
    let sphere = |text: &str| shape(SizeSource::parse_sphere(text).unwrap());
    let inside = summary(&sphere("0.5,0.5,0.5,0.001,0.01"));
    assert!((inside.field.low / 0.01 - 1.0).abs() < 1e-9, "{inside}");
    assert_eq!(inside.warnings, []);
    let everywhere = summary(&sphere("0.5,0.5,0.5,9,0.01"));
    assert_eq!([everywhere.field.low, everywhere.field.high], [0.01; 2]);
    let of_box = shape(SizeSource::parse_box("0,0,0,0.2,0.2,0.2,0.01").unwrap());
    let of_cylinder = shape(SizeSource::parse_cylinder("0.5,0.5,0,0.5,0.5,1,0.1,0.01").unwrap());
    for (asked, option) in [
        (sphere("0,0,0,0.1,0.01"), "size_sphere"),
        (of_box, "size_box"),
        (of_cylinder, "size_cylinder"),
        (formula("0.01 + 0.1*z"), "size_expr"),
    ] {
        let found = summary(&asked);
        assert!(found.field.low < plain.field.low, "{option}: {found}");
        assert_eq!(found.warnings.len(), 1, "{option}");
        let text = found.warnings[0].to_string();
        assert!(text.starts_with(option) && text.contains("0.01 is far below"), "{text}");
    }
    assert_eq!(summary(&formula("0.05")).warnings, []);
}

/// `cargo test --release --lib sizing -- --ignored --nocapture`
#[test]
#[ignore = "prints a table for people"]
fn table_of_costs() {
    let surfaces = [
        ("even 0.7 M triangles", cube(240, |i| i as f64 / 240.0)),
        ("steep 50:1, 0.7 M triangles", graded(50.0, 240)),
    ];
    for (name, surface) in &surfaces {
        for asked in [SizeOptions::default(), options(Some("0.02"), None, None)] {
            let start = std::time::Instant::now();
            let field = build(surface, &asked);
            let seconds = start.elapsed().as_secs_f64();
            println!(
                "{name}, hsiz {:?}: {} leaves, {:.1} MB, built in {seconds:.2} s",
                asked.hsiz,
                field.n_leaves(),
                field.bytes() as f64 * 1e-6
            );
            time_reads(&field);
        }
    }
}

fn time_reads(field: &SizeField) {
    let mut dice = Dice(6);
    let scattered: Vec<Point> = (0..1_000_000).map(|_| dice.point()).collect();
    let mut at = Point::splat(0.5);
    let walk = (0..1_000_000).map(|_| {
        at = (at + (dice.point() - Point::splat(0.5)) * 0.02).clamp(Point::ZERO, Point::ONE);
        at
    });
    for (name, points) in [("scattered", scattered), ("walking", walk.collect())] {
        let start = std::time::Instant::now();
        let sum: f64 = points.iter().map(|&p| field.h(p)).sum();
        let ns = start.elapsed().as_secs_f64() * 1e9 / points.len() as f64;
        println!("    h(p), {name}: {ns:.1} ns (mean {:.4})", sum / points.len() as f64);
    }
}

/// Walls of the unit cube as two triangles each, and small tetrahedra around some places.
fn specks(size: f64, places: &[Point]) -> (Vec<Point>, Vec<[u32; 3]>) {
    let (mut points, mut triangles) = cube(1, |i| i as f64);
    for &place in places {
        let first = points.len() as u32;
        let corners = [
            Point::ONE,
            Point::new(1.0, -1.0, -1.0),
            Point::new(-1.0, 1.0, -1.0),
            Point::new(-1.0, -1.0, 1.0),
        ];
        points.extend(corners.map(|c| place + c * size));
        let faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
        triangles.extend(faces.map(|f| f.map(|v| first + v)));
    }
    (points, triangles)
}

/// Such a cube once was small in a quarter of its width around the speck: 7e12 tetrahedra for a speck of 1e-5.
#[test]
fn sizes_grow_from_a_speck_far_from_all_others() {
    let alone = vec![Point::new(0.322, 0.357, 0.65)];
    let at = |i: usize| [0.21, 0.5, 0.77][i];
    let many = (0..27).map(|i| Point::new(at(i % 3), at(i / 3 % 3), at(i / 9))).collect();
    for places in [alone, many] {
        for size in [1e-2, 1e-3, 1e-4, 1e-5] {
            let field = build(&specks(size, &places), &SizeOptions::default());
            let mut away = 32.0 * size;
            while away < 0.1 {
                let h = field.h(places[0] + Point::new(0.6, -0.64, 0.48) * away);
                let grown = field.beta() * away;
                assert!(h > 0.4 * grown, "{size}: {h} at {away}, {grown} is allowed");
                away *= 1.5;
            }
        }
    }
}

#[test]
fn a_bound_that_is_never_reached_changes_nothing() {
    let balls = SampleSpec::parse("balls,count=20").unwrap().make().unwrap();
    let surfaces = [
        cube(3, |i| i as f64 / 3.0),
        graded(100.0, 20),
        specks(1e-3, &[Point::new(0.3, 0.4, 0.6)]),
        (balls.points, balls.triangles),
    ];
    for (points, triangles) in surfaces {
        let bytes = |hmin, hmax| {
            let options = options(None, hmin, hmax);
            SizeField::build(&points, &triangles, &options).unwrap().to_bytes()
        };
        let free = bytes(None, None);
        assert!(bytes(None, Some("1e6")) == free, "{} points: hmax", points.len());
        assert!(bytes(Some("1e-9"), None) == free, "{} points: hmin", points.len());
    }
}

/// Many small places: on a helix, in a bed.
#[test]
fn fine_places_leave_the_interior_coarse() {
    let helix = (0..300).map(|i| {
        let (sin, cos) = (0.1 * f64::from(i)).sin_cos();
        Point::new(0.5 + 0.2 * cos, 0.5 + 0.2 * sin, 0.1 + 0.8 * f64::from(i) / 300.0)
    });
    let bed = (0..300).map(|i| {
        let at = |k: i32, step: f64| 0.2 + 0.6 * (f64::from(i * k) * step).fract();
        Point::new(at(1, 0.618), at(1, 0.7548), 0.2 + 0.1 * at(1, 0.5698))
    });
    let sets: [Vec<Point>; 2] = [helix.collect(), bed.collect()];
    for (set, places) in sets.iter().enumerate() {
        let field = build(&specks(5e-3, places), &SizeOptions::default());
        let mut dice = Dice(7);
        for _ in 0..2000 {
            let p = dice.point();
            let away = places.iter().map(|q| p.distance(*q)).fold(f64::INFINITY, f64::min);
            let (h, grown) = (field.h(p), field.beta() * away);
            assert!(h > 0.35 * grown.min(0.2), "set {set}: {h} at {away}, {grown} is allowed");
        }
    }
}
