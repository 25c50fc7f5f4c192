//! `retrain_completed`, kind 9.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::Digest;

/// Version 1, written by 0.1: it does not say which code trained.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct V1 {
    pub recipe: Digest,
    pub mind: Digest,
    pub report: Report,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Report {
    pub exemplars: u32,
    pub threshold: f32,
    pub figures: BTreeMap<String, f64>,
}
