use serde::{Deserialize, Serialize};

use super::option_text::{text, texts};

use super::Plan;
use crate::pipeline::error::PipelineError;
use crate::pipeline::work::Hands;
use tetdb_base::surface::Seed;
use tetdb_kernel::bisect::Method;
use tetdb_kernel::boundary::{RegionPolicy, RegionRule};
use tetdb_kernel::optimize::Mode;
use tetdb_kernel::sizing::{Formula, RegionSize, SizeOptions, SizeSource, SizingError};
use tetdb_store::sealed::Form;

/// Sub-domains smaller than this are nearly all refined zone: more are not made.
const TETS_MIN: f64 = 25_000.0;

/// What decides the mesh, besides the surface; stored with the job. Memory and threads are not here: they do not.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Wanted sizes as typed: lengths, or `1%` of the box diagonal.
    #[serde(deserialize_with = "text")]
    pub hsiz: Option<String>,
    /// Least wanted length, as typed.
    #[serde(deserialize_with = "text")]
    pub hmin: Option<String>,
    /// Greatest wanted length, as typed.
    #[serde(deserialize_with = "text")]
    pub hmax: Option<String>,
    /// Gradation, as typed.
    #[serde(deserialize_with = "text")]
    pub hgrad: Option<String>,
    /// Sizes in boxes, spheres and cylinders, as typed.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub size_box: Vec<String>,
    /// Sizes in spheres, as typed.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub size_sphere: Vec<String>,
    /// Sizes in cylinders, as typed.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub size_cylinder: Vec<String>,
    /// Sizes of regions, as typed.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub size_region: Vec<String>,
    /// A length as an expression in x, y and z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_expr: Option<String>,
    /// A file of sizes at the vertices of a mesh; stored with its full path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_field: Option<String>,
    /// What the files of `size_field` hold, as 32 hex digits: found by the program, so that a changed file is noticed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_field_hash: Option<String>,
    /// `parity`, `all`, `outer`, `by-orientation`, `seeds`.
    pub regions: Option<String>,
    /// Points in regions to fill or name, as typed.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub region_seed: Vec<String>,
    /// Points in regions that stay empty, as typed.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub hole: Vec<String>,
    /// What the surface's files say of regions that are not chosen by seeds: found by the program.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub region_name: Vec<String>,
    /// `none`, `delaunay`, `full`.
    pub optimize: Option<String>,
    /// `auto` or a number.
    #[serde(deserialize_with = "text", skip_serializing_if = "Option::is_none")]
    pub subdomains: Option<String>,
    /// Whether sub-domains are made for good: what they were made from is not kept. It does not shape the mesh.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub drop_coarse: bool,
    /// `packed`, `none`: whether finished sub-domains are packed into chunks or kept as working pages. It does not shape the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seal: Option<String>,
    /// Whether meshes on their way are kept to be looked at; the finished mesh is the same.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub keep_stages: bool,
    /// Whether the surface's triangles are divided to the wanted lengths first. The store keeps the divided surface.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub refine_surface: bool,
    /// Whether the run ends with the coarse mesh: tasks do the rest. Not stored: it does not shape the mesh.
    #[serde(skip)]
    pub coarse_only: bool,
    /// Other processes that share the work. Not stored.
    #[serde(skip)]
    pub hands: Hands,
    /// For comparisons by a program. It is not stored: a run that is resumed makes cuts as usual.
    #[serde(skip)]
    pub method: Method,
    /// For tests by a program. Not stored either: how many sub-domains there will be is, once that is decided.
    #[serde(skip)]
    pub trial: Trial,
}

/// What makes of a small mesh a test of what happens to large ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trial {
    /// As many sub-domains as are asked for, however small they are.
    pub subdomains_small: bool,
    /// Frames and buffers that are not shares of the cap: with very few, pages leave memory and sorts have runs.
    pub plan: Option<Plan>,
}

impl Options {
    /// Sizes, parsed.
    ///
    /// Errors: the option and the value that make no sense.
    pub fn sizes(&self) -> Result<SizeOptions, SizingError> {
        let text = |o: &'_ Option<String>| o.clone();
        let [hsiz, hmin, hmax, hgrad] = [&self.hsiz, &self.hmin, &self.hmax, &self.hgrad].map(text);
        let mut sizes = SizeOptions::parse(
            hsiz.as_deref(),
            hmin.as_deref(),
            hmax.as_deref(),
            hgrad.as_deref(),
        )?;
        let boxes = self.size_box.iter().map(|t| SizeSource::parse_box(t));
        let spheres = self.size_sphere.iter().map(|t| SizeSource::parse_sphere(t));
        let cylinders = self.size_cylinder.iter().map(|t| SizeSource::parse_cylinder(t));
        sizes.sources = boxes.chain(spheres).chain(cylinders).collect::<Result<_, _>>()?;
        sizes.formula = self.size_expr.as_deref().map(Formula::parse).transpose()?;
        let regions = self.size_region.iter().map(|t| RegionSize::parse(t));
        sizes.regions = regions.collect::<Result<_, _>>()?;
        Ok(sizes)
    }

