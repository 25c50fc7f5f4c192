use serde::{Deserialize, Serialize};

use super::{LiftedProgram, LiftedUtterance, Program, Symbol};

/// What came of one utterance, and why: everything a person, an auditor or a simulated teacher may
/// ask about it later.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    pub outcome: Outcome,
    pub evidence: Evidence,
    /// The type that the last mention meant: what a later "it" means while the hand is empty.
    pub mentioned: Option<Symbol>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The program was carried out. `bindings[i]` names the things that step `i` acted on.
    Understood { program: Program, bindings: Vec<Vec<String>> },
    /// The words were known and the world forbids it: nothing was carried out. `step` is 0-based.
    Impossible { program: Program, step: u32, reason: String },
    /// Nothing known is close enough. Nothing was carried out.
    NotSure,
}

/// Why the answer is what it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct Evidence {
    /// The utterance as the parser saw it, whole or clause by clause.
    pub lifted: Vec<LiftedUtterance>,
    /// The nearest exemplars, nearest first, whether or not they were near enough.
    pub nearest: Vec<Near>,
    /// The threshold that `nearest` was held against, in the same unit as its distances.
    pub threshold: f32,
    /// Candidates that were dropped, with the reason.
    pub discarded: Vec<Discarded>,
    /// How many candidates the reranker had to choose from; 0 when it was not asked.
    pub reranked: u32,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Near {
    pub exemplar: LiftedUtterance,
    pub program: LiftedProgram,
    /// No unit; smaller is nearer.
    pub distance: f32,
    /// Which of the mind's exemplars this is; seeds come first, then lessons in order.
    pub number: u32,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Discarded {
    pub program: Program,
    /// A sentence that names the object and the reason.
    pub reason: String,
}
