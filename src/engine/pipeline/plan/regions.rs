//! Sizes of regions, given by number, by name or by a label of the triangles around them; and checks that no sheet, embedded edge
//! or embedded point lies outside the filled regions.

use std::collections::BTreeMap;

use crate::pipeline::error::PipelineError;
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::{EnclosedVolumes, Seeker, Surface};
use tetdb_kernel::boundary::Filled;
use tetdb_kernel::sizing::{Domain, Region, RegionSize, SizeOptions, SizingError};

/// Returns the region sizes of `sizes` for `domain`; `names` gives the names of its volumes.
///
/// Errors: a number, name or label that fits no filled region.
pub fn region_sizes<'a>(
    domain: &Domain<'a>,
    names: &BTreeMap<u32, String>,
    sizes: &SizeOptions,
    scratch: &ScratchSpace,
) -> Result<Vec<Region<'a>>, PipelineError> {
    let diagonal = domain.seeker.surface().bounds().diagonal();
    let one = |size: &RegionSize| {
        let is_here = find(domain, names, &size.which)?;
        let h = size.h.resolve(diagonal);
        let Domain { seeker, volumes, .. } = *domain;
        Ok(Region::new(seeker, volumes, is_here, h, sizes.beta(), scratch))
    };
    sizes.regions.iter().map(one).collect()
}

/// Returns for each volume whether `which` means it. A number takes precedence, then a region's name, then a label; the prefix
/// `label:` rules out the first two.
fn find(
    domain: &Domain,
    names: &BTreeMap<u32, String>,
    which: &str,
) -> Result<Vec<bool>, SizingError> {
    let (surface, filled) = (domain.seeker.surface(), domain.filled);
    let mut is_here = vec![false; filled.len()];
    let mut regions = (0..filled.len()).filter(|&v| filled[v]);
    let n_regions = regions.clone().count();
    let unknown = || unknown(which, surface, n_regions);
    if let Ok(region) = which.parse::<usize>() {
        let found = region.checked_sub(1).and_then(|n| regions.nth(n));
        is_here[found.ok_or_else(unknown)?] = true;
        return Ok(is_here);
    }
    for (&volume, _) in names.iter().filter(|(_, name)| *name == which) {
        is_here[volume as usize] = filled[volume as usize];
    }
    if is_here.contains(&true) {
        return Ok(is_here);
    }
    let name = which.strip_prefix("label:").unwrap_or(which);
    let label = surface.label_names.iter().position(|known| known == name);
    let label = label.ok_or_else(unknown)?;
    for v in domain.volumes.enclosed_by(surface, label as u32) {
        is_here[v as usize] = filled[v as usize];
    }
    match is_here.contains(&true) {
        true => Ok(is_here),
        false => Err(unknown()),
    }
}

fn unknown(which: &str, surface: &Surface, n_regions: usize) -> SizingError {
    /// Largest number of names listed in the message.
    const LISTED: usize = 12;
    let names = &surface.label_names;
    let mut list = names[..names.len().min(LISTED)].join(", ");
    if names.len() > LISTED {
        list += ", …";
    }
    SizingError::BadRegion {
        found: which.to_owned(),
        expected: format!(
            "no filled region has this number or name, and no label of this name encloses one; there are regions 1 to {n_regions}, and labels {list}"
        ),
    }
}

/// Checks that every sheet and embedded edge is inside. Errors: one lies where nothing is filled.
pub(super) fn refuse_outer_sheets(
    surface: &Surface,
    volumes: &EnclosedVolumes,
    chosen: &Filled,
) -> Result<(), PipelineError> {
    let is_outer =
        |&t: &u32| surface.is_sheet(t) && !chosen.volumes.contains(&volumes.of_side[t as usize][0]);
    let mut outer = (0..surface.n_triangles() as u32).filter(is_outer);
    let Some(triangle) = outer.next() else {
        return Ok(());
    };
    let [a, b, c] = surface.corners(triangle);
    if surface.is_support_triangle(triangle) {
        return Err(PipelineError::WireOutside {
            what: "edges",
            label: surface.label_name(triangle).to_owned(),
            at: a.midpoint(b),
            n: 1 + outer.count() as u64,
        });
    }
    Err(PipelineError::SheetOutside {
        triangle,
        label: surface.label_name(triangle).to_owned(),
        at: (a + b + c) / 3.0,
        n: 1 + outer.count() as u64,
    })
}

/// Checks that every embedded point is inside. Errors: one lies where nothing is filled.
pub(super) fn refuse_outer_points(
    surface: &Surface,
    seeker: &Seeker,
    volumes: &EnclosedVolumes,
    chosen: &Filled,
) -> Result<(), PipelineError> {
    let wires = &surface.embedded;
    let alone = (wires.points.iter().zip(&wires.sizes)).filter(|(_, size)| **size > 0.0);
    let is_outer =
        |&v: &u32| !(chosen.volumes).contains(&volumes.at(seeker, surface.points[v as usize]));
    let mut outer = alone.map(|(&[v, label], _)| (v, label)).filter(|(v, _)| is_outer(v));
    let Some((v, label)) = outer.next() else {
        return Ok(());
    };
    Err(PipelineError::WireOutside {
        what: "points",
        label: surface.label_names[label as usize].clone(),
        at: surface.points[v as usize],
        n: 1 + outer.count() as u64,
    })
}
