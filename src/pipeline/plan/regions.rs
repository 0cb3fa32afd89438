//! Sizes of regions, by their numbers, their names or by labels of the triangles around them.

use std::collections::BTreeMap;

use crate::pipeline::error::PipelineError;
use crate::sizing::{Domain, Region, RegionSize, SizeOptions, SizingError};
use crate::storage::ScratchSpace;
use crate::surface::Surface;

/// What `sizes` asks of regions of `domain`, whose volumes have `names`.
///
/// Errors: a number or label that no filled region has.
pub(crate) fn region_sizes<'a>(
    domain: &Domain<'a>,
    names: &BTreeMap<u32, String>,
    sizes: &SizeOptions,
    scratch: &ScratchSpace,
) -> Result<Vec<Region<'a>>, PipelineError> {
    let diagonal = domain.seeker.surface().bounds().diagonal();
    let one = |size: &RegionSize| {
        let is_here = find(domain, names, &size.which)?;
        let h = size.h.resolve(diagonal);
        let Domain {
            seeker, volumes, ..
        } = *domain;
        Ok(Region::new(
            seeker,
            volumes,
            is_here,
            h,
            sizes.beta(),
            scratch,
        ))
    };
    sizes.regions.iter().map(one).collect()
}

/// Whether each volume is meant. A number goes first, then a region's name; `label:` before a name says that it is neither.
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
    /// Names listed in the message.
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
