//! The museum: the former form of everything that a release ever wrote and a later one writes
//! differently, and the one-way doors out of them.
//!
//! - [`records`]: bodies of events, read through types. Records are never rewritten.
//! - [`layouts`]: data directories, which are brought up by copying.
//!
//! An exhibit never changes once released: it imports nothing that lives, so nothing that lives can
//! move it along. Each door is total, from one form to the next; the last step, into a living type,
//! stands in `apprentice` beside that type. `docs/upgrading.md` says how a form is added.

pub mod layouts;
pub mod records;
