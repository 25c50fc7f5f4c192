use serde::{Deserialize, Serialize};

use crate::events::{Ending, Report};
use crate::ids::{Digest, Seq};
use crate::language::{Answer, Exemplar, Program};

/// What a command led to. Computed from the recorded events alone, so a repeated request gets the
/// same reply from the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reply {
    /// The recorded events, first and last.
    pub first: Seq,
    pub last: Seq,
    pub told: Vec<Told>,
}

/// One event as its person is told of it: without scenes and digests that nobody reads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Told {
    Opened {
        recipe: String,
        mind: Digest,
    },
    EpisodeStarted {
        goal: String,
        fewest: Option<u32>,
    },
    Answered {
        seq: Seq,
        utterance: String,
        answer: Answer,
        actions_before: u32,
    },
    EpisodeEnded {
        ending: Ending,
        utterances: u32,
        actions: u32,
        to_teach: Vec<Seq>,
    },
    Taught {
        lesson: Seq,
        explains: Seq,
        utterance: String,
        program: Program,
        first: u32,
        last: u32,
    },
    Declined {
        explains: Seq,
        utterance: String,
    },
    Forgotten {
        lesson: Seq,
        utterance: String,
    },
    Learning {
        lessons: u32,
    },
    Learned {
        mind: Digest,
        report: Report,
    },
    LearningFailed {
        reason: String,
    },
    Closed {
        reason: String,
    },
}

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

/// The answer to [`super::Query::Status`].
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
}

/// One exemplar of the present mind, for [`super::Query::Known`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KnownExemplar {
    pub exemplar: Exemplar,
    /// The lesson it comes from; none for a seed.
    pub lesson: Option<Seq>,
}
