//! Data directories that are damaged, incomplete, moved, or written by earlier releases. Runs the
//! program; see `tests/README.md`.

mod cut_short;
mod kept;
mod labs_rescue;
mod rescue;
mod upgrade;
