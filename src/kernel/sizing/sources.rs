//! Sizes in a box, a sphere or a cylinder, graded outwards by formula.
//!
//! Inside the shape the size is `inside`, away from it at most `outside` (unbounded if not given). Between the two it
//! changes with the slope of the gradation; the minimum with the octree keeps that slope.

use std::fmt;

use super::SizingError;
use super::length::Length;
use tetdb_base::geom::Point;

/// A convex region, closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SourceShape {
    /// A box along the axes.
    Box {
        /// Least coordinates.
        low: Point,
        /// Greatest coordinates.
        high: Point,
    },
    /// A full sphere.
    Sphere {
        /// Its center.
        center: Point,
        /// Its radius; may be 0.
        radius: Length,
    },
    /// A full cylinder.
    Cylinder {
        /// Centers of its two ends.
        ends: [Point; 2],
        /// Its radius; may be 0.
        radius: Length,
    },
}

/// Sizes inside and outside a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeSource {
    /// The shape in which the sizes hold.
    pub shape: SourceShape,
    /// Size inside the shape.
    pub inside: Length,
    /// Size outside it, if one was given.
    pub outside: Option<Length>,
}

impl SizeSource {
    /// Reads `X0,Y0,Z0,X1,Y1,Z1,H[,OUTSIDE]`: two opposite corners, in any order.
    ///
    /// # Errors
    /// Names the option and the value.
    pub fn parse_box(text: &str) -> Result<Self, SizingError> {
        let text = SourceText {
            option: "size_box",
            expected: "X0,Y0,Z0,X1,Y1,Z1,H or X0,Y0,Z0,X1,Y1,Z1,H,OUTSIDE",
            text,
        };
        let ([a, b, c, d, e, f], inside, outside) = text.read()?;
        let (p, q) = (Point::new(a, b, c), Point::new(d, e, f));
        let shape = SourceShape::Box { low: p.min(q), high: p.max(q) };
        Ok(Self { shape, inside, outside })
    }

    /// Reads `X,Y,Z,R,H[,OUTSIDE]`: center and radius.
    ///
    /// # Errors
    /// Names the option and the value.
    pub fn parse_sphere(text: &str) -> Result<Self, SizingError> {
        let text = SourceText {
            option: "size_sphere",
            expected: "X,Y,Z,R,H or X,Y,Z,R,H,OUTSIDE with R not below zero",
            text,
        };
        let ([x, y, z], radius, inside, outside) = text.read_round()?;
        let center = Point::new(x, y, z);
        Ok(Self { shape: SourceShape::Sphere { center, radius }, inside, outside })
    }

    /// Reads `X0,Y0,Z0,X1,Y1,Z1,R,H[,OUTSIDE]`: the ends of the axis, which differ, and the radius.
    ///
    /// # Errors
    /// Names the option and the value.
    pub fn parse_cylinder(text: &str) -> Result<Self, SizingError> {
        let text = SourceText {
            option: "size_cylinder",
            expected: "X0,Y0,Z0,X1,Y1,Z1,R,H or X0,Y0,Z0,X1,Y1,Z1,R,H,OUTSIDE with two different ends",
            text,
        };
        let ([a, b, c, d, e, f], radius, inside, outside) = text.read_round()?;
        let ends = [Point::new(a, b, c), Point::new(d, e, f)];
        if ends[0] == ends[1] {
            return Err(text.bad());
        }
        Ok(Self { shape: SourceShape::Cylinder { ends, radius }, inside, outside })
    }

    /// The option that asks for such a source.
    pub fn option(&self) -> &'static str {
        match self.shape {
            SourceShape::Box { .. } => "size_box",
            SourceShape::Sphere { .. } => "size_sphere",
            SourceShape::Cylinder { .. } => "size_cylinder",
        }
    }

    /// # Errors
    /// Names the option and the value.
    pub(super) fn check(&self) -> Result<(), SizingError> {
        let form = self.to_string();
        match self.shape {
            SourceShape::Box { .. } => Self::parse_box(&form),
            SourceShape::Sphere { .. } => Self::parse_sphere(&form),
            SourceShape::Cylinder { .. } => Self::parse_cylinder(&form),
        }
        .map(|_| ())
    }

    /// The source for a surface whose box has that diagonal; no size below `least`.
    pub(super) fn resolve(&self, diagonal: f64, least: f64) -> ResolvedSource {
        ResolvedSource {
            shape: self.shape.resolve(diagonal),
            inside: self.inside.resolve(diagonal).max(least),
            outside: self.outside.map_or(f64::INFINITY, |h| h.resolve(diagonal).max(least)),
        }
    }
}

