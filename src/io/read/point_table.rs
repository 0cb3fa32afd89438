//! Text files of points: three numbers a line and at most a name, or four numbers where sizes are read.
//!
//! The separator (comma, semicolon, tab or blanks), the decimal mark and the order of columns are decided once, from all
//! lines: each combination is tried, and those that fit every line are left. If they differ in any value, the file is
//! refused with both readings. A first line may name the columns: `x`, `y`, `z`, `name` (or `label`), `id`, `h`, in any
//! order, with units in brackets; it may be a comment. Comments begin with `#` at the start of a line, or with a `#`
//! between blanks.

use std::path::Path;

use super::error::{FilePlace, ReadError, ReadFault};
use super::feed::{Feed, Result, name, quote};
use super::open::{Reader, open};

/// The columns that a file of points must have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointColumns {
    /// Three coordinates, and a name or not.
    Named,
    /// Three coordinates and a length.
    Sized,
}

/// One line of a file of points.
#[derive(Clone, Debug, PartialEq)]
pub struct PointRow {
    /// The coordinates, and the length where there is one.
    pub numbers: [f64; 4],
    /// The name, or nothing.
    pub name: String,
    /// Where the line is.
    pub place: FilePlace,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Meaning {
    Number(usize),
    Name,
    /// Whole numbers count the lines and say nothing else; other words are names if no column is.
    Id,
}

/// One way to read all lines.
#[derive(Clone, Debug)]
struct Dialect {
    /// A space stands for any number of blanks and tabs, each word with or without a comma behind it.
    separator: char,
    decimal_comma: bool,
    columns: Vec<Meaning>,
    /// A name may follow the columns.
    is_open: bool,
}

/// The values of a line, before the file is known to have no other reading.
type PointValues = ([f64; 4], String);

/// Why a line does not fit a dialect.
#[derive(Clone)]
enum Misfit {
    TooFew(usize),
    NoNumber(String),
    TooMany,
}

const SEPARATORS: [char; 4] = [';', '\t', ',', ' '];

impl Dialect {
    fn fields<'t>(&self, text: &'t str) -> Vec<&'t str> {
        let mut quoted = false;
        let fields = text.split(|c: char| {
            quoted ^= c == '"';
            !quoted && (c == self.separator || self.separator == ' ' && c.is_whitespace())
        });
        let fields = fields.map(str::trim);
        fields.filter(|f| self.separator != ' ' || !f.is_empty()).collect()
    }

    fn number(&self, word: &str) -> Option<f64> {
        let word = match self.separator {
            ' ' => word.strip_suffix(',').unwrap_or(word),
            _ => word.trim_matches('"').trim(),
        };
        let number = match self.decimal_comma {
            true if word.contains('.') => None,
            true => word.replacen(',', ".", 1).parse().ok(),
            false => word.parse().ok(),
        };
        number.filter(|x: &f64| x.is_finite())
    }

    fn values(&self, text: &str) -> std::result::Result<PointValues, Misfit> {
        let fields = self.fields(text);
        let mut values = ([0.0; 4], String::new());
        let name_of = |words: &[&str]| {
            name(words.join(" ").as_bytes()).trim_matches('"').replace("\"\"", "\"")
        };
        for (k, column) in self.columns.iter().enumerate() {
            match (fields.get(k), column) {
                (None, Meaning::Name) => {}
                (None, _) => return Err(Misfit::TooFew(k)),
                (Some(word), Meaning::Number(axis)) => {
                    let number = self.number(word);
                    values.0[*axis] = number.ok_or_else(|| Misfit::NoNumber((*word).to_owned()))?;
                }
                (Some(word), Meaning::Name) => values.1 = name_of(&[word]),
                (Some(_), Meaning::Id) => {}
            }
        }
        let rest = fields.get(self.columns.len()..).unwrap_or_default();
        let rest = &rest[..rest.iter().rposition(|f| !f.is_empty()).map_or(0, |k| k + 1)];
        let ends_with_name = self.columns.last() == Some(&Meaning::Name);
        match (rest.len(), self.separator) {
            (0, _) => {}
            (1, _) if self.is_open => values.1 = name_of(rest),
            (_, ' ') if self.is_open => values.1 = name_of(rest),
            (_, ' ') if ends_with_name => values.1 = name_of(&fields[self.columns.len() - 1..]),
            _ => return Err(Misfit::TooMany),
        }
        Ok(values)
    }

    /// The word of the column `id`, if it is no whole number.
    fn named_by_id(&self, text: &str) -> bool {
        let id = self.columns.iter().position(|c| *c == Meaning::Id);
        let fields = self.fields(text);
        id.and_then(|k| fields.get(k)).is_some_and(|word| word.parse::<i64>().is_err())
    }

    /// The dialects in which `text` names the columns. Errors: a column that has no meaning.
    fn from_heading(text: &str, columns: PointColumns) -> std::result::Result<Vec<Self>, String> {
        let mut bare = String::new();
        let mut depth = 0;
        for c in text.chars() {
            depth += i32::from(matches!(c, '[' | '('));
            if depth == 0 {
                bare.extend(c.to_lowercase());
            }
            depth -= i32::from(matches!(c, ']' | ')'));
        }
        let mut found = Vec::new();
        let mut unknown = None;
        for separator in SEPARATORS {
            let mut dialect =
                Self { separator, decimal_comma: false, columns: Vec::new(), is_open: false };
            let mut other = None;
            let fields = dialect.fields(&bare);
            for field in fields.iter().map(|f| f.trim_end_matches(',').trim_matches('"').trim()) {
                let column = match field {
                    "x" | "points:0" | "points_0" => Meaning::Number(0),
                    "y" | "points:1" | "points_1" => Meaning::Number(1),
                    "z" | "points:2" | "points_2" => Meaning::Number(2),
                    "h" | "size" | "length" if columns == PointColumns::Sized => Meaning::Number(3),
                    "name" | "label" | "group" => Meaning::Name,
                    "id" | "nr" | "no" | "number" | "index" => Meaning::Id,
                    _ => {
                        other.get_or_insert_with(|| field.to_owned());
                        continue;
                    }
                };
                if dialect.columns.contains(&column) {
                    other.get_or_insert_with(|| format!("{field} twice"));
                }
                dialect.columns.push(column);
            }
            let n = if columns == PointColumns::Sized { 4 } else { 3 };
            if (0..n).any(|axis| !dialect.columns.contains(&Meaning::Number(axis))) {
                continue;
            }
            if other.is_some() {
                unknown = unknown.or(other);
                continue;
            }
            dialect.is_open = !dialect.columns.contains(&Meaning::Name) && n == 3;
            found.push(dialect);
        }
        match unknown {
            Some(unknown) if found.is_empty() => Err(unknown),
            _ => Ok(found),
        }
    }

    /// All dialects of files that do not name their columns, the usual ones first.
    fn unnamed(columns: PointColumns) -> Vec<Self> {
        let numbers = |n| (0..n).map(Meaning::Number).collect::<Vec<_>>();
        let layouts = match columns {
            PointColumns::Named => {
                vec![(numbers(3), true), ([vec![Meaning::Name], numbers(3)].concat(), false)]
            }
            PointColumns::Sized => vec![(numbers(4), false)],
        };
        let dialect = |(columns, is_open): (Vec<Meaning>, bool)| {
            SEPARATORS.map(|separator| Self {
                separator,
                decimal_comma: false,
                columns: columns.clone(),
                is_open,
            })
        };
        layouts.into_iter().flat_map(dialect).collect()
    }

    /// Each dialect with either decimal mark.
    fn with_marks(dialects: Vec<Self>) -> Vec<Self> {
        let comma = dialects.iter().filter(|d| d.separator != ',').cloned();
        let comma: Vec<_> = comma.map(|d| Self { decimal_comma: true, ..d }).collect();
        [dialects, comma].concat()
    }

    /// A line as this dialect reads it, in words.
    fn show(&self, (numbers, name): &PointValues) -> String {
        let words = self.columns.iter().filter_map(|column| match column {
            Meaning::Number(axis) => {
                Some(format!("{} {}", ["x", "y", "z", "h"][*axis], numbers[*axis]))
            }
            Meaning::Name if name.is_empty() => None,
            Meaning::Name => Some(format!("name or number {name}")),
            Meaning::Id => None,
        });
        let mut words: Vec<String> = words.collect();
        if self.is_open && !name.is_empty() {
            words.push(format!("name {name}"));
        }
        words.join(", ")
    }
}

