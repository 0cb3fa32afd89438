//! The options that shape the mesh, from the command line and a file.

use std::path::Path;
use tetdb_schema::code::Code;

use clap::ValueEnum;

use super::args::{Optimize, Regions, ShapeArgs, SizeArgs};
use super::failure::Failure;
use tetdb_base::surface::{Seed, SeedKind};
use tetdb_engine::api::job::identify_sizes;
use tetdb_engine::pipeline::Options;

/// No configuration is longer.
const BYTES_MAX: u64 = 1 << 20;

/// The options of a run: the file's, then the command line's over them, then the defaults.
///
/// Lists of shapes on the command line replace those of the file. Errors: the file, with its line and column.
pub fn options(args: &ShapeArgs) -> Result<Options, Failure> {
    let mut options = match &args.config {
        None => Options::default(),
        Some(path) => {
            let text = text(path).map_err(|e| {
                Failure::new(Code::UnreadableFile, format!("the file cannot be read: {e}"))
                    .at(path.display())
                    .help("a configuration is a regular file of some lines")
            })?;
            read(&text).map_err(|failure| failure.at(path.display()))?
        }
    };
    take_sizes(&args.sizes, &mut options);
    let texts = [
        (&args.regions.map(word), &mut options.regions),
        (&args.optimize.map(word), &mut options.optimize),
        (&args.subdomains, &mut options.subdomains),
        (&args.seal.map(word), &mut options.seal),
    ];
    for (given, option) in texts {
        if given.is_some() {
            option.clone_from(given);
        }
    }
    options.drop_coarse |= args.drop_coarse;
    options.keep_stages |= args.keep_stages;
    options.refine_surface |= args.refine_surface;
    take_seeds(args, &mut options)?;
    let is_seeded = !(options.region_seed.is_empty() && options.hole.is_empty());
    // The words are stored in full, so that a store tells all of what made it.
    options.regions.get_or_insert_with(|| match is_seeded {
        true => word(Regions::Seeds),
        false => word(Regions::Parity),
    });

    options.optimize.get_or_insert_with(|| word(Optimize::Full));
    if options.region_policy().is_none() || options.optimize_mode().is_none() {
        let words = [&options.regions, &options.optimize].map(|w| w.clone().unwrap_or_default());
        let failure = bad(format!("`{}` or `{}` is no known word", words[0], words[1]));
        return Err(match &args.config {
            Some(path) => failure.at(path.display()),
            None => failure,
        });
    }
    options.region_rule()?;
    options.subdomain_count()?;
    options.form()?;
    identify_sizes(&mut options)?;
    Ok(options)
}

/// Puts the sizes of the command line over those of `options`: its lists replace theirs.
pub fn take_sizes(args: &SizeArgs, options: &mut Options) {
    take_lengths(args, options);
    for (given, option) in lists(args, options) {
        if !given.is_empty() {
            option.clone_from(given);
        }
    }
}

/// Seeds of the command line and of its file replace those of `options`. Errors: the file, with its line.
fn take_seeds(args: &ShapeArgs, options: &mut Options) -> Result<(), Failure> {
    for (given, option) in
        [(&args.region_seed, &mut options.region_seed), (&args.hole, &mut options.hole)]
    {
        if !given.is_empty() {
            option.clone_from(given);
        }
    }
    let Some(path) = &args.seeds else {
        return Ok(());
    };
    let text = text(path).map_err(|e| {
        Failure::new(Code::UnreadableFile, format!("the file cannot be read: {e}"))
            .at(path.display())
            .help("seeds are in a regular file, a line for each")
    })?;
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let seed = Seed::parse_line(line).ok_or_else(|| {
            Failure::new(Code::BadSeed, format!("`{line}` is no seed"))
                .at(format!("{}, line {number}", path.display()))
                .help("a line is `x y z name`, `x y z` or `x y z hole`")
        })?;
        match seed.kind {
            SeedKind::Hole => options.hole.push(seed.to_string()),
            SeedKind::Region(_) => options.region_seed.push(seed.to_string()),
        }
    }
    Ok(())
}

