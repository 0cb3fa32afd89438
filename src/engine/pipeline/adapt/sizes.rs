//! Lengths at nodes for a wanted number of tetrahedra.
//!
//! The length is `c` times the relative one, between the limits. Sub-domains keep their skin, so from there it grows and shrinks as
//! the gradation allows, as it does when they are meshed. Both are part of the search for `c`.

use super::arrays::{MeshArrays, MeshPart};
use tetdb_base::geom::Point;
use tetdb_base::storage::{ScratchSpace, SpillVec};
use tetdb_kernel::sizing::{TETS_PER_LOAD, load_of_tet};

/// The search ends within this share of the wanted number; the number itself is known to some percent.
const NEAR: f64 = 0.005;
/// Most steps of the search. Five to eight are usual.
const STEPS_MAX: usize = 30;
/// The search begins at most this far below the factor at which the first length gets shorter. The mean of a steep field is many powers of
/// ten below it, and each step there takes all passes.
const STEEP: f64 = 64.0;
/// Passes over the edges in each direction. In the order of the mesh most lengths are settled after two.
const PASSES_MAX: usize = 20;
/// A load below that of one tetrahedron is none.
const LOAD_MIN: f64 = 1.0 / TETS_PER_LOAD;
/// Paths along edges of a mesh are longer than straight by this much: 1.06 to 1.11 between vertices of boxes, even or graded.
const STRETCH: f64 = 1.09;
/// A change of lengths below this share is none: they are known to a tenth.
const SETTLED: f64 = 0.005;

/// Limits of lengths.
#[derive(Clone, Copy, Debug)]
pub struct SizeLimits {
    /// Least and greatest length.
    pub range: [f64; 2],
    /// Slope with which lengths may grow.
    pub beta: f64,
}

/// Lengths at nodes.
pub struct NodeSizes<'a> {
    mesh: &'a mut MeshArrays,
    limits: SizeLimits,
    /// Relative lengths.
    relative: SpillVec<f64>,
    /// Bounds from the lengths at the skin.
    cones: SpillVec<[f64; 2]>,
    h: SpillVec<f64>,
    /// Loads of the sub-domains with the present lengths.
    loads: Vec<PartLoad>,
    c: f64,
}

/// The load of a sub-domain.
#[derive(Clone, Copy, Default)]
struct PartLoad {
    /// Of tetrahedra with a vertex of the skin, and their number.
    at_skin: f64,
    n_at_skin: f64,
    /// Of all others.
    inside: f64,
}

/// The lengths that a search has found.
pub struct FoundSizes {
    /// At nodes, with the skin as it is.
    pub h: SpillVec<f64>,
    /// Relative lengths at nodes.
    pub relative: SpillVec<f64>,
    /// Factor for relative lengths.
    pub c: f64,
    pub limits: SizeLimits,
    /// Expected tetrahedra of each sub-domain.
    pub tets: Vec<f64>,
}

impl FoundSizes {
    /// The length wanted at a node if the skin were free.
    pub fn wanted(&mut self, v: usize) -> f64 {
        wanted(self.c, self.relative.get(v), &self.limits)
    }
}

fn wanted(c: f64, relative: f64, limits: &SizeLimits) -> f64 {
    (c * relative).max(limits.range[0]).min(limits.range[1])
}

/// The lengths with about `n_tets` tetrahedra, or as near as limits and skin allow.
pub fn sizes_for(
    mesh: &mut MeshArrays,
    relative: SpillVec<f64>,
    limits: SizeLimits,
    n_tets: f64,
    scratch: &ScratchSpace,
) -> FoundSizes {
    let mut sizes = NodeSizes::new(mesh, relative, limits, scratch);
    let ends = sizes.factors();
    let [mut low, mut high] = ends;
    // Free of the skin the number goes with c⁻³.
    let mut slope = -3.0;
    let mut last: Option<[f64; 2]> = None;
    sizes.c = sizes.first_factor().clamp(low.max(high / STEEP), high);
    let mut tets = sizes.tets();
    let (mut is_flat, mut tried) = (false, [false; 2]);
    for _ in 0..STEPS_MAX {
        let [n, at] = [tets.iter().sum::<f64>() / n_tets, sizes.c].map(libm::log);
        let side = usize::from(n > 0.0);
        // At the end limits and skin allow no more, or no less.
        if n.abs() < NEAR || sizes.c == ends[side] {
            break;
        }
        match n > 0.0 {
            true => low = f64::max(low, sizes.c),
            false => high = f64::min(high, sizes.c),
        }
        if let Some([n_before, at_before]) = last {
            slope = ((n - n_before) / (at - at_before)).clamp(-3.0, -0.1);
        }
        last = Some([n, at]);
        // Where a field is steep, all lengths may be at a limit for many factors, though not for all.
        let next = match (is_flat, n > 0.0) {
            (false, _) => libm::exp(at - n / slope),
            (true, false) => sizes.c / 4.0,
            (true, true) => high,
        };
        sizes.c = if low < next && next < high {
            next
        } else if [low, high][side] == ends[side] && !tried[side] {
            tried[side] = true;
            ends[side]
        } else {
            (low * high).sqrt()
        };
        let before = tets;
        tets = sizes.tets();
        is_flat = tets == before;
    }
    let NodeSizes { relative, h, c, limits, .. } = sizes;
    FoundSizes { h, relative, c, limits, tets }
}

