//! Panics on purpose, for the tests that show what a panic costs (`tests/faults/`).
//!
//! In a release build, [`point`] is empty.

/// A place where a test may let the program panic. With the environment variable
/// `APPRENTICE_PANIC=NAME:N`, it panics when the point NAME is passed for the N-th time.
#[cfg(debug_assertions)]
pub fn point(name: &'static str) {
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicU64, Ordering};

    static WANTED: OnceLock<Option<(String, u64)>> = OnceLock::new();
    static PASSED: AtomicU64 = AtomicU64::new(0);

    let wanted = WANTED.get_or_init(|| {
        let text = std::env::var("APPRENTICE_PANIC").ok()?;
        let (name, number) = text.split_once(':')?;
        Some((name.to_owned(), number.parse().ok()?))
    });
    let Some((wanted, number)) = wanted else { return };
    if wanted == name && PASSED.fetch_add(1, Ordering::SeqCst) + 1 == *number {
        panic!("a test wants a panic in the {name}");
    }
}

/// A place where a test may let the program panic; empty in a release build.
#[cfg(not(debug_assertions))]
#[inline]
pub fn point(_: &'static str) {}
