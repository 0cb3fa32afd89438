//! Parses a word such as `balls,count=1000,h=0.02`.

use super::balls::{Balls, ELLIPSOID};
use super::broken::{Broken, BrokenKind};
use super::caps::Caps;
use super::faults::Faults;
use super::grains::Grains;
use super::needles::Needles;
use super::shells::{ShellKind, make_shells};
use super::steps::Steps;
use super::wells::Wells;
use super::{Sample, SampleError, boxes, knot, sphere};
use std::fmt::Display;
use std::str::FromStr;
use tetdb_base::geom::Point;

/// Prefix of a surface argument that names a sample.
pub const PREFIX: &str = "sample:";
/// The samples there are.
pub const SAMPLES: &[&str] = &[
    "balls",
    "box",
    "broken",
    "caps",
    "ellipsoids",
    "faults",
    "grains",
    "knot",
    "needles",
    "shells",
    "sphere",
    "steps",
    "wells",
];

/// The specification of a sample.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleSpec {
    kind: SampleKind,
}

/// The generators and their parameters; lengths in the sample's own units.
#[derive(Clone, Debug, PartialEq)]
pub enum SampleKind {
    /// Balls or ellipsoids inside a box.
    Balls(Balls),
    /// A box.
    Box {
        /// Lengths of its sides.
        sides: Point,
        /// Edge length of the triangles.
        h: f64,
    },
    /// Holes, crossings and what else keeps a surface from being meshed; see `broken.rs`.
    Broken(Broken),
    /// A coplanar cap with many vertices, badly triangulated; see `caps.rs`.
    Caps(Caps),
    /// A box with sheets in it; see `faults.rs`.
    Faults(Faults),
    /// Grains that fill a box.
    Grains(Grains),
    /// A tube along a knot.
    Knot {
        /// Radius of the tube.
        tube: f64,
        /// Edge length of the triangles.
        h: f64,
    },
    /// Fans, slats and perforated plates; see `needles.rs`.
    Needles(Needles),
    /// Surfaces within each other.
    Shells {
        /// Number of shells.
        count: usize,
        /// Their shape.
        kind: ShellKind,
        /// Edge length of the triangles.
        h: f64,
    },
    /// A sphere.
    Sphere {
        /// Its radius.
        radius: f64,
        /// Edge length of the triangles.
        h: f64,
    },
    /// Plates with steps of a small share of their size; see `steps.rs`.
    Steps(Steps),
    /// A box with layers, wells and sensors in it; see `wells.rs`.
    Wells(Wells),
}

impl SampleSpec {
    /// Reads `NAME,key=value,…`, with or without `sample:` before it.
    ///
    /// # Errors
    /// Names the word that is wrong and those that would do.
    pub fn parse(text: &str) -> Result<Self, SampleError> {
        let text = text.strip_prefix(PREFIX).unwrap_or(text);
        let (name, rest) = text.split_once(',').unwrap_or((text, ""));
        let kind = match name {
            "balls" => parse_balls("balls", Point::ONE, rest)?,
            "ellipsoids" => parse_balls("ellipsoids", ELLIPSOID, rest)?,
            "box" => parse_box(rest)?,
            "broken" => parse_broken(rest)?,
            "caps" => parse_caps(rest)?,
            "faults" => parse_faults(rest)?,
            "grains" => parse_grains(rest)?,
            "knot" => {
                let keys = Keys::new("knot", &["tube", "h"], rest)?;
                let tube = keys.number("tube", 0.2, 0.001, 0.3)?;
                let h = keys.length("h", tube / 4.0)?;
                SampleKind::Knot { tube, h }
            }
            "needles" => parse_needles(rest)?,
            "shells" => parse_shells(rest)?,
            "sphere" => {
                let keys = Keys::new("sphere", &["radius", "h"], rest)?;
                let radius = keys.length("radius", 1.0)?;
                let h = keys.length("h", radius / 10.0)?;
                SampleKind::Sphere { radius, h }
            }
            "steps" => parse_steps(rest)?,
            "wells" => parse_wells(rest)?,
            _ => {
                return Err(SampleError::UnknownName { found: name.to_owned(), expected: SAMPLES });
            }
        };
        Ok(Self { kind })
    }

