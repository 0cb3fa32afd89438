//! Settings of the C library's allocator: large blocks are returned to the system when they are freed.
//!
//! The budget counts the memory that the program holds. But the allocator of the GNU C library keeps memory that a thread freed for
//! later requests of this thread. Each large block that is freed also raises the size of blocks that it keeps, up to 32 MiB. Measured on
//! a run in six sub-domains with two threads and a cap of 224 MiB: it held at most 199 MiB and had 339 MiB resident. With blocks from
//! 256 KiB on mapped separately and few heaps, which are swept, it had 258 MiB.

/// Blocks of this many bytes go back to the system when they are freed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const MAPPED_FROM: i32 = 256 << 10;

/// Least heaps for all threads; where there are more cores, as many. With one heap, threads wait for each other: a run that mostly mends
/// bad tetrahedra took two threads as long as one. With four, two threads have at most 1 MiB more resident.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const HEAPS: usize = 4;

/// Configures the allocator. Must be called before any thread starts.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code)]
pub fn keep_little() {
    let cores = std::thread::available_parallelism().map_or(HEAPS, usize::from);
    let heaps = cores.clamp(HEAPS, 64) as i32;
    // SAFETY: `mallopt` takes two numbers and changes only how the allocator works from now on; no other thread exists yet. A result of
    // 0 means that the setting is unknown, which costs only memory.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, heaps);
        libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED_FROM);
    }
}

/// Starts a thread that regularly returns unused pages of the heaps to the system.
///
/// Blocks of all ages share a heap, so its end is hardly ever free. Measured on 20 million tetrahedra with two threads and a cap of 128
/// MiB: at most 160 MiB resident, and 170 MiB without this thread (one heap).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code)]
pub fn keep_sweeping() {
    let sweep = || {
        loop {
            std::thread::sleep(EVERY);
            // SAFETY: `malloc_trim` takes the allocator's own lock and touches no block in use.
            unsafe {
                libc::malloc_trim(0);
            }
        }
    };
    // Without the thread everything works, with more memory.
    let _ = std::thread::Builder::new().name("heap".into()).spawn(sweep);
}

/// A sweep takes less than half a millisecond.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const EVERY: std::time::Duration = std::time::Duration::from_millis(100);

/// Does nothing for other allocators.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn keep_little() {}

/// Does nothing for other allocators.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn keep_sweeping() {}