/// A file of points, read line by line in the one dialect that fits all its lines.
pub struct PointTable {
    feed: Feed<Reader>,
    columns: PointColumns,
    /// Nothing before the first line of points is found.
    dialect: Option<Dialect>,
    /// The line that names the columns.
    heading: Option<u64>,
    line: Vec<u8>,
}

impl PointTable {
    /// Opens a file, which is read to its end to decide how. Pipes and packed files are held in at most `limit` bytes.
    ///
    /// # Errors
    /// The first line that does not fit where no dialect fits all; a line with two readings.
    pub fn open(path: &Path, columns: PointColumns, limit: u64) -> Result<Self> {
        let feed = open(path, limit)?;
        let mut table = Self { feed, columns, dialect: None, heading: None, line: Vec::new() };
        table.decide()?;
        table.feed.rewind()?;
        Ok(table)
    }

    /// The next line that is neither empty nor a comment, and its place.
    fn text(&mut self) -> Result<Option<(String, FilePlace)>> {
        loop {
            let place = self.feed.place();
            self.line.clear();
            if !self.feed.read_line(&mut self.line)? {
                return Ok(None);
            }
            let text = String::from_utf8_lossy(&self.line);
            let end = [" # ", "\t# "].iter().filter_map(|mark| text.find(mark)).min();
            let text = text[..end.unwrap_or(text.len())].trim();
            let is_heading = self.heading.is_some_and(|line| place.spot == super::Spot::Line(line));
            let comment = text.strip_prefix('#');
            if text.is_empty() || is_heading {
                continue;
            }
            match comment {
                None => return Ok(Some((text.to_owned(), place))),
                // A comment may name the columns of the lines after it.
                Some(words) if self.heading.is_none() => {
                    if let Ok([_, ..]) = Dialect::from_heading(words, self.columns).as_deref() {
                        return Ok(Some((words.to_owned(), place)));
                    }
                }
                Some(_) => {}
            }
        }
    }

