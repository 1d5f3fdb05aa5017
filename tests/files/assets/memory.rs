//! Counts the bytes that a thread allocates, so that a reader's memory use does not depend on the
//! machine.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

thread_local! {
    static NOW: Cell<i64> = const { Cell::new(0) };
    static MOST: Cell<i64> = const { Cell::new(0) };
}

struct Counting;

#[global_allocator]
static COUNTING: Counting = Counting;

fn count(change: i64) {
    // A thread that is ending has lost its counter, which nobody reads any more.
    let _ = NOW.try_with(|now| {
        now.set(now.get() + change);
        let _ = MOST.try_with(|most| most.set(most.get().max(now.get())));
    });
}

#[allow(unsafe_code)]
// SAFETY: all calls go to the system's allocator; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as i64);
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as i64);
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as i64));
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Peak of the bytes that `work` holds at once on this thread, beyond those held before, and its
/// result.
pub fn peak<T>(work: impl FnOnce() -> T) -> (i64, T) {
    let before = NOW.get();
    MOST.set(before);
    let result = work();
    (MOST.get() - before, result)
}

#[test]
fn the_peak_is_the_most_at_once() {
    let (most, ()) = peak(|| {
        drop(vec![1_u8; 3_000_000]);
        let mut grown = vec![1_u8; 1_000_000];
        grown.reserve_exact(1_000_000);
        drop(std::hint::black_box(grown));
    });
    assert!((3_000_000..3_100_000).contains(&most), "{most}");
}