impl<'a> NodeSizes<'a> {
    fn new(
        mesh: &'a mut MeshArrays,
        relative: SpillVec<f64>,
        limits: SizeLimits,
        scratch: &ScratchSpace,
    ) -> Self {
        let n = mesh.n_nodes();
        let h = scratch.vec(n, f64::INFINITY);
        let cones = scratch.vec(n, [0.0; 2]);
        let mut sizes = Self { mesh, limits, relative, cones, h, loads: Vec::new(), c: 0.0 };
        // The cones above the skin, and those below it upside down.
        for (bound, sign) in [(1, 1.0), (0, -1.0)] {
            for v in 0..n {
                let own = sizes.mesh.present.get(v) * sign;
                let is_skin = sizes.mesh.skin.get(v) != 0;
                sizes.h.set(v, if is_skin { own } else { f64::INFINITY });
            }
            sizes.grade();
            for v in 0..n {
                let h = sizes.h.get(v) * sign;
                sizes.cones.change(v, |cone| cone[bound] = h);
            }
        }
        for v in 0..n {
            let present = sizes.mesh.present.get(v);
            sizes.h.set(v, present);
        }
        sizes.loads = sizes.loads_now();
        sizes
    }

    /// The least and the greatest factor of interest: above the greatest no length gets longer, below the least none gets shorter. Without
    /// limits the least is a millionth of the greatest, where the number is beyond any.
    fn factors(&mut self) -> [f64; 2] {
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        for v in 0..self.mesh.n_nodes() {
            let relative = self.relative.get(v);
            if self.mesh.skin.get(v) == 0 && relative.is_normal() {
                let [low, high] = self.cones.get(v);
                least = least.min(low.max(self.limits.range[0]) / relative);
                let high = high.min(self.limits.range[1]) / relative;
                most = most.max(if high.is_finite() { high } else { 0.0 });
            }
        }
        match (most.is_normal(), least > 0.0) {
            (false, _) => [1.0; 2],
            (true, true) => [least.min(most), most],
            (true, false) => [1e-6 * most, most],
        }
    }

    /// Where the present lengths have the relative ones as mean, by load.
    fn first_factor(&mut self) -> f64 {
        let n = self.mesh.n_nodes();
        let (mut sum, mut count) = (0.0, 0.0);
        for v in 0..n {
            let ratio = self.mesh.present.get(v) / self.relative.get(v);
            if ratio.is_normal() {
                (sum, count) = (sum + libm::log(ratio), count + 1.0);
            }
        }
        libm::exp(sum / f64::max(count, 1.0))
    }

    /// Sets the lengths for the factor, and returns the tetrahedra to expect in each sub-domain: their present number times the ratio of
    /// the loads.
    fn tets(&mut self) -> Vec<f64> {
        for v in 0..self.mesh.n_nodes() {
            let h = match self.mesh.skin.get(v) {
                0 => {
                    let [low, high] = self.cones.get(v);
                    wanted(self.c, self.relative.get(v), &self.limits).max(low).min(high)
                }
                _ => self.mesh.present.get(v),
            };
            self.h.set(v, h);
        }
        self.grade();
        let now = self.loads_now();
        let tets = |(part, (before, now)): (&MeshPart, (&PartLoad, PartLoad))| {
            let ratio = |now: f64, before: f64| now.max(LOAD_MIN) / before.max(LOAD_MIN);
            // The triangles of the skin stay, and with them what stands on them.
            let at_skin = before.n_at_skin * ratio(now.at_skin, before.at_skin).max(1.0);
            let inside = part.row.tets as f64 - before.n_at_skin;
            let tets = at_skin + inside * ratio(now.inside, before.inside);
            tets.max(part.least_tets as f64)
        };
        self.mesh.parts.iter().zip(self.loads.iter().zip(now)).map(tets).collect()
    }

    fn loads_now(&mut self) -> Vec<PartLoad> {
        let mut loads = vec![PartLoad::default(); self.mesh.parts.len()];
        for (part, load) in loads.iter_mut().enumerate() {
            let first = self.mesh.parts[part].first_tet;
            for t in first..first + self.mesh.parts[part].row.tets as usize {
                let tet = self.mesh.tet(t);
                let [a, b, c, d] = self.mesh.corners(tet);
                let volume = (b - a).dot((c - a).cross(d - a)) / 6.0;
                let own = load_of_tet(volume, tet.map(|v| self.h.get(v as usize)));
                match tet.iter().any(|&v| self.mesh.skin.get(v as usize) != 0) {
                    true => {
                        load.at_skin += own;
                        load.n_at_skin += 1.0;
                    }
                    false => load.inside += own,
                }
            }
        }
        loads
    }

    /// Lets no length exceed another by more than the slope times their distance. The skin stays.
    fn grade(&mut self) {
        let n = self.mesh.tets.len();
        for pass in 0..PASSES_MAX {
            let mut is_settled = true;
            for i in 0..n {
                let tet = self.mesh.tet(if pass % 2 == 0 { i } else { n - 1 - i });
                is_settled &= self.grade_tet(tet);
            }
            if is_settled {
                return;
            }
        }
    }

    /// Returns whether no length changed by much.
    fn grade_tet(&mut self, tet: [u32; 4]) -> bool {
        let mut h = tet.map(|v| self.h.get(v as usize));
        let least = h.into_iter().fold(f64::INFINITY, f64::min);
        if least == f64::INFINITY {
            return true;
        }
        let points: [Point; 4] = self.mesh.corners(tet);
        let (before, slope) = (h, self.limits.beta / STRETCH);
        for i in 0..4 {
            for j in 0..4 {
                let most = h[j] + slope * points[i].distance(points[j]);
                if most < h[i] && self.mesh.skin.get(tet[i] as usize) == 0 {
                    h[i] = most;
                }
            }
        }
        let mut is_settled = true;
        for i in 0..4 {
            if h[i] < before[i] {
                self.h.set(tet[i] as usize, h[i]);
                is_settled &= before[i] - h[i] <= SETTLED * h[i].abs();
            }
        }
        is_settled
    }
}
