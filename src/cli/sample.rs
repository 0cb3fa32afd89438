//! `sample`: made surfaces as files.

use serde_json::json;

use super::args::SampleArgs;
use super::failure::Failure;
use super::input;
use super::talk::Talk;
use crate::samples::PREFIX;

pub fn run(args: &SampleArgs, talk: &Talk) -> Result<u8, Failure> {
    let word = if args.sample.starts_with(PREFIX) {
        args.sample.clone()
    } else {
        format!("{PREFIX}{}", args.sample)
    };
    let input = input::load(&[word], talk)?;
    let _ = json!({});
    Err(Failure::new("unknown-format", "no writer yet")
        .at(args.output.display())
        .help(format!("{}", input.stem)))
}
