use std::fmt;

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

impl Answer {
    /// Whether a part that answers whatever is said gave the program, or some of it, for words that
    /// it was never taught.
    pub fn guessed(&self) -> bool {
        let Evidence { lifted, nearest, answered_by, .. } = &self.evidence;
        let taught = |clause: &LiftedUtterance| nearest.iter().any(|near| near.exemplar == *clause);
        let clauses = lifted.iter().zip(answered_by);
        clauses.into_iter().any(|(clause, by)| *by == Answerer::Seq2seq && !taught(clause))
    }
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
    /// Which part of the parser gave the program, clause by clause as in `lifted`. Empty where
    /// there is no program, and for parsers that have one part only.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub answered_by: Vec<Answerer>,
}

/// A part of a parser that answers by itself: in the paper's baseline a grammar answers first, else
/// a network, and a study counts which (paper: 713 of 793 parses were the grammar's).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answerer {
    Grammar,
    Seq2seq,
}

impl fmt::Display for Answerer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Answerer::Grammar => "the grammar",
            Answerer::Seq2seq => "the sequence-to-sequence model",
        })
    }
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
