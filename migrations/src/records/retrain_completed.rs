//! `retrain_completed`, kind 9.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::Digest;

/// Version 1, written by 0.1: it does not say which code trained.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct V1 {
    /// Of the recipe.
    pub recipe: Digest,
    /// Of the trained mind.
    pub mind: Digest,
    /// What the training measured.
    pub report: Report,
}

/// What a training measured about itself.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Report {
    /// Seeds and lessons.
    pub exemplars: u32,
    /// Of the trained parser.
    pub threshold: f32,
    /// Everything else, by name.
    pub figures: BTreeMap<String, f64>,
}
