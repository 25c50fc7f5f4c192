//! Deciding a recorded command again, and holding what would be recorded against what was.

use super::Difference;
use crate::events::{EpisodeEnded, Event, Record};
use crate::session::{Command, Proposed, Session};
use crate::world::Domain;

/// What deciding again came to.
pub(super) enum Verdict {
    Same,
    /// Recorded otherwise by an old version, in a way that is known and means the same.
    OfOld,
    /// The first place at which the proposed events are not the recorded ones.
    Differs(Difference),
}

/// Decides `command` in `session`, which stands just before `batch` and has its mind where the
/// command needs one.
///
/// - panics: when `batch` is empty.
pub(super) fn compare<D: Domain>(
    session: &Session<D>,
    command: &Command,
    batch: &[Record],
) -> Verdict {
    let first = batch.first().expect("a command led to at least one record");
    let kinds = || batch.iter().map(|record| format!("{:?}", record.event.kind()));
    let recorded = || kinds().collect::<Vec<_>>().join(", ");
    let events = match session.propose_recorded(command, first.request, first.at) {
        Ok(Proposed::Turn(turn)) => turn.batch.events,
        Ok(Proposed::Repeat { first: old, .. }) => {
            let field = "request";
            let recomputed = format!("a repetition of record {old}");
            let found = Difference::new(first.seq.get(), field, recorded(), recomputed);
            return Verdict::Differs(found);
        }
        Ok(Proposed::Defect(divergence)) => {
            return Verdict::Differs(Difference::of_fold(divergence));
        }
        Err(rejection) => {
            let recomputed = format!("a refusal: {rejection}");
            let found = Difference::new(first.seq.get(), "decision", recorded(), recomputed);
            return Verdict::Differs(found);
        }
    };
    let mut verdict = Verdict::Same;
    for (record, event) in batch.iter().zip(&events) {
        let Some(found) = Difference::of_events(record.seq.get(), &record.event, event) else {
            continue;
        };
        match is_of_old(record, event) {
            true => verdict = Verdict::OfOld,
            false => return Verdict::Differs(found),
        }
    }
    let one = |event: Option<&Event>| match event {
        Some(event) => format!("{:?}", event.kind()),
        None => "no further record".to_owned(),
    };
    let both = batch.len().min(events.len());
    if batch.len() != events.len() {
        let (old, new) = (batch.get(both).map(|record| &record.event), events.get(both));
        let seq = first.seq.get() + both as u64;
        return Verdict::Differs(Difference::new(seq, "kind", one(old), one(new)));
    }
    verdict
}

/// Whether the two differ only in what is known of records of versions up to 0.2, and means the
/// same; see [`EpisodeEnded::leaves_out_its_own`].
fn is_of_old(record: &Record, today: &Event) -> bool {
    let (Event::EpisodeEnded(old), Event::EpisodeEnded(new)) = (&record.event, today) else {
        return false;
    };
    let whole = EpisodeEnded { to_teach: new.to_teach.clone(), ..old.clone() };
    old.leaves_out_its_own(record.seq, &new.to_teach) && whole == *new
}
