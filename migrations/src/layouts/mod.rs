//! Data directories as released. Layout 2 is the present one.

pub mod layout_1;
