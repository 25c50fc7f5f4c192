//! Deciding a recorded command again, and holding what would be recorded against what was.

use super::Difference;
use crate::events::{Ending, Event, Record};
use crate::session::{Command, OnClash, Proposed, Session};
use crate::world::Domain;

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

/// Decides `command` in `session`, which stands just before `batch` and has its mind where the
/// command needs one.
///
/// - returns: the first place at which the proposed events are not the recorded ones.
pub(super) fn compare<D: Domain>(
    session: &Session<D>,
    command: &Command,
    batch: &[Record],
) -> Option<Difference> {
    let first = batch.first()?;
    let kinds = || batch.iter().map(|record| format!("{:?}", record.event.kind()));
    let recorded = || kinds().collect::<Vec<_>>().join(", ");
    let events = match session.propose_recorded(command, first.request, first.at) {
        Ok(Proposed::Turn(turn)) => turn.batch.events,
        Ok(Proposed::Repeat { first: old, .. }) => {
            let field = "request";
            let recomputed = format!("a repetition of record {old}");
            return Some(Difference::new(first.seq.get(), field, recorded(), recomputed));
        }
        Err(rejection) => {
            let recomputed = format!("a refusal: {rejection}");
            return Some(Difference::new(first.seq.get(), "decision", recorded(), recomputed));
        }
    };
    for (record, event) in batch.iter().zip(&events) {
        if let found @ Some(_) = Difference::of_events(record.seq.get(), &record.event, event) {
            return found;
        }
    }
    let one = |event: Option<&Event>| match event {
        Some(event) => format!("{:?}", event.kind()),
        None => "no further record".to_owned(),
    };
    let both = batch.len().min(events.len());
    (batch.len() != events.len()).then(|| {
        let (old, new) = (batch.get(both).map(|record| &record.event), events.get(both));
        Difference::new(first.seq.get() + both as u64, "kind", one(old), one(new))
    })
}
