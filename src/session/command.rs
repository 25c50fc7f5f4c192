use serde::{Deserialize, Serialize};

use super::Rejection;
use crate::events::Report;
use crate::ids::{Digest, Seq, UserId};
use crate::language::UtteranceError;
use crate::limits::UTTERANCE_BYTES_MAX;
use crate::plain;
use crate::world::Stage;

/// A wish that may be refused. What people send is `StartEpisode` to `Close`; `Open` and
/// `FinishRetrain` come from inside the service.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
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
        #[serde(default)]
        on_clash: OnClash,
    },
    /// No more teaching: train on what was taught.
    FinishTeaching,
    /// Take back the lesson recorded at `lesson`.
    Forget {
        lesson: Seq,
    },
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

/// What to do when a new lesson has the lifted form of an old one and another program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum OnClash {
    /// Refuse with `Rejection::Clash`, which names the old lesson; nothing is recorded.
    #[default]
    Ask,
    /// Forget the old lesson and learn the new one, in one batch.
    Replace,
    /// Keep both and let the scene decide.
    Keep,
}

/// A question that changes nothing and is never recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Query {
    /// What the robot sees and holds.
    Look,
    /// The exemplars that answers come from.
    Known,
    /// Phase, goal, progress, actions so far and what may be taught.
    Status,
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
            Command::Close { .. } => "close",
            Command::FinishRetrain { .. } => "finish retraining",
        }
    }
}
