//! `interpreted`, kind 3.

use serde::Deserialize;

use super::Digest;

/// Version 1, written by 0.1 and 0.2. It does not say which things the words chose, why an
/// utterance was no request, and what each word was used for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct V1 {
    /// What was said.
    pub utterance: String,
    /// What came of it.
    pub answer: Answer,
    /// Primitives carried out in the episode before.
    pub actions_before: u32,
    /// Of the scene afterwards.
    pub scene_after: Digest,
    /// Of the mind that answered.
    pub mind: Digest,
}

/// What came of an utterance.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Answer {
    /// What was done.
    pub outcome: Outcome,
    /// Why.
    pub evidence: Evidence,
    /// The type that the last mention meant.
    pub mentioned: Option<String>,
}

/// Programs are text: `GOTO Apple; PICKUP Apple`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It was carried out.
    Understood {
        /// What was carried out.
        program: String,
        /// Per step the names of the things it acted on.
        bindings: Vec<Vec<String>>,
    },
    /// The world did not allow it.
    Impossible {
        /// What was understood.
        program: String,
        /// 0-based.
        step: u32,
        /// A sentence.
        reason: String,
    },
    /// Nothing known was close enough.
    NotSure,
}

/// Lifted utterances are text: `pick up <obj>`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Evidence {
    /// Whole, or clause by clause.
    pub lifted: Vec<String>,
    /// Nearest first.
    pub nearest: Vec<Near>,
    /// In the unit of the distances.
    pub threshold: f32,
    /// Candidates that were dropped.
    pub discarded: Vec<Discarded>,
    /// How many candidates the reranker had.
    pub reranked: u32,
    /// Absent in records of 0.1, and if it is empty.
    #[serde(default)]
    pub answered_by: Vec<Answerer>,
}

/// An exemplar that came close.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Near {
    /// A lifted utterance.
    pub exemplar: String,
    /// A lifted program.
    pub program: String,
    /// No unit; smaller is nearer.
    pub distance: f32,
    /// Seeds first, then lessons in order.
    pub number: u32,
}

/// A candidate that was dropped.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Discarded {
    /// A program.
    pub program: String,
    /// A sentence.
    pub reason: String,
}

/// The part of a parser that answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answerer {
    /// Rules over words.
    Grammar,
    /// A network.
    Seq2seq,
}
