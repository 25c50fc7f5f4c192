//! Faults on purpose: a log that fails by plan, and the drill that a service runs with it.

pub(in crate::store) mod drill;
pub(in crate::store) mod faulty;
