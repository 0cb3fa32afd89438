//! Estimate of a mesh before any of it exists: tetrahedra, bytes and seconds.
//!
//! Predicted counts of tetrahedra come from the size field and the surface. Bytes and seconds per tetrahedron, vertex and
//! triangle are measured. Unless another case is named, the measured cases are:
//! - `balls,count=100`: 394,000 tetrahedra on 62,000 triangles;
//! - `box,h=0.02`: 1.03 million tetrahedra on 30,000 triangles;
//! - the armadillo: 1.02 million tetrahedra on 52,000 triangles;
//! - `balls,count=1000`: 4.04 million tetrahedra on 506,000 triangles.

use super::regions::{OuterEmbedded, chosen, refuse_outer_sheets, region_sizes};
use super::subdomains::n_subdomains;
use super::{MEMORY_MIN, Options, Plan};
use crate::pipeline::error::PipelineError;
use tetdb_base::storage::{ScratchSpace, attempt, join};
use tetdb_base::surface::{EnclosedVolumes, Seeker, Surface, VOLUMES_TRIANGLE};
use tetdb_kernel::boundary::{Filled, RegionPolicy};
use tetdb_kernel::optimize::Mode;
use tetdb_kernel::sizing::{
    Background, Domain, ExtraSizes, NearLabel, Region, SizeConstraint, SizeField, SizeSummary,
    TetCounts,
};
use tetdb_schema::catalog::JournalRow;
use tetdb_store::sealed::Form;

/// Bytes held per triangle once volumes are identified: the volume on each of its two sides.
const OF_SIDE: usize = size_of::<[u32; 2]>();
/// Bytes held per vertex while sizes are computed: its size and slope, and lists of the vertices near a cell and of as many
/// points along edges. Each list has 0.42 of the length of the one above it; the ratio holds for evenly spread vertices.
const SIZES_VERTEX: usize = 26;
/// Free bytes per triangle with which sizes and volumes are computed at the same time. This is eight times the bytes that both
/// hold. Arrays take at most a quarter of the free bytes, so they stay in memory.
const ROOM_FOR_BOTH: usize = 8 * 160;
/// Bytes for frames of data outside memory, and for lists of a quarter of a million points.
const PREPARE_LEAST: usize = 16 << 20;
/// Ratio of inner tetrahedra without optimization, and with only the Delaunay part of it, to those with full optimization.
/// Measured: 1.072 and 1.083; 1.023 and 1.026.
const UNOPTIMIZED: f64 = 1.078;
const DELAUNAY: f64 = 1.025;

/// A mesh is refused if less than this share of its predicted disk space is free. Predictions may be off by that much.
pub const REFUSED_BELOW: f64 = 0.7;
/// Bytes of a sealed sub-domain per tetrahedron, vertex and facet; the sums are within 6 % on seven surfaces.
const SEALED_TET: f64 = 2.74;
const SEALED_VERTEX: f64 = 22.1;
const SEALED_FACET: f64 = 10.0;
/// Bytes of the coarse snapshots per triangle (14 to 20) and per tetrahedron of the refined zones (8 to 10).
const KEPT_TRIANGLE: f64 = 18.0;
const KEPT_ZONE_TET: f64 = 9.0;
/// Bytes per record of any kind in a sub-domain stored as working pages: one slot and a quarter of another.
const PAGES_RECORD: f64 = 40.05;
/// Smallest file of a sub-domain, smallest file of a coarse snapshot, and the catalog without its size field: redb's own pages.
const FILE_LEAST: f64 = 50e3;
const COARSE_FILE_LEAST: f64 = 30e3;
const CATALOG_LEAST: f64 = 100e3;
/// Bytes of the coarse mesh on disk per triangle, and per side of a triangle in a filled region. Sum: 120 to 130 with one side,
/// 195 with both.
const COARSE_TRIANGLE: f64 = 57.0;
const COARSE_SIDE: f64 = 69.0;
/// Ratio of the pages of the coarse mesh during its renumbering to those before.
const RENUMBERED: f64 = 1.6;
/// Bytes of a bisected subtree on disk per tetrahedron of its refined zones; measured on the box in four sub-domains.
const ZONE_TET: f64 = 65.0;
/// Width of a refined zone in wanted lengths.
const ZONE_WIDTH: f64 = 8.0;
/// Scratch bytes per byte of pages that do not fit in frames. The factor is above 1 because a page in memory keeps its place in
/// the file. The scratch file never exceeds [`SPILLED_MAX`] times all pages. Measured with caps from 64 to 256 MiB: 1.5 to 1.9,
/// and up to 1.16.
const SPILLED: f64 = 2.0;
const SPILLED_MAX: f64 = 1.15;
/// Bytes of sort runs per tetrahedron of a sub-domain being sealed, and the share of buffers that a sort fills before it writes
/// runs.
const SORTED_TET: f64 = 25.0;
const SORT_SHARE: f64 = 0.25;

