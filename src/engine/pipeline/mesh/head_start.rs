//! Head start: inserts a surface's vertices on a second thread while the caller examines the surface.
//!
//! Validation and size computation read the surface, but not the Delaunay mesh of its vertices. One thread builds this mesh in
//! frames without a file, so nothing is on disk before the surface is accepted. The mesh is dropped if it exceeds its frames or
//! if the caller rejects the surface.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::Instant;

use super::coarse::triangulate;
use crate::pipeline::plan::{Options, Plan};
use crate::pipeline::progress::{Event, Watcher};
use tetdb_base::storage::{
    Backing, Pager, ScratchSpace, StorageError, attempt, in_place_scope, n_threads, raise,
};
use tetdb_base::surface::Surface;
use tetdb_kernel::delaunay::KernelStats;
use tetdb_kernel::mesh::Mesh;

/// Bytes of frames per vertex: 6.4 to 7.2 tetrahedra, the vertex and its attribute. A mesh that needs more is dropped and built
/// later.
const FRAMES_VERTEX: u64 = 8 * 32 + 32 + 8;
/// Bytes of frames per triangle: its facet, and the unused part of pages.
const FRAMES_TRIANGLE: u64 = 33;
/// Bytes of frames for the last page of each kind of record.
const FRAMES_LEAST: u64 = 1 << 20;
/// Bytes held per vertex outside the frames: its place in the order of insertion and its number.
const BESIDE_VERTEX: u64 = 24;
/// Bytes that validation and size computation hold when everything is in memory: per triangle (140 measured), and a little
/// besides.
const LOOK_TRIANGLE: u64 = 160;
const LOOK_LEAST: u64 = 16 << 20;

/// A mesh with the vertices and facets of a surface, built before the store exists.
pub struct HeadStart {
    mesh: Mesh,
    kernel: KernelStats,
    /// Wall seconds of the insertion.
    pub seconds: f64,
}

impl HeadStart {
    /// Bytes of frames the mesh holds.
    pub fn bytes(&self) -> u64 {
        frames_bytes(&self.mesh)
    }

    /// Returns the mesh with a spill file for its pages and a limit of `bytes` for frames, which must be enough for the mesh.
    pub fn into_mesh(mut self, bytes: u64, backing: Backing) -> (Mesh, KernelStats) {
        self.mesh.pages_mut().limit_with_backing(bytes, backing);
        (self.mesh, self.kernel)
    }
}

fn frames_bytes(mesh: &Mesh) -> u64 {
    mesh.pages().frames_used() as u64 * tetdb_schema::page::FRAME_BYTES as u64
}

/// Memory of a head start, if there is enough for the head start and everything else.
struct HeadStartShare {
    frames: u64,
    /// All bytes of the head start, frames included.
    all: u64,
    /// Upper limit of the frames once sizes are known. Frames that are not touched take no memory.
    frames_later: u64,
}

impl HeadStartShare {
    fn of(surface: &Surface, options: &Options, cap: u64) -> Option<Self> {
        let [points, triangles] = [surface.n_vertices(), surface.n_triangles()].map(|n| n as u64);
        // Sizes from a file may take half of the memory.
        if n_threads() < 2 || triangles == 0 || options.mesh.size_field.is_some() {
            return None;
        }
        let frames = FRAMES_VERTEX * points + FRAMES_TRIANGLE * triangles + FRAMES_LEAST;
        let all = frames + BESIDE_VERTEX * points;
        let held = surface.bytes() as u64;
        let look = LOOK_TRIANGLE * triangles + LOOK_LEAST;
        // Once sizes are known, frames of the head start count as frames of the plan.
        let plan = Plan::new(cap, held + LOOK_LEAST).ok()?;
        let has_room = held + all + look <= cap && frames <= plan.frames;
        has_room.then_some(Self { frames, all, frames_later: Plan::new(cap, held).ok()?.frames })
    }
}

/// Runs `look`, which decides if and how `surface` is meshed, and inserts the surface's vertices at the same time. The insertion
/// takes place only with a second thread and with memory for both under `cap`.
///
/// `look` receives the number of bytes of the cap that it must leave free; its result must not depend on this number. Effects:
/// none on disk. Errors: those of `look`; the inserted vertices are then dropped.
pub fn head_start<T, E>(
    surface: &Surface,
    options: &Options,
    cap: u64,
    watch: &Watcher,
    look: impl FnOnce(u64) -> Result<T, E>,
) -> Result<(T, Option<HeadStart>), E> {
    let Some(share) = HeadStartShare::of(surface, options, cap) else {
        return Ok((look(0)?, None));
    };
    let is_vain = AtomicBool::new(false);
    let made = Mutex::new(None);
    let (tell, hear) = channel();
    let looked = in_place_scope(|scope| {
        let (made, is_vain, share) = (&made, &is_vain, &share);
        scope.spawn(move |_| {
            let start = begin(surface, share, is_vain, tell);
            *made.lock().expect("nobody else has it yet") = start;
        });
        let vain = Vain(is_vain);
        let looked = look(share.all)?;
        std::mem::forget(vain);
        // A pool thread must not wait here: the insertion may be its own next task.
        if rayon::current_thread_index().is_none() {
            hear.iter().for_each(watch);
        }
        Ok(looked)
    })?;
    let made = made.into_inner().expect("the other thread is done");
    Ok((looked, made))
}

