//! Sizes near the triangles of one label.

use std::fmt;

use super::SizingError;
use super::constraint::SizeConstraint;
use super::length::Length;
use tetdb_base::geom::Point;
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::{Seeker, Surface};
use tetdb_schema::labels::labels_within;

/// Cells where lengths begin to grow are at most this many of their lengths wide.
const CELLS_PER_LENGTH: f64 = 2.0;
/// Cells farther away than this many of their widths are not divided: the distance is so nearly linear in them that
/// interpolated lengths are within an eighth. With 3 a small label takes three times as many leaves.
const FAR: f64 = 1.0;

/// A size near the triangles of a label, as asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelSize {
    /// The label.
    pub label: String,
    /// The size on its triangles.
    pub h: Length,
    /// The distance up to which the size holds; `None` if it grows from the triangles on.
    pub distance: Option<Length>,
}

impl LabelSize {
    /// Parses `LABEL,H` or `LABEL,H,DISTANCE`; a label may have commas, and a distance may be 0.
    ///
    /// # Errors
    /// Names the option and the value.
    pub fn parse(text: &str) -> Result<Self, SizingError> {
        let bad = || SizingError::BadValue {
            option: "size_label",
            found: text.to_owned(),
            expected: "LABEL,H or LABEL,H,DISTANCE, such as inlet,0.05 or inlet,0.05,0.2",
        };
        let length = |text: &str| Length::parse("size_label", text).ok();
        let split = |text: &str| {
            let (label, last) = text.rsplit_once(',')?;
            (!label.trim().is_empty()).then(|| (label.trim().to_owned(), last.trim().to_owned()))
        };
        let (label, last) = split(text).ok_or_else(bad)?;
        let is_zero = last.parse() == Ok(0.0);
        let distance = length(&last);
        if distance.is_none() && !is_zero {
            return Err(bad());
        }
        match (split(&label).and_then(|(label, h)| Some((label, length(&h)?))), distance) {
            (Some((label, h)), distance) => Ok(Self { label, h, distance }),
            (None, Some(h)) => Ok(Self { label, h, distance: None }),
            (None, None) => Err(bad()),
        }
    }

    /// # Errors
    /// Names the option and the value.
    pub(super) fn check(&self) -> Result<(), SizingError> {
        self.h.check("size_label")?;
        self.distance.map_or(Ok(()), |distance| distance.check("size_label"))
    }
}

impl fmt::Display for LabelSize {
    /// As [`LabelSize::parse`] reads it. A distance of 0 keeps a number at the end of a label apart from the size.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.label, self.h)?;
        let end = self.label.rsplit_once(',').map(|(_, end)| end);
        match (self.distance, end) {
            (Some(distance), _) => write!(f, ",{distance}"),
            (None, Some(end)) if Length::parse("size_label", end).is_ok() => f.write_str(",0"),
            (None, _) => Ok(()),
        }
    }
}

/// A length on the triangles of a label, and up to a distance from them; beyond, it grows as the gradation allows.
pub struct NearLabel<'a> {
    triangles: Seeker<'a>,
    h: f64,
    distance: f64,
    beta: f64,
}

impl<'a> NearLabel<'a> {
    /// The sizes for labels of a surface, in a field of slope `beta`. A scratch file that fails unwinds.
    ///
    /// # Errors
    /// A label that no triangle has.
    pub fn all(
        surface: &'a Surface,
        sizes: &[LabelSize],
        beta: f64,
        scratch: &ScratchSpace,
    ) -> Result<Vec<Self>, SizingError> {
        let diagonal = surface.bounds().diagonal();
        let one = |size: &LabelSize| {
            let of_name = surface.label_names.iter().position(|name| *name == size.label);
            let labels = of_name
                .map(|label| labels_within(&surface.label_sets, label as u32))
                .unwrap_or_default();
            let is_here = |t: u32| labels.contains(&surface.labels[t as usize]);
            let n = surface.n_input_triangles() as u32;
            if !(0..n).any(is_here) {
                return Err(SizingError::BadLabel {
                    found: size.label.clone(),
                    expected: list_of_labels(surface),
                });
            }
            Ok(Self {
                triangles: Seeker::with_filter(surface, scratch, |t| t < n && is_here(t)),
                h: size.h.resolve(diagonal),
                distance: size.distance.map_or(0.0, |distance| distance.resolve(diagonal)),
                beta,
            })
        };
        sizes.iter().map(one).collect()
    }
}

