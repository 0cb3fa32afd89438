//! What a mesh will be and what it will take, before any of it exists.
//!
//! Numbers of tetrahedra come from the size field and the surface; bytes and seconds per tetrahedron, vertex and triangle are measured.
//! Unless another case is named, they are those of `balls,count=100` (394,000 tetrahedra on 62,000 triangles), `box,h=0.02` (1.03 million on
//! 30,000), the armadillo (1.02 million on 52,000), `balls,count=1000` (4.04 million on 506,000).

use super::regions::{refuse_outer_points, refuse_outer_sheets, region_sizes};
use super::{MEMORY_MIN, Options, Plan};
use crate::pipeline::error::PipelineError;
use tetdb_base::storage::{ScratchSpace, attempt, join};
use tetdb_base::surface::{EnclosedVolumes, OUTSIDE, Seeker, Surface, VOLUMES_TRIANGLE};
use tetdb_kernel::boundary::{BoundaryError, Filled, RegionPolicy};
use tetdb_kernel::optimize::Mode;
use tetdb_kernel::sizing::{
    Background, Domain, ExtraSizes, Region, SizeConstraint, SizeField, SizeSummary, TetCounts,
};
use tetdb_store::sealed::Form;

/// A seed nearer to the surface than this share of the box diagonal lies on it: the side is found by sums of doubles, which are known to
/// some 1e-16 of it, and a thousand times more where triangles are steep.
const ON_SURFACE: f64 = 1e-12;
/// Bytes held for each triangle once volumes are identified: which one each side has.
const OF_SIDE: usize = size_of::<[u32; 2]>();
/// Bytes held while sizes are computed, for each vertex: its size and slope, and lists of those and of as many places along edges near a cell,
/// where each list is 0.42 of the one above, as it is where vertices are spread evenly.
const SIZES_VERTEX: usize = 26;
/// Bytes left for each triangle with which sizes and volumes are found side by side: eight times what they hold, so that arrays, which take a
/// quarter of what is left at most, stay in memory.
const ROOM_FOR_BOTH: usize = 8 * 160;
/// Bytes for frames of what is not held, and for lists of a quarter of a million places.
const PREPARE_LEAST: usize = 16 << 20;
/// Most tetrahedra of one sub-domain where two or more are made unasked. A cut is dear: 21 million in ten take a tenth to a fifth longer than in
/// four, with caps from 128 MiB on, and the first of the cuts is made alone however many follow.
const TETS_PER_SUBDOMAIN: f64 = (5u64 << 20) as f64;
/// The same of a mesh so large that it has [`MANY`] of them in any case: 41 million in four take less time than in ten within 1 GiB too.
const TETS_PER_SUBDOMAIN_MAX: f64 = 2.0 * TETS_PER_SUBDOMAIN;
/// A mesh with more than this is made in two at least: two threads are faster side by side than within one sub-domain.
const TETS_ALONE: f64 = (2u64 << 20) as f64;
/// Sub-domains that are enough to be shared out among threads and machines.
const MANY: f64 = 32.0;
/// Inner tetrahedra without and with only part of the optimization, over those with all of it: 1.072 and 1.083, 1.023 and 1.026.
const UNOPTIMIZED: f64 = 1.078;
const DELAUNAY: f64 = 1.025;

/// Bytes of a sealed sub-domain for each tetrahedron, vertex and facet: sums within 6 % on seven surfaces.
const SEALED_TET: f64 = 2.74;
const SEALED_VERTEX: f64 = 22.1;
const SEALED_FACET: f64 = 10.0;
/// Bytes of the coarse snapshots for each triangle, and for each tetrahedron of the refined zones: 14 to 20, and 8 to 10.
const KEPT_TRIANGLE: f64 = 18.0;
const KEPT_ZONE_TET: f64 = 9.0;
/// Of one kept as working pages, for each record of whatever kind: a slot, and a quarter of another.
const PAGES_RECORD: f64 = 40.05;
/// The least file of a sub-domain, of a coarse snapshot, and the catalog without its size field: redb's own pages.
const FILE_LEAST: f64 = 50e3;
const COARSE_FILE_LEAST: f64 = 30e3;
const CATALOG_LEAST: f64 = 100e3;
/// Bytes of the coarse mesh on disk for each triangle, and for each side of one that is filled: 120 to 130 with one side, 195 with both.
const COARSE_TRIANGLE: f64 = 57.0;
const COARSE_SIDE: f64 = 69.0;
/// Pages of the coarse mesh while it is numbered anew, over those before.
const RENUMBERED: f64 = 1.6;
/// Bytes of a bisected part on disk for each tetrahedron of its refined zones, in the box in four parts.
const ZONE_TET: f64 = 65.0;
/// Width of a refined zone in wanted lengths.
const ZONE_WIDTH: f64 = 8.0;
/// Pages that leave memory take up this many times what is missing of frames, for a page keeps its place while it is in memory; and never more
/// than [`SPILLED_MAX`] times all pages. With caps from 64 to 256 MiB: 1.5 to 1.9, and up to 1.16.
const SPILLED: f64 = 2.0;
const SPILLED_MAX: f64 = 1.15;
/// Bytes of runs for each tetrahedron of the sub-domain that is sorted to be sealed, and the share of buffers a sort takes before it writes runs.
const SORTED_TET: f64 = 25.0;
const SORT_SHARE: f64 = 0.25;

