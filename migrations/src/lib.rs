//! The museum: the frozen forms of everything that a release wrote and a later one writes
//! differently, and the conversions out of them.
//!
//! - [`records`]: bodies of events, read through types. Records are never rewritten.
//! - [`layouts`]: data directories, which are upgraded by copying.
//!
//! A form never changes once released. It imports no current type, so a change of a current type
//! cannot change it. Each conversion is total and leads from one form to the next. The last one,
//! into a current type, is in `apprentice` beside that type. `docs/upgrading.md` says how a form is
//! added.

pub mod layouts;
pub mod records;
