//! Sizes of regions, given by number, by name or by a label of the triangles around them; and checks that no sheet, embedded edge
//! or embedded point lies outside the filled regions.

use std::collections::{BTreeMap, HashSet};

use super::Options;
use crate::pipeline::error::PipelineError;
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::{EnclosedVolumes, OUTSIDE, Seeker, Surface};
use tetdb_kernel::boundary::{BoundaryError, Filled};
use tetdb_kernel::sizing::{Domain, Region, RegionSize, SizeOptions, SizingError, list_of_labels};
use tetdb_schema::labels::labels_within;

/// Share of the box diagonal below which a seed counts as on the surface. The side of a seed comes from sums of doubles, with an
/// error of some 1e-16 of the diagonal, and a thousand times more where triangles are steep.
const ON_SURFACE: f64 = 1e-12;

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
    let labels = labels_within(&surface.label_sets, label as u32);
    for v in domain.volumes.enclosed_by(surface, &labels) {
        is_here[v as usize] = filled[v as usize];
    }
    match is_here.contains(&true) {
        true => Ok(is_here),
        false => Err(unknown()),
    }
}

fn unknown(which: &str, surface: &Surface, n_regions: usize) -> SizingError {
    let list = list_of_labels(surface);
    SizingError::BadRegion {
        found: which.to_owned(),
        expected: format!(
            "no filled region has this number or name, and no label of this name encloses one; there are regions 1 to {n_regions}, and labels {list}"
        ),
    }
}

/// Returns the filled volumes. Errors: a seed on a triangle, outside all volumes, in an empty region, or in conflict with another.
pub(super) fn chosen(
    seeker: &Seeker,
    volumes: &EnclosedVolumes,
    options: &Options,
) -> Result<Filled, PipelineError> {
    let rule = &options.mesh.regions;
    let reach = ON_SURFACE * seeker.surface().bounds().diagonal();
    for seed in &rule.seeds {
        if seeker.distance(seed.point, reach).is_finite() {
            return Err(PipelineError::Boundary(BoundaryError::Seed {
                message: format!(
                    "the seed {seed} lies on a triangle: a seed lies inside its region"
                ),
                point: seed.point,
            }));
        }
    }
    let (end, walls) = (volumes.n_volumes, volumes.walls());
    let chosen = rule.policy.filled(OUTSIDE, end, &walls)?;
    Ok(rule.apply(chosen, OUTSIDE, end, |p| volumes.at(seeker, p))?)
}

/// Checks that every sheet is inside. Errors: one lies where nothing is filled.
pub(super) fn refuse_outer_sheets(
    surface: &Surface,
    volumes: &EnclosedVolumes,
    chosen: &Filled,
) -> Result<(), PipelineError> {
    let is_outer = |&t: &u32| surface.is_sheet(t) && is_outer(t, volumes, chosen);
    let mut outer = (0..surface.n_input_triangles() as u32).filter(is_outer);
    let Some(triangle) = outer.next() else {
        return Ok(());
    };
    let [a, b, c] = surface.corners(triangle);
    Err(PipelineError::SheetOutside {
        triangle,
        label: surface.label_name(triangle).to_owned(),
        at: (a + b + c) / 3.0,
        n: 1 + outer.count() as u64,
    })
}

/// Returns whether the front of a triangle is where nothing is filled.
fn is_outer(t: u32, volumes: &EnclosedVolumes, chosen: &Filled) -> bool {
    !chosen.volumes.contains(&volumes.of_side[t as usize][0])
}

/// Embedded edges and points outside all filled regions, by their numbers in the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OuterEmbedded {
    /// Numbers of edges.
    pub edges: Vec<usize>,
    /// Numbers of points.
    pub points: Vec<usize>,
}

impl OuterEmbedded {
    pub(super) fn find(
        surface: &Surface,
        seeker: &Seeker,
        volumes: &EnclosedVolumes,
        chosen: &Filled,
    ) -> Self {
        let first = surface.n_input_triangles() as u32;
        let supports = first..surface.n_triangles() as u32;
        let supports = supports.filter(|&t| is_outer(t, volumes, chosen));
        // A support triangle begins with the ends of its edge.
        let ends = |t: u32| surface.triangles[t as usize];
        let outer: HashSet<[u32; 2]> = supports.map(|t| [ends(t)[0], ends(t)[1]]).collect();
        let wires = &surface.embedded;
        let mut found = Self::default();
        let is_outer = |&(_, &[a, b, _]): &(usize, &[u32; 3])| outer.contains(&[a, b]);
        let edges = wires.edges.iter().enumerate().filter(is_outer);
        found.edges.extend(edges.map(|(e, _)| e));
        let mut ends: HashSet<u32> = outer.into_iter().flatten().collect();
        if !ends.is_empty() {
            let used = surface.triangles[..first as usize].iter().flatten();
            used.for_each(|v| _ = ends.remove(v));
        }
        for (i, (&[v, _], &size)) in wires.points.iter().zip(&wires.sizes).enumerate() {
            let at = || volumes.at(seeker, surface.points[v as usize]);
            if ends.contains(&v) || size > 0.0 && !chosen.volumes.contains(&at()) {
                found.points.push(i);
            }
        }
        found
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty() && self.points.is_empty()
    }

    /// The error that names the first of them, if there are any.
    pub(super) fn refuse(
        &self,
        surface: &Surface,
        scratch: &ScratchSpace,
    ) -> Result<(), PipelineError> {
        let (what, n, name, ends) = match (&self.edges[..], &self.points[..]) {
            ([e, ..], _) => {
                let [a, b, _] = surface.embedded.edges[*e];
                ("edges", self.edges.len(), surface.edge_name(*e), [a, b])
            }
            (_, [p, ..]) => {
                let [v, _] = surface.embedded.points[*p];
                ("points", self.points.len(), surface.point_name(*p), [v, v])
            }
            _ => return Ok(()),
        };
        let ends = ends.map(|v| surface.points[v as usize]);
        let plain = Seeker::with_filter(surface, scratch, |t| !surface.is_support_triangle(t));
        let [a, b] = ends.map(|p| plain.distance(p, f64::INFINITY));
        let (n, at, distance) = (n as u64, ends[0].midpoint(ends[1]), a.min(b));
        Err(PipelineError::WireOutside { what, name, distance, at, n })
    }
}

/// Refuses sheets, embedded edges and embedded points outside the regions that `options` fill. Errors: as [`outer_embedded`].
pub fn refuse_outer(
    surface: &Surface,
    options: &Options,
    scratch: &ScratchSpace,
) -> Result<(), PipelineError> {
    let seeker = Seeker::with_filter(surface, scratch, |_| true);
    let volumes = EnclosedVolumes::new_in(&seeker, scratch);
    let chosen = chosen(&seeker, &volumes, options)?;
    refuse_outer_sheets(surface, &volumes, &chosen)?;
    OuterEmbedded::find(surface, &seeker, &volumes, &chosen).refuse(surface, scratch)
}

/// Finds embedded edges and points outside the regions that `options` fill. Errors: seeds that fit no region.
pub fn outer_embedded(
    surface: &Surface,
    options: &Options,
    scratch: &ScratchSpace,
) -> Result<OuterEmbedded, PipelineError> {
    let seeker = Seeker::with_filter(surface, scratch, |_| true);
    let volumes = EnclosedVolumes::new_in(&seeker, scratch);
    let chosen = chosen(&seeker, &volumes, options)?;
    Ok(OuterEmbedded::find(surface, &seeker, &volumes, &chosen))
}
