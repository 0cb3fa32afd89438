//! Parsing of query arguments into positions, ids and conditions.

use super::args::QueryArgs;
use super::failure::Failure;
use tetdb_engine::api::{Code, Condition, ExprError, Query, Store, Summary};

/// The error for an option with a value that makes no sense.
pub fn bad(option: &str, found: &str, expected: &str) -> Failure {
    Failure::new(Code::BadQuery, format!("{option} {found}: expected {expected}"))
        .help("`tetdb query --help` has examples")
}

/// The error for an invalid expression, with a caret under the place.
fn bad_expression(text: &str, error: &ExprError) -> Failure {
    let line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let before = text[..error.at].chars().count();
    // The place is printed after "  at: ".
    let caret = format!("{:1$}^", "", before + "  at: ".len());
    Failure::new(Code::BadExpression, error)
        .at(format!("{line}\n{caret}"))
        .help("such as \"quality > 6 and region in [1, 2]\" or \"0.1 + 0.05*x\"")
}

/// `N` finite numbers separated by commas.
pub fn numbers<const N: usize>(
    option: &str,
    text: &str,
    expected: &str,
) -> Result<[f64; N], Failure> {
    let parsed: Option<Vec<f64>> = text
        .split(',')
        .map(|word| word.trim().parse().ok().filter(|x: &f64| x.is_finite()))
        .collect();
    parsed.and_then(|list| list.try_into().ok()).ok_or_else(|| bad(option, text, expected))
}

/// Parses a point.
pub fn point(option: &str, text: &str) -> Result<[f64; 3], Failure> {
    numbers(option, text, "three numbers such as 0.1,0.2,0.3")
}

/// Parses values separated by commas.
fn list<T: std::str::FromStr>(option: &str, text: &str, expected: &str) -> Result<Vec<T>, Failure> {
    let parsed: Option<Vec<T>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    parsed.ok_or_else(|| bad(option, text, expected))
}

const RANKS: &str = "numbers such as 0,3";
const REGIONS: &str = "numbers such as 1,3, or names the store knows";

/// Builds the query of these arguments. Errors: values that make no sense; parts that the store does not have.
pub fn query<'s>(args: &QueryArgs, store: &'s mut Store) -> Result<Query<'s>, Failure> {
    let summary = store.summary();
    if args.inside && args.boxes.is_empty() && args.sphere.is_empty() {
        return Err(bad("--inside", "", "a --box or --sphere to be inside of"));
    }
    let regions = args.region.as_ref().map(|text| regions(text, summary)).transpose()?;
    let labels = args.label.as_ref().map(|text| {
        text.split(',').map(|name| summary.label_called(name.trim())).collect::<Result<Vec<_>, _>>()
    });
    let labels = labels.transpose()?;
    let condition = args.condition.as_ref().map(|text| condition(text, store)).transpose()?;
    let mut query = places(args, store.query())?;
    if args.inside {
        query = query.inside();
    }
    if args.touching_surface {
        query = query.touching_surface();
    }
    if args.touching_sheet {
        query = query.touching_sheet();
    }
    if let Some(text) = &args.subdomain {
        query = query.in_subdomains(&list("--subdomain", text, RANKS)?);
    }
    if let Some(regions) = regions {
        query = query.in_regions(&regions);
    }
    if let Some(labels) = labels {
        query = query.on_labels(&labels);
    }
    if let Some(text) = &args.interface {
        let expected = "two sub-domains such as 0,1";
        match list("--interface", text, expected)?[..] {
            [low, high] => query = query.on_interface(low, high),
            _ => return Err(bad("--interface", text, expected)),
        }
    }
    if let Some(text) = &args.tet {
        query = query.among(&list("--tet", text, "tetrahedra such as 7:1048211")?);
    }
    if let Some(condition) = condition {
        query = query.condition(condition);
    }
    if let Some(text) = &args.neighbors {
        let id = text.parse();
        let id = id.map_err(|_| bad("--neighbors", text, "a tetrahedron such as 7:1048211"))?;
        query = query.next_to(id)?;
    }
    for (option, text, n) in [("--ball", &args.ball, 1), ("--shell", &args.shell, 2)] {
        let Some(text) = text else { continue };
        let expected =
            "vertices such as surface:12, cut3:5 or 7:40, one for a ball and two for a shell";
        let vertices = list(option, text, expected)?;
        if vertices.len() != n {
            return Err(bad(option, text, expected));
        }
        query = query.around(&vertices)?;
    }
    Ok(query)
}

/// Parses regions, given by number or name.
pub(super) fn regions(text: &str, summary: &Summary) -> Result<Vec<u32>, Failure> {
    let mut found = Vec::new();
    for word in text.split(',').map(str::trim) {
        match word.parse() {
            Ok(region) => found.push(region),
            Err(_) if word.is_empty() || summary.region_names.is_empty() => {
                return Err(bad("--region", text, REGIONS));
            }
            Err(_) => found.extend(summary.regions_called(word)?),
        }
    }
    Ok(found)
}

fn places<'s>(args: &QueryArgs, mut query: Query<'s>) -> Result<Query<'s>, Failure> {
    for text in &args.boxes {
        let expected = "six numbers, the low corner and the high one";
        let [x0, y0, z0, x1, y1, z1] = numbers("--box", text, expected)?;
        if x0 > x1 || y0 > y1 || z0 > z1 {
            return Err(bad("--box", text, expected));
        }
        query = query.in_box([x0, y0, z0], [x1, y1, z1]);
    }
    for text in &args.sphere {
        let expected = "four numbers, a center and a radius";
        let [x, y, z, radius] = numbers("--sphere", text, expected)?;
        if radius < 0.0 {
            return Err(bad("--sphere", text, expected));
        }
        query = query.in_sphere([x, y, z], radius);
    }
    for text in &args.plane {
        let expected = "six numbers, a point and a direction";
        let [x, y, z, nx, ny, nz] = numbers("--plane", text, expected)?;
        if [nx, ny, nz] == [0.0; 3] {
            return Err(bad("--plane", text, expected));
        }
        query = query.at_plane([x, y, z], [nx, ny, nz]);
    }
    Ok(query)
}

/// Parses a condition on the variables of a query and the fields of the store.
pub fn condition(text: &str, store: &Store) -> Result<Condition, Failure> {
    store.condition(text)?.map_err(|error| bad_expression(text, &error))
}