/// The first labels of a surface, for messages.
pub fn list_of_labels(surface: &Surface) -> String {
    /// Largest number of names listed.
    const LISTED: usize = 12;
    let names = &surface.label_names;
    let mut list = names[..names.len().min(LISTED)].join(", ");
    if names.len() > LISTED {
        list += ", …";
    }
    list
}

impl SizeConstraint for NearLabel<'_> {
    fn h(&self, p: Point) -> Result<f64, SizingError> {
        let away = self.triangles.distance(p, f64::INFINITY) - self.distance;
        Ok(self.h + self.beta * away.max(0.0))
    }

    fn option(&self) -> Option<&'static str> {
        Some("size_label")
    }

    fn divides(&self, middle: Point, width: f64) -> Option<bool> {
        let half = 0.5 * 3f64.sqrt() * width;
        let reach = half + FAR * width;
        let away = self.triangles.distance(middle, self.distance + reach) - self.distance;
        let least = self.h + self.beta * (away - half).max(0.0);
        // Lengths are the same in a cell that lies within the distance.
        Some(away > -half && away < reach && width > CELLS_PER_LENGTH * least)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ExtraSizes, SizeField, SizeOptions};
    use super::*;

    #[test]
    fn texts_come_back_and_labels_may_have_commas() {
        let of = |label: &str, h, distance| LabelSize { label: label.to_owned(), h, distance };
        let (tenth, share) = (Length::units(0.1), Length::percent(2.0));
        for (text, size) in [
            ("wall,0.1", of("wall", tenth, None)),
            ("wall,0.1,2%", of("wall", tenth, Some(share))),
            ("inner, wet wall,2%", of("inner, wet wall", share, None)),
            ("3,0.1", of("3", tenth, None)),
            ("a,3,0.1,0", of("a,3", tenth, None)),
            ("a,3,0.1,2%", of("a,3", tenth, Some(share))),
        ] {
            assert_eq!(LabelSize::parse(text).as_ref(), Ok(&size), "{text}");
            assert_eq!(size.to_string(), text);
        }
        for text in ["", "wall", "wall,", ",0.1", "wall,0", "wall,-1", "wall,0.1,-1", "wall,nan"] {
            let error = LabelSize::parse(text).expect_err(text).to_string();
            assert!(error.contains("size_label") && error.contains("LABEL,H"), "{error}");
        }
    }

    /// A cube of side 4 with long triangles; that below has the label `floor`.
    fn cube() -> Surface {
        let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2].map(f64::from);
        let faces =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
        Surface {
            points: (0..8).map(|i| Point::from_array(corner(i)) * 4.0).collect(),
            triangles: faces.into_iter().flat_map(halves).collect(),
            labels: (0..12).map(|t| u32::from(t > 1)).collect(),
            label_names: vec!["floor".to_owned(), "rest".to_owned()],
            ..Surface::default()
        }
    }

    #[test]
    fn lengths_follow_the_distance() {
        let (surface, scratch) = (cube(), ScratchSpace::boundless());
        for (text, distance) in
            [("floor,0.05", 0.0), ("floor,0.05,0.7", 0.7), ("floor,0.3,1.1", 1.1)]
        {
            let size = LabelSize::parse(text).expect("a size");
            let h = size.h.resolve(1.0);
            let options = SizeOptions { labels: vec![size], ..SizeOptions::default() };
            let near = NearLabel::all(&surface, &options.labels, options.beta(), &scratch)
                .expect("a known label");
            let list: Vec<&dyn SizeConstraint> =
                near.iter().map(|near| near as &dyn SizeConstraint).collect();
            let extra = ExtraSizes { constraints: &list, ..ExtraSizes::default() };
            let (points, triangles) = (&surface.points, &surface.triangles);
            let built = SizeField::build_with(points, triangles, &options, &extra, &scratch);
            let (field, summary) = built.expect("a field");
            assert!(summary.source.starts_with("1 label, "), "{}", summary.source);
            for k in 0..4000 {
                let at = |step: i32| 4.0 * f64::from(k * step % 997) / 996.0;
                let p = Point::new(at(7), at(31), at(57));
                let wanted = h + options.beta() * (p.z - distance).max(0.0);
                let ratio = field.h(p) / wanted;
                assert!((0.99..1.15).contains(&ratio), "{text} at {p}: {ratio}");
            }
        }
    }

    #[test]
    fn an_unknown_label_is_refused_with_those_there_are() {
        let labels = vec![LabelSize::parse("flor,1").expect("a size")];
        let surface = cube();
        let near = NearLabel::all(&surface, &labels, 0.3, &ScratchSpace::boundless());
        let error = near.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains("flor") && error.contains("floor, rest"), "{error}");
    }
}
