//! `interpreted`, kind 3.

use serde::Deserialize;

use super::Digest;

/// Version 1, written by 0.1 and 0.2. It does not say which things the words chose, why an
/// utterance was no request, and what each word was used for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct V1 {
    pub utterance: String,
    pub answer: Answer,
    pub actions_before: u32,
    pub scene_after: Digest,
    pub mind: Digest,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Answer {
    pub outcome: Outcome,
    pub evidence: Evidence,
    pub mentioned: Option<String>,
}

/// Programs are text: `GOTO Apple; PICKUP Apple`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    Understood { program: String, bindings: Vec<Vec<String>> },
    Impossible { program: String, step: u32, reason: String },
    NotSure,
}

/// Lifted utterances are text: `pick up <obj>`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Evidence {
    pub lifted: Vec<String>,
    pub nearest: Vec<Near>,
    pub threshold: f32,
    pub discarded: Vec<Discarded>,
    pub reranked: u32,
    /// Absent in records of 0.1, and if it is empty.
    #[serde(default)]
    pub answered_by: Vec<Answerer>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Near {
    pub exemplar: String,
    pub program: String,
    pub distance: f32,
    pub number: u32,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Discarded {
    pub program: String,
    pub reason: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answerer {
    Grammar,
    Seq2seq,
}
