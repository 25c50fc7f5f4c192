//! The event log, its caches and its audit. Uses the library alone; see `tests/README.md`.

mod audit;
mod caches;
mod log_conformance;
mod recovery;
