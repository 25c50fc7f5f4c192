//! Data directories as released. Layout 2 is the current one.

pub mod layout_1;
