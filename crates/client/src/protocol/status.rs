use apprentice_core::ids::{Digest, Seq};
use apprentice_core::language::Exemplar;
use serde::{Deserialize, Serialize};

/// Where a person is in the round of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Between episodes.
    Idle,
    /// In an episode: utterances are welcome.
    Interacting,
    /// After an episode that had utterances worth teaching.
    Teaching,
    /// A training is running.
    Learning,
    /// Withdrawn.
    Closed,
}

/// The answer to [`Query::Status`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Status {
    pub phase: Phase,
    /// The last recorded event.
    pub seq: u64,
    pub episodes: u32,
    pub recipe: String,
    pub mind: Digest,
    /// Seeds and live lessons of the present mind.
    pub exemplars: u32,
    pub lessons: u32,
    /// Of the present or last episode.
    pub goal: Option<String>,
    /// The parts of the goal, each with whether it holds.
    pub progress: Vec<(String, bool)>,
    pub utterances: u32,
    pub actions: Vec<ActionView>,
    /// What may be taught now (in Teaching), in the order it was said.
    pub to_teach: Vec<Teachable>,
}

/// A primitive that was carried out in the present or last episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ActionView {
    /// Counted from 1 in the episode.
    pub number: u32,
    /// `PICKUP Mug`
    pub step: String,
    /// `picks up the mug from the counter top`
    pub sentence: String,
}

/// An utterance that may be taught.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Teachable {
    pub seq: Seq,
    pub utterance: String,
    /// Only actions after this number can explain it.
    pub actions_before: u32,
    /// Whether the answer was NOT-SURE; otherwise it was understood but impossible, or guessed.
    pub not_sure: bool,
    /// Whether it was taken, perhaps wrongly, for something that nobody taught. Left out if not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub guessed: bool,
}

/// One exemplar of the present mind, for [`Query::Known`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KnownExemplar {
    pub exemplar: Exemplar,
    /// The lesson it comes from; none for a seed.
    pub lesson: Option<Seq>,
}
