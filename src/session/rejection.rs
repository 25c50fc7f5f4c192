use crate::client::{Phase, Rejected, RejectionCode, Response};
use crate::ids::{RequestId, Seq};
use crate::language::{LiftedProgram, LiftedUtterance, UtteranceError};
use crate::limits::{
    EPISODE_ACTIONS_MAX, EPISODE_UTTERANCES_MAX, LESSONS_MAX, SCENE_FILE_BYTES_MAX,
    UTTERANCE_BYTES_MAX,
};
use crate::plain::{self, Hidden};
use crate::world::StageError;

/// Why a command was declined. Normal; nothing was recorded. The text is for the person who asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Rejection {
    #[error(transparent)]
    Utterance(#[from] UtteranceError),
    #[error(transparent)]
    Stage(#[from] StageError),
    #[error("in the {what}, {hidden}")]
    StageText { what: &'static str, hidden: Hidden },
    #[error("in the reason, {0}")]
    Reason(Hidden),
    #[error("the reason has {found} bytes; the limit is {UTTERANCE_BYTES_MAX}")]
    ReasonTooLong { found: usize },
    #[error("{command} is not possible {}; {}", phase_words(*phase), way_out(*phase))]
    WrongPhase { command: &'static str, phase: Phase },
    #[error("still learning from the last lessons; try again in a moment")]
    StillLearning,
    #[error("this session is closed and cannot be opened again")]
    Closed,
    #[error("the session is already open")]
    AlreadyOpen,
    #[error("this person has no records, so there is no session to close")]
    NobodyThere,
    #[error("there is no utterance to teach at record {explains}; status lists what can be taught")]
    NothingToTeach { explains: Seq },
    #[error("the utterance at record {explains} was already taught or declined")]
    TaughtAlready { explains: Seq },
    #[error("actions {actions:?} are not consecutive; name a first and a last action")]
    NotContiguous { actions: Vec<u32> },
    #[error("you named actions {first}..{last}, but this episode has {have} actions")]
    NoSuchAction { first: u32, last: u32, have: u32 },
    #[error(
        "action {first} came before you said \"{utterance}\"; start at action {} or later",
        before + 1
    )]
    NotAfter { first: u32, before: u32, utterance: String },
    /// Another program already has this lifted form, or a form that covers it.
    #[error(
        "\"{utterance}\" already means {known} ({}); {}",
        whose(*lesson),
        clash_way_out(*lesson)
    )]
    Clash { utterance: LiftedUtterance, known: LiftedProgram, lesson: Option<Seq> },
    #[error("there is no act in this task that you could mark as wrong")]
    NothingToMark,
    #[error("what I did for \"{utterance}\" is already marked as wrong")]
    MarkedAlready { utterance: String },
    #[error("there is no lesson at record {lesson}, or it was already forgotten")]
    NoSuchLesson { lesson: Seq },
    #[error("you have {LESSONS_MAX} lessons, and the limit is {LESSONS_MAX}; forget one first")]
    TooManyLessons,
    #[error(
        "an episode has at most {EPISODE_UTTERANCES_MAX} utterances and {EPISODE_ACTIONS_MAX} \
         actions; say done and start another"
    )]
    EpisodeFull,
    #[error("the scene has {found} bytes; the limit is {SCENE_FILE_BYTES_MAX}")]
    SceneTooLarge { found: usize },
    #[error("no training is running for recipe {recipe}")]
    NoTraining { recipe: String },
    #[error("the recipe cannot be read: {reason}")]
    Recipe { reason: String },
    #[error(
        "request id {request} was used before, for the command {used_for:?} (record {first}); \
         send this command with a new id"
    )]
    RequestIdReused { request: RequestId, used_for: &'static str, first: Seq },
}

impl Rejection {
    pub fn code(&self) -> RejectionCode {
        match self {
            Rejection::Utterance(_) => RejectionCode::BadUtterance,
            Rejection::Stage(_) | Rejection::StageText { .. } | Rejection::SceneTooLarge { .. } => {
                RejectionCode::BadStage
            }
            Rejection::Reason(_) | Rejection::ReasonTooLong { .. } => RejectionCode::BadText,
            Rejection::WrongPhase { .. } | Rejection::AlreadyOpen | Rejection::NobodyThere => {
                RejectionCode::WrongPhase
            }
            Rejection::StillLearning => RejectionCode::StillLearning,
            Rejection::Closed => RejectionCode::Closed,
            Rejection::NothingToTeach { .. }
            | Rejection::TaughtAlready { .. }
            | Rejection::NotContiguous { .. }
            | Rejection::NoSuchAction { .. }
            | Rejection::NotAfter { .. } => RejectionCode::BadTeach,
            // The code `clash` offers a choice. A seed offers none.
            Rejection::Clash { lesson: None, .. } => RejectionCode::BadTeach,
            Rejection::Clash { .. } => RejectionCode::Clash,
            Rejection::NothingToMark | Rejection::MarkedAlready { .. } => {
                RejectionCode::NothingToMark
            }
            Rejection::NoSuchLesson { .. } => RejectionCode::NoSuchLesson,
            Rejection::TooManyLessons | Rejection::EpisodeFull => RejectionCode::LimitReached,
            Rejection::RequestIdReused { .. } => RejectionCode::RequestIdReused,
            Rejection::NoTraining { .. } | Rejection::Recipe { .. } => RejectionCode::Internal,
        }
    }
}

fn phase_words(phase: Phase) -> &'static str {
    match phase {
        Phase::Idle => "between episodes",
        Phase::Interacting => "during an episode",
        Phase::Teaching => "while lessons are being taught",
        Phase::Learning => "while learning",
        Phase::Closed => "in a closed session",
    }
}

fn way_out(phase: Phase) -> &'static str {
    match phase {
        Phase::Idle => "start an episode first",
        Phase::Interacting => "reach the goal or say done first",
        Phase::Teaching => "finish teaching first",
        Phase::Learning => "wait until it has learned",
        Phase::Closed => "it cannot be opened again",
    }
}

fn whose(lesson: Option<Seq>) -> String {
    match lesson {
        Some(seq) => format!("your lesson at record {seq}"),
        None => "known from the start".to_owned(),
    }
}

fn clash_way_out(lesson: Option<Seq>) -> &'static str {
    match lesson {
        Some(_) => "replace it, keep both, or cancel",
        None => "this cannot be changed, so teach other words",
    }
}

impl From<Rejection> for Response {
    fn from(rejection: Rejection) -> Response {
        // It may quote what the person sent.
        let message = plain::escape(&rejection.to_string()).into_owned();
        Response::Rejected(Rejected { code: rejection.code(), message })
    }
}