/// Bytes of frames per tetrahedron: 100 to 105.
const FRAMES_TET: f64 = 102.0;
/// Bytes held besides the frames: the program and its code (17 to 19 MB); buffers, at most and per tetrahedron, which soon reach
/// their maximum; other data per tetrahedron; other data per triangle of the input.
const PROGRAM: f64 = 18e6;
const BUFFERS_MAX: f64 = 8e6;
const BUFFERS_TET: f64 = 200.0;
const BESIDE_TET: f64 = 45.0;
const BESIDE_TRIANGLE: f64 = 200.0;
/// Bytes held beyond the cap for code, stacks and memory that the allocator keeps: 17 to 20 MB.
const BEYOND_CAP: f64 = 18e6;

/// CPU seconds per tetrahedron and per triangle on one core of an EPYC at 2.6 GHz. Where needles slow the recovery, it may take
/// ten times as long.
pub(super) const SECONDS_TET: f64 = 1.0 / 240e3;
pub(super) const SECONDS_TRIANGLE: f64 = 7.5e-6;
/// CPU seconds of verification per tetrahedron.
pub(super) const SECONDS_VERIFY: f64 = 0.6e-6;

/// Predicted counts of a mesh, from which its bytes and seconds follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Predicted tetrahedra.
    pub counts: TetCounts,
    /// Number of triangles of the surface.
    pub triangles: u64,
    /// Number of triangle sides in filled regions.
    sides: u64,
    /// Predicted number of vertices.
    pub vertices: f64,
    /// Number of sub-domains of the mesh.
    pub subdomains: u32,
    /// Requested number of sub-domains, if it was larger than the mesh allows.
    pub subdomains_requested: Option<u32>,
    surface_bytes: u64,
    least_to_prepare: u64,
    /// Bytes of the size field: its octree, and the sizes at cell corners. The sizes go to a scratch file if their share of the
    /// cap is too small.
    octree_bytes: u64,
    sizes_bytes: u64,
    /// Storage form of finished sub-domains.
    form: Form,
    /// True if the coarse snapshots stay in the store.
    keeps_coarse: bool,
}

/// The results that precede the first step: a size field and the estimate from it.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The size field.
    pub field: SizeField,
    /// Sources of the size field, and its extremes.
    pub sizes: SizeSummary,
    /// The predicted mesh.
    pub estimate: Estimate,
    /// Notes on the regions for the user.
    pub notes: Vec<String>,
    /// The journal row of the checks and the size field: their seconds.
    pub journal: Option<JournalRow>,
}

/// Builds the size field and predicts the counts of the mesh. `background` has the contents of the options' `size_field`.
///
/// The result depends on surface and options alone. Effects: no mesh or store on disk. Errors: options that make no sense for the
/// surface; orientations that contradict each other.
pub fn prepare(
    surface: &Surface,
    options: &Options,
    background: Option<&Background>,
    scratch: &ScratchSpace,
) -> Result<Prepared, PipelineError> {
    // A failing scratch file unwinds to here.
    attempt(|| prepare_in(surface, options, background, scratch))?
}

