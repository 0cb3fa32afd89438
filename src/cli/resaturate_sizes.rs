//! Sizes for sub-domains that are made again, as typed.

use std::path::Path;
use tetdb_schema::code::Code;

use serde_json::json;

use super::args::ResaturateArgs;
use super::args::SizeArgs;
use super::config;
use super::failure::Failure;
use tetdb_engine::api::Settings;
use tetdb_engine::api::remesh::AskedSizes;
use tetdb_engine::pipeline::{NewSizes, Options, Values};
use tetdb_io::read::read_lengths;
use tetdb_kernel::sizing::SizingError;
use tetdb_store::store::Catalog;

/// Whether any sizes are asked for.
pub fn are_given(args: &ResaturateArgs) -> bool {
    args.refine_by.is_some() || args.sizes != SizeArgs::default()
}

/// What is asked for; `None` for the sizes that are recorded.
///
/// Errors: sizes without a meaning; files that cannot be read; a surface that is not what it was, where its edges are needed.
pub fn new_sizes(
    args: &ResaturateArgs,
    open: &mut Catalog,
    options: &Options,
    settings: &Settings,
) -> Result<Option<NewSizes>, Failure> {
    if !are_given(args) {
        return Ok(None);
    }
    let mut asked = config::sizes_of(&args.sizes);
    let file = asked.size_field.take_if(|file| file.ends_with(".npy"));
    let given = (asked.sizes()?, asked.size_file());
    let mut sizes = AskedSizes {
        sizes: (args.sizes != SizeArgs::default()).then_some(given),
        values: None,
        file,
        factor: factor(args.refine_by.as_deref())?,
        limits: [0.0, f64::INFINITY],
        refine_by: json!(args.refine_by),
    };
    if let Some(file) = &sizes.file {
        let others = SizeArgs {
            hmin: None,
            hmax: None,
            hgrad: None,
            size_field: None,
            ..args.sizes.clone()
        };
        if others != SizeArgs::default() || args.changed {
            return Err(Failure::new(
                Code::Usage,
                "lengths one by one go with --subdomain, --hmin, --hmax, --hgrad and --refine-by only",
            )
            .at(file)
            .help("leave the other options away"));
        }
        sizes.limits = limits(open, args)?;
        sizes.values = Some(values(Path::new(file), open, args, settings.cap()?)?);
    }
    Ok(Some(sizes.new_sizes(open, options, settings)?))
}

fn factor(text: Option<&str>) -> Result<f64, Failure> {
    let Some(text) = text else {
        return Ok(1.0);
    };
    match text.trim().parse::<f64>() {
        Ok(x) if x.is_normal() && x > 0.0 => Ok(x),
        _ => Err(SizingError::BadValue {
            option: "refine_by",
            found: text.to_owned(),
            expected: "a factor above zero, such as 0.5",
        }
        .into()),
    }
}

/// `--hmin` and `--hmax` of lengths one by one; shares are of the box of all sub-domains.
fn limits(open: &mut Catalog, args: &ResaturateArgs) -> Result<[f64; 2], Failure> {
    let rows = open.subdomains()?;
    let side = |axis: usize| {
        let low = rows.iter().map(|r| r.bounds[0][axis]);
        let high = rows.iter().map(|r| r.bounds[1][axis]);
        high.fold(f64::NEG_INFINITY, f64::max) - low.fold(f64::INFINITY, f64::min)
    };
    let diagonal = (0..3).map(|axis| side(axis).powi(2)).sum::<f64>().sqrt();
    let parse = |option, text: &Option<String>| match text {
        Some(text) => {
            Ok(Some(tetdb_kernel::sizing::Length::parse(option, text)?.resolve(diagonal)))
        }
        None => Ok::<_, SizingError>(None),
    };
    let hmin = parse("hmin", &args.sizes.hmin)?;
    let hmax = parse("hmax", &args.sizes.hmax)?;
    if let (Some(hmin), Some(hmax)) = (hmin, hmax)
        && hmin > hmax
    {
        return Err(SizingError::Crossed { hmin, hmax }.into());
    }
    Ok([hmin.unwrap_or(0.0), hmax.unwrap_or(f64::INFINITY)])
}

/// Lengths for the tetrahedra or the vertices of the named sub-domains: their number tells.
fn values(
    file: &Path,
    open: &mut Catalog,
    args: &ResaturateArgs,
    cap: u64,
) -> Result<Values, Failure> {
    let lengths = read_lengths(file, cap / 4)?;
    let catalog = open;
    // What is not as many as either is told of as wrong for both later.
    match args.subdomain[..] {
        [rank] if lengths.len() as u64 == catalog.subdomain(rank)?.vertices => {
            Ok(Values::Vertices(lengths))
        }
        _ => Ok(Values::Tets(lengths)),
    }
}
