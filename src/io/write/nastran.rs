//! Nastran bulk data: CTETRA with a PSOLID for each region, CTRIA3 with a PSHELL for each label, numbered from 1.
//!
//! A coordinate has 16 characters (long fields), so it is the nearest number of 11 to 15 digits: of all formats here this one alone rounds. A
//! PSOLID names the material of its own number, which is left to the user, and a PSHELL names none. A triangle of several groups has the property
//! of its combination. Source: the MSC Nastran quick reference guide; midpoints have VTK's order.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::{Result, WriteError};
use super::merged::Merged;
use super::midpoints::Midpoints;
use super::output_files::OutputFiles;
use super::stream::Stream;

/// Greatest number of a node, an element or a property.
const NUMBER_MAX: u64 = 99_999_999;
/// Characters of a long field.
const WIDTH: usize = 16;

pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    midpoints: Option<&Midpoints>,
) -> Result<()> {
    let n_midpoints = midpoints.map_or(0, Midpoints::n);
    mesh.check_limits(out, NUMBER_MAX, n_midpoints)?;
    mesh.expect_passes(1, 1);
    let regions = mesh.regions()?;
    let first_shell = regions.last().copied().unwrap_or_default() + 1;
    let labels = mesh.labels();
    let last = labels.keys().next_back().copied().unwrap_or_default();
    let found = u64::from(first_shell) + u64::from(last);
    if found > NUMBER_MAX {
        let (path, what, limit) = (out.to_owned(), "regions and labels", NUMBER_MAX);
        return Err(WriteError::TooLarge { path, what, limit, found });
    }
    let bytes_each = if midpoints.is_some() { 112 } else { 56 };
    let bytes = 90 * (mesh.n_vertices() + n_midpoints) + bytes_each * mesh.n_tets();
    let path = outputs.create(out, bytes)?;
    let mut stream = Stream::open(&path)?;
    for line in mesh.origin()? {
        stream.text(&format!("$ {line}\n"));
    }
    stream.text("CEND\nBEGIN BULK\n");
    let names = regions.into_iter().map(|region| (region, mesh.region_name(region)));
    properties(&mut stream, "PSOLID", 0, names.collect())?;
    properties(&mut stream, "PSHELL", first_shell, labels)?;

    let mut grid = |number: u64, point: [f64; 3]| {
        let [x, y, z] = point.map(long_field);
        stream.text("GRID*   ");
        stream.integer_padded(number + 1, 2 * WIDTH);
        stream.text(&format!("{x:WIDTH$}{y}\n*       {z}\n"));
        stream.end()
    };
    mesh.vertices(|number, vertex| grid(number, vertex.point))?;
    if let Some(midpoints) = midpoints {
        for (number, point) in (mesh.n_vertices()..).zip(midpoints.points()?) {
            grid(number, point?)?;
        }
    }
    elements(mesh, &mut stream, first_shell, midpoints)?;
    stream.text("ENDDATA\n");
    stream.finish()
}

/// A property for each region or label, numbered after `first`, with its name in a comment.
fn properties(
    stream: &mut Stream,
    card: &str,
    first: u32,
    names: BTreeMap<u32, String>,
) -> Result<()> {
    for (number, name) in names {
        let (id, name) = (first + number, name.replace(['\n', '\r'], " "));
        let material = if card == "PSOLID" { format!("{id:<8}{id}") } else { id.to_string() };
        stream.text(&format!("$ {card} {id}: {name}\n{card:<8}{material}\n"));
        stream.end()?;
    }
    Ok(())
}

