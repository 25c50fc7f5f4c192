use apprentice::events::{Ending, Event, Overlap, Record, TenantEvent};
use apprentice::ids::Timestamp;
use apprentice::language::Outcome;
use apprentice::replay;
use serde_json::{Value, json};

/// One record as a JSON object: its number, its kind and its whole body. No times, so that equal
/// histories print equal bytes.
pub fn json(record: &Record) -> Value {
    let kind = format!("{:?}", record.event.kind());
    json!({ "seq": record.seq.get(), "kind": kind, "event": replay::body(&record.event) })
}

/// Shown below a held time.
const HELD: &str = "time held: the clock did not move forward";

/// One record for a person: number, time (UTC), kind, and what it says.
///
/// - `held`: whether its time is later than what the wall clock showed ([`apprentice::events::Times`]).
pub fn readable(record: &Record, held: bool) -> Vec<String> {
    let (first, more) = sentences(&record.event);
    let kind = format!("{:?}", record.event.kind());
    let mut lines = vec![format!("{:>5}  {}  {kind:<21}  {first}", record.seq, utc(record.at))];
    // Under the columns of the times and of the sentences.
    if held {
        lines.push(format!("{:5}  {HELD}", ""));
    }
    lines.extend(more.into_iter().map(|line| format!("{:51}  {line}", "")));
    lines
}

fn sentences(event: &Event) -> (String, Vec<String>) {
    match event {
        Event::SessionOpened(event) => (
            format!("{} of {} {}", event.user, event.domain, event.domain_version),
            vec![format!(
                "recipe {} {}, mind {}",
                event.recipe,
                event.recipe_digest.short(),
                event.mind.short()
            )],
        ),
        Event::EpisodeStarted(event) => {
            let drawn = event.seed.map_or("a scene file".to_owned(), |seed| format!("seed {seed}"));
            let fewest = event.fewest.map_or(String::new(), |n| format!(", fewest actions {n}"));
            (event.goal.clone(), vec![format!("{drawn}{fewest}")])
        }
        Event::Interpreted(event) => {
            let outcome = match &event.answer.outcome {
                Outcome::Understood { program, .. } => format!("= {program}"),
                Outcome::Asked { question } => format!("~ asked ({})", question.text),
                Outcome::Told { text } => format!("i told ({text})"),
                Outcome::NotSure => match event.answer.evidence.passed_over() {
                    Some(words) => format!("? not sure ({words})"),
                    None => "? not sure".to_owned(),
                },
                Outcome::Impossible { program, step, reason } => {
                    format!("! impossible {program} step {} ({reason})", step + 1)
                }
            };
            (format!("> {}", event.utterance), vec![outcome])
        }
        Event::EpisodeEnded(event) => {
            let ending = match event.ending {
                Ending::Achieved => "achieved",
                Ending::Abandoned => "abandoned",
            };
            let counts = format!(
                "{ending}: {} utterances, {} actions, {} to teach",
                event.utterances,
                event.actions,
                event.to_teach.len()
            );
            (counts, vec![])
        }
        Event::DecompositionTaught(event) => (
            format!("{:?} (record {})", event.utterance.as_str(), event.explains),
            vec![format!("actions {}..{}: {}", event.first, event.last, event.program)],
        ),
        Event::DecompositionDeclined(event) => {
            (format!("{:?} (record {})", event.utterance.as_str(), event.explains), vec![])
        }
        Event::LessonForgotten(event) => {
            (format!("{:?} (record {})", event.utterance.as_str(), event.lesson), vec![])
        }
        Event::RetrainScheduled(event) => {
            let lessons: Vec<String> = event.lessons.iter().map(ToString::to_string).collect();
            let lessons = match lessons.is_empty() {
                true => "no lessons".to_owned(),
                false => format!("lessons {}", lessons.join(", ")),
            };
            (format!("recipe {}, {lessons}", event.recipe.short()), vec![])
        }
        Event::RetrainCompleted(event) => (
            format!("mind {}, {} examples", event.mind.short(), event.report.exemplars),
            vec![format!("threshold {:.3}", event.report.threshold)],
        ),
        Event::RetrainFailed(event) => (event.reason.clone(), vec![]),
        Event::MarkedWrong(event) => (format!("record {}", event.act), vec![]),
        Event::SessionClosed(event) => (event.reason.clone(), vec![]),
        Event::Tenant(event) => (tenants(event), vec![]),
    }
}

fn tenants(event: &TenantEvent) -> String {
    match event {
        TenantEvent::Opened(_) | TenantEvent::Enabled(_) => String::new(),
        TenantEvent::KeyAdmitted(event) => {
            let role = event.role.name();
            format!("{role} {} {:?}", event.key, event.label)
        }
        TenantEvent::KeyRetired(event) => {
            let (key, overlap) = (event.key, event.overlap);
            match overlap {
                Overlap::Read { wall, overlap_seconds: 0 } => {
                    format!("{key}, now; the clock showed {}", utc(wall))
                }
                Overlap::Read { wall, overlap_seconds } => {
                    let wall = utc(wall);
                    format!("{key}, after {overlap_seconds} s more; the clock showed {wall}")
                }
                Overlap::Former { valid_until } => {
                    format!("{key}, at {}", utc(valid_until))
                }
            }
        }
        TenantEvent::Disabled(event) => event.reason.clone(),
        TenantEvent::QuotasSet(event) => event.quotas.to_string(),
        TenantEvent::PersonErased(event) => {
            format!("stream {}, records 1 to {}", event.stream, event.last)
        }
        TenantEvent::SegmentClosed(event) => {
            format!("stream {}, records {} to {}", event.stream, event.first, event.last)
        }
    }
}

/// `2026-01-31 12:00:00Z`; after the year 9999 the number of microseconds since 1970.
pub fn utc(at: Timestamp) -> String {
    let micros = i64::try_from(at.0).unwrap_or(i64::MAX);
    match jiff::Timestamp::from_microsecond(micros) {
        Ok(time) => time.strftime("%Y-%m-%d %H:%M:%SZ").to_string(),
        Err(_) => format!("{} µs after 1970", at.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (micros, shown) in [
            (0, "1970-01-01 00:00:00Z"),
            (951_827_696_999_999, "2000-02-29 12:34:56Z"),
            (1_769_860_800_000_000, "2026-01-31 12:00:00Z"),
            (253_402_207_200_000_000, "9999-12-30 22:00:00Z"),
            (u64::MAX, "18446744073709551615 µs after 1970"),
        ] {
            assert_eq!(utc(Timestamp(micros)), shown);
        }
    }
}
