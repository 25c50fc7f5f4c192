//! What keeps records private: where randomness comes from, the seal of a record, and the keys.

pub(in crate::store) mod entropy;
pub(in crate::store) mod keys;
pub(in crate::store) mod seal;
