//! What may vanish at any moment and costs time only: minds and snapshots, and their origin.

pub(in crate::store) mod cache;
pub(in crate::store) mod models;
pub(in crate::store) mod origin;
pub(in crate::store) mod snapshots;