fn prepare_in(
    surface: &Surface,
    options: &Options,
    background: Option<&Background>,
    scratch: &ScratchSpace,
) -> Result<Prepared, PipelineError> {
    if let (Some(file), None) = (&options.mesh.size_field, background) {
        return Err(PipelineError::SizeField { file: file.path.clone() });
    }
    let requested = &options.mesh.sizes;
    let isolated_points = surface.isolated_points();
    let labels = NearLabel::all(surface, &requested.labels, requested.beta(), scratch)?;
    let built = |regions: &[Region]| {
        let mut constraints: Vec<&dyn SizeConstraint> =
            regions.iter().map(|r| r as &dyn SizeConstraint).collect();
        constraints.extend(labels.iter().map(|near| near as &dyn SizeConstraint));
        let mut at_vertices = None;
        match background {
            Some(Background::Mesh(mesh)) => constraints.push(&**mesh),
            Some(Background::AtVertices(h)) => at_vertices = Some(&h[..]),
            None => {}
        }
        let further =
            ExtraSizes { constraints: &constraints, at_vertices, at_points: &isolated_points };
        SizeField::build_with(&surface.points, &surface.triangles, requested, &further, scratch)
    };
    let enclosed = || {
        // Leased before the tree takes its share of the free bytes.
        let _held = scratch.lease(VOLUMES_TRIANGLE * surface.n_triangles());
        let seeker = Seeker::with_filter(surface, scratch, |_| true);
        let volumes = EnclosedVolumes::new_in(&seeker, scratch);
        (seeker, volumes)
    };
    let has_room = scratch.available() >= (ROOM_FOR_BOTH * surface.n_triangles()) as u64;
    let (early, (seeker, volumes)) = if !requested.regions.is_empty() {
        (None, enclosed())
    } else if has_room {
        let (early, enclosed) = join(|| built(&[]), enclosed);
        (Some(early?), enclosed)
    } else {
        // The memory of building the field is free again before the surface's tree is built.
        let early = built(&[])?;
        let _early = scratch.lease(early.0.octree_bytes());
        (Some(early), enclosed())
    };
    let _early = (early.as_ref()).map(|(field, _)| scratch.lease(field.octree_bytes()));
    let _volumes = scratch.lease(OF_SIDE * surface.n_triangles());
    let chosen = chosen(&seeker, &volumes, options)?;
    refuse_outer_sheets(surface, &volumes, &chosen)?;
    OuterEmbedded::find(surface, &seeker, &volumes, &chosen).refuse(surface, scratch)?;
    let filled: Vec<bool> = (0..volumes.n_volumes).map(|v| chosen.volumes.contains(&v)).collect();
    let domain = Domain { seeker: &seeker, volumes: &volumes, filled: &filled };
    let (field, mut sizes) = match early {
        Some(built) => built,
        None => built(&region_sizes(&domain, &chosen.names, requested, scratch)?)?,
    };
    if background.is_some() {
        sizes.source = format!("a size field, {}", sizes.source);
    }
    let estimate = Estimate::of(&domain, options, &field)?;
    let notes = notes(&chosen, options, volumes.n_volumes - 1);
    Ok(Prepared { field, sizes, estimate, notes, journal: None })
}

/// Notes on seeds: the number of unnamed regions if some have names, and how many of the `n` volumes stay empty under a rule by
/// seeds.
fn notes(chosen: &Filled, options: &Options, n: u32) -> Vec<String> {
    let filled = chosen.volumes.len();
    let (unnamed, empty) = (filled - chosen.names.len(), n as usize - filled);
    let mut notes = Vec::new();
    if !chosen.names.is_empty() && unnamed > 0 {
        let has = if unnamed == 1 { "has" } else { "have" };
        notes.push(format!("{unnamed} of {filled} filled regions {has} no name"));
    }
    let policy = options.mesh.regions.policy;
    if matches!(policy, RegionPolicy::Seeds | RegionPolicy::AllButHoles) && empty > 0 {
        let stays = if empty == 1 { "stays" } else { "stay" };
        notes.push(format!("{empty} of {n} regions {stays} empty: no seed is inside, or a hole"));
    }
    notes
}

impl Estimate {
    fn of(domain: &Domain, options: &Options, field: &SizeField) -> Result<Self, PipelineError> {
        let surface = domain.seeker.surface();
        let mut counts = field.counts(domain);
        counts.inner_tets *= match options.mesh.optimize {
            Mode::None => UNOPTIMIZED,
            Mode::Delaunay => DELAUNAY,
            Mode::Full => 1.0,
        };
        let (subdomains, subdomains_requested) = n_subdomains(counts.tets(), options);
        let sides = (0..surface.n_triangles())
            .flat_map(|t| domain.volumes.of_side[t])
            .filter(|&v| domain.filled[v as usize]);
        let sizes_bytes = (field.n_leaves() * size_of::<[f32; 8]>()) as u64;
        Ok(Self {
            counts,
            triangles: surface.n_triangles() as u64,
            sides: sides.count() as u64,
            vertices: surface.n_vertices() as f64 + counts.inner_vertices,
            subdomains,
            subdomains_requested,
            surface_bytes: surface.bytes() as u64,
            least_to_prepare: least_to_prepare(surface, !options.mesh.sizes.regions.is_empty()),
            octree_bytes: field.bytes_in(0) - SizeField::share_of(0).min(sizes_bytes),
            sizes_bytes,
            form: options.mesh.seal,
            keeps_coarse: !options.mesh.drop_coarse,
        })
    }

