//! Sizes as the Python half words them.

use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use tetdb::{Length, Sizes};

use crate::failure::Failure;

/// A number, and whether it is in percent of the diagonal of the surface's box.
pub type LengthWords = (f64, bool);

pub fn length((value, is_percent): LengthWords) -> Length {
    match is_percent {
        true => Length::percent(value),
        false => Length::units(value),
    }
}

/// A shape by its kind, its numbers, a length inside and, for some, one at most outside.
type ShapeWords = (String, Vec<f64>, LengthWords, Option<LengthWords>);

/// Points, tetrahedra and a length at each point.
type FieldWords<'py> =
    (PyReadonlyArray2<'py, f64>, PyReadonlyArray2<'py, u32>, PyReadonlyArray1<'py, f64>);

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct SizeWords<'py> {
    hsiz: Option<LengthWords>,
    hmin: Option<LengthWords>,
    hmax: Option<LengthWords>,
    hgrad: Option<f64>,
    shapes: Vec<ShapeWords>,
    regions: Vec<(String, LengthWords)>,
    labels: Vec<(String, LengthWords, Option<LengthWords>)>,
    expression: Option<String>,
    file: Option<String>,
    field: Option<FieldWords<'py>>,
}

impl SizeWords<'_> {
    pub fn sizes(&self, py: Python<'_>) -> PyResult<Sizes> {
        let mut sizes = match self.hsiz {
            Some(h) => Sizes::interior(length(h)),
            None => Sizes::from_surface(),
        };
        if let Some(h) = self.hmin {
            sizes = sizes.at_least(length(h));
        }
        if let Some(h) = self.hmax {
            sizes = sizes.at_most(length(h));
        }
        if let Some(ratio) = self.hgrad {
            sizes = sizes.gradation(ratio);
        }
        for (kind, numbers, h, outside) in &self.shapes {
            let (h, outside) = (length(*h), outside.map(length));
            sizes = match (kind.as_str(), numbers[..].as_chunks::<3>()) {
                ("box", ([low, high], [])) => sizes.in_box(*low, *high, h, outside),
                ("sphere", ([center], [radius])) => sizes.in_sphere(*center, *radius, h, outside),
                ("cylinder", ([a, b], [radius])) => sizes.in_cylinder(*a, *b, *radius, h, outside),
                _ => return Err(Failure::internal("a shape of sizes is not known").raised(py)),
            };
        }
        for (name, h) in &self.regions {
            sizes = sizes.in_region(name, length(*h));
        }
        for (label, h, distance) in &self.labels {
            sizes = sizes.near_label(label, length(*h), distance.map(length));
        }
        if let Some(text) = &self.expression {
            sizes = sizes.expression(text);
        }
        if let Some(file) = &self.file {
            sizes = sizes.field(file);
        }
        if let Some((points, tets, lengths)) = &self.field {
            let points = bytemuck::cast_slice(points.as_slice()?);
            let tets = bytemuck::cast_slice(tets.as_slice()?);
            let sizes = sizes.field_of_arrays(points, tets, lengths.as_slice()?);
            return sizes.map_err(|e| Failure::from(e).raised(py));
        }
        Ok(sizes)
    }
}
