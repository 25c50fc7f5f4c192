//! Small files that survive a crash, the lock of a directory, and marks of an orderly end.

pub(in crate::store) mod closed;
pub(in crate::store) mod files;
pub(in crate::store) mod lock;