    /// Predicted number of tetrahedra.
    pub fn tets(&self) -> f64 {
        self.counts.tets()
    }

    /// Bytes of the surface and the size field, which stay in memory all the time under a cap of `cap`.
    pub fn resident_bytes(&self, cap: u64) -> u64 {
        let share = SizeField::share_of(cap.saturating_sub(self.surface_bytes));
        self.surface_bytes + self.octree_bytes + self.sizes_bytes.min(share)
    }

    /// Bytes of the finished store.
    pub fn store_bytes(&self) -> u64 {
        let [tet, vertex, facet] = match self.form {
            Form::Packed => [SEALED_TET, SEALED_VERTEX, SEALED_FACET],
            Form::Pages => [PAGES_RECORD; 3],
        };
        let sealed = tet * self.tets() + vertex * self.vertices + facet * self.triangles as f64;
        let files = FILE_LEAST * f64::from(self.subdomains) + CATALOG_LEAST;
        (sealed + files) as u64 + self.octree_bytes + self.sizes_bytes + self.coarse_bytes()
    }

    /// Bytes of the coarse snapshots in the store.
    fn coarse_bytes(&self) -> u64 {
        if !self.keeps_coarse {
            return 0;
        }
        let files = COARSE_FILE_LEAST * f64::from(self.subdomains);
        (KEPT_TRIANGLE * self.triangles as f64 + KEPT_ZONE_TET * self.zone_tets() + files) as u64
    }

    /// Peak of bytes on disk while `threads` threads mesh with `cap` bytes of memory.
    pub fn disk_peak_bytes(&self, cap: u64, threads: usize) -> u64 {
        let (n, at_once) = (f64::from(self.subdomains), self.at_once(threads));
        let (frames, buffers) = match Plan::new(cap, self.resident_bytes(cap)) {
            Ok(plan) => (plan.frames as f64, plan.buffers as f64),
            Err(_) => (0.0, 0.0),
        };
        // The working file of a sub-domain is removed when its sealed file is listed. Two moments may be the peak: before the
        // first removal, and while the last sub-domains are sealed.
        let parts = self.coarse_mesh_bytes() + ZONE_TET * self.zone_tets();
        let store = self.store_bytes() as f64;
        let files = (parts + at_once / n * store).max(store + at_once / n * parts);
        let spilled = spilled(self.pages_bytes(threads), frames);
        let sorted = SORTED_TET * self.tets() / n;
        let runs = match sorted > buffers / at_once * SORT_SHARE {
            true => sorted,
            false => 0.0,
        };
        (files + spilled + runs).max(self.first_cut_bytes(frames)) as u64
    }

    /// Bytes of the coarse mesh on disk.
    fn coarse_mesh_bytes(&self) -> f64 {
        COARSE_TRIANGLE * self.triangles as f64 + COARSE_SIDE * self.sides as f64
    }

    /// Peak of bytes on disk during the first cut: the coarse mesh, the pages of the coarse mesh with its refined zone, and the
    /// two subtrees.
    fn first_cut_bytes(&self, frames: f64) -> f64 {
        if self.subdomains == 1 {
            return 0.0;
        }
        let side = self.counts.inner_vertices.cbrt().max(1.0);
        let zone = (ZONE_WIDTH / side).min(1.0) * self.tets();
        let coarse = self.coarse_mesh_bytes();
        let pages = RENUMBERED * coarse + FRAMES_TET * zone;
        // Half of the frames belong to the subtrees.
        2.0 * coarse + ZONE_TET * zone + spilled(pages, 0.5 * frames)
    }

    /// Peak of bytes that the process holds with a cap of `cap`.
    pub fn memory_bytes(&self, cap: u64, threads: usize) -> u64 {
        self.memory_full_bytes(threads).min(cap + BEYOND_CAP as u64)
    }

    /// Like `memory_bytes`, without a cap: more memory than this changes nothing.
    pub fn memory_full_bytes(&self, threads: usize) -> u64 {
        let pages = self.pages_bytes(threads);
        let buffers = (BUFFERS_TET * self.tets()).min(BUFFERS_MAX);
        // All triangles of the surface while the coarse mesh is built, later those of the sub-domains in work.
        let triangles = BESIDE_TRIANGLE * self.triangles as f64;
        let share = self.at_once(threads) / f64::from(self.subdomains);
        let beside = BESIDE_TET / FRAMES_TET * pages + share * triangles;
        // A reopened subtree is read through a cache.
        let cache = match self.subdomains {
            1 => 0.0,
            _ => ZONE_TET * self.zone_tets().min(1e6),
        };
        (PROGRAM + buffers + (pages + beside + cache).max(triangles)) as u64
    }

