use serde::{Deserialize, Serialize};

use super::parsing::ParserWeights;
use super::{Report, TrainError};
use crate::grounding::RerankerWeights;
use crate::ids::Digest;
use crate::language::Exemplar;

/// A mind as it is stored: a MessagePack map with field names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Bundle {
    /// [`Bundle::VERSION`] of the writer.
    pub version: u16,
    /// Of the recipe it was trained with.
    pub recipe: Digest,
    /// How many of the exemplars, from the first, are seeds.
    pub seeds: u32,
    /// Seeds, then lessons.
    pub exemplars: Vec<Exemplar>,
    /// What the parser learned.
    pub parser: ParserWeights,
    /// None before the first lesson.
    pub reranker: Option<RerankerWeights>,
    /// What the training measured.
    pub report: Report,
}

impl Bundle {
    /// Goes up when the form changes; a mind of another version is trained again.
    pub(super) const VERSION: u16 = 1;
}

/// The bytes of a stored mind.
pub(super) fn encode(bundle: &Bundle) -> Vec<u8> {
    rmp_serde::to_vec_named(bundle).expect("a bundle is plain data, which MessagePack can hold")
}

/// Reads a stored mind.
///
/// - errors: bytes that are not a bundle, or of another version.
pub(super) fn decode(bytes: &[u8]) -> Result<Bundle, TrainError> {
    #[derive(Deserialize)]
    struct Versioned {
        version: u16,
    }
    let Versioned { version } = rmp_serde::from_slice(bytes).map_err(TrainError::unreadable)?;
    if version != Bundle::VERSION {
        let reason = format!(
            "it has version {version}, this binary reads version {}; train it again",
            Bundle::VERSION
        );
        return Err(TrainError::Unreadable { reason });
    }
    rmp_serde::from_slice(bytes).map_err(TrainError::unreadable)
}