    /// Puts other sizes beside these: single lengths replace them, lists are added.
    pub fn add_sizes(&mut self, other: &Self) {
        let texts = [
            (&other.hsiz, &mut self.hsiz),
            (&other.hmin, &mut self.hmin),
            (&other.hmax, &mut self.hmax),
            (&other.hgrad, &mut self.hgrad),
            (&other.size_expr, &mut self.size_expr),
            (&other.size_field, &mut self.size_field),
            (&other.size_field_hash, &mut self.size_field_hash),
        ];
        for (given, option) in texts {
            if given.is_some() {
                option.clone_from(given);
            }
        }
        let lists = [
            (&other.size_box, &mut self.size_box),
            (&other.size_sphere, &mut self.size_sphere),
            (&other.size_cylinder, &mut self.size_cylinder),
            (&other.size_region, &mut self.size_region),
        ];
        for (given, option) in lists {
            option.extend_from_slice(given);
        }
    }

    /// The number of sub-domains asked for; `None` for one that follows from the predicted size of the mesh.
    ///
    /// Errors: a text that is neither `auto` nor a number from 1.
    pub fn subdomain_count(&self) -> Result<Option<u32>, PipelineError> {
        match self.subdomains.as_deref() {
            None | Some("auto") => Ok(None),
            Some(text) => match text.parse() {
                Ok(n) if n > 0 => Ok(Some(n)),
                _ => Err(PipelineError::Option { option: "subdomains", value: text.to_owned() }),
            },
        }
    }

    /// Fewest tetrahedra of a sub-domain.
    pub fn subdomain_tets_min(&self) -> f64 {
        match self.trial.subdomains_small {
            true => 1.0,
            false => TETS_MIN,
        }
    }

    /// Which regions are filled; `None` when the word is not known.
    pub fn region_policy(&self) -> Option<RegionPolicy> {
        Some(match self.regions.as_deref().unwrap_or("parity") {
            "parity" => RegionPolicy::Parity,
            "all" => RegionPolicy::All,
            "outer" => RegionPolicy::Outer,
            "by-orientation" => RegionPolicy::ByOrientation,
            "seeds" => RegionPolicy::Seeds,
            _ => return None,
        })
    }

    /// How far to optimize; `None` when the word is not known.
    pub fn optimize_mode(&self) -> Option<Mode> {
        Some(match self.optimize.as_deref().unwrap_or("full") {
            "none" => Mode::None,
            "delaunay" => Mode::Delaunay,
            "full" => Mode::Full,
            _ => return None,
        })
    }

    /// The form of finished sub-domains.
    ///
    /// Errors: a word that is not known.
    pub fn form(&self) -> Result<Form, PipelineError> {
        match self.seal.as_deref().unwrap_or("packed") {
            "packed" => Ok(Form::Sealed),
            "none" => Ok(Form::Pages),
            _ => Err(unknown("seal", &self.seal)),
        }
    }

    /// Which regions are filled and what they are called.
    ///
    /// Errors: the word or the seed that has no meaning.
    pub fn region_rule(&self) -> Result<RegionRule, PipelineError> {
        let policy = self.region_policy();
        let bad = |option, text: &str| PipelineError::BadSeed { option, found: text.to_owned() };
        let region =
            |text: &String| Seed::parse_region(text).ok_or_else(|| bad("region_seed", text));
        let hole = |text: &String| Seed::parse_hole(text).ok_or_else(|| bad("hole", text));
        let regions = self.region_seed.iter().map(region);
        Ok(RegionRule {
            policy: policy.ok_or_else(|| unknown("regions", &self.regions))?,
            seeds: regions.chain(self.hole.iter().map(hole)).collect::<Result<_, _>>()?,
            names: (self.region_name.iter().map(region)).collect::<Result<_, _>>()?,
        })
    }

    /// [`Options::optimize_mode`], or an error that names the word.
    pub fn mode(&self) -> Result<Mode, PipelineError> {
        self.optimize_mode().ok_or_else(|| unknown("optimize", &self.optimize))
    }
}

fn unknown(option: &'static str, value: &Option<String>) -> PipelineError {
    PipelineError::Option { option, value: value.clone().unwrap_or_default() }
}