    /// The word with every key spelled out: equal words make equal surfaces.
    pub fn canonical(&self) -> String {
        match &self.kind {
            SampleKind::Balls(balls @ Balls { count, seed, h, .. }) => {
                format!("{PREFIX}{},count={count},seed={seed},h={h}", balls.name())
            }
            SampleKind::Box { sides, h } => {
                format!("{PREFIX}box,x={},y={},z={},h={h}", sides.x, sides.y, sides.z)
            }
            SampleKind::Broken(Broken { kind, count, seed, h }) => {
                format!("{PREFIX}broken,kind={},count={count},seed={seed},h={h}", kind.word())
            }
            SampleKind::Caps(Caps { count, seed }) => {
                format!("{PREFIX}caps,count={count},seed={seed}")
            }
            SampleKind::Faults(Faults { count, seed, cells, shift }) => {
                format!("{PREFIX}faults,count={count},seed={seed},cells={cells},shift={shift}")
            }
            SampleKind::Grains(Grains { count, seed, h }) => {
                format!("{PREFIX}grains,count={count},seed={seed},h={h}")
            }
            SampleKind::Needles(Needles { count, holes, seed }) => {
                format!("{PREFIX}needles,count={count},holes={holes},seed={seed}")
            }
            SampleKind::Knot { tube, h } => format!("{PREFIX}knot,tube={tube},h={h}"),
            SampleKind::Shells { count, kind, h } => {
                let kind = match kind {
                    ShellKind::Spheres => "spheres",
                    ShellKind::Boxes => "boxes",
                };
                format!("{PREFIX}shells,count={count},kind={kind},h={h}")
            }
            SampleKind::Sphere { radius, h } => format!("{PREFIX}sphere,radius={radius},h={h}"),
            SampleKind::Steps(Steps { count, step, seed }) => {
                format!("{PREFIX}steps,count={count},step={step},seed={seed}")
            }
            SampleKind::Wells(Wells { count, seed, cells, layers, points, shift }) => {
                format!(
                    "{PREFIX}wells,count={count},seed={seed},cells={cells},layers={layers},points={points},shift={shift}"
                )
            }
        }
    }

    /// Makes the surface in memory.
    ///
    /// # Errors
    /// [`SampleError::TooMany`] before anything large is allocated; [`SampleError::NoRoom`] when
    /// balls find no place.
    pub fn make(&self) -> Result<Sample, SampleError> {
        self.make_within(u64::MAX)
    }

    /// [`SampleSpec::make`] within about `bytes_max` of memory.
    ///
    /// # Errors
    /// [`SampleError::Memory`] too, before anything large is allocated.
    pub fn make_within(&self, bytes_max: u64) -> Result<Sample, SampleError> {
        match &self.kind {
            SampleKind::Balls(balls) => balls.make(bytes_max),
            SampleKind::Box { sides, h } => boxes::make_box(*sides, *h, bytes_max),
            SampleKind::Broken(broken) => broken.make(bytes_max),
            SampleKind::Caps(caps) => caps.make(bytes_max),
            SampleKind::Faults(faults) => faults.make(bytes_max),
            SampleKind::Grains(grains) => grains.make(bytes_max),
            SampleKind::Knot { tube, h } => knot::make_knot(*tube, *h, bytes_max),
            SampleKind::Needles(needles) => needles.make(bytes_max),
            SampleKind::Shells { count, kind, h } => make_shells(*count, *kind, *h, bytes_max),
            SampleKind::Sphere { radius, h } => sphere::make_sphere(*radius, *h, bytes_max),
            SampleKind::Steps(steps) => steps.make(bytes_max),
            SampleKind::Wells(wells) => wells.make(bytes_max),
        }
    }
}

