//! Options as text: the form recorded with a job and given in option files and on the command line.

use std::fmt;

use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};

use super::options::{MeshOptions, SizeFile, Subdomains};
use crate::pipeline::error::PipelineError;
use tetdb_base::surface::{Seed, SeedKind};
use tetdb_kernel::boundary::{RegionPolicy, RegionRule};
use tetdb_kernel::sizing::{
    Formula, LabelSize, Length, RegionSize, SizeOptions, SizeSource, SizingError,
};
use tetdb_schema::word::Word as _;

/// Options as text, one key each. Lengths are numbers or shares of the box diagonal such as `1%`; shapes and seeds are numbers
/// with commas.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OptionsText {
    /// Edge length inside.
    #[serde(deserialize_with = "text")]
    pub hsiz: Option<String>,
    /// Least edge length.
    #[serde(deserialize_with = "text")]
    pub hmin: Option<String>,
    /// Greatest edge length.
    #[serde(deserialize_with = "text")]
    pub hmax: Option<String>,
    /// Gradation.
    #[serde(deserialize_with = "text")]
    pub hgrad: Option<String>,
    /// Sizes in boxes.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub size_box: Vec<String>,
    /// Sizes in spheres.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub size_sphere: Vec<String>,
    /// Sizes in cylinders.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub size_cylinder: Vec<String>,
    /// Sizes of regions.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub size_region: Vec<String>,
    /// Sizes near labels.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub size_label: Vec<String>,
    /// Edge length as an expression in x, y and z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_expr: Option<String>,
    /// File of sizes at the vertices of a mesh; recorded with its full path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_field: Option<String>,
    /// Hash of the files of `size_field`; written by the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_field_hash: Option<String>,
    /// A word of [`RegionPolicy`].
    pub regions: Option<String>,
    /// Points in regions to fill or name.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub region_seed: Vec<String>,
    /// Points in regions that stay empty.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub hole: Vec<String>,
    /// Names of regions from the surface's files; written by the program.
    #[serde(deserialize_with = "texts", skip_serializing_if = "Vec::is_empty")]
    pub region_name: Vec<String>,
    /// A word of [`Mode`](tetdb_kernel::optimize::Mode).
    pub optimize: Option<String>,
    /// `auto` or a number.
    #[serde(deserialize_with = "text", skip_serializing_if = "Option::is_none")]
    pub subdomains: Option<String>,
    /// See [`MeshOptions::drop_coarse`].
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub drop_coarse: bool,
    /// A word of [`Form`](tetdb_store::sealed::Form).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seal: Option<String>,
    /// See [`MeshOptions::keep_stages`].
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub keep_stages: bool,
    /// See [`MeshOptions::refine_surface`].
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub refine_surface: bool,
    /// See [`MeshOptions::snap_embedded`].
    #[serde(deserialize_with = "text", skip_serializing_if = "Option::is_none")]
    pub snap_embedded: Option<String>,
    /// A word of [`EmbedOutside`](super::EmbedOutside).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub embed_outside: Option<String>,
}

impl OptionsText {
    /// Returns the sizes as text; all other options are absent.
    pub fn from_sizes(sizes: &SizeOptions, file: Option<&SizeFile>) -> Self {
        let sources = |option: &str| {
            let of_shape = sizes.sources.iter().filter(|source| source.option() == option);
            of_shape.map(SizeSource::to_string).collect()
        };
        Self {
            hsiz: sizes.hsiz.map(|h| h.to_string()),
            hmin: sizes.hmin.map(|h| h.to_string()),
            hmax: sizes.hmax.map(|h| h.to_string()),
            hgrad: sizes.hgrad.map(|ratio| ratio.to_string()),
            size_box: sources("size_box"),
            size_sphere: sources("size_sphere"),
            size_cylinder: sources("size_cylinder"),
            size_region: sizes.regions.iter().map(RegionSize::to_string).collect(),
            size_label: sizes.labels.iter().map(LabelSize::to_string).collect(),
            size_expr: sizes.formula.as_ref().map(Formula::to_string),
            size_field: file.map(|file| file.path.clone()),
            size_field_hash: file.and_then(|file| file.hash.clone()),
            ..Self::default()
        }
    }

