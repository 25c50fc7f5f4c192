use serde::{Deserialize, Serialize};

use crate::events::{Ending, Event, Record, Report};
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

/// The reply to the command that these records came from. `records` is not empty: every accepted
/// command records something.
pub fn reply_of(records: &[Record]) -> Reply {
    let first = records.first().expect("an accepted command records at least one event").seq;
    let last = records.last().expect("an accepted command records at least one event").seq;
    Reply { first, last, told: records.iter().filter_map(told).collect() }
}

/// - returns: none for what is nobody's, and stands in no person's stream.
fn told(record: &Record) -> Option<Told> {
    Some(match record.event.clone() {
        Event::SessionOpened(event) => Told::Opened { recipe: event.recipe, mind: event.mind },
        Event::EpisodeStarted(event) => {
            Told::EpisodeStarted { goal: event.goal, fewest: event.fewest }
        }
        Event::Interpreted(event) => Told::Answered {
            seq: record.seq,
            utterance: event.utterance.into(),
            answer: event.answer,
            actions_before: event.actions_before,
        },
        Event::EpisodeEnded(event) => Told::EpisodeEnded {
            ending: event.ending,
            utterances: event.utterances,
            actions: event.actions,
            to_teach: event.to_teach,
        },
        Event::DecompositionTaught(event) => Told::Taught {
            lesson: record.seq,
            explains: event.explains,
            utterance: event.utterance.into(),
            program: event.program,
            first: event.first,
            last: event.last,
        },
        Event::DecompositionDeclined(event) => {
            Told::Declined { explains: event.explains, utterance: event.utterance.into() }
        }
        Event::LessonForgotten(event) => {
            Told::Forgotten { lesson: event.lesson, utterance: event.utterance.into() }
        }
        Event::RetrainScheduled(event) => Told::Learning { lessons: event.lessons.len() as u32 },
        Event::RetrainCompleted(event) => Told::Learned { mind: event.mind, report: event.report },
        Event::RetrainFailed(event) => Told::LearningFailed { reason: event.reason },
        Event::SessionClosed(event) => Told::Closed { reason: event.reason },
        Event::Tenant(_) => return None,
    })
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
    /// Whether the answer was NOT-SURE; otherwise it was understood but impossible, or guessed.
    pub not_sure: bool,
    /// Whether it was taken, perhaps wrongly, for something that nobody taught. Left out if not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub guessed: bool,
}

/// One exemplar of the present mind, for [`super::Query::Known`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KnownExemplar {
    pub exemplar: Exemplar,
    /// The lesson it comes from; none for a seed.
    pub lesson: Option<Seq>,
}
