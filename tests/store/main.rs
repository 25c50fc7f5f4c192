//! The event log, its caches and its audit. Uses only the library; see `tests/README.md`.

mod audit;
mod caches;
mod log_conformance;
mod recovery;