/// Bytes of frames for each tetrahedron: 100 to 105.
const FRAMES_TET: f64 = 102.0;
/// Bytes held beside the frames: by the program and its code, 17 to 19 MB; by buffers that fill up soon; for each tetrahedron; for each triangle of the input.
const PROGRAM: f64 = 18e6;
const BUFFERS_MAX: f64 = 8e6;
const BUFFERS_TET: f64 = 200.0;
const BESIDE_TET: f64 = 45.0;
const BESIDE_TRIANGLE: f64 = 200.0;
/// Held beyond the cap: code, stacks, what the allocator keeps. 17 to 20 MB.
const BEYOND_CAP: f64 = 18e6;

/// CPU seconds for each tetrahedron and each triangle on one core of an EPYC at 2.6 GHz. Where needles make recovery slow it may take ten times that.
const SECONDS_TET: f64 = 1.0 / 240e3;
pub(super) const SECONDS_TRIANGLE: f64 = 7.5e-6;
/// For verification.
pub(super) const SECONDS_VERIFY: f64 = 0.6e-6;

/// What to expect of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Predicted tetrahedra.
    pub counts: TetCounts,
    /// Triangles of the surface.
    pub triangles: u64,
    /// Sides of triangles in a filled region.
    sides: u64,
    /// Predicted vertices.
    pub vertices: f64,
    /// Sub-domains the mesh will have.
    pub subdomains: u32,
    /// What was asked for, when that was more than the mesh allows.
    pub subdomains_asked: Option<u32>,
    surface_bytes: u64,
    least_to_prepare: u64,
    /// Of the size field: its octree, and sizes at corners, which go to a scratch file where their share of the cap is too small.
    octree_bytes: u64,
    sizes_bytes: u64,
    /// How finished sub-domains are kept.
    form: Form,
    /// Whether the coarse snapshots stay in the store.
    keeps_coarse: bool,
}

/// A size field and what it makes expect: everything before the first step.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The size field.
    pub field: SizeField,
    /// What the size field was built from, and its extremes.
    pub sizes: SizeSummary,
    /// The predicted mesh.
    pub estimate: Estimate,
    /// What is worth knowing of the regions.
    pub notes: Vec<String>,
}

/// Builds the size field and counts what it will give. It makes nothing on disk. `background` is what the options' `size_field` holds.
///
/// The result depends on surface and options alone. Errors: options that make no sense for the surface; orientations that contradict each other.
pub fn prepare(
    surface: &Surface,
    options: &Options,
    background: Option<&Background>,
    scratch: &ScratchSpace,
) -> Result<Prepared, PipelineError> {
    // A scratch file that fails unwinds to here.
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
    let asked = &options.mesh.sizes;
    let isolated_points = surface.isolated_points();
    let built = |regions: &[Region]| {
        let mut constraints: Vec<&dyn SizeConstraint> =
            regions.iter().map(|r| r as &dyn SizeConstraint).collect();
        let mut at_vertices = None;
        match background {
            Some(Background::Mesh(mesh)) => constraints.push(&**mesh),
            Some(Background::AtVertices(h)) => at_vertices = Some(&h[..]),
            None => {}
        }
        let further =
            ExtraSizes { constraints: &constraints, at_vertices, at_points: &isolated_points };
        SizeField::build_with(&surface.points, &surface.triangles, asked, &further, scratch)
    };
    let enclosed = || {
        // Counted before the tree takes its share of what is left.
        let _held = scratch.lease(VOLUMES_TRIANGLE * surface.n_triangles());
        let seeker = Seeker::with_filter(surface, scratch, |_| true);
        let volumes = EnclosedVolumes::new_in(&seeker, scratch);
        (seeker, volumes)
    };
    let has_room = scratch.available() >= (ROOM_FOR_BOTH * surface.n_triangles()) as u64;
    let (early, (seeker, volumes)) = if !asked.regions.is_empty() {
        (None, enclosed())
    } else if has_room {
        let (early, enclosed) = join(|| built(&[]), enclosed);
        (Some(early?), enclosed)
    } else {
        // What building takes is given back before the surface's tree is built.
        let early = built(&[])?;
        let _early = scratch.lease(early.0.octree_bytes());
        (Some(early), enclosed())
    };
    let _early = (early.as_ref()).map(|(field, _)| scratch.lease(field.octree_bytes()));
    let _volumes = scratch.lease(OF_SIDE * surface.n_triangles());
    let chosen = chosen(&seeker, &volumes, options)?;
    refuse_outer_sheets(surface, &volumes, &chosen)?;
    refuse_outer_points(surface, &seeker, &volumes, &chosen)?;
    let filled: Vec<bool> = (0..volumes.n_volumes).map(|v| chosen.volumes.contains(&v)).collect();
    let domain = Domain { seeker: &seeker, volumes: &volumes, filled: &filled };
    let (field, mut sizes) = match early {
        Some(built) => built,
        None => built(&region_sizes(&domain, &chosen.names, asked, scratch)?)?,
    };
    if background.is_some() {
        sizes.source = format!("a size field, {}", sizes.source);
    }
    let estimate = Estimate::of(&domain, options, &field)?;
    Ok(Prepared { field, sizes, estimate, notes: notes(&chosen, options, volumes.n_volumes - 1) })
}

