use super::Rejection;
use crate::client::{self, OnClash};
use crate::events::Report;
use crate::ids::{Digest, Seq, UserId};
use crate::language::UtteranceError;
use crate::limits::UTTERANCE_BYTES_MAX;
use crate::plain;
use crate::world::Stage;

/// A wish that may be refused. What people send is `StartEpisode` to `Close`; `Open` and
/// `FinishRetrain` come from inside the service.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Begin the stream. The recipe's text decides everything that the base mind was trained with.
    Open {
        user: UserId,
        recipe_text: String,
        mind: Digest,
    },
    StartEpisode {
        stage: Stage,
    },
    Say {
        utterance: String,
    },
    /// End the episode early; it counts as abandoned.
    Done,
    /// The utterance recorded at `explains` stands for these actions of the episode (counted from
    /// 1, a contiguous run, all after the utterance). No action at all means "nothing did".
    Teach {
        explains: Seq,
        actions: Vec<u32>,
        on_clash: OnClash,
    },
    /// No more teaching: train on what was taught.
    FinishTeaching,
    /// Take back the lesson recorded at `lesson`.
    Forget {
        lesson: Seq,
    },
    /// What the robot did last is not what was meant.
    MarkWrong,
    /// Withdraw for good. The reason may be empty.
    Close {
        reason: String,
    },
    /// A training has come to its end: the mind and what it measured, or why there is none.
    FinishRetrain {
        recipe: Digest,
        outcome: Result<(Digest, Report), String>,
    },
}

impl Command {
    /// Whether the texts of the command are ones that may be said now. Older versions recorded more;
    /// deciding a recorded command again does not ask.
    ///
    /// - errors: a [hidden](plain::check) character, or a reason that is too long.
    pub(super) fn check_texts(&self) -> Result<(), Rejection> {
        let stage = |what, hidden| Rejection::StageText { what, hidden };
        match self {
            Command::Say { utterance } => {
                // As an utterance is read: without the white space around it, tabs as blanks.
                let text = utterance.trim().replace('\t', " ");
                plain::check(&text).map_err(|hidden| UtteranceError::Hidden(hidden).into())
            }
            Command::StartEpisode { stage: Stage::Seed { .. } } => Ok(()),
            Command::StartEpisode { stage: Stage::Task { task, .. } } => {
                plain::check(task).map_err(|hidden| stage("task", hidden))
            }
            Command::StartEpisode { stage: Stage::Scene { scene, task } } => {
                plain::check(task).map_err(|hidden| stage("task", hidden))?;
                plain::check_lines(scene).map_err(|hidden| stage("scene", hidden))
            }
            Command::Close { reason } if reason.len() > UTTERANCE_BYTES_MAX => {
                Err(Rejection::ReasonTooLong { found: reason.len() })
            }
            Command::Close { reason } => plain::check(reason).map_err(Rejection::Reason),
            Command::Open { .. }
            | Command::Done
            | Command::Teach { .. }
            | Command::FinishTeaching
            | Command::Forget { .. }
            | Command::MarkWrong
            | Command::FinishRetrain { .. } => Ok(()),
        }
    }

    /// The verb as people type it.
    pub fn name(&self) -> &'static str {
        match self {
            Command::Open { .. } => "open",
            Command::StartEpisode { .. } => "start an episode",
            Command::Say { .. } => "say",
            Command::Done => "done",
            Command::Teach { .. } => "teach",
            Command::FinishTeaching => "finish teaching",
            Command::Forget { .. } => "forget",
            Command::MarkWrong => "mark as wrong",
            Command::Close { .. } => "close",
            Command::FinishRetrain { .. } => "finish retraining",
        }
    }
}

impl From<client::Command> for Command {
    fn from(command: client::Command) -> Command {
        match command {
            client::Command::StartEpisode { stage } => Command::StartEpisode { stage },
            client::Command::Say { utterance } => Command::Say { utterance },
            client::Command::Done => Command::Done,
            client::Command::Teach { explains, actions, on_clash } => {
                Command::Teach { explains, actions, on_clash }
            }
            client::Command::FinishTeaching => Command::FinishTeaching,
            client::Command::Forget { lesson } => Command::Forget { lesson },
            client::Command::MarkWrong => Command::MarkWrong,
            client::Command::Close { reason } => Command::Close { reason },
        }
    }
}
