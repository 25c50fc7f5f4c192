use crate::client::{Reply, Told};
use crate::events::{Event, Record};

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
        Event::MarkedWrong(event) => Told::MarkedWrong {
            act: event.act,
            utterance: event.utterance.map(String::from).unwrap_or_default(),
        },
        Event::SessionClosed(event) => Told::Closed { reason: event.reason },
        Event::Tenant(_) => return None,
    })
}
