//! Adapting a mesh to a field: sub-domains meshed again with the lengths that an estimate of its error asks for.

use std::path::PathBuf;

use serde_json::json;

use super::field_spec::bad;
use super::fields::fields_of;
use super::remesh::{Remeshed, check_recipe, recorded_options, verify_changed};
use super::remesh_sizes::limits;
use super::store::{open_finished, open_to_change};
use super::{Code, Error, Settings, Sizes, Store, guarded};
use crate::pipeline::{
    self, AdaptPlan, AdaptRequest, ErrorEstimate, NewSizes, Options, OptionsText,
    ResaturateSummary, Resaturation,
};
use tetdb_kernel::sizing::SizeOptions;
use tetdb_schema::field::{FieldPlace, FieldRow};
use tetdb_schema::word::Word;
use tetdb_store::store::Catalog;

/// Ratio of two lengths above which they differ, unless another is given. Meshes scatter by as much around their wanted lengths.
const CHANGE: f64 = 1.25;

/// A request to adapt a mesh to a field; see [`Store::adapt`].
///
/// ```
/// # use tetdb_engine::api as tetdb;
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("box.tetdb");
/// # let mut store = tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.1")?).create(&path)?;
/// use tetdb::{FieldPlace, FieldSource, NewField};
///
/// let front = FieldSource::Expression("if(x < 0.5, 0, (x - 0.5)^4)".to_owned());
/// store.add_field_from(&NewField::new("u", FieldPlace::Vertices), &front)?;
/// let adapt = store.adapt("u").factor(2.0);
/// println!("{} tetrahedra to expect", adapt.plan()?.predicted_tets);
/// let adapted = adapt.run()?;
/// assert!(adapted.remeshed.store.summary().n_tets as f64 > 1.5 * adapted.plan.tets as f64);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Adapt {
    path: PathBuf,
    settings: Settings,
    field: String,
    estimate: ErrorEstimate,
    target: Option<AdaptTarget>,
    sizes: Sizes,
    change: f64,
    verify: bool,
}

/// The wanted number of tetrahedra.
#[derive(Clone, Copy, Debug)]
enum AdaptTarget {
    Tets(f64),
    Factor(f64),
}

/// A mesh that was adapted to a field.
#[non_exhaustive]
pub struct Adapted {
    /// The plan, as [`Adapt::plan`] returns it.
    pub plan: AdaptPlan,
    /// The store after the change, and its sub-domains before and after.
    pub remeshed: Remeshed,
}

impl Store {
    /// Starts a request to mesh sub-domains again with the lengths that are best for a field at vertices.
    ///
    /// `field` is the name of the field, or of a component, such as `u.x`. Its numbers are of type `f32` or `f64`.
    pub fn adapt(self, field: &str) -> Adapt {
        let (path, settings) = self.into_parts();
        Adapt {
            path,
            settings,
            field: field.to_owned(),
            estimate: ErrorEstimate::default(),
            target: None,
            sizes: Sizes::default(),
            change: CHANGE,
            verify: true,
        }
    }
}

impl Adapt {
    /// Sets how the error is estimated. Default: [`ErrorEstimate::Hessian`].
    pub fn estimate(mut self, estimate: ErrorEstimate) -> Self {
        self.estimate = estimate;
        self
    }

    /// Wants about `n` tetrahedra in all sub-domains together. Without it and [`Adapt::factor`], as many as now.
    pub fn tets(mut self, n: u64) -> Self {
        self.target = Some(AdaptTarget::Tets(n as f64));
        self
    }

    /// Wants `factor` times as many tetrahedra as now.
    pub fn factor(mut self, factor: f64) -> Self {
        self.target = Some(AdaptTarget::Factor(factor));
        self
    }

    /// Sets the least and the greatest length, and the gradation; nothing else of these sizes counts.
    pub fn sizes(mut self, sizes: Sizes) -> Self {
        self.sizes = sizes;
        self
    }

    /// Sets the ratio of two lengths above which they differ. Sub-domains with other lengths in more than a twentieth of their load are
    /// meshed again. Default: 1.25.
    pub fn change(mut self, ratio: f64) -> Self {
        self.change = ratio;
        self
    }

    /// Sets whether the changed mesh is verified. Default: true.
    pub fn verify(mut self, verify: bool) -> Self {
        self.verify = verify;
        self
    }

    /// Lists what [`Adapt::run`] would change. Nothing is changed. Errors: as [`Adapt::run`].
    pub fn plan(&self) -> Result<AdaptPlan, Error> {
        guarded(&self.settings, || {
            let mut open = open_finished(&self.path, &self.settings)?;
            let options = recorded_options(&mut open, &self.path)?;
            Ok(self.planned(&mut open, &options)?.0)
        })
    }

