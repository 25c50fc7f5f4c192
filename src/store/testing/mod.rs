//! For tests only: what every log must do, and the readers of private files.

pub mod conformance;
pub mod decoders;