    /// Decides the dialect from all lines.
    fn decide(&mut self) -> Result<()> {
        let Some((first, first_place)) = self.text()? else {
            return Ok(());
        };
        let named = Dialect::from_heading(&first, self.columns);
        let named = named.map_err(|column| self.bad_column(&column, &first_place))?;
        let is_named = !named.is_empty();
        let mut left = Dialect::with_marks(match is_named {
            true => named,
            false => Dialect::unnamed(self.columns),
        });
        // From here on, comments name no columns.
        self.heading = match first_place.spot {
            super::Spot::Line(line) if is_named => Some(line),
            _ => Some(0),
        };
        let mut next = if is_named { self.text()? } else { Some((first, first_place.clone())) };
        let mut named_by_id = vec![false; left.len()];
        while let Some((text, place)) = next {
            let fits: Vec<bool> = left.iter().map(|d| d.values(&text).is_ok()).collect();
            if !fits.contains(&true) {
                return Err(self.misfit(&left, &text, &place));
            }
            let mut keep = fits.iter();
            named_by_id =
                named_by_id.into_iter().zip(&fits).filter(|(_, f)| **f).map(|(n, _)| n).collect();
            left.retain(|_| *keep.next().unwrap_or(&false));
            for (is_name, dialect) in named_by_id.iter_mut().zip(&left) {
                *is_name |= dialect.named_by_id(&text);
            }
            next = self.text()?;
        }
        for (dialect, is_name) in left.iter_mut().zip(named_by_id) {
            let id = dialect.columns.iter_mut().find(|c| **c == Meaning::Id).filter(|_| is_name);
            if let Some(id) = id.filter(|_| dialect.is_open) {
                (*id, dialect.is_open) = (Meaning::Name, false);
            }
        }
        self.refuse_two_readings(&left)?;
        self.dialect = left.into_iter().next();
        Ok(())
    }