impl fmt::Display for SizeSource {
    /// As the parser of its shape reads it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (points, radius) = match self.shape {
            SourceShape::Box { low, high } => (vec![low, high], None),
            SourceShape::Sphere { center, radius } => (vec![center], Some(radius)),
            SourceShape::Cylinder { ends, radius } => (ends.to_vec(), Some(radius)),
        };
        let numbers = points.iter().flat_map(|p| p.to_array());
        let lengths = [radius, Some(self.inside), self.outside].into_iter().flatten();
        let words = numbers.map(|x| x.to_string()).chain(lengths.map(|h| h.to_string()));
        f.write_str(&words.collect::<Vec<_>>().join(","))
    }
}

/// A text of numbers and one or two lengths.
struct SourceText<'a> {
    option: &'static str,
    expected: &'static str,
    text: &'a str,
}

impl SourceText<'_> {
    fn bad(&self) -> SizingError {
        SizingError::BadValue {
            option: self.option,
            found: self.text.to_owned(),
            expected: self.expected,
        }
    }

    /// Numbers, a radius, and lengths.
    fn read_round<const N: usize>(
        &self,
    ) -> Result<([f64; N], Length, Length, Option<Length>), SizingError> {
        let words: Vec<&str> = self.text.split(',').collect();
        let word = words.get(N).ok_or_else(|| self.bad())?.trim();
        let radius = match word.parse() {
            Ok(0.0) => Length::Units(0.0),
            _ => Length::parse(self.option, word).map_err(|_| SizingError::BadValue {
                option: self.option,
                found: format!("{} (in it {word})", self.text),
                expected: "R to be a length not below zero, such as 0.25, or a share of the box diagonal, such as 1%",
            })?,
        };
        let others = [&words[..N], &words[N + 1..]].concat().join(",");
        let (numbers, inside, outside) =
            SourceText { option: self.option, expected: self.expected, text: &others }
                .read()
                .map_err(|e| match e {
                    SizingError::BadValue { found, .. } if found == others => self.bad(),
                    other => other,
                })?;
        Ok((numbers, radius, inside, outside))
    }

    fn read<const N: usize>(&self) -> Result<([f64; N], Length, Option<Length>), SizingError> {
        let words: Vec<&str> = self.text.split(',').collect();
        if words.len() != N + 1 && words.len() != N + 2 {
            return Err(self.bad());
        }
        let mut numbers = [0.0; N];
        for (number, word) in numbers.iter_mut().zip(&words) {
            let read: Option<f64> = word.trim().parse().ok();
            *number = read.filter(|x| x.is_finite()).ok_or_else(|| SizingError::BadValue {
                option: self.option,
                found: format!("{} (in it {})", self.text, word.trim()),
                expected: "a plain number for each coordinate; only R, H and OUTSIDE may be shares such as 2%",
            })?;
        }
        let length = |i: usize| {
            Length::parse(self.option, words[i]).map_err(|_| SizingError::BadValue {
                option: self.option,
                found: format!("{} (in it {})", self.text, words[i].trim()),
                expected: "H and OUTSIDE to be lengths above zero, such as 0.25, or shares of the box diagonal, such as 1%",
            })
        };
        let outside = (words.len() == N + 2).then(|| length(N + 1)).transpose()?;
        Ok((numbers, length(N)?, outside))
    }
}

/// A source in input units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ResolvedSource {
    shape: SourceShape,
    inside: f64,
    outside: f64,
}

impl ResolvedSource {
    /// The smallest size of the source.
    pub fn least(&self) -> f64 {
        self.inside.min(self.outside)
    }

    /// The middle of the shape.
    pub fn middle(&self) -> Point {
        match self.shape {
            SourceShape::Box { low, high } => (low + high) * 0.5,
            SourceShape::Sphere { center, .. } => center,
            SourceShape::Cylinder { ends: [a, b], .. } => (a + b) * 0.5,
        }
    }

    /// The size wanted at `p` in a field of slope `beta`.
    #[inline]
    pub fn h(&self, p: Point, beta: f64) -> f64 {
        let depth = self.shape.depth(p);
        // Both branches are the smaller of the two sizes on the shape's boundary.
        if depth >= 0.0 {
            self.inside.min(self.outside + beta * depth)
        } else {
            self.outside.min(self.inside - beta * depth)
        }
    }
}

