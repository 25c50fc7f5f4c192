//! Compares what was recorded with what is computed today, field by field.

use serde::Serialize;
use serde_json::Value;

use crate::events::{self, Event};
use crate::ids::Digest;
use crate::session::Divergence;
use crate::store::ReadError;

/// Characters of a value shown; a scene has thousands.
const SHOWN_MAX: usize = 200;

/// The place where recorded and recomputed part: a sentence, and its parts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("record {seq}: {field}: recorded {recorded}, recomputed {recomputed}")]
pub struct Difference {
    pub seq: u64,
    /// `scene digest`, or a path in the event's body: `answer.evidence.nearest[0].distance`.
    pub field: String,
    pub recorded: String,
    pub recomputed: String,
}

impl Difference {
    pub(super) fn new(
        seq: u64,
        field: &str,
        recorded: impl ToString,
        recomputed: impl ToString,
    ) -> Difference {
        let (recorded, recomputed) = (recorded.to_string(), recomputed.to_string());
        Difference { seq, field: field.to_owned(), recorded, recomputed }
    }

    /// `next` is the record that was being read, for errors that name none.
    pub(super) fn of_read(error: &ReadError, next: u64) -> Difference {
        use crate::events::HeaderError::Checksum;
        match error {
            ReadError::Header { seq, error: Checksum { said, found } } => {
                Difference::new(*seq, "checksum", format!("{said:08x}"), format!("{found:08x}"))
            }
            ReadError::Header { seq, error } => {
                Difference::new(*seq, "header", error, "a header of 128 bytes that fits its record")
            }
            ReadError::Chain { seq, expected, found } => {
                Difference::new(*seq, "predecessor", found, expected)
            }
            ReadError::Gap { expected, found } => {
                Difference::new(*expected, "sequence number", found, expected)
            }
            ReadError::Chunks { seq, reason } => {
                Difference::new(*seq, "chunks", reason, "all chunks of the record, in order")
            }
            ReadError::Seal { seq, reason } => {
                Difference::new(*seq, "seal", reason, "a seal that opens with this user's key")
            }
            ReadError::Decode { seq, error } => {
                Difference::new(*seq, "body", error, "an event that this binary can read")
            }
            ReadError::Erased => Difference::new(next, "key", "erased", "a key that opens it"),
            ReadError::Store { reason } => Difference::new(next, "record", reason, "a record"),
        }
    }

    pub(super) fn of_fold(divergence: Divergence) -> Difference {
        let Divergence { seq, field, recorded, recomputed } = divergence;
        Difference::new(seq.get(), field, recorded, recomputed)
    }

    /// None when the two are equal, every bit of every number included.
    pub(super) fn of_events(seq: u64, recorded: &Event, recomputed: &Event) -> Option<Difference> {
        let bytes = (events::encode(recorded), events::encode(recomputed));
        let kinds = (recorded.kind(), recomputed.kind());
        if kinds.0 != kinds.1 {
            let (old, new) = (format!("{:?}", kinds.0), format!("{:?}", kinds.1));
            return Some(Difference::new(seq, "kind", old, new));
        }
        if bytes.0 == bytes.1 {
            return None;
        }
        let found = first_difference(&body(recorded), &body(recomputed));
        Some(match found {
            Some((path, old, new)) => Difference::new(seq, &path, old, new),
            // Numbers that no text can tell apart, such as two kinds of NaN.
            None => Difference::new(
                seq,
                "digest of the body",
                Digest::of(&bytes.0),
                Digest::of(&bytes.1),
            ),
        })
    }
}

/// An event's body as a JSON value; map keys are sorted.
pub fn body(event: &Event) -> Value {
    let value = match event {
        Event::SessionOpened(event) => serde_json::to_value(event),
        Event::EpisodeStarted(event) => serde_json::to_value(event),
        Event::Interpreted(event) => serde_json::to_value(event),
        Event::EpisodeEnded(event) => serde_json::to_value(event),
        Event::DecompositionTaught(event) => serde_json::to_value(event),
        Event::DecompositionDeclined(event) => serde_json::to_value(event),
        Event::LessonForgotten(event) => serde_json::to_value(event),
        Event::RetrainScheduled(event) => serde_json::to_value(event),
        Event::RetrainCompleted(event) => serde_json::to_value(event),
        Event::RetrainFailed(event) => serde_json::to_value(event),
        Event::SessionClosed(event) => serde_json::to_value(event),
        Event::MarkedWrong(event) => serde_json::to_value(event),
        Event::Tenant(event) => serde_json::to_value(event),
    };
    value.expect("an event is plain data")
}

/// The first leaf, in the order of the keys, at which two values part.
fn first_difference(old: &Value, new: &Value) -> Option<(String, String, String)> {
    let mut path = String::new();
    descend(&mut path, old, new).map(|(old, new)| (path, old, new))
}

