//! Data directories that are damaged, incomplete, moved, or written by earlier releases. Runs the
//! program; see `tests/README.md`.

#[path = "../support"]
mod support {
    pub mod chance;
    pub mod diary;
    pub mod ran;
    pub mod released;
    pub mod toy;
    pub mod tree;
}

mod cut_short;
mod kept;
mod labs_rescue;
mod rescue;
mod upgrade;