    /// Returns these options, each replaced by that of `other` where `other` has it; a list replaces a list.
    pub fn overridden_by(self, other: Self) -> Self {
        let list =
            |own: Vec<String>, other: Vec<String>| if other.is_empty() { own } else { other };
        Self {
            hsiz: other.hsiz.or(self.hsiz),
            hmin: other.hmin.or(self.hmin),
            hmax: other.hmax.or(self.hmax),
            hgrad: other.hgrad.or(self.hgrad),
            size_box: list(self.size_box, other.size_box),
            size_sphere: list(self.size_sphere, other.size_sphere),
            size_cylinder: list(self.size_cylinder, other.size_cylinder),
            size_region: list(self.size_region, other.size_region),
            size_label: list(self.size_label, other.size_label),
            size_expr: other.size_expr.or(self.size_expr),
            size_field: other.size_field.or(self.size_field),
            size_field_hash: other.size_field_hash.or(self.size_field_hash),
            regions: other.regions.or(self.regions),
            region_seed: list(self.region_seed, other.region_seed),
            hole: list(self.hole, other.hole),
            region_name: list(self.region_name, other.region_name),
            optimize: other.optimize.or(self.optimize),
            subdomains: other.subdomains.or(self.subdomains),
            drop_coarse: other.drop_coarse || self.drop_coarse,
            seal: other.seal.or(self.seal),
            keep_stages: other.keep_stages || self.keep_stages,
            refine_surface: other.refine_surface || self.refine_surface,
            snap_embedded: other.snap_embedded.or(self.snap_embedded),
            embed_outside: other.embed_outside.or(self.embed_outside),
        }
    }

    /// Parses the sizes.
    ///
    /// # Errors
    /// An option has an invalid value; the error names the option and the value.
    pub fn sizes(&self) -> Result<SizeOptions, SizingError> {
        let [hsiz, hmin, hmax, hgrad] =
            [&self.hsiz, &self.hmin, &self.hmax, &self.hgrad].map(|o| o.as_deref());
        let boxes = self.size_box.iter().map(|t| SizeSource::parse_box(t));
        let spheres = self.size_sphere.iter().map(|t| SizeSource::parse_sphere(t));
        let cylinders = self.size_cylinder.iter().map(|t| SizeSource::parse_cylinder(t));
        Ok(SizeOptions {
            sources: boxes.chain(spheres).chain(cylinders).collect::<Result<_, _>>()?,
            formula: self.size_expr.as_deref().map(Formula::parse).transpose()?,
            regions: self
                .size_region
                .iter()
                .map(|t| RegionSize::parse(t))
                .collect::<Result<_, _>>()?,
            labels: self
                .size_label
                .iter()
                .map(|t| LabelSize::parse(t))
                .collect::<Result<_, _>>()?,
            ..SizeOptions::parse(hsiz, hmin, hmax, hgrad)?
        })
    }

    /// Returns the file of sizes, if one is named.
    pub fn size_file(&self) -> Option<SizeFile> {
        let path = self.size_field.clone()?;
        Some(SizeFile { path, hash: self.size_field_hash.clone() })
    }

    /// Parses the rule for regions. Without a policy, seeds or holes imply [`RegionPolicy::Seeds`].
    fn region_rule(&self) -> Result<RegionRule, PipelineError> {
        let bad = |option, text: &str| PipelineError::BadSeed { option, found: text.to_owned() };
        let region =
            |text: &String| Seed::parse_region(text).ok_or_else(|| bad("region_seed", text));
        let hole = |text: &String| Seed::parse_hole(text).ok_or_else(|| bad("hole", text));
        let seeds = self.region_seed.iter().map(region).chain(self.hole.iter().map(hole));
        let seeds: Vec<Seed> = seeds.collect::<Result<_, _>>()?;
        let usual = if seeds.is_empty() { RegionPolicy::Parity } else { RegionPolicy::Seeds };
        Ok(RegionRule {
            policy: word("regions", &self.regions, usual)?,
            is_given: self.regions.is_some() || !seeds.is_empty(),
            seeds,
            names: self.region_name.iter().map(region).collect::<Result<_, _>>()?,
        })
    }
}

impl Serialize for MeshOptions {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        OptionsText::from(self.clone()).serialize(to)
    }
}

impl<'de> Deserialize<'de> for MeshOptions {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        OptionsText::deserialize(from)?.try_into().map_err(D::Error::custom)
    }
}

impl TryFrom<OptionsText> for MeshOptions {
    type Error = PipelineError;

    fn try_from(text: OptionsText) -> Result<Self, PipelineError> {
        Ok(Self {
            sizes: text.sizes()?,
            size_field: text.size_file(),
            regions: text.region_rule()?,
            optimize: word("optimize", &text.optimize, Default::default())?,
            subdomains: match text.subdomains.as_deref() {
                None | Some("auto") => Subdomains::Auto,
                Some(n) => Subdomains::Exactly(
                    n.parse().ok().filter(|&n| n > 0).ok_or_else(|| unknown("subdomains", n))?,
                ),
            },
            drop_coarse: text.drop_coarse,
            seal: word("seal", &text.seal, Default::default())?,
            keep_stages: text.keep_stages,
            refine_surface: text.refine_surface,
            snap_embedded: (text.snap_embedded.as_deref())
                .map(|t| Length::parse("snap_embedded", t))
                .transpose()?,
            embed_outside: word("embed_outside", &text.embed_outside, Default::default())?,
        })
    }
}

