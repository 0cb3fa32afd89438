//! How the C library keeps memory that was given back: not at all, where it is large.
//!
//! The ledger counts what is held. But the allocator of the GNU C library keeps what a thread gave back for that thread's next
//! requests, and learns from each large block that is freed to keep blocks of its size, up to 32 MiB. Measured: a run in six sub-domains
//! with two threads and a cap of 224 MiB held 199 MiB at most and had 339 MiB resident; with blocks from 256 KiB on mapped for themselves
//! and few heaps, which are swept, 258 MiB.

/// Blocks of this many bytes go back to the system when they are freed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const MAPPED_FROM: i32 = 256 << 10;

/// Heaps for all threads. With one they wait for each other: a surface whose mesh is mostly mended took two threads as long as one. With four, two
/// threads have 1 MiB more resident at most.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const HEAPS: i32 = 4;

/// Sets the allocator up. To be called before there are threads.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code)]
pub fn keep_little() {
    // SAFETY: `mallopt` takes two numbers and changes only how the allocator works from now on; no other thread exists yet. An answer
    // of 0 means that the setting is not known, and costs nothing but memory.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, HEAPS);
        libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED_FROM);
    }
}

/// Gives back, from now on and every so often, the pages of smaller blocks in which nothing lies any more.
///
/// Blocks of all ages lie side by side in a heap, so that its end hardly ever falls free. Measured: 20 million tetrahedra with two threads
/// and a cap of 128 MiB had 160 MiB resident at most, without this 170 MiB (one heap).
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
    // Without the thread all works as well, with more memory.
    let _ = std::thread::Builder::new().name("heap".into()).spawn(sweep);
}

/// A sweep takes less than half a millisecond.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const EVERY: std::time::Duration = std::time::Duration::from_millis(100);

/// Other allocators are left as they are.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn keep_little() {}

/// Other allocators are left as they are.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn keep_sweeping() {}
