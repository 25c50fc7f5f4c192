//! The mind of apprentice, without a service: a [`learning::Mind`] is a pure function of a recipe
//! and lessons ([`learning::train`]). It turns an utterance into a program of the world's
//! primitives, or says that it is not sure.

use apprentice_core::{ids, language, limits, numerics, world};

pub mod dialogue;
pub mod grounding;
pub mod learning;
pub mod parser;
