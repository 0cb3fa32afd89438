//! Closed, oriented, near the wanted edges, the same on every machine.

mod divide;
mod sheets;
mod support_triangles;

use super::*;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use tetdb_base::geom::{Aabb, Point, orient};
use tetdb_base::surface::Surface;

fn made(text: &str) -> Sample {
    SampleSpec::parse(text).unwrap().make().unwrap()
}

/// Requirements on a complete surface; returns V − E + F.
fn check_closed(sample: &Sample) -> i64 {
    let mut edges: HashSet<(u32, u32)> = HashSet::new();
    let mut used = vec![false; sample.points.len()];
    for t in &sample.triangles {
        for i in 0..3 {
            used[t[i] as usize] = true;
            assert!(edges.insert((t[i], t[(i + 1) % 3])), "edge twice in one direction: {t:?}");
        }
    }
    assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))));
    assert!(used.iter().all(|&u| u), "a point is not used");
    let distinct: HashSet<_> =
        sample.points.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
    assert_eq!(distinct.len(), sample.points.len());
    assert_eq!(sample.labels.len(), sample.triangles.len());
    let n_labels = sample.label_names.len() as u32;
    assert!(sample.labels.iter().all(|&l| l < n_labels));
    sample.points.len() as i64 - edges.len() as i64 / 2 + sample.triangles.len() as i64
}

/// Shortest, mean and longest edge.
fn edges_of(sample: &Sample) -> (f64, f64, f64) {
    let (mut low, mut sum, mut high) = (f64::INFINITY, 0.0, 0.0f64);
    for t in &sample.triangles {
        for i in 0..3 {
            let l = sample.points[t[i] as usize].distance(sample.points[t[(i + 1) % 3] as usize]);
            (low, sum, high) = (low.min(l), sum + l, high.max(l));
        }
    }
    (low, sum / (3.0 * sample.triangles.len() as f64), high)
}

fn check_edges(sample: &Sample, h: f64, within: [f64; 2]) {
    let (low, mean, high) = edges_of(sample);
    let found = format!("{:.3} {:.3} {:.3}", low / h, mean / h, high / h);
    assert!(low > within[0] * h && high < within[1] * h, "{found}");
    assert!((mean / h - 1.0).abs() < 0.12, "{found}");
}

/// FNV-1a over all bits; changes whenever any bit of a surface does.
fn hash(sample: &Sample) -> u64 {
    let coordinates = sample.points.iter().flat_map(|p| p.to_array());
    let words = coordinates
        .map(f64::to_bits)
        .chain(sample.triangles.iter().flatten().map(|&v| u64::from(v)))
        .chain(sample.labels.iter().map(|&l| u64::from(l)));
    words
        .fold(0xcbf2_9ce4_8422_2325, |hash, word| (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3))
}

#[test]
fn boxes_are_closed_and_have_their_volume() {
    for (text, h) in
        [("box", 0.05), ("box,h=0.1,x=2,z=0.5", 0.1), ("box,h=1e-10,x=1e-9,y=1e-9,z=1e-9", 1e-10)]
    {
        let sample = made(text);
        assert_eq!(check_closed(&sample), 2, "{text}");
        check_edges(&sample, h, [0.5, 1.3]);
    }
    assert!((made("box,h=0.1,x=2,z=0.5").signed_volume() - 1.0).abs() < 1e-12);
    let coarse = made("box,h=3");
    assert_eq!((coarse.points.len(), coarse.triangles.len()), (8, 12));
    for h in [0.7, 0.5, 0.34] {
        assert_eq!(check_closed(&made(&format!("box,h={h}"))), 2);
    }
}

#[test]
fn spheres_are_round() {
    let sample = made("sphere,radius=2,h=0.1");
    assert_eq!(check_closed(&sample), 2);
    check_edges(&sample, 0.1, [0.8, 1.25]);
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
    let volume = sample.signed_volume();
    assert!(volume < exact && volume > exact * 0.995, "{volume}");
    assert_eq!(made("sphere,h=10").triangles.len(), 180);
}