fn parse_balls(kind: &'static str, axes: Point, rest: &str) -> Result<SampleKind, SampleError> {
    let keys = Keys::new(kind, &["count", "seed", "h"], rest)?;
    let count = keys.number("count", 100, 1, 10_000_000)?;
    let seed = keys.number("seed", 1, 0, u64::MAX)?;
    let h = keys.length("h", Balls::h_default(count))?;
    Ok(SampleKind::Balls(Balls { count, seed, h, axes }))
}

fn parse_box(rest: &str) -> Result<SampleKind, SampleError> {
    let keys = Keys::new("box", &["x", "y", "z", "h"], rest)?;
    let x = keys.length("x", 1.0)?;
    let y = keys.length("y", 1.0)?;
    let sides = Point::new(x, y, keys.length("z", 1.0)?);
    let h = keys.length("h", sides.max_element() / 20.0)?;
    Ok(SampleKind::Box { sides, h })
}

fn parse_broken(rest: &str) -> Result<SampleKind, SampleError> {
    let keys = Keys::new("broken", &["kind", "count", "seed", "h"], rest)?;
    let kind = match keys.get("kind") {
        None => BrokenKind::Crossings,
        Some(word) => {
            let known = BrokenKind::WORDS.iter().find(|(_, known)| *known == word);
            let words: Vec<&str> = BrokenKind::WORDS.iter().map(|(_, word)| *word).collect();
            known.ok_or_else(|| keys.bad("kind", format!("one of {}", words.join(", "))))?.0
        }
    };
    let count = keys.number("count", 8, 1, 1_000_000)?;
    let seed = keys.number("seed", 1, 0, u64::MAX)?;
    let h = keys.length("h", 0.25)?;
    Ok(SampleKind::Broken(Broken { kind, count, seed, h }))
}

fn parse_caps(rest: &str) -> Result<SampleKind, SampleError> {
    let keys = Keys::new("caps", &["count", "seed"], rest)?;
    // With more corners, neighbors would be too near to distinguish convex from flat.
    let count = keys.number("count", 60, 3, 20_000)?;
    let seed = keys.number("seed", 1, 0, u64::MAX)?;
    Ok(SampleKind::Caps(Caps { count, seed }))
}

fn parse_faults(rest: &str) -> Result<SampleKind, SampleError> {
    let keys = Keys::new("faults", &["count", "seed", "cells", "shift"], rest)?;
    let count = keys.number("count", 12, 1, 100_000)?;
    let seed = keys.number("seed", 1, 0, u64::MAX)?;
    let cells = keys.number("cells", 8, 2, 4000)?;
    // Beyond this triangles of two sides could meet.
    let shift = keys.number("shift", 0.1, 0.0, 0.15)?;
    Ok(SampleKind::Faults(Faults { count, seed, cells, shift }))
}

fn parse_needles(rest: &str) -> Result<SampleKind, SampleError> {
    let keys = Keys::new("needles", &["count", "holes", "seed"], rest)?;
    let count = keys.number("count", 64, 8, 20_000)?;
    let holes = keys.number("holes", 9, 1, 100_000)?;
    let seed = keys.number("seed", 1, 0, u64::MAX)?;
    Ok(SampleKind::Needles(Needles { count, holes, seed }))
}

fn parse_steps(rest: &str) -> Result<SampleKind, SampleError> {
    let keys = Keys::new("steps", &["count", "step", "seed"], rest)?;
    let count = keys.number("count", 5, 1, 1_000_000)?;
    let step = keys.number("step", 1e-7, 1e-8, 1e-2)?;
    let seed = keys.number("seed", 1, 0, u64::MAX)?;
    Ok(SampleKind::Steps(Steps { count, step, seed }))
}

