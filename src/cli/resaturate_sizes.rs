//! Sizes for sub-domains that are meshed again, as typed on the command line.

use super::args::{ResaturateArgs, SizeArgs};
use super::config;
use super::failure::Failure;
use tetdb_engine::api::{Code, Error, Remesh};

/// Returns whether any sizes are given.
pub fn are_given(args: &ResaturateArgs) -> bool {
    args.refine_by.is_some() || args.sizes != SizeArgs::default()
}

/// Adds the given sizes. Errors: sizes that make no sense or exclude each other.
pub fn with_sizes(args: &ResaturateArgs, mut remesh: Remesh) -> Result<Remesh, Failure> {
    if args.sizes != SizeArgs::default() {
        let mut sizes = config::sizes_of(&args.sizes);
        let file = sizes.size_field.take_if(|file| file.ends_with(".npy"));
        remesh = remesh.sizes((sizes.sizes().map_err(Error::from)?, sizes.size_file()).into());
        if let Some(file) = file {
            check_alone(args, &file)?;
            remesh = remesh.lengths_from(file);
        }
    }
    match &args.refine_by {
        Some(text) => Ok(remesh.scaled(factor(text)?)),
        None => Ok(remesh),
    }
}

/// Refuses options that exclude lengths given one by one.
fn check_alone(args: &ResaturateArgs, file: &str) -> Result<(), Failure> {
    let others =
        SizeArgs { hmin: None, hmax: None, hgrad: None, size_field: None, ..args.sizes.clone() };
    if others == SizeArgs::default() && !args.changed {
        return Ok(());
    }
    Err(Failure::new(
        Code::Usage,
        "lengths one by one go with --subdomain, --hmin, --hmax, --hgrad and --refine-by only",
    )
    .at(file)
    .help("leave the other options away"))
}

fn factor(text: &str) -> Result<f64, Failure> {
    match text.trim().parse::<f64>() {
        Ok(x) if x.is_normal() && x > 0.0 => Ok(x),
        _ => Err(Failure::new(
            Code::BadSize,
            format!("--refine-by {text}: expected a factor above zero, such as 0.5"),
        )
        .help("write a plain number, with a point and without a unit")),
    }
}
