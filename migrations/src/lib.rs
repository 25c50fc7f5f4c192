//! Former formats of everything that a release wrote and a later release writes differently, and
//! conversions to the next format.
//!
//! - [`records`]: bodies of events. Types read them; records are never rewritten.
//! - [`layouts`]: data directories, which are upgraded by copying.
//!
//! A released format never changes. This crate imports nothing from the other crates, so a change
//! there cannot change it. Each conversion is total, from one format to the next. The last one, to
//! a type of today, is in `apprentice` next to that type. `docs/upgrading.md` says how to add a
//! format.

pub mod layouts;
pub mod records;
