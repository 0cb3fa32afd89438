//! What a query asks for: words to places, ids and conditions.

use super::args::QueryArgs;
use super::failure::Failure;
use tetdb_base::expr::{ExprError, ExprKind, Expression};
use tetdb_base::geom::{Aabb, Point};
use tetdb_schema::code::Code;
use tetdb_store::query::{QueryError, QuerySession, Selection, Solid, VARIABLES, regions_called};

/// An option's value that makes no sense.
pub fn bad(option: &str, found: &str, expected: &str) -> Failure {
    Failure::new(Code::BadQuery, format!("{option} {found}: expected {expected}"))
        .help("`tetdb query --help` has examples")
}

/// An expression that cannot be read, with a caret under the place.
pub fn bad_expression(text: &str, error: &ExprError) -> Failure {
    let line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let before = text[..error.at].chars().count();
    // The place is told behind "  at: ".
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

/// A point as typed.
pub fn point(option: &str, text: &str) -> Result<Point, Failure> {
    numbers::<3>(option, text, "three numbers such as 0.1,0.2,0.3").map(Point::from_array)
}

/// Words separated by commas, each read by its kind.
fn list<T: std::str::FromStr>(option: &str, text: &str, expected: &str) -> Result<Vec<T>, Failure> {
    let parsed: Option<Vec<T>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    parsed.ok_or_else(|| bad(option, text, expected))
}

const RANKS: &str = "numbers such as 0,3";

/// The selection of these arguments. Errors: what has no meaning, what the store does not have.
pub fn selection(args: &QueryArgs, inquiry: &mut QuerySession) -> Result<Selection, Failure> {
    let mut selection = Selection {
        solids: solids(args)?,
        inside: args.inside,
        touching_surface: args.touching_surface,
        touching_sheet: args.touching_sheet,
        ..Selection::default()
    };
    if args.inside && selection.solids.is_empty() {
        return Err(bad("--inside", "", "a --box or --sphere to be inside of"));
    }
    let ranks = |option, text: &Option<String>| match text {
        Some(text) => list(option, text, RANKS).map(Some),
        None => Ok(None),
    };
    selection.subdomains = ranks("--subdomain", &args.subdomain)?;
    if let Some(text) = &args.region {
        selection.regions = Some(regions(text, &inquiry.region_names)?);
    }
    if let Some(text) = &args.label {
        let names = text.split(',').map(|name| label(inquiry, name.trim()));
        selection.labels = Some(names.collect::<Result<_, _>>()?);
    }
    if let Some(text) = &args.interface {
        let pair: Vec<u32> = list("--interface", text, "two sub-domains such as 0,1")?;
        let pair: [u32; 2] =
            pair.try_into().map_err(|_| bad("--interface", text, "two sub-domains such as 0,1"))?;
        selection.interface = Some(pair);
    }
    if let Some(text) = &args.tet {
        selection.tets = Some(list("--tet", text, "tetrahedra such as 7:1048211")?);
    }
    if let Some(text) = &args.condition {
        selection.condition = Some(condition(text)?);
    }
    if let Some(text) = &args.neighbors {
        let id = text.parse();
        let id = id.map_err(|_| bad("--neighbors", text, "a tetrahedron such as 7:1048211"))?;
        selection.sharing = Some(inquiry.next_to(id)?);
    }
    for (option, text, n) in [("--ball", &args.ball, 1), ("--shell", &args.shell, 2)] {
        let Some(text) = text else { continue };
        let expected =
            "vertices such as surface:12, cut3:5 or 7:40, one for a ball and two for a shell";
        let vertices = list(option, text, expected)?;
        if vertices.len() != n {
            return Err(bad(option, text, expected));
        }
        selection.sharing = Some(inquiry.around(&vertices)?);
    }
    Ok(selection)
}

/// Regions by number or name; `names` are those from region 1 on.
pub(super) fn regions(text: &str, names: &[String]) -> Result<Vec<u32>, Failure> {
    let mut found = Vec::new();
    for word in text.split(',').map(str::trim) {
        match word.parse() {
            Ok(region) => found.push(region),
            Err(_) if word.is_empty() || names.is_empty() => {
                return Err(bad("--region", text, RANKS));
            }
            Err(_) => found.extend(regions_called(names, word)?),
        }
    }
    Ok(found)
}

fn solids(args: &QueryArgs) -> Result<Vec<Solid>, Failure> {
    let mut solids = Vec::new();
    for text in &args.boxes {
        let expected = "six numbers, the low corner and the high one";
        let [x0, y0, z0, x1, y1, z1] = numbers("--box", text, expected)?;
        let (low, high) = (Point::new(x0, y0, z0), Point::new(x1, y1, z1));
        if !low.cmple(high).all() {
            return Err(bad("--box", text, expected));
        }
        solids.push(Solid::Box(Aabb { low, high }));
    }
    for text in &args.sphere {
        let expected = "four numbers, a center and a radius";
        let [x, y, z, radius] = numbers("--sphere", text, expected)?;
        if radius < 0.0 {
            return Err(bad("--sphere", text, expected));
        }
        let center = Point::new(x, y, z);
        solids.push(Solid::Sphere { center, radius });
    }
    for text in &args.plane {
        let expected = "six numbers, a point and a direction";
        let [x, y, z, nx, ny, nz] = numbers("--plane", text, expected)?;
        let (point, normal) = (Point::new(x, y, z), Point::new(nx, ny, nz));
        if normal == Point::ZERO {
            return Err(bad("--plane", text, expected));
        }
        solids.push(Solid::Plane { point, normal });
    }
    Ok(solids)
}

/// A truth about the variables of a query.
pub fn condition(text: &str) -> Result<Expression, Failure> {
    let condition =
        Expression::parse(text, &VARIABLES).map_err(|error| bad_expression(text, &error))?;
    if condition.kind() == ExprKind::Truth {
        return Ok(condition);
    }
    let error = ExprError {
        at: 0,
        message: "this is a number; a condition compares, such as `quality > 6`".to_owned(),
    };
    Err(bad_expression(text, &error))
}

/// A label by its name or, where nothing is called so, its number.
fn label(inquiry: &QuerySession, name: &str) -> Result<u32, Failure> {
    let known = inquiry.labels();
    let by_name = known.iter().position(|label| label == name);
    let place = by_name.or_else(|| name.parse().ok().filter(|&n| n < known.len()));
    place
        .map(|n| n as u32)
        .ok_or_else(|| QueryError::NoLabel { name: name.to_owned(), known: known.to_vec() }.into())
}