impl SourceShape {
    /// The shape in input units, for a surface whose box has that diagonal.
    fn resolve(mut self, diagonal: f64) -> Self {
        if let Self::Sphere { radius, .. } | Self::Cylinder { radius, .. } = &mut self {
            *radius = Length::Units(radius.resolve(diagonal));
        }
        self
    }

    /// Distance to the boundary, positive inside. Inside a box and a cylinder it is that to the nearest wall.
    fn depth(&self, p: Point) -> f64 {
        match *self {
            Self::Sphere { center, radius } => radius.resolve(0.0) - p.distance(center),
            Self::Box { low, high } => {
                let walls = (p - low).min(high - p);
                let beyond = (-walls).max(Point::ZERO);
                if beyond == Point::ZERO { walls.min_element() } else { -beyond.length() }
            }
            Self::Cylinder { ends: [a, b], radius } => {
                let axis = b - a;
                let length = axis.length();
                let along = (p - a).dot(axis) / length;
                let radial = radius.resolve(0.0) - (p - a - axis * (along / length)).length();
                let axial = along.min(length - along);
                let beyond = glam::DVec2::new((-radial).max(0.0), (-axial).max(0.0));
                if beyond == glam::DVec2::ZERO { radial.min(axial) } else { -beyond.length() }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_bounded_and_values_are_those_asked_for() {
        let texts = ["-1,-1,-1,1,1,1,0.1,0.7", "0,0,0,1,0.9,0.2"];
        let sources = [
            SizeSource::parse_box(texts[0]),
            SizeSource::parse_sphere(texts[1]),
            SizeSource::parse_cylinder("0,0,-1,0,0.5,1,0.4,0.05"),
            SizeSource::parse_cylinder("0,0,-1,0,0.5,1,0.4,0.5,0.1"),
        ];
        let beta = 0.262;
        for source in sources {
            let source = source.expect("a source").resolve(1.0, 0.0);
            let mut at = Point::new(0.3, -0.2, 0.4);
            let mut before = source.h(at, beta);
            for k in 0..5000 {
                let step = Point::new(
                    f64::from(k * 7 % 11) - 5.0,
                    f64::from(k * 5 % 13) - 6.0,
                    f64::from(k * 3 % 7) - 3.0,
                ) * 0.01;
                at = (at + step).clamp(Point::splat(-3.0), Point::splat(3.0));
                let now = source.h(at, beta);
                // The walk's clamp only shortens steps.
                assert!((now - before).abs() <= beta * step.length() + 1e-12);
                before = now;
            }
        }
        let small = SizeSource::parse_box(texts[0]).expect("a box");
        let small = small.resolve(1.0, 0.0);
        assert_eq!(small.h(Point::ZERO, beta), 0.1);
        assert_eq!(small.h(Point::splat(9.0), beta), 0.7);
        assert_eq!(small.h(Point::new(2.0, 0.0, 0.0), beta), 0.1 + beta);
    }

    #[test]
    fn a_radius_may_be_a_share() {
        for (text, at, radius) in
            [("1,0,0,5%,0.1", 10.0, 0.5), ("0,0,0,0,0.1", 1.0, 0.0), ("0,0,0,2,0.1", 1.0, 2.0)]
        {
            let source = SizeSource::parse_sphere(text).expect(text);
            assert_eq!(source.to_string(), text);
            let SourceShape::Sphere { center, .. } = source.shape else { panic!("{text}") };
            let h = source.resolve(at, 0.0).h(center + Point::new(radius + 1.0, 0.0, 0.0), 0.3);
            assert!((h - 0.4).abs() < 1e-12, "{text}: {h}");
        }
        let text = "0,0,0,1,0,0,2%,0.1,0.2";
        assert_eq!(SizeSource::parse_cylinder(text).map(|s| s.to_string()).as_deref(), Ok(text));
        for text in ["0,0,0,-1%,0.1", "0,0,0,-1,0.1", "0,0,5%,1,0.1"] {
            assert!(SizeSource::parse_sphere(text).is_err(), "{text}");
        }
    }

    #[test]
    fn bad_texts_are_named() {
        for text in ["", "1,2,3", "1,2,3,4,x", "1,2,3,-1,0.1", "1,2,3,4,0", "nan,2,3,4,1"] {
            let error = SizeSource::parse_sphere(text).expect_err(text).to_string();
            assert!(error.contains("size_sphere"), "{error}");
        }
        assert!(SizeSource::parse_cylinder("0,0,0,0,0,0,1,0.1").is_err());
    }
}