fn parse_wells(rest: &str) -> Result<SampleKind, SampleError> {
    let expected = &["count", "seed", "cells", "layers", "points", "shift"];
    let keys = Keys::new("wells", expected, rest)?;
    let count = keys.number("count", 20, 1, 1_000_000)?;
    let seed = keys.number("seed", 1, 0, u64::MAX)?;
    let least = Wells::cells_least(count);
    let cells = keys.number("cells", Wells::cells_default(count), least.max(3), 4000)?;
    let layers = keys.number("layers", 3, 0, cells - 1)?;
    let points = keys.number("points", count, 0, (cells as usize).pow(3))?;
    let shift = keys.number("shift", 0.1, 0.0, 0.15)?;
    Ok(SampleKind::Wells(Wells { count, seed, cells, layers, points, shift }))
}

fn parse_grains(rest: &str) -> Result<SampleKind, SampleError> {
    let keys = Keys::new("grains", &["count", "seed", "h"], rest)?;
    let count = keys.number("count", 100, 1, 10_000_000)?;
    let seed = keys.number("seed", 1, 0, u64::MAX)?;
    let h = keys.length("h", Grains::h_default(count))?;
    Ok(SampleKind::Grains(Grains { count, seed, h }))
}

fn parse_shells(rest: &str) -> Result<SampleKind, SampleError> {
    let keys = Keys::new("shells", &["count", "kind", "h"], rest)?;
    let count = keys.number("count", 3, 1, 1000)?;
    let kind = match keys.get("kind") {
        None | Some("spheres") => ShellKind::Spheres,
        Some("boxes") => ShellKind::Boxes,
        Some(_) => return Err(keys.bad("kind", "`spheres` or `boxes`")),
    };
    let h = keys.length("h", 0.4 / count as f64)?;
    Ok(SampleKind::Shells { count, kind, h })
}

/// The `key=value` pairs of one sample, keys known and given once.
struct Keys<'a> {
    name: &'static str,
    pairs: Vec<(&'a str, &'a str)>,
}

impl<'a> Keys<'a> {
    fn new(
        name: &'static str,
        expected: &'static [&'static str],
        rest: &'a str,
    ) -> Result<Self, SampleError> {
        let mut pairs: Vec<(&str, &str)> = Vec::new();
        for word in rest.split(',').filter(|word| !word.is_empty()) {
            let found = word.to_owned();
            let Some((key, value)) = word.split_once('=') else {
                return Err(SampleError::NotAPair { name, found, expected });
            };
            if !expected.contains(&key) {
                let found = key.to_owned();
                return Err(SampleError::UnknownKey { name, found, expected });
            }
            if pairs.iter().any(|(other, _)| *other == key) {
                let key = key.to_owned();
                return Err(SampleError::Twice { name, key });
            }
            pairs.push((key, value));
        }
        Ok(Self { name, pairs })
    }

    fn get(&self, key: &str) -> Option<&'a str> {
        let pair = self.pairs.iter().find(|(other, _)| *other == key);
        pair.map(|(_, value)| *value)
    }

    fn bad(&self, key: &'static str, expected: impl Into<String>) -> SampleError {
        SampleError::BadValue {
            name: self.name,
            key,
            found: self.get(key).unwrap_or_default().to_owned(),
            expected: expected.into(),
        }
    }

    /// A number within `low..=high`.
    fn number<T: FromStr + PartialOrd + Display>(
        &self,
        key: &'static str,
        default: T,
        low: T,
        high: T,
    ) -> Result<T, SampleError> {
        let Some(text) = self.get(key) else {
            return Ok(default);
        };
        match text.parse() {
            Ok(value) if low <= value && value <= high => Ok(value),
            _ => Err(self.bad(key, format!("a number from {low} to {high}"))),
        }
    }

    /// A length from 1e-100 to 1e100, which keeps squares and volumes representable.
    fn length(&self, key: &'static str, default: f64) -> Result<f64, SampleError> {
        let Some(text) = self.get(key) else {
            return Ok(default);
        };
        match text.parse::<f64>() {
            Ok(value) if (1e-100..=1e100).contains(&value) => Ok(value),
            _ => Err(self.bad(key, "a length above zero")),
        }
    }
}