fn elements(
    mesh: &mut Merged,
    stream: &mut Stream,
    first_shell: u32,
    midpoints: Option<&Midpoints>,
) -> Result<()> {
    let first_midpoint = mesh.n_vertices();
    let mut number = 0;
    let mut put = |card: &str, property: u32, nodes: &mut dyn Iterator<Item = u64>| {
        number += 1;
        stream.text(card);
        stream.integer_padded(number, 8);
        stream.integer_padded(property.into(), 8);
        for (i, node) in nodes.enumerate() {
            // A line has six nodes.
            if i == 6 {
                stream.text("\n+       ");
            }
            stream.integer_padded(node + 1, 8);
        }
        stream.text("\n");
        stream.end()
    };
    let mut edges = midpoints.map(Midpoints::tets).transpose()?;
    mesh.tets(|tet| {
        let edges = edges.as_mut().map(|edges| edges.next()).transpose()?;
        let edges = edges.into_iter().flatten().map(|edge| first_midpoint + edge);
        put("CTETRA  ", tet.region, &mut tet.nodes.into_iter().chain(edges))
    })?;
    let card = if midpoints.is_some() { "CTRIA6  " } else { "CTRIA3  " };
    let mut edges = midpoints.map(Midpoints::faces).transpose()?;
    mesh.faces().each(|face| {
        let edges = edges.as_mut().map(|edges| edges.next()).transpose()?;
        let edges = edges.into_iter().flatten().map(|edge| first_midpoint + edge);
        put(card, first_shell + face.label, &mut face.vertices.into_iter().chain(edges))
    })
}

/// The nearest number of up to 16 characters, with a point; an exponent follows the digits by its sign, without a letter.
fn long_field(x: f64) -> String {
    let (size, sign) = (x.abs(), if x.is_sign_negative() { "-" } else { "" });
    if size == 0.0 {
        return format!("{sign}0.");
    }
    let width = WIDTH - sign.len();
    let exponent = size.log10().floor() as i32;
    // Below 0.001 a number with an exponent has more digits.
    let is_plain = (-3..width as i32 - 2).contains(&exponent);
    // One more than there may be space for, since the logarithm is rounded.
    let most = if is_plain { width as i32 - 1 - exponent.max(0) } else { width as i32 - 3 };
    for digits in (1..=most as usize).rev() {
        let (number, exponent) = match is_plain {
            true => (format!("{size:.digits$}"), String::new()),
            false => {
                let text = format!("{size:.digits$e}");
                let (number, exponent) = text.split_once('e').expect("it has an exponent");
                let plus = if exponent.starts_with('-') { "" } else { "+" };
                (number.to_owned(), format!("{plus}{exponent}"))
            }
        };
        let number = number.strip_prefix("0.").map_or(number.clone(), |rest| format!(".{rest}"));
        if number.len() + exponent.len() <= width {
            return format!("{sign}{}{exponent}", number.trim_end_matches('0'));
        }
    }
    unreachable!("a digit behind the point and an exponent have less than {WIDTH} characters")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number that a reader of bulk data makes of a field.
    fn read(field: &str) -> f64 {
        let signed = field.rfind(['+', '-']).filter(|&at| at > 0);
        let number = match signed {
            Some(at) => format!("{}e{}", &field[..at], &field[at..]),
            None => field.to_owned(),
        };
        number.parse().expect("a number")
    }

    #[test]
    fn coordinates_are_rounded_to_the_nearest_field() {
        for (x, text) in [
            (0.0, "0."),
            (-1.5, "-1.5"),
            (0.25, ".25"),
            (1.0 / 3.0, ".333333333333333"),
            (-2.0 / 3.0, "-.66666666666667"),
            (0.001, ".001"),
            (1.0 / 3.0e4, "3.333333333333-5"),
            (1e20, "1.+20"),
            (-1e300, "-1.+300"),
            (f64::from_bits(1), "4.9406564584-324"),
            (99_999_999_999_999.96, "1.+14"),
            (9_999_999_999_999.96, "9999999999999.96"),
            (99_999_999_999_999.4, "99999999999999.4"),
        ] {
            let field = long_field(x);
            assert!(field.len() <= WIDTH, "{field}");
            assert_eq!(field, text, "{x:e}");
            assert!((read(&field) - x).abs() <= 1e-11 * x.abs(), "{field} of {x:e}");
        }
        // Every power of ten, on both sides: eleven digits or more where the exponent has two.
        for exponent in -99..100 {
            for x in [9.999999999999995, 1.0, 1.234567890123456, 1.0000000000000002] {
                for x in [x, -x].map(|x| x * 10f64.powi(exponent)) {
                    let field = long_field(x);
                    assert!(field.len() <= WIDTH && field.contains('.'), "{field}");
                    assert!((read(&field) - x).abs() <= 5e-11 * x.abs(), "{field} of {x:e}");
                }
            }
        }
    }
}