/// The volumes that are filled. Errors: seeds that say what cannot be.
fn chosen(
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

/// What is worth knowing of seeds: where some regions have a name, how many have none; how many of the `n` volumes have no seed.
fn notes(chosen: &Filled, options: &Options, n: u32) -> Vec<String> {
    let filled = chosen.volumes.len();
    let (unnamed, empty) = (filled - chosen.names.len(), n as usize - filled);
    let mut notes = Vec::new();
    if !chosen.names.is_empty() && unnamed > 0 {
        notes.push(format!("{unnamed} of {filled} filled regions have no name"));
    }
    if options.mesh.regions.policy == RegionPolicy::Seeds && empty > 0 {
        notes.push(format!("{empty} of {n} regions stay empty: no seed is inside, or a hole"));
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
        let (subdomains, subdomains_asked) = n_subdomains(counts.tets(), options);
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
            subdomains_asked,
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

    /// Bytes of surface and size field, held all the time under `cap`.
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

    /// Bytes of the coarse snapshots in it.
    fn coarse_bytes(&self) -> u64 {
        if !self.keeps_coarse {
            return 0;
        }
        let files = COARSE_FILE_LEAST * f64::from(self.subdomains);
        (KEPT_TRIANGLE * self.triangles as f64 + KEPT_ZONE_TET * self.zone_tets() + files) as u64
    }

    /// Most bytes on disk while it is meshed with `cap` bytes of memory by so many threads.
    pub fn disk_peak_bytes(&self, cap: u64, threads: usize) -> u64 {
        let (n, at_once) = (f64::from(self.subdomains), self.at_once(threads));
        let (frames, buffers) = match Plan::new(cap, self.resident_bytes(cap)) {
            Ok(plan) => (plan.frames as f64, plan.buffers as f64),
            Err(_) => (0.0, 0.0),
        };
        // A part's file goes when it is sealed: before the first is, and while the last are.
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

    /// Most bytes on disk during the first cut: the coarse mesh, the same with the refined zone as pages, and the two parts.
    fn first_cut_bytes(&self, frames: f64) -> f64 {
        if self.subdomains == 1 {
            return 0.0;
        }
        let side = self.counts.inner_vertices.cbrt().max(1.0);
        let zone = (ZONE_WIDTH / side).min(1.0) * self.tets();
        let coarse = self.coarse_mesh_bytes();
        let pages = RENUMBERED * coarse + FRAMES_TET * zone;
        // Half of the frames are for the parts.
        2.0 * coarse + ZONE_TET * zone + spilled(pages, 0.5 * frames)
    }

    /// Most bytes the process will hold with a cap of `cap`.
    pub fn memory_bytes(&self, cap: u64, threads: usize) -> u64 {
        self.memory_full_bytes(threads).min(cap + BEYOND_CAP as u64)
    }

    /// The same without a cap: more memory than this changes nothing.
    pub fn memory_full_bytes(&self, threads: usize) -> u64 {
        let pages = self.pages_bytes(threads);
        let buffers = (BUFFERS_TET * self.tets()).min(BUFFERS_MAX);
        // All triangles while the coarse mesh is built, later those of the sub-domains at hand.
        let triangles = BESIDE_TRIANGLE * self.triangles as f64;
        let share = self.at_once(threads) / f64::from(self.subdomains);
        let beside = BESIDE_TET / FRAMES_TET * pages + share * triangles;
        // A part that is opened again is read through a cache.
        let cache = match self.subdomains {
            1 => 0.0,
            _ => ZONE_TET * self.zone_tets().min(1e6),
        };
        (PROGRAM + buffers + (pages + beside + cache).max(triangles)) as u64
    }

    /// The smallest cap under which all steps find room.
    pub fn memory_least_bytes(&self) -> u64 {
        let mut cap = (self.least_to_prepare + self.octree_bytes).max(MEMORY_MIN);
        while Plan::new(cap, self.resident_bytes(cap)).is_err() {
            cap += 1 << 20;
        }
        cap
    }

    /// Seconds on so many threads, with verification. Only sub-domains are meshed side by side.
    pub fn seconds(&self, threads: usize) -> f64 {
        let side_by_side = f64::from(self.subdomains).min(threads.max(1) as f64);
        SECONDS_TRIANGLE * self.triangles as f64
            + SECONDS_TET * self.tets() / side_by_side
            + SECONDS_VERIFY * self.tets()
    }

    /// Sub-domains meshed at one time.
    fn at_once(&self, threads: usize) -> f64 {
        f64::from(self.subdomains).min(threads.max(1) as f64)
    }

    /// Their pages.
    fn pages_bytes(&self, threads: usize) -> f64 {
        FRAMES_TET * self.tets() / f64::from(self.subdomains) * self.at_once(threads)
    }

    /// Tetrahedra of the refined zones of all cuts, were the domain a cube cut into cubes.
    fn zone_tets(&self) -> f64 {
        let n = f64::from(self.subdomains);
        let side = (self.counts.inner_vertices / n).cbrt().max(1.0);
        let shared = 3.0 * (1.0 - 1.0 / n.cbrt());
        (ZONE_WIDTH / side * shared).min(1.0) * self.tets()
    }
}

/// Bytes of the scratch file for so many bytes of pages with so many of frames.
fn spilled(pages: f64, frames: f64) -> f64 {
    (SPILLED * (pages - frames)).clamp(0.0, SPILLED_MAX * pages)
}

/// The smallest cap under which this surface may be meshed, as far as it alone tells: the size field needs a little more.
pub fn least_for(surface: &Surface) -> u64 {
    let mut cap = least_to_prepare(surface, false).max(MEMORY_MIN);
    while Plan::new(cap, surface.bytes() as u64).is_err() {
        cap += 1 << 20;
    }
    cap
}

/// The smallest cap under which volumes and sizes can be computed: one after the other, unless regions have sizes of their own.
fn least_to_prepare(surface: &Surface, regions_have_sizes: bool) -> u64 {
    let (triangles, vertices) = (surface.n_triangles(), surface.n_vertices());
    let (volumes, sizes) = (VOLUMES_TRIANGLE * triangles, SIZES_VERTEX * vertices);
    let beside = match regions_have_sizes {
        false => volumes.max(sizes),
        true => volumes.max(OF_SIDE * triangles + sizes),
    };
    (surface.bytes() + beside + PREPARE_LEAST) as u64
}

/// Number of sub-domains for a mesh of `tets` tetrahedra, and the number asked for where that is larger.
pub fn n_subdomains(tets: f64, options: &Options) -> (u32, Option<u32>) {
    let asked = options.mesh.subdomains.count();
    let each = (tets / MANY).clamp(TETS_PER_SUBDOMAIN, TETS_PER_SUBDOMAIN_MAX);
    // An even number of them: three take longer on two threads than two or four.
    let auto = match tets > TETS_ALONE {
        true => 2.0 * (0.5 * tets / each).ceil(),
        false => 1.0,
    };
    let most = (tets / options.run.subdomain_tets_min()).floor().max(1.0);
    let wanted = asked.map_or(auto, f64::from);
    let n = wanted.min(most).min(f64::from(1u32 << 20)) as u32;
    (n, asked.filter(|_| wanted > most && wanted > 1.0))
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
        // What is held of it, and no more, is what the ledger has recorded.
        assert!(made.field.bytes() as u64 <= wide.estimate.octree_bytes + (1 << 20));
        Ok(())
    }

    #[test]
    fn a_large_mesh_has_fewer_subdomains_for_its_size() {
        let options = Options::default();
        // From 32 on they grow, and when they are twice as large there are more of them.
        let shares = [(0.6, 2), (2.0, 2), (2.1, 4), (10.0, 10), (32.0, 32), (48.0, 32)];
        for (shares, n) in shares.into_iter().chain([(500.0, 250)]) {
            assert_eq!(n_subdomains(shares * TETS_PER_SUBDOMAIN, &options).0, n);
        }
        assert_eq!(n_subdomains(TETS_ALONE, &options).0, 1);
        assert_eq!(n_subdomains(1.01 * TETS_ALONE, &options).0, 2);
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
