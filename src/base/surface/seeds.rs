//! Points that mark the volume around them as a region with a name, or as a hole.

use std::fmt;

use crate::geom::Point;

/// A point inside a volume, and its meaning for the volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Seed {
    /// Position of the seed.
    pub point: Point,
    /// Region or hole.
    pub kind: SeedKind,
}

/// Meaning of a [`Seed`] for the volume around it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SeedKind {
    /// A filled volume, with its name.
    Region(Option<String>),
    /// A hole: the volume stays empty.
    Hole,
}

impl Seed {
    /// `X,Y,Z` or `X,Y,Z,NAME`; the name is the rest and may have commas.
    pub fn parse_region(text: &str) -> Option<Self> {
        let mut words = text.splitn(4, ',');
        let point = point_of(words.by_ref().take(3))?;
        let name = words.next().map(str::trim).filter(|name| !name.is_empty());
        let kind = SeedKind::Region(name.map(str::to_owned));
        Some(Self { point, kind })
    }

    /// `X,Y,Z`.
    pub fn parse_hole(text: &str) -> Option<Self> {
        let point = point_of(text.split(','))?;
        let kind = SeedKind::Hole;
        Some(Self { point, kind })
    }

    /// A seed of a file: `name` is that of the region, nothing, or `hole`.
    pub fn named(point: Point, name: &str) -> Self {
        let kind = match name {
            "hole" => SeedKind::Hole,
            "" => SeedKind::Region(None),
            name => SeedKind::Region(Some(name.to_owned())),
        };
        Self { point, kind }
    }
}

/// As it is typed.
impl fmt::Display for Seed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.point.to_array();
        write!(f, "{x},{y},{z}")?;
        match &self.kind {
            SeedKind::Region(Some(name)) => write!(f, ",{name}"),
            _ => Ok(()),
        }
    }
}

/// Three finite numbers and nothing else.
fn point_of<'a>(words: impl Iterator<Item = &'a str>) -> Option<Point> {
    let numbers: Option<Vec<f64>> =
        words.map(|word| word.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    Some(Point::from_array(numbers?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_come_back_as_they_are_typed() {
        for text in ["0.5,0.25,-1", "1,2,3,rock", "1,2,3,salt, wet"] {
            let seed = Seed::parse_region(text).expect("a seed");
            assert_eq!(seed.to_string(), text);
        }
        assert_eq!(Seed::named(Point::ZERO, "hole").kind, SeedKind::Hole);
        for text in ["", "1,2", "1,2,x,rock", "1,nan,2"] {
            assert_eq!(Seed::parse_region(text), None, "{text}");
        }
        assert_eq!(Seed::parse_hole("1,2,3,rock"), None);
    }
}