#[test]
fn balls_keep_their_gaps() {
    let sample = made("balls,count=60,seed=3,h=0.06");
    assert_eq!(check_closed(&sample), 2 * 61);
    let volume = sample.signed_volume();
    assert!(volume > 0.55 && volume < 0.7, "{volume}");
    // An ellipsoid has 3/8 of its ball.
    let inner = made("ellipsoids,count=60,seed=3,h=0.06").signed_volume();
    assert!((1.0 - inner - 0.375 * (1.0 - volume)).abs() < 1e-9, "{inner}");
    // Balls are 61 connected parts; points of two parts are never nearer than the gap.
    let gap = 0.006 * (1000.0f64 / 60.0).cbrt();
    let part = parts(&sample);
    let mut cells: HashMap<[i32; 3], Vec<usize>> = HashMap::new();
    let cell = |p: Point| p.to_array().map(|x| (x / gap).floor() as i32);
    for (i, &p) in sample.points.iter().enumerate() {
        cells.entry(cell(p)).or_default().push(i);
    }
    for (i, &p) in sample.points.iter().enumerate() {
        let [x, y, z] = cell(p);
        for k in 0..27 {
            let near = [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1];
            for &j in cells.get(&near).into_iter().flatten() {
                let apart = part[i] == part[j] || p.distance(sample.points[j]) >= gap * 0.999;
                assert!(apart, "{p} {}", sample.points[j]);
            }
        }
    }
}