fn descend(path: &mut String, old: &Value, new: &Value) -> Option<(String, String)> {
    let length = path.len();
    match (old, new) {
        (Value::Object(old_map), Value::Object(new_map)) => {
            let mut keys: Vec<&String> = old_map.keys().chain(new_map.keys()).collect();
            keys.sort();
            keys.dedup();
            for key in keys {
                if !path.is_empty() {
                    path.push('.');
                }
                path.push_str(key);
                if let found @ Some(_) = part(path, old_map.get(key), new_map.get(key)) {
                    return found;
                }
                path.truncate(length);
            }
            None
        }
        (Value::Array(old_list), Value::Array(new_list)) => {
            for index in 0..old_list.len().max(new_list.len()) {
                path.push_str(&format!("[{index}]"));
                if let found @ Some(_) = part(path, old_list.get(index), new_list.get(index)) {
                    return found;
                }
                path.truncate(length);
            }
            None
        }
        (Value::Number(old_number), Value::Number(new_number)) => {
            let bits = |number: &serde_json::Number| number.as_f64().map(f64::to_bits);
            let equal = old_number == new_number && bits(old_number) == bits(new_number);
            (!equal).then(|| (shown(Some(old)), shown(Some(new))))
        }
        _ => (old != new).then(|| (shown(Some(old)), shown(Some(new)))),
    }
}

/// As [`descend`], for a part that one of the two may lack.
fn part(path: &mut String, old: Option<&Value>, new: Option<&Value>) -> Option<(String, String)> {
    match (old, new) {
        (Some(old), Some(new)) => descend(path, old, new),
        (old, new) => Some((shown(old), shown(new))),
    }
}

fn shown(value: Option<&Value>) -> String {
    let Some(value) = value else { return "nothing".to_owned() };
    let text = match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    match text.chars().count() > SHOWN_MAX {
        true => text.chars().take(SHOWN_MAX).chain(" ...".chars()).collect(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::{Interpreted, Report, RetrainCompleted, SessionClosed};
    use crate::language::{Accounted, Answer, Evidence, Mood, Outcome, Use, Utterance};

    fn completed(threshold: f32) -> Event {
        let report = Report { exemplars: 44, threshold, ..Report::default() };
        Event::RetrainCompleted(RetrainCompleted {
            recipe: Digest::ZERO,
            mind: Digest::of(b"mind"),
            report,
            code: None,
        })
    }

    #[test]
    fn equal_events_have_no_difference_and_one_bit_makes_one() {
        assert_eq!(Difference::of_events(3, &completed(0.5), &completed(0.5)), None);
        let next = f32::from_bits(0.5_f32.to_bits() + 1);
        let found = Difference::of_events(3, &completed(0.5), &completed(next)).unwrap();
        assert_eq!(
            found.to_string(),
            "record 3: report.threshold: recorded 0.5, recomputed 0.5000000596046448"
        );
        let zero = Difference::of_events(3, &completed(0.0), &completed(-0.0)).unwrap();
        assert_eq!(zero.field, "report.threshold");
        let closed = Event::SessionClosed(SessionClosed { reason: "enough".to_owned() });
        assert_eq!(Difference::of_events(3, &closed, &completed(0.5)).unwrap().field, "kind");
    }

    #[test]
    fn what_words_chose_and_were_used_for_is_part_of_an_answer() {
        let interpreted = |change: fn(&mut Answer)| {
            let evidence = Evidence::default();
            let outcome = Outcome::NotSure;
            let mut answer = Answer { outcome, evidence, mentioned: None, chosen: Vec::new() };
            change(&mut answer);
            let utterance = Utterance::new("do not wash mug 2").unwrap();
            let (scene_after, mind) = (Digest::ZERO, Digest::ZERO);
            let event = Interpreted { utterance, answer, actions_before: 0, scene_after, mind };
            Event::Interpreted(event)
        };
        let plain = interpreted(|_| ());
        type Change = (&'static str, fn(&mut Answer));
        let changes: [Change; 3] = [
            ("answer.chosen", |answer| answer.chosen = vec![vec![Some("Mug 2".to_owned())]]),
            ("answer.evidence.mood", |answer| {
                answer.evidence.mood = Some(Mood::Forbidden { word: "not".to_owned() });
            }),
            ("answer.evidence.accounting", |answer| {
                let word = "wash".to_owned();
                answer.evidence.accounting = vec![Accounted { word, used: Use::Verb }];
            }),
        ];
        for (field, change) in changes {
            let found = Difference::of_events(3, &plain, &interpreted(change)).unwrap();
            assert_eq!((&*found.field, &*found.recorded), (field, "nothing"));
            assert_eq!(Difference::of_events(3, &plain, &plain), None);
        }
    }

    #[test]
    fn the_path_leads_into_maps_and_lists() {
        let parse = |text| serde_json::from_str::<Value>(text).unwrap();
        let old = parse(r#"{"a": 1, "b": [{"c": "x"}, {"c": "y"}]}"#);
        let found = |new| first_difference(&old, &parse(new));
        assert_eq!(found(r#"{"a": 1, "b": [{"c": "x"}, {"c": "y"}]}"#), None);
        let (path, recorded, recomputed) =
            found(r#"{"a": 1, "b": [{"c": "x"}, {"c": "z"}]}"#).unwrap();
        assert_eq!((&*path, &*recorded, &*recomputed), ("b[1].c", "y", "z"));
        let (path, _, recomputed) = found(r#"{"a": 1, "b": [{"c": "x"}]}"#).unwrap();
        assert_eq!((&*path, &*recomputed), ("b[1]", "nothing"));
        let (path, recorded, _) = found(r#"{"a": 1, "b": [], "d": true}"#).unwrap();
        assert_eq!((&*path, &*recorded), ("b[0]", r#"{"c":"x"}"#));
    }
}
