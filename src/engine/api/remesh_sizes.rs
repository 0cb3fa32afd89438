//! Sizes for sub-domains that are meshed again.

use std::collections::BTreeSet;
use std::path::PathBuf;

use serde_json::json;

use super::mesher::predict;
use super::preflight::scratch_beside;
use super::{Code, Error, Settings, Sizes, Surface, job};
use crate::pipeline::{self, MeshOptions, NewSizes, Options, OptionsText, SizeFile, Values};
use tetdb_base::storage::attempt;
use tetdb_io::read::read_lengths;
use tetdb_kernel::sizing::{Length, SizeField, SizeOptions, SizingError};
use tetdb_store::store::{Catalog, StoreError};

/// Lengths given one by one, for tetrahedra or vertices.
#[derive(Clone, Debug)]
pub enum Lengths {
    Given(Values),
    /// A `.npy` file.
    File(PathBuf),
}

/// Changes to the recorded sizes; by default none.
#[derive(Clone, Debug, Default)]
pub struct RemeshSizes {
    /// Sizes added to those on record.
    pub sizes: Option<Sizes>,
    pub lengths: Option<Lengths>,
    /// Factor for all lengths.
    pub factor: Option<f64>,
}

impl RemeshSizes {
    /// Builds the sizes for sub-domains of these ranks; `None` for the recorded sizes.
    ///
    /// Errors: sizes that make no sense; files that cannot be read; a changed surface, if its edges are needed.
    pub fn prepare(
        &self,
        ranks: &BTreeSet<u32>,
        (open, options): (&mut Catalog, &Options),
        settings: &Settings,
    ) -> Result<Option<NewSizes>, Error> {
        let Self { sizes, lengths, factor } = self;
        if sizes.is_none() && lengths.is_none() && factor.is_none() {
            return Ok(None);
        }
        let scale = factor.unwrap_or(1.0);
        if !(scale.is_normal() && scale > 0.0) {
            let message = format!("a factor of {scale} scales nothing, expected one above zero");
            return Err(Error::new(Code::BadSize, message));
        }
        if sizes.as_ref().is_some_and(|sizes| sizes.field.is_some()) {
            let message = "a background mesh of arrays is for a new mesh";
            return Err(Error::new(Code::Usage, message)
                .with_help("give a length for each tetrahedron or vertex instead"));
        }
        let given = match sizes {
            Some(sizes) => Some((sizes.options()?, sizes.file.clone())),
            None => None,
        };
        let only = given.as_ref().map(|(sizes, _)| sizes);
        let beta = match only.filter(|sizes| sizes.hgrad.is_some()) {
            Some(sizes) => sizes.beta(),
            None => options.mesh.sizes.beta(),
        };
        let (limits, values) = match lengths {
            None => ([0.0, f64::INFINITY], None),
            Some(lengths) => {
                let limits = limits(open, only.unwrap_or(&SizeOptions::default()))?;
                (limits, Some(values(lengths, ranks, open, settings.cap()?)?))
            }
        };
        let has_lengths = values.is_some();
        let ([field, base], requested) = fields(given, has_lengths, (open, options), settings)?;
        let mut requested =
            OptionsText::from_sizes(&requested.sizes, requested.size_field.as_ref());
        if let Some(Lengths::File(file)) = lengths {
            requested.size_field = Some(file.to_string_lossy().into_owned());
        }
        let requested = serde_json::to_value(&requested).unwrap_or_default();
        let refine_by = factor.map(|factor| factor.to_string());
        let requested = json!({ "options": requested, "refine_by": refine_by }).to_string();
        Ok(Some(NewSizes { field, base, values, factor: scale, limits, beta, requested }))
    }
}