    /// Refuses the first line that the dialects left read differently.
    fn refuse_two_readings(&mut self, left: &[Dialect]) -> Result<()> {
        let [best, others @ ..] = left else {
            return Ok(());
        };
        if others.is_empty() {
            return Ok(());
        }
        self.feed.rewind()?;
        while let Some((text, place)) = self.text()? {
            let Ok(values) = best.values(&text) else {
                continue;
            };
            for other in others {
                if let Some(second) = other.values(&text).ok().filter(|second| *second != values) {
                    let readings = [best.show(&values), other.show(&second)];
                    let line = quote(text.as_bytes());
                    return Err(place.refuse(ReadFault::TwoReadings { line, readings }));
                }
            }
        }
        Ok(())
    }

    fn bad_column(&self, column: &str, place: &FilePlace) -> ReadError {
        let expected = match self.columns {
            PointColumns::Named => "columns x, y, z, name and id",
            PointColumns::Sized => "columns x, y, z and h",
        };
        let found = quote(column.as_bytes());
        place.refuse(ReadFault::Unexpected { expected: expected.to_owned(), found })
    }

    /// The error of a line that fits none of the dialects that fit all lines before it.
    fn misfit(&self, left: &[Dialect], text: &str, place: &FilePlace) -> ReadError {
        let expected = match self.columns {
            PointColumns::Named => "three numbers and at most a name",
            PointColumns::Sized => "three coordinates and a length",
        };
        // The dialect that reads most of the line; of several the first.
        let n_numbers = |d: &Dialect| {
            let fields = d.fields(text);
            fields.iter().take(4).filter(|f| d.number(f).is_some()).count()
        };
        let best = left.iter().rev().max_by_key(|d| n_numbers(d));
        let misfit = best.and_then(|d| d.values(text).err()).unwrap_or(Misfit::TooMany);
        let unexpected = |expected: &str, found: String| {
            place.refuse(ReadFault::Unexpected { expected: expected.to_owned(), found })
        };
        let line = quote(text.as_bytes());
        match misfit {
            Misfit::NoNumber(_) if best.is_some_and(|d| n_numbers(d) == 0) => unexpected(
                &format!("{expected}, or a line that names the columns x, y and z"),
                line,
            ),
            Misfit::NoNumber(word) => {
                let found = format!("{} in {line}", quote(word.as_bytes()));
                place.refuse(ReadFault::NotANumber { what: "a coordinate", found })
            }
            Misfit::TooFew(n) => {
                let found = format!("only {n} columns in {line}");
                place.refuse(ReadFault::NotANumber { what: "a coordinate", found })
            }
            Misfit::TooMany => unexpected(expected, line),
        }
    }
}

impl Iterator for PointTable {
    type Item = Result<PointRow>;

