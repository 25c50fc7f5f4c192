use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::language::{Program, Symbol, Utterance};

/// One taught decomposition, with everything that its lifting depends on. `S` is a world's scene,
/// `T` its task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lesson<S, T> {
    /// What was said.
    pub utterance: Utterance,
    /// What it means: object types, no slots.
    pub program: Program,
    /// The scene at the utterance.
    pub scene: Arc<S>,
    /// The task of that episode.
    pub task: Arc<T>,
    /// The type named last before the utterance: what "it" meant while the hand was empty.
    pub mentioned: Option<Symbol>,
}
