//! What a store has on record of how it was made: options, surface, sizes from a file, the recipe's version.

use std::path::{Path, PathBuf};
use tetdb_schema::code::Code;

use tetdb_schema::catalog::Job;
use xxhash_rust::xxh3::Xxh3;

use super::error::{Error, Remedy};
use super::field_arrays::is_in_store;
use super::surface::source;
use crate::pipeline::{Options, RECIPE, recipe_of};
use tetdb_base::surface::{Seed, SeedKind};
use tetdb_io::read::{FileSizes, read_sizes, size_files};
use tetdb_kernel::boundary::RegionPolicy;
use tetdb_kernel::sizing::{Background, BackgroundMesh};
use tetdb_schema::catalog::SurfaceSource;
use tetdb_store::store::Catalog;

/// The record of a run.
#[doc(hidden)]
pub fn job(options: &Options, surfaces: &[SurfaceSource]) -> Job {
    Job {
        options: serde_json::to_string(options).unwrap_or_default(),
        surfaces: surfaces.to_vec(),
        tool_version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

/// The options a store was made with. Errors: `damaged`.
#[doc(hidden)]
pub fn options_of(job: &Job, store: &Path) -> Result<Options, Error> {
    serde_json::from_str(&job.options).map_err(|e| {
        Error::new(Code::Damaged, format!("the job's options cannot be read: {e}"))
            .at(store.display())
    })
}

/// Whether a job would give the same mesh as these options and surfaces.
#[doc(hidden)]
pub fn is_same(job: &Job, options: &Options, surfaces: &[SurfaceSource]) -> bool {
    let same = serde_json::from_str::<Options>(&job.options).is_ok_and(|mut o| {
        // A store that kept more or less than asked for holds the same mesh.
        o.drop_coarse = options.drop_coarse;
        o.seal.clone_from(&options.seal);
        o.coarse_only = options.coarse_only;
        o == *options
    });
    same && job.surfaces == surfaces
}

/// Refuses to go on with a store that another version of the recipe began: the result would be of neither.
#[doc(hidden)]
pub fn check_recipe(catalog: &mut Catalog) -> Result<(), Error> {
    let found = recipe_of(catalog)?;
    if found == RECIPE {
        return Ok(());
    }
    Err(Error::new(
        Code::StoreRecipe,
        format!("the store was begun by version {found} of the recipe, this is version {RECIPE}"),
    )
    .at(catalog.dir().display())
    .with_help("go on with the version of tetdb that began it, or mesh again"))
}

/// Notes in the options where the file of sizes is and what it holds.
#[doc(hidden)]
pub fn identify_sizes(options: &mut Options) -> Result<(), Error> {
    // What was given as arrays is identified already.
    if options.size_field.as_deref().is_some_and(is_in_store) {
        return Ok(());
    }
    options.size_field_hash = None;
    if let Some(file) = &options.size_field {
        let path =
            std::path::absolute(file).map_err(|e| Error::new(Code::UnreadableFile, e).at(file))?;
        options.size_field_hash = Some(hash(&path)?);
        options.size_field = Some(path.to_string_lossy().into_owned());
    }
    Ok(())
}

/// Puts what the surface's files say of regions into the options, so that the record is complete: under the rule `seeds` as if it was asked
/// for; names alone under any other rule.
#[doc(hidden)]
pub fn take_seeds(options: &mut Options, seeds: &[Seed]) {
    let is_rule = options.region_policy() == Some(RegionPolicy::Seeds);
    for seed in seeds {
        let list = match (is_rule, &seed.kind) {
            (true, SeedKind::Hole) => &mut options.hole,
            (true, SeedKind::Region(_)) => &mut options.region_seed,
            (false, SeedKind::Region(Some(_))) => &mut options.region_name,
            (false, _) => continue,
        };
        let text = seed.to_string();
        if !list.contains(&text) {
            list.push(text);
        }
    }
}

/// Reads the sizes of identified options, in at most half of what may be held; those that were given as arrays from `store`.
///
/// Errors: `size-field-changed` when the files are not what they were.
#[doc(hidden)]
pub fn read_background(
    options: &Options,
    store: &Path,
    cap: u64,
) -> Result<Option<Background>, Error> {
    let Some(file) = &options.size_field else {
        return Ok(None);
    };
    let path = &match is_in_store(file) {
        true => store.join(file.trim_start_matches("store:")),
        false => PathBuf::from(file),
    };
    if options.size_field_hash != Some(hash(path)?) {
        return Err(Error::new(
            Code::SizeFieldChanged,
            "the sizes are not those the store was begun with",
        )
        .at(file)
        .with_help("put the old files back, or mesh again")
        .with_remedy(Remedy::General));
    }
    Ok(Some(match read_sizes(path, cap / 2)? {
        FileSizes::AtVertices(h) => Background::AtVertices(h),
        FileSizes::Mesh { points, tets, h } => {
            Background::Mesh(Box::new(BackgroundMesh::new(points, tets, h)))
        }
    }))
}

/// Of the sizes and the mesh beside them.
fn hash(path: &Path) -> Result<String, Error> {
    let (sizes, mesh) = size_files(path)?;
    let mut all = Xxh3::new();
    for file in [Some(sizes), mesh].into_iter().flatten() {
        for half in source(&file)?.hash {
            all.update(&half.to_le_bytes());
        }
    }
    Ok(format!("{:032x}", all.digest128()))
}
