//! Data directories as released. Layout 2 is what lives.

pub mod layout_1;
