use apprentice_core::outcomes::Ending;
use serde::{Deserialize, Serialize};

use super::TenantEvent;
use crate::ids::{Digest, Seq, UserId};
use crate::language::{Answer, Document, Program, Report, Utterance};

/// A fact of one person's life with the robot. Domain-neutral; what a domain knows travels inside
/// [`Document`] and [`Program`].
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    SessionOpened(SessionOpened),
    EpisodeStarted(EpisodeStarted),
    Interpreted(Interpreted),
    EpisodeEnded(EpisodeEnded),
    DecompositionTaught(DecompositionTaught),
    DecompositionDeclined(DecompositionDeclined),
    LessonForgotten(LessonForgotten),
    RetrainScheduled(RetrainScheduled),
    RetrainCompleted(RetrainCompleted),
    RetrainFailed(RetrainFailed),
    SessionClosed(SessionClosed),
    MarkedWrong(MarkedWrong),
    /// Of the tenant's own stream; nothing that a person lived through.
    Tenant(TenantEvent),
}

/// The number of a kind in record headers. Never reused, never renumbered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u16)]
pub enum EventKind {
    SessionOpened = 1,
    EpisodeStarted = 2,
    Interpreted = 3,
    EpisodeEnded = 4,
    DecompositionTaught = 5,
    DecompositionDeclined = 6,
    LessonForgotten = 7,
    RetrainScheduled = 8,
    RetrainCompleted = 9,
    RetrainFailed = 10,
    SessionClosed = 11,
    TenantOpened = 12,
    KeyAdmitted = 13,
    KeyRetired = 14,
    TenantDisabled = 15,
    TenantEnabled = 16,
    QuotasSet = 17,
    PersonErased = 18,
    SegmentClosed = 19,
    MarkedWrong = 20,
}

/// A stream began: who, in which world, with which recipe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionOpened {
    pub user: UserId,
    pub domain: String,
    pub domain_version: u16,
    pub recipe: String,
    /// The recipe's own text (TOML), so that a stream can be replayed when the file is long gone.
    pub recipe_text: String,
    pub recipe_digest: Digest,
    /// The base mind.
    pub mind: Digest,
}

/// The stage was set. The event carries the whole scene: replay reads no generator and no file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeStarted {
    pub scene: Document,
    pub scene_digest: Digest,
    pub task: Document,
    /// The task as a sentence.
    pub goal: String,
    /// The seed of a drawn stage; none when a scene file was given.
    pub seed: Option<u64>,
    /// The fewest primitives that achieve the task from this scene, where the planner found them.
    pub fewest: Option<u32>,
}

/// A person said something, and this is what came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Interpreted {
    pub utterance: Utterance,
    pub answer: Answer,
    /// Primitives carried out in this episode before this utterance; its own, if any, are counted
    /// from the next number on.
    pub actions_before: u32,
    pub scene_after: Digest,
    pub mind: Digest,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeEnded {
    pub ending: Ending,
    pub utterances: u32,
    /// Primitives carried out.
    pub actions: u32,
    /// The [`Interpreted`] events that may be taught now; when empty there is no teaching.
    pub to_teach: Vec<Seq>,
}

impl EpisodeEnded {
    /// Whether `to_teach` is what versions up to 0.2 recorded of `unexplained`, as the record `seq`:
    /// where the goal held although the last utterance had not brought it about, they left that
    /// utterance out. No version since does, and such a record means what today's would.
    pub fn leaves_out_its_own(&self, seq: Seq, unexplained: &[Seq]) -> bool {
        let Some((last, before)) = unexplained.split_last() else { return false };
        self.ending == Ending::Achieved && last.next() == seq && self.to_teach == before
    }
}

/// A person said which run of actions an utterance stands for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DecompositionTaught {
    /// The [`Interpreted`] event that is explained.
    pub explains: Seq,
    pub utterance: Utterance,
    pub program: Program,
    /// The run of actions of the episode, counted from 1, both ends included.
    pub first: u32,
    pub last: u32,
}

/// A person said that nothing they did was what an utterance stands for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DecompositionDeclined {
    pub explains: Seq,
    pub utterance: Utterance,
}

/// A lesson was taken back. `lesson` is its [`DecompositionTaught`] event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LessonForgotten {
    pub lesson: Seq,
    pub utterance: Utterance,
}

/// A training is due: a pure function of the recipe and these lessons, in this order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RetrainScheduled {
    pub recipe: Digest,
    pub lessons: Vec<Seq>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RetrainCompleted {
    pub recipe: Digest,
    pub mind: Digest,
    pub report: Report,
    /// What trained it (`learning::code_digest`): tells a mind that this code cannot be expected to
    /// train again from one that it must. None in records of version 1.
    pub code: Option<Digest>,
}

/// The previous mind stays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RetrainFailed {
    pub recipe: Digest,
    pub reason: String,
}

/// A person said that what the robot did was not what they meant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkedWrong {
    /// The [`Interpreted`] event of the utterance whose program was not meant. If the robot asked first,
    /// the one with the question.
    pub act: Seq,
    /// The words that said so; none when it was a command.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub utterance: Option<Utterance>,
}

/// The person withdrew. Final.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionClosed {
    pub reason: String,
}

impl Event {
    pub fn kind(&self) -> EventKind {
        match self {
            Event::SessionOpened(_) => EventKind::SessionOpened,
            Event::EpisodeStarted(_) => EventKind::EpisodeStarted,
            Event::Interpreted(_) => EventKind::Interpreted,
            Event::EpisodeEnded(_) => EventKind::EpisodeEnded,
            Event::DecompositionTaught(_) => EventKind::DecompositionTaught,
            Event::DecompositionDeclined(_) => EventKind::DecompositionDeclined,
            Event::LessonForgotten(_) => EventKind::LessonForgotten,
            Event::RetrainScheduled(_) => EventKind::RetrainScheduled,
            Event::RetrainCompleted(_) => EventKind::RetrainCompleted,
            Event::RetrainFailed(_) => EventKind::RetrainFailed,
            Event::SessionClosed(_) => EventKind::SessionClosed,
            Event::MarkedWrong(_) => EventKind::MarkedWrong,
            Event::Tenant(event) => event.kind(),
        }
    }
}

impl EventKind {
    pub const ALL: [EventKind; 20] = [
        EventKind::SessionOpened,
        EventKind::EpisodeStarted,
        EventKind::Interpreted,
        EventKind::EpisodeEnded,
        EventKind::DecompositionTaught,
        EventKind::DecompositionDeclined,
        EventKind::LessonForgotten,
        EventKind::RetrainScheduled,
        EventKind::RetrainCompleted,
        EventKind::RetrainFailed,
        EventKind::SessionClosed,
        EventKind::TenantOpened,
        EventKind::KeyAdmitted,
        EventKind::KeyRetired,
        EventKind::TenantDisabled,
        EventKind::TenantEnabled,
        EventKind::QuotasSet,
        EventKind::PersonErased,
        EventKind::SegmentClosed,
        EventKind::MarkedWrong,
    ];

    /// The version of the body that this binary writes.
    pub fn version(self) -> u16 {
        match self {
            EventKind::Interpreted | EventKind::RetrainCompleted | EventKind::KeyRetired => 2,
            _ => 1,
        }
    }

    pub fn from_number(number: u16) -> Option<EventKind> {
        EventKind::ALL.into_iter().find(|kind| *kind as u16 == number)
    }
}
