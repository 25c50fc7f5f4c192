//! The event log, its caches and its audit. Uses only the library; see `tests/README.md`.

#[path = "../support"]
mod support {
    pub mod chance;
    pub mod diary;
    pub mod toy;
}

mod audit;
mod caches;
mod log_conformance;
mod recovery;