    /// Meshes the sub-domains whose lengths change, in one step, evaluates all fields on the new mesh, verifies it and opens the store.
    ///
    /// The surface and interfaces stay. The result depends only on the store and the request. Errors: `no-such-part` for a field that the
    /// store lacks; `bad-field` for one of integers, at tetrahedra, with values that are not finite, or without any curvature; `bad-size`;
    /// `no-coarse-leaf`. After these errors the store is unchanged.
    pub fn run(&self) -> Result<Adapted, Error> {
        let (plan, summary) = guarded(&self.settings, || {
            let mut open = open_to_change(&self.path, &self.settings)?;
            let lock = open.lock().expect("it is open for writing");
            let options = recorded_options(&mut open, &self.path)?;
            check_recipe(&mut open, false, &self.settings)?;
            let (plan, sizes) = self.planned(&mut open, &options)?;
            let ranks = plan.changed();
            if ranks.is_empty() {
                return Ok((plan, ResaturateSummary::default()));
            }
            let sizes = Some(sizes);
            let what = Resaturation { ranks, sizes, repair: false, drop_fields: false };
            let (budget, watch) = (self.settings.budget()?, self.settings.watcher());
            let summary = pipeline::resaturate(&mut open, &options, &what, &budget, &watch)?;
            open.close()?;
            if self.verify {
                verify_changed(&self.path, &self.settings, lock)?;
            }
            Ok((plan, summary))
        })?;
        let store = Store::open_with(&self.path, self.settings.clone())?;
        Ok(Adapted { plan, remeshed: Remeshed::new(store, summary)? })
    }

    fn planned(
        &self,
        open: &mut Catalog,
        options: &Options,
    ) -> Result<(AdaptPlan, NewSizes), Error> {
        let request = self.request(open, options)?;
        let planned = pipeline::plan_adaptation(open, options, &request, &self.settings.budget()?)?;
        planned.ok_or_else(|| {
            bad(format!("{} is linear but for rounding: any mesh has it exactly", self.field))
                .with_help("adapt to a field whose gradient changes")
        })
    }

    /// Checks all that is asked for. Errors: what makes no sense.
    fn request(&self, open: &mut Catalog, options: &Options) -> Result<AdaptRequest, Error> {
        let sizes = self.sizes.options()?;
        let only = SizeOptions {
            hmin: sizes.hmin,
            hmax: sizes.hmax,
            hgrad: sizes.hgrad,
            ..SizeOptions::default()
        };
        let is_all = self.sizes.file.is_none() && self.sizes.field.is_none() && only == sizes;
        if !is_all {
            let message =
                "the field decides the lengths; only their limits and the gradation can be given";
            return Err(Error::new(Code::Usage, message).with_help("leave the other sizes away"));
        }
        let number = |what: &str, x: f64, least: f64| match x > least && x.is_finite() {
            true => Ok(x),
            false => Err(Error::new(
                Code::BadSize,
                format!("a {what} of {x} makes no sense, expected one above {least}"),
            )
            .with_help("give a plain number, such as 2")),
        };
        let tets: u64 = open.subdomains()?.iter().map(|row| row.tets).sum();
        let tets = match self.target {
            Some(AdaptTarget::Tets(n)) => number("number of tetrahedra", n, 0.0)?,
            Some(AdaptTarget::Factor(factor)) => number("factor", factor, 0.0)? * tets as f64,
            None => tets as f64,
        };
        let change = number("ratio of lengths", self.change, 1.0)?;
        let (field, component) = self.component(open)?;
        let recorded = &options.mesh.sizes;
        let with_gradation = if sizes.hgrad.is_some() { &sizes } else { recorded };
        let text = serde_json::to_value(OptionsText::from_sizes(&sizes, None)).unwrap_or_default();
        let requested = json!({
            "options": text,
            "adapt": { "field": self.field, "estimate": self.estimate.word(), "tets": tets, "change": change },
        });
        let mut limits = limits(open, &sizes)?;
        // No length beyond the mesh means anything, and an infinite one cannot be scaled.
        limits[1] = limits[1].min(pipeline::bounds(open)?.diagonal()).max(limits[0]);
        Ok(AdaptRequest {
            field,
            component,
            estimate: self.estimate,
            tets,
            limits,
            beta: with_gradation.beta(),
            change,
            requested: requested.to_string(),
        })
    }

    /// The field and its component. Errors: none of that name; values without derivatives.
    fn component(&self, open: &mut Catalog) -> Result<(FieldRow, u32), Error> {
        let name = &self.field;
        let rows = open.fields()?;
        let found = rows.iter().find_map(|row| {
            let column = row.columns().iter().position(|column| column == name);
            Some((row.clone(), column.or((row.name == *name).then_some(0))? as u32))
        });
        let Some((row, component)) = found else {
            let base = name.split('.').next().unwrap_or(name);
            super::fields::field_called(open, base)?;
            return Err(
                bad(format!("{base} has no component {name}")).with_help("such as u.x, u.y or u.z")
            );
        };
        if row.components > 1 && row.name == *name {
            return Err(bad(format!("{name} has {} numbers at each vertex", row.components))
                .with_help(format!("name one of them, such as {}", row.columns()[0])));
        }
        if row.place == FieldPlace::Tets {
            return Err(bad(format!("{name} is at tetrahedra, where it has no derivatives"))
                .with_help("adapt to a field at vertices"));
        }
        if row.number.is_integer() {
            return Err(bad(format!("{name} has integers, which have no derivatives"))
                .with_help("adapt to a field of type f32 or f64"));
        }
        let ranges = fields_of(open)?.into_iter().find(|field| field.name == row.name);
        let range = ranges.and_then(|field| field.ranges.get(component as usize).copied());
        match range {
            Some(range) if range.nan == 0 && range.low.is_finite() && range.high.is_finite() => {
                Ok((row, component))
            }
            _ => Err(bad(format!("{name} has values that are not finite"))
                .with_help("`nan` and `inf` have no derivatives; add the field without them")),
        }
    }
}
