use apprentice_core::ids::{Digest, Seq};
use apprentice_core::language::{Answer, Program, Report};
use apprentice_core::outcomes::Ending;
use serde::{Deserialize, Serialize};

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
#[allow(clippy::large_enum_variant, reason = "nearly all that is told are answers")]
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
