use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::language::{Program, Symbol, Utterance};

/// One taught decomposition, with what its lifting depends on. `S` is the domain's scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lesson<S, T> {
    pub utterance: Utterance,
    /// Ground: object types, no slots.
    pub program: Program,
    /// The scene at the utterance.
    pub scene: Arc<S>,
    /// The task of that episode.
    pub task: Arc<T>,
    /// The type named last before the utterance: what "it" meant while the hand was empty.
    pub mentioned: Option<Symbol>,
}
