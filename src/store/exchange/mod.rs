//! Moving data between directories: export and import of a tenant, and rescue from a damaged one.

pub(in crate::store) mod export;
pub(in crate::store) mod import;
pub(in crate::store) mod rescue;
pub(in crate::store) mod salvage;
