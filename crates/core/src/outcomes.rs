//! How an episode and a training ended. The log and the wire write these in the same form.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// How an episode came to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    Achieved,
    Abandoned,
}

/// What a training measured about itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct Report {
    /// Seeds and live lessons.
    pub exemplars: u32,
    pub threshold: f32,
    /// Everything else the parser kind reports, by name.
    pub figures: BTreeMap<String, f64>,
}
