//! A data directory on disk. `open` is the sequence; each step has a file.

pub(in crate::store) mod check;
pub(in crate::store) mod checkpoints;
pub(in crate::store) mod copy;
pub(in crate::store) mod error;
pub(in crate::store) mod layout;
pub(in crate::store) mod open;
pub(in crate::store) mod store;
pub(in crate::store) mod unfinished;
mod upgrade;