fn take_lengths(args: &SizeArgs, options: &mut Options) {
    let texts = [
        (&args.hsiz, &mut options.hsiz),
        (&args.hmin, &mut options.hmin),
        (&args.hmax, &mut options.hmax),
        (&args.hgrad, &mut options.hgrad),
        (&args.size_expr, &mut options.size_expr),
        (&args.size_field, &mut options.size_field),
    ];
    for (given, option) in texts {
        if given.is_some() {
            option.clone_from(given);
        }
    }
}

/// Shapes and regions, of the command line and of options.
fn lists<'a>(
    args: &'a SizeArgs,
    options: &'a mut Options,
) -> [(&'a Vec<String>, &'a mut Vec<String>); 4] {
    [
        (&args.size_box, &mut options.size_box),
        (&args.size_sphere, &mut options.size_sphere),
        (&args.size_cylinder, &mut options.size_cylinder),
        (&args.size_region, &mut options.size_region),
    ]
}

/// What a file holds. Errors: a pipe or a device, which may have no end; a file that is far too long for options.
fn text(path: &Path) -> std::io::Result<String> {
    let refused = |why: &str| Err(std::io::Error::other(why));
    match std::fs::metadata(path)? {
        meta if !meta.is_file() => refused("it is not a regular file"),
        meta if meta.len() > BYTES_MAX => refused("it is longer than a megabyte"),
        _ => std::fs::read_to_string(path),
    }
}

fn read(text: &str) -> Result<Options, Failure> {
    toml::from_str(text).map_err(|e| bad(e.to_string().trim_end().to_owned()))
}

fn bad(what: String) -> Failure {
    Failure::new(Code::BadConfig, what).help(
        "keys are those of `tetdb mesh --help`, for example hsiz = 0.1, hmax = \"2%\" or size_sphere = [[0, 0, 0, 1, 0.1]]",
    )
}

fn word(value: impl ValueEnum) -> String {
    value.to_possible_value().map(|p| p.get_name().to_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_read_and_their_faults_placed() {
        let options = read("hsiz = \"2%\"\nsize_sphere = [\"0,0,0,1,0.1\"]\n");
        let options = options.unwrap_or_else(|_| panic!("a good file"));
        assert_eq!(options.hsiz.as_deref(), Some("2%"));
        assert_eq!(options.size_sphere.len(), 1);
        let numbers = "hsiz = 2\nhgrad = 1.5\nsubdomains = 4\nsize_sphere = [[0, -1, 0.5, 1, 1e-2], \"0,0,0,1,0.1\"]\n";
        let options = read(numbers).unwrap_or_else(|_| panic!("numbers are numbers"));
        assert_eq!(options.hsiz.as_deref(), Some("2"));
        assert_eq!(options.hgrad.as_deref(), Some("1.5"));
        assert_eq!(options.subdomains.as_deref(), Some("4"));
        assert_eq!(options.size_sphere, ["0,-1,0.5,1,0.01", "0,0,0,1,0.1"]);
        for text in
            ["hsiz = 3 4", "hsize = \"1\"", "size_box = 3", "hsiz = true", "size_box = [[true]]"]
        {
            assert_eq!(read(text).err().map(|f| f.exit()), Some(2), "{text}");
        }
    }

    #[test]
    fn a_list_is_no_number() {
        for text in ["hsiz = [1]", "hgrad = [1, 2]", "size_box = [[[0, 0], 0, 1]]"] {
            let failure = read(text).err().unwrap_or_else(|| panic!("{text}"));
            let message = failure.message;
            let key = text.split(' ').next().unwrap_or_default();
            for word in [key, "sequence", "a text or a number"] {
                assert!(message.contains(word), "{text}: {message}");
            }
        }
    }
}