    /// Smallest cap with enough memory for all steps.
    pub fn memory_least_bytes(&self) -> u64 {
        let mut cap = (self.least_to_prepare + self.octree_bytes).max(MEMORY_MIN);
        while Plan::new(cap, self.resident_bytes(cap)).is_err() {
            cap += 1 << 20;
        }
        cap
    }

    /// Number of sub-domains meshed at once.
    pub(super) fn at_once(&self, threads: usize) -> f64 {
        f64::from(self.subdomains).min(threads.max(1) as f64)
    }

    /// Bytes of pages of the sub-domains meshed at once.
    fn pages_bytes(&self, threads: usize) -> f64 {
        FRAMES_TET * self.tets() / f64::from(self.subdomains) * self.at_once(threads)
    }

    /// Tetrahedra of the refined zones of all cuts, modeled as a cube cut into cubes.
    fn zone_tets(&self) -> f64 {
        let n = f64::from(self.subdomains);
        let side = (self.counts.inner_vertices / n).cbrt().max(1.0);
        let shared = 3.0 * (1.0 - 1.0 / n.cbrt());
        (ZONE_WIDTH / side * shared).min(1.0) * self.tets()
    }
}

/// Bytes of the scratch file for `pages` bytes of pages with `frames` bytes of frames.
fn spilled(pages: f64, frames: f64) -> f64 {
    (SPILLED * (pages - frames)).clamp(0.0, SPILLED_MAX * pages)
}

/// Smallest cap for this surface, from the surface alone; the size field needs a little more.
pub fn least_for(surface: &Surface) -> u64 {
    let mut cap = least_to_prepare(surface, false).max(MEMORY_MIN);
    while Plan::new(cap, surface.bytes() as u64).is_err() {
        cap += 1 << 20;
    }
    cap
}

/// Smallest cap with which volumes and sizes can be computed. They are computed in turn, unless regions have sizes of their own.
fn least_to_prepare(surface: &Surface, regions_have_sizes: bool) -> u64 {
    let (triangles, vertices) = (surface.n_triangles(), surface.n_vertices());
    let (volumes, sizes) = (VOLUMES_TRIANGLE * triangles, SIZES_VERTEX * vertices);
    let beside = match regions_have_sizes {
        false => volumes.max(sizes),
        true => volumes.max(OF_SIDE * triangles + sizes),
    };
    (surface.bytes() + beside + PREPARE_LEAST) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::plan::MeshOptions;
    use tetdb_base::surface::{orient_alike_with, validate_with};
    use tetdb_kernel::samples::SampleSpec;

    #[test]
    fn a_surface_larger_than_its_room_gives_the_same() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        let mut surface: Surface = SampleSpec::parse("grains,count=400")?.make()?.into();
        surface.shrink();
        let options: Options =
            MeshOptions { regions: RegionPolicy::All.into(), ..MeshOptions::default() }.into();
        let wide = prepare(&surface, &options, None, &ScratchSpace::boundless())?;
        let narrow = ScratchSpace::new(surface.bytes() as u64 / 4, dir.path());
        orient_alike_with(&mut surface, &narrow);
        assert!(validate_with(&surface, &narrow).is_valid());
        let made = prepare(&surface, &options, None, &narrow)?;
        assert_eq!(made.estimate, wide.estimate);
        assert_eq!(made.sizes.to_string(), wide.sizes.to_string());
        assert_eq!(made.field.to_bytes(), wide.field.to_bytes());
        assert!(made.field.bytes() < wide.field.bytes());
        // The ledger has recorded the bytes that the field holds, and no more.
        assert!(made.field.bytes() as u64 <= wide.estimate.octree_bytes + (1 << 20));
        Ok(())
    }

    #[test]
    fn the_least_cap_leaves_room_for_the_surface_and_little_more() {
        let surface = |n: usize| Surface { triangles: vec![[0; 3]; n], ..Surface::default() };
        assert_eq!(least_for(&surface(0)), MEMORY_MIN);
        for n in [1 << 20, 1 << 22] {
            let surface = surface(n);
            let (held, least) = (surface.bytes() as u64, least_for(&surface));
            assert!(Plan::new(least, held).is_ok());
            assert!(least > held && least < 3 * held + MEMORY_MIN, "{held} {least}");
        }
    }
}
