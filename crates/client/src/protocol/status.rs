use apprentice_core::ids::{Digest, Seq};
use apprentice_core::language::Exemplar;
use serde::{Deserialize, Serialize};

/// Where a person is in the round of an episode. It decides which commands are accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Between episodes.
    Idle,
    /// In an episode: utterances are accepted.
    Interacting,
    /// After an episode in which something may be taught.
    Teaching,
    /// A training is queued or runs.
    Learning,
    /// The person has withdrawn.
    Closed,
}

/// The answer to [`Query::Status`](super::Query::Status).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Where the person is.
    pub phase: Phase,
    /// The last record of the person's stream; 0 if there is none.
    pub seq: u64,
    /// Episodes that were started.
    pub episodes: u32,
    /// The name of the person's recipe.
    pub recipe: String,
    /// The digest of the mind that answers now.
    pub mind: Digest,
    /// Seeds and lessons that this mind was trained on.
    pub exemplars: u32,
    /// Lessons that were taught and not forgotten.
    pub lessons: u32,
    /// The goal of the present or last episode; none before the first.
    pub goal: Option<String>,
    /// The parts of the goal, each with whether it is reached.
    pub progress: Vec<(String, bool)>,
    /// Utterances of the present or last episode.
    pub utterances: u32,
    /// Actions of the present or last episode, in their order.
    pub actions: Vec<ActionView>,
    /// What may be taught now, in the order in which it was said. Empty outside Teaching.
    pub to_teach: Vec<Teachable>,
}

/// A primitive that was carried out in the present or last episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ActionView {
    /// Its number in the episode, from 1.
    pub number: u32,
    /// `PICKUP Mug`
    pub step: String,
    /// `picks up the mug from the counter top`
    pub sentence: String,
}

/// An utterance that may be taught.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Teachable {
    /// The record of its answer; [`Command::Teach`](super::Command::Teach) names it.
    pub seq: Seq,
    /// What was said.
    pub utterance: String,
    /// Only actions with a greater number can explain it.
    pub actions_before: u32,
    /// True if the outcome was *not sure*. Otherwise it was understood but impossible, or guessed.
    pub not_sure: bool,
    /// True if it was understood, perhaps wrongly, although it had never been taught. Left out if
    /// false.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub guessed: bool,
}

/// One exemplar of the present mind: the answer to [`Query::Known`](super::Query::Known) lists all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KnownExemplar {
    /// The lifted utterance, and the program that it means.
    pub exemplar: Exemplar,
    /// The record of the lesson that it comes from; none for a seed.
    pub lesson: Option<Seq>,
}
