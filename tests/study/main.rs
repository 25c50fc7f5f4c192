//! Studies, evaluations and their figures. Runs the program; see `tests/README.md`.

mod conversations;
mod evaluation;
mod report;
mod rerun;
mod whole;
