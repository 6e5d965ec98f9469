//! The system's allocator, with an end in order where it has no memory left: one message and an exit code, in place
//! of an abort. For tests one that counts.

#![warn(missing_docs, clippy::undocumented_unsafe_blocks)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::Write;

/// Exit code of a process that gets no memory.
const CODE: i32 = 7;

thread_local! {
    /// True if this thread only asks.
    static ASKING: Cell<bool> = const { Cell::new(false) };
    /// Bytes that this thread took and did not give back, and the most there were; what others give back is not taken
    /// off.
    static TAKEN: Cell<[isize; 2]> = const { Cell::new([0; 2]) };
}

/// The system's allocator that counts what each thread takes; for `#[global_allocator]` of a test.
pub struct Counting;

/// Runs `work`; with it the most bytes that it held at a time, on this thread, beside what there was before.
pub fn counted<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = TAKEN.get()[0];
    TAKEN.set([before; 2]);
    let result = work();
    (result, (TAKEN.get()[1] - before).max(0) as usize)
}

fn take(bytes: usize, instead_of: usize) {
    let _ = TAKEN.try_with(|taken| {
        let now = taken.get()[0] + bytes as isize - instead_of as isize;
        taken.set([now, now.max(taken.get()[1])]);
    });
}

// SAFETY: every call is passed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        take(layout.size(), 0);
        // SAFETY: the caller's promises are those of the system's allocator.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        take(layout.size(), 0);
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        take(size, layout.size());
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        take(0, layout.size());
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// The system's allocator that ends the process where there is no memory; for `#[global_allocator]`.
pub struct Exiting;

/// Lets freed memory go back to the system, where the C library is glibc: large blocks one by one, others from the
/// end of the heap. SuperLU_DIST, which Debian's PETSc brings along, forbids both for the whole process when it is
/// loaded: a factor that is freed would stay taken. To be called once, early.
pub fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    glibc::give_back();
}

/// Gives back what lies free between blocks in use, where the C library is glibc: a factorisation leaves much of
/// that, which blocks of other sizes do not fill.
pub fn trim() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    glibc::trim();
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod glibc {
    use std::ffi::c_int;

    // Parameters of mallopt, of glibc's malloc.h.
    const TRIM_THRESHOLD: c_int = -1;
    const MMAP_THRESHOLD: c_int = -3;
    const MMAP_MAX: c_int = -4;
    /// Byte. What the steps of an eigensolver take and give back for each product is smaller up to 390 000 degrees of
    /// freedom: its pages stay, which saves a third of all page faults at 316 000. What smaller matrices and a
    /// factorisation leave goes back with [`trim`](super::trim).
    const LARGE: c_int = 24 << 20;

    extern "C" {
        fn mallopt(parameter: c_int, value: c_int) -> c_int;
        fn malloc_trim(pad: usize) -> c_int;
    }

    pub(super) fn trim() {
        // SAFETY: it may be called at any time.
        unsafe { malloc_trim(0) };
    }

    fn set(parameter: c_int, value: c_int) {
        // SAFETY: a parameter of malloc.h with a value in its range; it may be set at any time.
        unsafe { mallopt(parameter, value) };
    }

    pub(super) fn give_back() {
        set(MMAP_THRESHOLD, LARGE);
        set(MMAP_MAX, 65_536);
        set(TRIM_THRESHOLD, 2 * LARGE);
    }
}

/// Runs `work`, in which an allocation may fail without ending the process (`Vec::try_reserve`).
pub fn asking<T>(work: impl FnOnce() -> T) -> T {
    let before = ASKING.replace(true);
    let result = work();
    ASKING.set(before);
    result
}

// SAFETY: every call is passed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Exiting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are those of the system's allocator.
        given(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        given(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        given(unsafe { System.realloc(pointer, layout, size) }, size)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

fn given(pointer: *mut u8, size: usize) -> *mut u8 {
    if pointer.is_null() && !ASKING.try_with(Cell::get).unwrap_or(true) {
        // Nothing is allocated any more.
        let _ = writeln!(
            std::io::stderr(),
            "railsqueal: error: out of memory: the system refuses {} MB; use more ranks on more machines or a \
             coarser mesh, or raise the limit (ulimit -v)",
            size.div_ceil(1_000_000)
        );
        std::process::exit(CODE);
    }
    pointer
}

#[cfg(test)]
mod tests {
    use super::*;

    #[global_allocator]
    static MEMORY: Exiting = Exiting;

    #[test]
    fn to_ask_ends_nothing() {
        let mut vector: Vec<u8> = Vec::new();
        // What nobody looks at an optimising compiler does not ask for.
        let mut ask = |bytes| std::hint::black_box(&mut vector).try_reserve_exact(std::hint::black_box(bytes));
        assert!(asking(|| ask(isize::MAX as usize)).is_err());
        assert!(asking(|| ask(1000)).is_ok() && vector.capacity() >= 1000);
    }
}
