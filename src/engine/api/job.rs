//! The job that a store records: options, surface, size file, version of the recipe.

use std::path::{Path, PathBuf};
use tetdb_schema::code::Code;

use tetdb_schema::catalog::Job;
use xxhash_rust::xxh3::Xxh3;

use super::error::{Error, Remedy};
use super::field_arrays::is_in_store;
use super::surface::source;
use crate::pipeline::{MeshOptions, RECIPE, recipe_of};
use tetdb_base::surface::{self, SeedKind};
use tetdb_io::read::{FileSizes, read_sizes, size_files};
use tetdb_kernel::boundary::RegionPolicy;
use tetdb_kernel::sizing::{Background, BackgroundMesh, Length, RegionSize};
use tetdb_schema::source::Source;
use tetdb_store::store::Catalog;

/// Builds the job record of a run.
pub fn job(options: &MeshOptions, surfaces: &[Source]) -> Job {
    Job {
        options: serde_json::to_string(options).unwrap_or_default(),
        surfaces: surfaces.iter().map(Source::to_record).collect(),
        tool_version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

/// The recorded options of a store. Errors: `damaged`.
pub fn options_of(job: &Job, store: &Path) -> Result<MeshOptions, Error> {
    serde_json::from_str(&job.options).map_err(|e| {
        Error::new(Code::Damaged, format!("the job's options cannot be read: {e}"))
            .at(store.display())
    })
}

/// Returns whether a job gives the same mesh as these options and surfaces.
pub fn is_same(job: &Job, options: &MeshOptions, surfaces: &[Source]) -> bool {
    let same = serde_json::from_str::<MeshOptions>(&job.options).is_ok_and(|mut o| {
        // Kept snapshots and the storage form do not affect the mesh.
        o.drop_coarse = options.drop_coarse;
        o.seal = options.seal;
        // What these did is in the surface that the store keeps.
        (o.snap_embedded, o.embed_outside) = (options.snap_embedded, options.embed_outside);
        o == *options
    });
    same && job.surfaces.len() == surfaces.len()
        && job.surfaces.iter().zip(surfaces).all(|(then, now)| *then == now.to_record())
}

/// Refuses to continue a store that another version of the recipe began, because the result would follow neither version.
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

/// Completes the record of the size file: its full path and the hash of its contents.
pub fn identify_sizes(options: &mut MeshOptions) -> Result<(), Error> {
    // Sizes from arrays already have a hash.
    let Some(file) = options.size_field.as_mut().filter(|file| !is_in_store(&file.path)) else {
        return Ok(());
    };
    let path = std::path::absolute(&file.path)
        .map_err(|e| Error::new(Code::UnreadableFile, e).at(&file.path))?;
    file.hash = Some(hash(&path)?);
    file.path = path.to_string_lossy().into_owned();
    Ok(())
}

/// Adds the seeds of the surface's files to the options, so that the record is complete. Returns a note if they decide what is filled.
///
/// They decide it if no rule and no seed is asked for. Under rules by seeds they count like the user's seeds, together with the lengths
/// asked for in their regions. Under any other rule, only their names are used.
pub fn take_seeds(options: &mut MeshOptions, surface: &surface::Surface) -> Option<String> {
    let rule = &mut options.regions;
    let is_default = !rule.is_given && rule.seeds.is_empty() && !surface.seeds.is_empty();
    rule.is_given = true;
    if is_default {
        rule.policy = match surface.fills_rest {
            true => RegionPolicy::AllButHoles,
            false => RegionPolicy::Seeds,
        };
    }
    let is_rule = matches!(rule.policy, RegionPolicy::Seeds | RegionPolicy::AllButHoles);
    for seed in &surface.seeds {
        let list = match (is_rule, &seed.kind) {
            (true, _) => &mut rule.seeds,
            (false, SeedKind::Region(Some(_))) => &mut rule.names,
            (false, _) => continue,
        };
        if !list.contains(seed) {
            list.push(seed.clone());
        }
    }
    if is_rule {
        let sizes = surface.region_sizes.iter();
        let sizes =
            sizes.map(|(which, h)| RegionSize { which: which.clone(), h: Length::units(*h) });
        options.sizes.regions.extend(sizes);
    }
    let what = match surface.fills_rest {
        true => "every region without a hole point is filled",
        false => "the regions of their solid elements are filled",
    };
    is_default.then(|| format!("as the surface's files say, {what}"))
}

/// Reads the size file of identified options, in at most half of `cap`. Sizes that were given as arrays are in `store`.
///
/// Errors: `size-field-changed` if the contents of the files differ from the record.
pub fn read_background(
    options: &MeshOptions,
    store: &Path,
    cap: u64,
) -> Result<Option<Background>, Error> {
    let Some(file) = &options.size_field else {
        return Ok(None);
    };
    let path = &match is_in_store(&file.path) {
        true => store.join(file.path.trim_start_matches("store:")),
        false => PathBuf::from(&file.path),
    };
    if file.hash != Some(hash(path)?) {
        return Err(Error::new(
            Code::SizeFieldChanged,
            "the sizes are not those the store was begun with",
        )
        .at(&file.path)
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

/// Hash of a size file and of its mesh file, if it has one.
fn hash(path: &Path) -> Result<String, Error> {
    let (sizes, beside) = size_files(path)?;
    let mut all = Xxh3::new();
    for file in std::iter::once(sizes).chain(beside) {
        for half in source(&file)?.hash {
            all.update(&half.to_le_bytes());
        }
    }
    Ok(format!("{:032x}", all.digest128()))
}
