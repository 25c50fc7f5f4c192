use apprentice_core::ids::{Digest, Seq};
use apprentice_core::language::{Answer, Program, Report};
use apprentice_core::outcomes::Ending;
use serde::{Deserialize, Serialize};

/// What a command led to. It is computed from the recorded events alone, so a repeated request gets
/// the same reply, from the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reply {
    /// The first record that the command led to.
    pub first: Seq,
    /// The last record that the command led to.
    pub last: Seq,
    /// One item for each event that a person is told about, in the order of the records.
    pub told: Vec<Told>,
}

/// One event as the person is told about it: without scenes, and with few digests.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(clippy::large_enum_variant, reason = "nearly all that is told are answers")]
pub enum Told {
    /// The person is new.
    Opened {
        /// The name of the person's recipe.
        recipe: String,
        /// The digest of the recipe's base mind.
        mind: Digest,
    },
    /// An episode began.
    EpisodeStarted {
        /// What must be true at its end.
        goal: String,
        /// The fewest actions that reach the goal; none if they were not computed.
        fewest: Option<u32>,
    },
    /// An utterance was answered.
    Answered {
        /// The record of the answer.
        seq: Seq,
        /// What was said.
        utterance: String,
        /// The outcome and the reasons for it.
        answer: Answer,
        /// Actions of the episode before this answer.
        actions_before: u32,
    },
    /// An episode ended.
    EpisodeEnded {
        /// How it ended.
        ending: Ending,
        /// Utterances of the episode.
        utterances: u32,
        /// Actions of the episode.
        actions: u32,
        /// The records of the answers that may be taught.
        to_teach: Vec<Seq>,
    },
    /// A lesson was taught.
    Taught {
        /// The record of the lesson.
        lesson: Seq,
        /// The record of the answer that it explains.
        explains: Seq,
        /// What was said.
        utterance: String,
        /// What it means from now on.
        program: Program,
        /// The number of the first action of the lesson.
        first: u32,
        /// The number of the last action of the lesson.
        last: u32,
    },
    /// The person said that no action explains an utterance.
    Declined {
        /// The record of the answer.
        explains: Seq,
        /// What was said.
        utterance: String,
    },
    /// A lesson was forgotten.
    Forgotten {
        /// The record of the lesson.
        lesson: Seq,
        /// What had been said.
        utterance: String,
    },
    /// An act was marked as wrong. Its utterance may be taught.
    MarkedWrong {
        /// The record of the act.
        act: Seq,
        /// The words that said so; empty when it was a command.
        utterance: String,
    },
    /// A training is due.
    Learning {
        /// Lessons that the new mind is trained on.
        lessons: u32,
    },
    /// A training ended, and its mind answers from now on.
    Learned {
        /// The digest of the new mind.
        mind: Digest,
        /// What the training measured.
        report: Report,
    },
    /// A training ended without a mind. The former mind stays.
    LearningFailed {
        /// Why, in words of the trainer.
        reason: String,
    },
    /// The person withdrew.
    Closed {
        /// In words of the person. May be empty.
        reason: String,
    },
}
