use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// What a training measured about itself. Stored in minds and in records, so its form is fixed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Report {
    /// Seeds and live lessons.
    pub exemplars: u32,
    /// The largest distance that counts as understood, in the unit of the parser's distances.
    pub threshold: f32,
    /// What else the parser and the reranker measured, by name.
    pub figures: BTreeMap<String, f64>,
}