/// The field of the given sizes combined with the recorded ones, and for an imported mesh that of the recorded ones alone; none if
/// lengths one by one replace it. Also returns the given sizes for the record.
fn fields(
    given: Option<(SizeOptions, Option<SizeFile>)>,
    has_lengths: bool,
    (open, options): (&mut Catalog, &Options),
    settings: &Settings,
) -> Result<([Option<SizeField>; 2], MeshOptions), Error> {
    let is_given = given.is_some();
    let (sizes, size_field) = given.unwrap_or_default();
    let mut requested = MeshOptions { sizes, size_field, ..MeshOptions::default() };
    if !is_given || has_lengths {
        return Ok(([None, None], requested));
    }
    job::identify_sizes(&mut requested)?;
    let mut all = options.clone();
    all.mesh.sizes.add(&requested.sizes);
    if requested.size_field.is_some() {
        all.mesh.size_field.clone_from(&requested.size_field);
    }
    // What is recorded of an imported mesh also has the lengths of the file's tetrahedra.
    let base = match open.job()?.is_imported() {
        true => Some(field_of_surface(open, options, settings)?.0),
        false => None,
    };
    let (field, note) = field_of_surface(open, &all, settings)?;
    settings.note(note);
    Ok(([Some(field), base], requested))
}

/// The size field of the surface that a store was made from, or of the shells of an imported one, with these options, and a summary.
/// Errors: a changed surface.
fn field_of_surface(
    open: &mut Catalog,
    all: &Options,
    settings: &Settings,
) -> Result<(SizeField, String), Error> {
    let (dir, cap) = (open.dir().to_owned(), settings.cap()?);
    let scratch = scratch_beside(&tetdb_base::surface::Surface::default(), cap, &dir)?;
    let job = open.job()?;
    let surface = match job.is_imported() {
        true => {
            refuse_regions(open, &all.mesh.sizes)?;
            attempt(|| pipeline::shells(open, &scratch))??
        }
        false => Surface::of_record(&job.surfaces, &dir, &scratch)?.inner,
    };
    drop(scratch);
    let prepared = predict(&surface, all, cap, &dir)?;
    Ok((prepared.field, prepared.sizes.to_string()))
}

/// Errors: lengths in a region, which the shells of an imported mesh do not tell apart.
fn refuse_regions(open: &mut Catalog, sizes: &SizeOptions) -> Result<(), Error> {
    let names = open.region_names()?;
    let is_region =
        |which: &str| which.parse::<usize>().is_ok() || names.iter().any(|name| name == which);
    match sizes.regions.iter().find(|size| is_region(&size.which)) {
        None => Ok(()),
        Some(size) => {
            let message =
                format!("region {} of an imported mesh has no surface of its own", size.which);
            Err(Error::new(Code::NoSuchPart, message).with_help(
                "give lengths in shapes, such as a sphere, or one length for whole sub-domains",
            ))
        }
    }
}

/// Least and greatest length. Shares refer to the diagonal of the bounding box of all sub-domains. Errors: the two cross.
pub(super) fn limits(open: &mut Catalog, sizes: &SizeOptions) -> Result<[f64; 2], Error> {
    let rows = open.subdomains()?;
    let side = |axis: usize| {
        let low = rows.iter().map(|r| r.bounds[0][axis]);
        let high = rows.iter().map(|r| r.bounds[1][axis]);
        high.fold(f64::NEG_INFINITY, f64::max) - low.fold(f64::INFINITY, f64::min)
    };
    let diagonal = (0..3).map(|axis| side(axis).powi(2)).sum::<f64>().sqrt();
    let length = |h: &Option<Length>| h.as_ref().map(|h| h.resolve(diagonal));
    match (length(&sizes.hmin), length(&sizes.hmax)) {
        (Some(hmin), Some(hmax)) if hmin > hmax => Err(SizingError::Crossed { hmin, hmax }.into()),
        (hmin, hmax) => Ok([hmin.unwrap_or(0.0), hmax.unwrap_or(f64::INFINITY)]),
    }
}

/// The lengths for the sub-domains. Errors: the file cannot be read.
fn values(
    lengths: &Lengths,
    ranks: &BTreeSet<u32>,
    open: &mut Catalog,
    cap: u64,
) -> Result<Values, Error> {
    let file = match lengths {
        Lengths::Given(values) => return Ok(values.clone()),
        Lengths::File(file) => file,
    };
    let lengths = read_lengths(file, cap / 4)?;
    let n = lengths.len() as u64;
    let only = ranks.first().filter(|_| ranks.len() == 1);
    let n_vertices = only.map(|&rank| Ok::<_, StoreError>(open.subdomain(rank)?.vertices));
    // The run refuses lengths whose number matches neither.
    Ok(match n_vertices.transpose()? {
        Some(n_vertices) if n == n_vertices => Values::Vertices(lengths),
        _ => Values::Tets(lengths),
    })
}
