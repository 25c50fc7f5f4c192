//! Studies, evaluations and their figures. Runs the program; see `tests/README.md`.

#[path = "../support"]
mod support {
    pub mod diary;
    pub mod ran;
    pub mod toy;
}

mod conversations;
mod evaluation;
mod report;
mod rerun;
mod whole;