/// Smallest point of each point's connected part.
fn parts(sample: &Sample) -> Vec<u32> {
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }
    let mut parent: Vec<u32> = (0..sample.points.len() as u32).collect();
    for t in &sample.triangles {
        for i in 1..3 {
            let (a, b) = (root(&mut parent, t[0]), root(&mut parent, t[i]));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    (0..parent.len() as u32).map(|v| root(&mut parent, v)).collect()
}

#[test]
fn a_thousand_balls_have_the_promised_size() {
    for seed in [1, 2] {
        let sample = made(&format!("balls,count=1000,h=0.0093,seed={seed}"));
        let n = sample.triangles.len() as f64;
        assert!((n / 0.69e6 - 1.0).abs() < 0.03, "{n}");
        if seed == 1 {
            assert_eq!(check_closed(&sample), 2 * 1001);
        }
    }
}

#[test]
fn any_count_of_balls_finds_room() {
    for count in [1, 2, 3, 5, 8, 13, 20, 40, 100] {
        for seed in 0..2 {
            let sample = made(&format!("balls,count={count},seed={seed}"));
            assert!(sample.triangles.len() < 70_000 || count > 100);
            assert!(sample.signed_volume() > 0.5);
        }
    }
}

#[test]
fn grains_are_disjoint_convex_polyhedra() {
    let count = 300;
    let sample = made(&format!("grains,count={count}"));
    assert_eq!(check_closed(&sample), 2 * (count + 1));
    let part = parts(&sample);
    let mut grains: BTreeMap<u32, Vec<[u32; 3]>> = BTreeMap::new();
    for (&t, &label) in sample.triangles.iter().zip(&sample.labels) {
        if label == 1 {
            grains.entry(part[t[0] as usize]).or_default().push(t);
        }
    }
    assert_eq!(grains.len() as i64, count);
    let mean = grains.values().map(Vec::len).sum::<usize>() as f64 / count as f64;
    assert!((80.0..82.0).contains(&mean), "{mean} triangles");
    let mut boxes = Vec::new();
    for grain in grains.values() {
        let ids: BTreeSet<u32> = grain.iter().flatten().copied().collect();
        let points: Vec<Point> = ids.iter().map(|&v| sample.points[v as usize]).collect();
        let size = points.iter().map(|p| points[0].distance(*p)).fold(0.0, f64::max);
        for t in grain {
            let [a, b, c] = t.map(|v| sample.points[v as usize]);
            // Inward triangles: all else lies in front.
            assert!(points.iter().all(|&p| orient(a, b, c, p) >= 0.0));
            assert!(a.distance(b).min(b.distance(c)) > 0.05 * size);
        }
        boxes.push(Aabb::around(points));
    }
    let volumes = boxes.iter().map(|b| (b.high - b.low).to_array().iter().product::<f64>());
    let (low, high) = volumes.fold((1.0, 0.0), |(low, high), v| (v.min(low), v.max(high)));
    assert!(high > 8.0 * low, "sizes vary: {low} {high}");
    for (i, a) in boxes.iter().enumerate() {
        assert!(boxes[..i].iter().all(|b| !a.meets(b)));
    }
}

#[test]
fn shells_fill_in_turn() {
    let sample = made("shells,count=3,kind=boxes,h=0.1");
    assert_eq!(check_closed(&sample), 6);
    let exact = 8.0 * (1.0 - 8.0 / 27.0 + 1.0 / 27.0);
    let volume = sample.signed_volume();
    assert!((volume - exact).abs() < 1e-11, "{volume} {exact}");
    let sample = made("shells,count=4");
    assert_eq!(check_closed(&sample), 8);
    assert_eq!(sample.label_names[3], "shell-4");
    assert!(sample.signed_volume() > 0.0);
}

#[test]
fn the_knot_is_one_ring() {
    let sample = made("knot");
    assert_eq!(check_closed(&sample), 0);
    check_edges(&sample, 0.05, [0.6, 1.5]);
    // Pappus: the section's area times the length of the center line.
    let length = 15.41;
    let exact = std::f64::consts::PI * 0.04 * length;
    assert!((sample.signed_volume() / exact - 1.0).abs() < 0.05, "{}", sample.signed_volume());
}

/// Requirements of meshing, and more: closed in exact signs, one volume or three.
fn check_solid(text: &str, n_parts: i64) -> Sample {
    let sample = made(text);
    let genus = if text.contains("needles") { 9 } else { 0 };
    assert_eq!(check_closed(&sample), 2 * (n_parts - genus), "{text}");
    let validation = tetdb_base::surface::validate(&sample.clone().into());
    assert!(validation.is_valid(), "{text}: {:?}", validation.defects.first());
    assert!(sample.signed_volume() > 0.0, "{text}");
    sample
}

#[test]
fn steps_are_valid_and_as_low_as_asked() {
    for seed in 0..20 {
        for step in ["1e-2", "1e-4", "1e-6", "1e-7", "1e-8"] {
            let sample = check_solid(&format!("steps,step={step},seed={seed}"), 1);
            assert_eq!(sample.triangles.len(), 60);
            let asked: f64 = step.parse().unwrap();
            let low = edges_of(&sample).0;
            assert!((0.49..=1.01).contains(&(low / asked)), "{low} {asked}");
        }
        check_solid(&format!("steps,count=200,step=0.01,seed={seed}"), 1);
    }
}

#[test]
fn needles_are_three_valid_parts() {
    for seed in 0..20 {
        let sample = check_solid(&format!("needles,seed={seed}"), 3);
        // A disk, a rod, nine holes, the plate's two sides and outer walls.
        assert_eq!(sample.triangles.len(), 2 * (4 * 64 - 4) + 9 * (4 * 64 + 8) + 24);
    }
    check_solid("needles,count=2000,seed=3", 3);
}

#[test]
fn caps_are_valid_however_their_ears_are_cut() {
    for seed in 0..20 {
        let sample = check_solid(&format!("caps,seed={seed}"), 1);
        assert_eq!(sample.triangles.len(), 4 * 60 - 4);
        check_solid(&format!("caps,count=2000,seed={seed}"), 1);
    }
}

#[test]
fn the_same_word_gives_the_same_bits() {
    let found = [
        "balls,count=20,seed=5",
        "box,h=0.2",
        "grains,count=30,seed=2",
        "knot,h=0.1",
        "shells",
        "sphere",
    ]
    .map(|text| hash(&made(text)));
    assert_eq!(found, EXPECTED, "{found:#x?}");
    for text in [
        "balls,count=20",
        "ellipsoids,count=20",
        "box,x=0.3",
        "grains,count=20",
        "knot",
        "shells,kind=boxes",
        "sphere,h=0.3",
        "steps,step=1e-3",
        "needles,holes=2",
        "caps,seed=5",
        "broken,kind=cracks",
        "broken,kind=soup,count=3",
    ] {
        let spec = SampleSpec::parse(text).unwrap();
        assert_eq!(SampleSpec::parse(&spec.canonical()).unwrap(), spec);
    }
}

#[test]
fn surfaces_have_the_order_of_files() {
    let spec = SampleSpec::parse("knot,h=0.1").unwrap();
    let surface = Surface::from(spec.make().unwrap());
    let mut next = 0;
    for &v in surface.triangles.iter().flatten() {
        assert!(v <= next);
        next += u32::from(v == next);
    }
    assert_eq!(next as usize, surface.points.len());
}

/// Recorded when the generators were written; they must never change.
const EXPECTED: [u64; 6] = [
    0x4d86_8dcf_cc8b_164a,
    0x7aac_3221_1b6f_2f59,
    0x61bc_4b9e_33a2_3dfd,
    0x7d56_a7e3_de65_fb91,
    0x21ff_4baa_bce4_d8bc,
    0x4b01_fd45_d99f_a41f,
];

#[test]
fn errors_name_the_word() {
    for (text, parts) in [
        ("bals", &["`bals`", "`balls`", "`knot`"][..]),
        ("sample:balls,cuont=3", &["`cuont`", "`count`, `seed`, `h`"]),
        ("balls,count=0", &["count=0", "from 1 to"]),
        ("balls,count=-1", &["count=-1"]),
        ("balls,h=nan", &["h=nan", "length above zero"]),
        ("box,x", &["`x`", "key=value"]),
        ("box,x=1,x=2", &["`x` twice"]),
        ("shells,kind=cones", &["kind=cones", "`spheres` or `boxes`"]),
        ("knot,tube=0.9", &["tube=0.9", "0.3"]),
    ] {
        let message = SampleSpec::parse(text).unwrap_err().to_string();
        for part in parts {
            assert!(message.contains(part), "{text}: {message}");
        }
    }
    for text in ["box,h=1e-6", "sphere,h=1e-90", "balls,h=1e-7", "shells,h=1e-7", "knot,h=1e-7"] {
        let error = SampleSpec::parse(text).unwrap().make().unwrap_err();
        assert!(matches!(error, SampleError::TooMany { .. }), "{error}");
    }
}

/// `cargo test --release --lib samples -- --ignored --nocapture` prints sizes for the docs.
#[test]
#[ignore = "prints a table for people"]
fn table_of_sizes() {
    for text in [
        "balls,count=10",
        "balls",
        "balls,count=1000",
        "balls,count=1000,h=0.0093",
        "balls,count=1000,h=0.02",
        "balls,count=10000",
        "box",
        "grains",
        "grains,count=5000",
        "knot",
        "shells",
        "sphere",
    ] {
        let start = std::time::Instant::now();
        let sample = made(text);
        let seconds = start.elapsed().as_secs_f64();
        let (low, mean, high) = edges_of(&sample);
        println!(
            "{:<48} {:>8} triangles, edges {low:.4} {mean:.4} {high:.4}, volume {:.4}, {seconds:.2} s",
            SampleSpec::parse(text).unwrap().canonical(),
            sample.triangles.len(),
            sample.signed_volume(),
        );
    }
}