/// Cancels the work of the other thread when dropped, also by a panic.
struct Vain<'a>(&'a AtomicBool);

impl Drop for Vain<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Inserts all vertices. Returns `None` if memory is too small, if a point is refused or if the run is cancelled; the regular
/// insertion reports the cause.
fn begin(
    surface: &Surface,
    share: &HeadStartShare,
    is_vain: &AtomicBool,
    tell: Sender<Event>,
) -> Option<HeadStart> {
    let clock = Instant::now();
    let watch = |event: Event| {
        if is_vain.load(Ordering::Relaxed) {
            raise(StorageError::Cancelled);
        }
        // The receiver is gone once the surface is refused.
        let _ = tell.send(event);
    };
    let inserted = attempt(|| {
        let mut pages = Pager::new(share.frames_later, None);
        pages.limit(share.frames);
        let mut mesh = Mesh::new(pages);
        let kernel = triangulate(&mut mesh, surface, &ScratchSpace::boundless(), &watch).ok()?;
        Some((mesh, kernel))
    });
    // The regular insertion fails again and reports the cause, or has enough memory.
    let (mesh, kernel) = inserted.ok()??;
    Some(HeadStart { mesh, kernel, seconds: clock.elapsed().as_secs_f64() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::mesh::coarse::inserted;
    use crate::pipeline::progress::silent;
    use tetdb_base::storage::{FlatPages, Pages, kind};
    use tetdb_kernel::samples::SampleSpec;
    use tetdb_schema::page::SLOT_BITS;

    const CAP: u64 = 1 << 30;

    fn surface() -> Surface {
        let spec = SampleSpec::parse("balls,count=5,h=0.08").expect("a good sample");
        spec.make().expect("room for five balls").into()
    }

    fn with_threads<T: Send>(n: usize, work: impl FnOnce() -> T + Send) -> T {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        pool.expect("threads").install(work)
    }

    /// All records of tetrahedra, vertices and facets.
    fn records<P: Pages>(mesh: &mut Mesh<P>) -> Vec<[u32; 8]> {
        let mut all = Vec::new();
        let mut from = 0;
        while let Some((t, tet)) = mesh.next_tet(from) {
            from = t + 1;
            all.push(tet.to_slot().map(u32::from));
        }
        for v in mesh.vertex_ids() {
            all.push(mesh.pages_mut().read::<{ kind::VERTICES }>(v).map(u32::from));
        }
        for n in 0..mesh.n_facets() {
            let facet = mesh.facet(n);
            let [a, b, c] = facet.vertices;
            all.push([a, b, c, facet.label, facet.input as u32, 0, 0, 0]);
        }
        all
    }

    #[test]
    fn what_is_made_ahead_is_what_is_made_in_turn_wherever_its_pages_go() {
        let (surface, options) = (surface(), Options::default());
        let mut flat = Mesh::new(FlatPages::default());
        let kernel = inserted(&mut flat, &surface, &ScratchSpace::boundless(), &silent);
        let expected = records(&mut flat);
        let begun =
            with_threads(2, || head_start(&surface, &options, CAP, &silent, Ok::<_, StorageError>));
        let (taken, begun) = begun.expect("nothing to object to");
        let begun = begun.expect("two threads and room for all");
        assert!(taken > begun.bytes());
        let dir = tempfile::tempdir().expect("a folder");
        let backing = Backing {
            subdomain: 0,
            generation: 1,
            spill: dir.path().into(),
            output: None,
            base: None,
            cache_bytes: 1 << 20,
        };
        let bytes = begun.bytes();
        let (mut mesh, found) = begun.into_mesh(bytes, backing);
        assert_eq!(found, kernel);
        // Writes enough scratch pages that the pages inserted early leave memory.
        let n = mesh.pages().n_pages::<{ kind::SCRATCH }>() + 4 * mesh.pages().frames_used() as u32;
        for page in 0..n {
            mesh.set_scratch((page << SLOT_BITS) * 8, page);
        }
        mesh.clear_scratch();
        assert!(mesh.pages().stats().pages_written > 0);
        assert!(records(&mut mesh) == expected);
    }

    #[test]
    fn a_refused_surface_and_too_little_room_leave_nothing() {
        let (surface, options) = (surface(), Options::default());
        let refused = with_threads(2, || {
            head_start(&surface, &options, CAP, &silent, |_| Err::<(), _>("bad"))
        });
        assert_eq!(refused.err(), Some("bad"));
        for (threads, cap) in [(1, CAP), (2, 16 << 20)] {
            let looked = with_threads(threads, || {
                head_start(&surface, &options, cap, &silent, Ok::<_, StorageError>)
            });
            assert!(matches!(looked, Ok((0, None))));
        }
        let share = HeadStartShare { frames: 0, all: 0, frames_later: CAP };
        let (tell, _hear) = channel();
        assert!(begin(&surface, &share, &AtomicBool::new(false), tell.clone()).is_some());
        assert!(begin(&surface, &share, &AtomicBool::new(true), tell).is_none());
        let large = SampleSpec::parse("box,h=0.04").expect("a good sample");
        let large: Surface = large.make().expect("a box").into();
        let (tell, _hear) = channel();
        assert!(begin(&large, &share, &AtomicBool::new(false), tell).is_none());
    }
}