    fn next(&mut self) -> Option<Self::Item> {
        let dialect = self.dialect.clone()?;
        let (text, place) = match self.text() {
            Ok(text) => text?,
            Err(error) => return Some(Err(error)),
        };
        let Ok((numbers, name)) = dialect.values(&text) else {
            // The file changed since it was read to its end.
            return Some(Err(self.misfit(&[dialect], &text, &place)));
        };
        for x in numbers {
            if self.feed.checked(x).is_err() {
                return Some(Err(place.refuse(ReadFault::CoordinateRange(x))));
            }
        }
        Some(Ok(PointRow { numbers, name, place }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<(Vec<f64>, String)>> {
        read_as(text, PointColumns::Named)
    }

    fn read_as(text: impl AsRef<[u8]>, columns: PointColumns) -> Result<Vec<(Vec<f64>, String)>> {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("p.csv");
        std::fs::write(&path, text).expect("the folder takes files");
        let n = if columns == PointColumns::Sized { 4 } else { 3 };
        let table = PointTable::open(&path, columns, 1 << 20)?;
        table.map(|row| row.map(|r| (r.numbers[..n].to_vec(), r.name))).collect()
    }

    #[test]
    fn one_point_is_the_same_in_every_dialect() {
        let expected = vec![(vec![1.5, -2.25, 3e2], "north 1".to_owned())];
        for text in [
            "1.5,-2.25,3e2,north 1",
            "1.5, -2.25, 3e2, north 1\n\n",
            "1,5;-2,25;3e2;north 1\r\n",
            "1.5;-2.25;3e2;\"north 1\"",
            "1.5 -2.25  300 north 1 # a remark",
            "1,5 -2,25 300 north 1",
            "1,5\t-2,25\t300\tnorth 1",
            "1.5, -2.25\t300 north 1",
            "# written by hand\nX [m];Y [m];Z (m);Label\n1,5;-2,25;300;north 1",
            "id,z,y,x,name\n7,300,-2.25,1.5,north 1",
            "\u{feff}x y z name\n1.5 -2.25 300 north 1",
            "# x, y, z\n1.5,-2.25,300,north 1",
            "# name,x,y,z\nnorth 1,1.5,-2.25,300",
            "north 1;1,5;-2,25;300",
            "id;x;y;z\nnorth 1;1,5;-2,25;300",
            "\"Points:0\",\"Points:1\",\"Points:2\",\"name\"\n1.5,-2.25,300,north 1,,",
        ] {
            assert_eq!(read(text).unwrap_or_else(|e| panic!("{text}: {e}")), expected, "{text}");
        }
        let wide: Vec<u8> =
            "\u{feff}x;y;z\r\n1,5;2;3\r\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let found = read_as(wide, PointColumns::Named).expect("UTF-16");
        assert_eq!(found, [(vec![1.5, 2.0, 3.0], String::new())]);
        assert_eq!(read("1 2 3\r4 5 6\r").expect("lines that end in CR").len(), 2);
        assert_eq!(read("# nothing\n").expect("no points"), []);
    }

    #[test]
    fn the_dialect_comes_from_all_lines() {
        // Only the second line shows that the first word is a name.
        let found = read("7 1.5 2.5 3.5\nB 4.5 5.5 6.5\n").expect("names first");
        assert_eq!(found[0], (vec![1.5, 2.5, 3.5], "7".to_owned()));
        // Only the second line shows that the last word is a name.
        let found = read("1 2 3 4\n5 6 7 east\n").expect("names last");
        assert_eq!(found[0], (vec![1.0, 2.0, 3.0], "4".to_owned()));
        // An id of the heading is a number of the line, and no name.
        let found = read("ID x y z\n1 10 20 30\n2 11 21 31\n").expect("ids");
        assert_eq!(found[1], (vec![11.0, 21.0, 31.0], String::new()));
        let sized = read_as("x;y;h;z\n1;2;0,5;3\n", PointColumns::Sized).expect("sizes");
        assert_eq!(sized[0].0, [1.0, 2.0, 3.0, 0.5]);
        assert_eq!(read_as("1 2 3 .5\n", PointColumns::Sized).expect("sizes")[0].0[3], 0.5);
    }

    #[test]
    fn what_has_two_readings_or_none_is_refused_at_its_line() {
        for (text, line, words) in [
            ("1 10.5 20.5 30.5\n", 1, "name 30.5` or `name or number 1, x 10.5"),
            ("# a\n1,1,2,3\n2,4,5,6\n", 2, "x 1, y 1, z 2, name 3"),
            ("0;1,5;2,5;3,5\n1;1,5;2,5;3,5", 1, "name 3,5"),
            ("1,5,2,5,3,5\n", 1, "three numbers and at most a name"),
            ("1,5;2;3\n1.5;2;3\n", 2, "a coordinate"),
            ("1 2 3\n1;2;3\n", 2, "`1;2;3`"),
            ("1 2\n", 1, "only 2 columns"),
            ("1 2 nan\n", 1, "`nan`"),
            ("1.000,5;2;3\n", 1, "`1.000,5`"),
            ("OFF\n8 12 0\n", 1, "x, y and z"),
            ("easting,northing,height\n1,2,3\n", 1, "x, y and z"),
            ("x,y,z,temperature\n1,2,3,4\n", 1, "`temperature`"),
            ("x,y,z,name\n1,2,3,a,b\n", 2, "at most a name"),
            ("1 2 1e31\n", 1, "too large"),
        ] {
            let error = read(text).err().unwrap_or_else(|| panic!("{text} is read"));
            assert_eq!(error.place().spot, super::super::Spot::Line(line), "{text}: {error}");
            assert!(error.to_string().contains(words), "{text}: {error}");
        }
        assert!(read_as("1 2 3\n", PointColumns::Sized).is_err());
        assert!(read_as("1 2 3 4 5\n", PointColumns::Sized).is_err());
    }
}
