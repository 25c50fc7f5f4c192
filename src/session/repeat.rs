//! A request id that comes again: what it was used for, and the reply to it.
//!
//! A record names its request and holds no command. So the command is read out of the events that
//! it led to: that needs nothing but the log, and holds for records of every version.

use super::decide;
use super::{Rejection, Session, reply_of};
use crate::client::{Command, OnClash, Reply};
use crate::events::{Ending, EpisodeStarted, Event, Record};
use crate::language::{Document, Utterance};
use crate::world::{Stage, World};

/// The command that these records came from, where the records tell: all but the stage of an
/// episode (a scene file is not recorded as its text), opening, closing and the end of a training.
pub fn command_of(batch: &[Record]) -> Option<Command> {
    let first = &batch.first()?.event;
    let teaches = batch.iter().find_map(|record| match &record.event {
        Event::DecompositionTaught(taught) => Some(taught),
        _ => None,
    });
    if let Some(taught) = teaches {
        // Whether the person was asked about a clash is not recorded, and need not be: keeping both
        // records the same when there is none.
        let replaces = matches!(first, Event::LessonForgotten(_));
        return Some(Command::Teach {
            explains: taught.explains,
            actions: run(taught.first, taught.last),
            on_clash: if replaces { OnClash::Replace } else { OnClash::Keep },
        });
    }
    match first {
        Event::Interpreted(event) => {
            Some(Command::Say { utterance: event.utterance.as_str().to_owned() })
        }
        Event::EpisodeEnded(event) if event.ending == Ending::Abandoned => Some(Command::Done),
        Event::DecompositionDeclined(event) => Some(Command::Teach {
            explains: event.explains,
            actions: Vec::new(),
            on_clash: OnClash::Ask,
        }),
        Event::LessonForgotten(event) => Some(Command::Forget { lesson: event.lesson }),
        Event::MarkedWrong(event) => Some(match &event.utterance {
            Some(utterance) => Command::Say { utterance: utterance.as_str().to_owned() },
            None => Command::MarkWrong,
        }),
        Event::RetrainScheduled(_) => Some(Command::FinishTeaching),
        _ => None,
    }
}

/// Both ends included; one that runs backwards keeps both, so that deciding says what is wrong.
fn run(first: u32, last: u32) -> Vec<u32> {
    let longest = crate::limits::EPISODE_ACTIONS_MAX as u32;
    match first <= last && last - first < longest {
        true => (first..=last).collect(),
        false => vec![first, last],
    }
}

impl<D: World> Session<D> {
    /// The reply to `command` under a request id that `records`, all of them, already carry.
    ///
    /// Two commands count as one where the records cannot tell them apart: a `teach` that met no
    /// clash says nothing of what it would have done about one.
    ///
    /// - errors: [`Rejection::RequestIdReused`] when another command led to these records.
    /// - panics: when `records` is empty.
    pub fn repeat(&self, command: &super::Command, records: &[Record]) -> Result<Reply, Rejection> {
        if self.led_to(command, records) {
            return Ok(reply_of(records));
        }
        let first = records.first().expect("an accepted command records at least one event");
        let used_for = used_for(records);
        Err(Rejection::RequestIdReused { request: first.request, used_for, first: first.seq })
    }

    fn led_to(&self, command: &super::Command, records: &[Record]) -> bool {
        let command = match (command, &records[0].event) {
            (super::Command::Person(command), _) => command,
            (super::Command::Open { user, recipe_text, mind }, Event::SessionOpened(event)) => {
                return (user, recipe_text, mind) == (&event.user, &event.recipe_text, &event.mind);
            }
            (super::Command::FinishRetrain { recipe, outcome }, Event::RetrainCompleted(event)) => {
                let found = outcome.as_ref();
                let same = found.is_ok_and(|it| (&it.0, &it.1) == (&event.mind, &event.report));
                return same && *recipe == event.recipe;
            }
            (super::Command::FinishRetrain { recipe, outcome }, Event::RetrainFailed(event)) => {
                return *recipe == event.recipe && outcome.as_ref() == Err(&event.reason);
            }
            _ => return false,
        };
        match (command, &records[0].event) {
            (Command::StartEpisode { stage }, Event::EpisodeStarted(event)) => {
                self.is_staged(stage, event)
            }
            (Command::Close { reason }, Event::SessionClosed(event)) => *reason == event.reason,
            _ => command_of(records).is_some_and(|recorded| is_recorded_as(command, &recorded)),
        }
    }

    /// Whether this stage is the recorded one. The same request gives the same stage, so it is set
    /// once more.
    fn is_staged(&self, stage: &Stage, event: &EpisodeStarted) -> bool {
        let seed = match stage {
            Stage::Seed { seed } | Stage::Task { seed, .. } => Some(*seed),
            Stage::Scene { .. } => None,
        };
        let domain = &*self.domain;
        seed == event.seed
            && decide::set(domain, stage).is_ok_and(|(scene, task)| {
                domain.digest(&scene) == event.scene_digest && Document::of(&task) == event.task
            })
    }
}

/// Whether `command` would be read out of its records as `recorded`, see [`command_of`].
fn is_recorded_as(command: &Command, recorded: &Command) -> bool {
    match (command, recorded) {
        (Command::Say { utterance }, Command::Say { utterance: said }) => {
            Utterance::new(utterance).is_ok_and(|utterance| utterance.as_str() == said)
        }
        (
            Command::Teach { explains, actions, on_clash },
            Command::Teach { explains: explained, actions: taken, on_clash: done },
        ) => {
            // Only a lesson that was replaced can be seen in the records.
            let clash = *on_clash == OnClash::Replace || *done != OnClash::Replace;
            (explains, actions) == (explained, taken) && clash
        }
        (command, recorded) => command == recorded,
    }
}

/// The name of the command that these records came from.
fn used_for(records: &[Record]) -> &'static str {
    match (command_of(records), &records[0].event) {
        (Some(command), _) => super::Command::from(command).name(),
        (None, Event::SessionOpened(_)) => "open",
        (None, Event::EpisodeStarted(_)) => "start an episode",
        (None, Event::SessionClosed(_)) => "close",
        (None, Event::RetrainCompleted(_) | Event::RetrainFailed(_)) => "finish retraining",
        (None, _) => "another command",
    }
}