impl From<MeshOptions> for OptionsText {
    fn from(options: MeshOptions) -> Self {
        let rule = &options.regions;
        let seeds = |is_hole| {
            let kept = rule.seeds.iter().filter(move |s| (s.kind == SeedKind::Hole) == is_hole);
            kept.map(Seed::to_string).collect()
        };
        let seal = Some(options.seal).filter(|&seal| seal != Default::default());
        let outside = Some(options.embed_outside).filter(|&outside| outside != Default::default());
        Self {
            regions: rule.is_given.then(|| rule.policy.word().to_owned()),
            region_seed: seeds(false),
            hole: seeds(true),
            region_name: rule.names.iter().map(Seed::to_string).collect(),
            optimize: Some(options.optimize.word().to_owned()),
            subdomains: options.subdomains.count().map(|n| n.to_string()),
            drop_coarse: options.drop_coarse,
            seal: seal.map(|seal| seal.word().to_owned()),
            keep_stages: options.keep_stages,
            refine_surface: options.refine_surface,
            snap_embedded: options.snap_embedded.map(|length| length.to_string()),
            embed_outside: outside.map(|outside| outside.word().to_owned()),
            ..Self::from_sizes(&options.sizes, options.size_field.as_ref())
        }
    }
}

fn word<T: tetdb_schema::word::Word>(
    option: &'static str,
    text: &Option<String>,
    usual: T,
) -> Result<T, PipelineError> {
    match text {
        None => Ok(usual),
        Some(text) => T::from_word(text).ok_or_else(|| unknown(option, text)),
    }
}

fn unknown(option: &'static str, value: &str) -> PipelineError {
    PipelineError::Option { option, value: value.to_owned() }
}

/// Text of an option, from a text or a number.
struct Scalar(String);

struct ScalarVisitor;

impl Visitor<'_> for ScalarVisitor {
    type Value = Scalar;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a text or a number")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Scalar, E> {
        Ok(Scalar(text.to_owned()))
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Scalar, E> {
        Ok(Scalar(x.to_string()))
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<Scalar, E> {
        Ok(Scalar(x.to_string()))
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<Scalar, E> {
        Ok(Scalar(x.to_string()))
    }
}

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(ScalarVisitor)
    }
}

/// Text of an option, from a text, a number or a list of both.
struct Typed(String);

struct TypedVisitor;

impl<'de> Visitor<'de> for TypedVisitor {
    type Value = Typed;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a text, a number or a list of numbers")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Typed, E> {
        Ok(Typed(text.to_owned()))
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Typed, E> {
        Ok(Typed(x.to_string()))
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<Typed, E> {
        Ok(Typed(x.to_string()))
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<Typed, E> {
        Ok(Typed(x.to_string()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Typed, A::Error> {
        let mut parts = Vec::new();
        while let Some(Scalar(part)) = list.next_element()? {
            parts.push(part);
        }
        Ok(Typed(parts.join(",")))
    }
}

impl<'de> Deserialize<'de> for Typed {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(TypedVisitor)
    }
}

/// Deserializes one optional option as text.
fn text<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    Ok(Option::<Scalar>::deserialize(from)?.map(|Scalar(text)| text))
}

/// Deserializes a list of options as texts.
fn texts<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<String>, D::Error> {
    let all = Vec::<Typed>::deserialize(from)?;
    Ok(all.into_iter().map(|Typed(text)| text).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every key with a value other than the default. A new field does not compile here until it is added.
    fn full() -> OptionsText {
        let some = |text: &str| Some(text.to_owned());
        let list = |text: &str| vec![text.to_owned()];
        OptionsText {
            hsiz: some("0.1"),
            hmin: some("0.01"),
            hmax: some("3%"),
            hgrad: some("1.5"),
            size_box: list("0,0,0,1,1,1,0.1"),
            size_sphere: list("0,0,0,1,0.1,2%"),
            size_cylinder: list("0,0,0,1,1,1,2,0.1"),
            size_region: list("rock,0.2"),
            size_label: list("wall,0.05,1%"),
            size_expr: some("x + 1"),
            size_field: some("/a/sizes.sol"),
            size_field_hash: some("12"),
            regions: some("all"),
            region_seed: list("0,0,0,rock"),
            hole: list("1,0,0"),
            region_name: list("0,0,1,ore"),
            optimize: some("none"),
            subdomains: some("4"),
            drop_coarse: true,
            seal: some("none"),
            keep_stages: true,
            refine_surface: true,
            snap_embedded: some("0.1%"),
            embed_outside: some("skip"),
        }
    }

    #[test]
    fn every_option_survives_each_conversion() {
        let options: MeshOptions = full().try_into().expect("options");
        assert_eq!(OptionsText::from(options), full(), "typed and back");
        assert_eq!(OptionsText::default().overridden_by(full()), full(), "all overridden");
        assert_eq!(full().overridden_by(OptionsText::default()), full(), "none overridden");
        let text = serde_json::to_string(&full()).expect("text");
        assert_eq!(serde_json::from_str::<OptionsText>(&text).expect("options"), full());
    }
}
