use super::Rejection;
use crate::client;
use crate::events::Report;
use crate::ids::{Digest, UserId};
use crate::language::UtteranceError;
use crate::limits::UTTERANCE_BYTES_MAX;
use crate::plain;
use crate::world::Stage;

/// A wish that may be refused: a person's, or one from inside the service.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Begin the stream. The recipe's text decides everything that the base mind was trained with.
    Open { user: UserId, recipe_text: String, mind: Digest },
    /// What the person wants.
    Person(client::Command),
    /// A training has come to its end: the mind and what it measured, or why there is none.
    FinishRetrain { recipe: Digest, outcome: Result<(Digest, Report), String> },
}

impl Command {
    /// Whether the texts of the command are ones that may be said now. Older versions recorded more;
    /// deciding a recorded command again does not ask.
    ///
    /// - errors: a [hidden](plain::check) character, or a reason that is too long.
    pub(super) fn check_texts(&self) -> Result<(), Rejection> {
        use client::Command;
        let stage = |what, hidden| Rejection::StageText { what, hidden };
        let Self::Person(command) = self else { return Ok(()) };
        match command {
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
            Command::Done
            | Command::Teach { .. }
            | Command::FinishTeaching
            | Command::Forget { .. }
            | Command::MarkWrong => Ok(()),
        }
    }

    /// The verb as people type it.
    pub fn name(&self) -> &'static str {
        use client::Command;
        match self {
            Self::Open { .. } => "open",
            Self::Person(Command::StartEpisode { .. }) => "start an episode",
            Self::Person(Command::Say { .. }) => "say",
            Self::Person(Command::Done) => "done",
            Self::Person(Command::Teach { .. }) => "teach",
            Self::Person(Command::FinishTeaching) => "finish teaching",
            Self::Person(Command::Forget { .. }) => "forget",
            Self::Person(Command::MarkWrong) => "mark as wrong",
            Self::Person(Command::Close { .. }) => "close",
            Self::FinishRetrain { .. } => "finish retraining",
        }
    }
}

impl From<client::Command> for Command {
    fn from(command: client::Command) -> Command {
        Command::Person(command)
    }
}
