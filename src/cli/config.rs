//! Options of a mesh, from the command line and from a file of options.

use std::path::Path;
use tetdb_engine::api::error::Error;
use tetdb_engine::api::{Code, MeshOptions, OptionsText, Seed, SeedKind, Word, read_seeds, typed};

use super::args::{InsideArgs, ShapeArgs, SizeArgs};
use super::failure::Failure;

/// Keys of a recorded job that no file of options has.
const OF_THE_PROGRAM: [&str; 2] = ["size_field_hash", "region_name"];
/// Largest length of a file of options.
const BYTES_MAX: u64 = 1 << 20;

/// The options of a run. Those of the command line override those of the file; the rest have defaults.
///
/// Lists on the command line replace those of the file. Errors: the file, with line and column; values that make no sense.
pub fn options(args: &ShapeArgs) -> Result<MeshOptions, Failure> {
    let file = match &args.config {
        None => OptionsText::default(),
        Some(path) => {
            let text = text(path).map_err(|e| {
                Failure::new(Code::UnreadableFile, format!("the file cannot be read: {e}"))
                    .at(path.display())
                    .help("a configuration is a regular file of some lines")
            })?;
            read(&text).map_err(|failure| failure.at(path.display()))?
        }
    };
    typed(file.overridden_by(text_of(args)?)).map_err(|e| match (&args.config, e.option()) {
        // The command line accepts only known words, so the unknown one comes from the file.
        (Some(path), Some(_)) if e.code() == Code::Usage => {
            bad(e.message().to_owned()).at(path.display())
        }
        _ => e.into(),
    })
}

/// The sizes given on the command line.
pub fn sizes_of(args: &SizeArgs) -> OptionsText {
    // Every flag is named: a new one does not compile until it has its line here.
    let SizeArgs {
        hsiz,
        hmin,
        hmax,
        hgrad,
        size_box,
        size_sphere,
        size_cylinder,
        size_region,
        size_label,
        size_field,
        size_expr,
    } = args.clone();
    OptionsText {
        hsiz,
        hmin,
        hmax,
        hgrad,
        size_box,
        size_sphere,
        size_cylinder,
        size_region,
        size_label,
        size_expr,
        size_field,
        ..OptionsText::default()
    }
}

/// The treatment of what is inside, given on the command line.
pub fn inside_of(args: &InsideArgs) -> OptionsText {
    let InsideArgs { snap_embedded, embed_outside } = args;
    OptionsText {
        snap_embedded: snap_embedded.clone(),
        embed_outside: embed_outside.map(|outside| outside.word().to_owned()),
        ..OptionsText::default()
    }
}

/// All options given on the command line. Errors: the file of seeds, with its line.
fn text_of(args: &ShapeArgs) -> Result<OptionsText, Failure> {
    // As in `sizes_of`.
    let ShapeArgs {
        sizes,
        config: _,
        refine_surface,
        inside,
        regions,
        region_seed,
        hole,
        seeds: file_of_seeds,
        optimize,
        drop_coarse,
        seal,
        subdomains,
        keep_stages,
    } = args;
    let mut text = OptionsText {
        regions: regions.map(|regions| regions.word().to_owned()),
        region_seed: region_seed.clone(),
        hole: hole.clone(),
        optimize: optimize.map(|optimize| optimize.word().to_owned()),
        subdomains: subdomains.clone(),
        drop_coarse: *drop_coarse,
        seal: seal.map(|seal| seal.word().to_owned()),
        keep_stages: *keep_stages,
        refine_surface: *refine_surface,
        ..inside_of(inside).overridden_by(sizes_of(sizes))
    };
    if let Some(path) = file_of_seeds {
        for seed in seeds(path)? {
            match seed.kind {
                SeedKind::Hole => text.hole.push(seed.to_string()),
                SeedKind::Region(_) => text.region_seed.push(seed.to_string()),
            }
        }
    }
    Ok(text)
}

/// Reads a file of seeds. Errors: the line.
fn seeds(path: &Path) -> Result<Vec<Seed>, Failure> {
    let bad = |e: Error| match e.code() {
        Code::UnreadableFile | Code::Memory => Failure::from(e),
        _ => Failure { code: Code::BadSeed, ..e.into() },
    };
    read_seeds(path, BYTES_MAX).map_err(|e| bad(e.into()))
}

/// Reads a text file. Errors: a pipe or a device, which may never end; a file too long for options.
fn text(path: &Path) -> std::io::Result<String> {
    let refused = |why: &str| Err(std::io::Error::other(why));
    match std::fs::metadata(path)? {
        meta if !meta.is_file() => refused("it is not a regular file"),
        meta if meta.len() > BYTES_MAX => refused("it is longer than a megabyte"),
        _ => std::fs::read_to_string(path),
    }
}

fn read(text: &str) -> Result<OptionsText, Failure> {
    let options: OptionsText = toml::from_str(text).map_err(|e| {
        let mut message = e.to_string().trim_end().to_owned();
        for key in OF_THE_PROGRAM {
            message = message.replace(&format!("`{key}`, "), "");
        }
        bad(message)
    })?;
    let is_of_the_program = [options.size_field_hash.is_some(), !options.region_name.is_empty()];
    match OF_THE_PROGRAM.iter().zip(is_of_the_program).find(|(_, is_there)| *is_there) {
        Some((key, _)) => Err(bad(format!("{key} is written by the program alone"))),
        None => Ok(options),
    }
}

fn bad(what: String) -> Failure {
    Failure::new(Code::BadConfig, what).help(
        "keys are the options of `tetdb mesh` for lengths, regions and the store, for example hsiz = 0.1, hmax = \"2%\" or size_sphere = [[0, 0, 0, 1, 0.1]]",
    )
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
    fn keys_of_the_program_are_neither_taken_nor_listed() {
        let message = |text: &str| read(text).err().map(|f| f.message).unwrap_or_default();
        assert!(message("size_field_hash = \"12\"").contains("written by the program"));
        assert!(message("region_name = [\"0,0,0,a\"]").contains("written by the program"));
        let unknown = message("hsize = 1");
        assert!(unknown.contains("size_field") && unknown.contains("`optimize`"), "{unknown}");
        assert!(OF_THE_PROGRAM.iter().all(|key| !unknown.contains(key)), "{unknown}");
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
