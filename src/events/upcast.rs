//! The last step from former bodies, which the museum keeps, to the events of today.

use std::fmt::Display;

use apprentice_migrations::records::{self, interpreted, key_retired, retrain_completed};

use super::codec::unpack;
use super::{
    DecodeError, Event, EventKind, Interpreted, KeyRetired, Overlap, Report, RetrainCompleted,
};
use crate::ids::{Digest, PublicKey, Timestamp};
use crate::language::{
    Answer, Answerer, Discarded, Evidence, LiftedUtterance, Near, Outcome, Symbol,
};

/// Reads a body of a version that was released and is not written any more; none when there never
/// was such a version.
pub(super) fn former(
    kind: EventKind,
    version: u16,
    body: &[u8],
) -> Result<Option<Event>, DecodeError> {
    Ok(match (kind, version) {
        (EventKind::Interpreted, 1) => {
            let former: interpreted::V1 = unpack(kind, body)?;
            let event = Interpreted::try_from(former);
            Some(Event::Interpreted(event.map_err(|reason| DecodeError::Body { kind, reason })?))
        }
        (EventKind::RetrainCompleted, 1) => {
            let former: retrain_completed::V1 = unpack(kind, body)?;
            Some(Event::RetrainCompleted(former.into()))
        }
        (EventKind::KeyRetired, 1) => {
            let former: key_retired::V1 = unpack(kind, body)?;
            Some(KeyRetired::from(former).into())
        }
        _ => None,
    })
}

/// Not total, unlike the others: a text in a damaged body may be no utterance and no program.
///
/// - errors: a sentence that says what is wrong with the text.
impl TryFrom<interpreted::V1> for Interpreted {
    type Error = String;
    fn try_from(former: interpreted::V1) -> Result<Interpreted, String> {
        let interpreted::V1 { utterance, answer, actions_before, scene_after, mind } = former;
        let interpreted::Answer { outcome, evidence, mentioned } = answer;
        let answer = Answer {
            outcome: outcome_of(outcome)?,
            evidence: evidence_of(evidence)?,
            mentioned: mentioned.as_deref().map(Symbol::new),
            // The world chose every thing, and chooses the same ones again.
            chosen: Vec::new(),
        };
        Ok(Interpreted {
            utterance: read(utterance)?,
            answer,
            actions_before,
            scene_after: digest(scene_after),
            mind: digest(mind),
        })
    }
}

fn outcome_of(former: interpreted::Outcome) -> Result<Outcome, String> {
    Ok(match former {
        interpreted::Outcome::Understood { program, bindings } => {
            Outcome::Understood { program: read(program)?, bindings }
        }
        interpreted::Outcome::Impossible { program, step, reason } => {
            Outcome::Impossible { program: read(program)?, step, reason }
        }
        interpreted::Outcome::NotSure => Outcome::NotSure,
    })
}

fn evidence_of(former: interpreted::Evidence) -> Result<Evidence, String> {
    let interpreted::Evidence { lifted, nearest, threshold, discarded, reranked, answered_by } =
        former;
    let near = |near: interpreted::Near| {
        let interpreted::Near { exemplar, program, distance, number } = near;
        let exemplar = LiftedUtterance::parse(&exemplar);
        Ok(Near { exemplar, program: read(program)?, distance, number })
    };
    let dropped = |dropped: interpreted::Discarded| {
        let interpreted::Discarded { program, reason } = dropped;
        Ok(Discarded { program: read(program)?, reason })
    };
    let by = |by: interpreted::Answerer| match by {
        interpreted::Answerer::Grammar => Answerer::Grammar,
        interpreted::Answerer::Seq2seq => Answerer::Seq2seq,
    };
    Ok(Evidence {
        lifted: lifted.iter().map(|clause| LiftedUtterance::parse(clause)).collect(),
        nearest: nearest.into_iter().map(near).collect::<Result<_, String>>()?,
        threshold,
        discarded: discarded.into_iter().map(dropped).collect::<Result<_, String>>()?,
        reranked,
        answered_by: answered_by.into_iter().map(by).collect(),
        mood: None,
        accounting: Vec::new(),
        replies_to: None,
    })
}

/// What the text of a former body stands for.
fn read<T: TryFrom<String, Error: Display>>(text: String) -> Result<T, String> {
    T::try_from(text).map_err(|error| error.to_string())
}

impl From<retrain_completed::V1> for RetrainCompleted {
    fn from(former: retrain_completed::V1) -> RetrainCompleted {
        let retrain_completed::V1 { recipe, mind, report } = former;
        let retrain_completed::Report { exemplars, threshold, figures } = report;
        let report = Report { exemplars, threshold, figures };
        RetrainCompleted { recipe: digest(recipe), mind: digest(mind), report, code: None }
    }
}

impl From<key_retired::V1> for KeyRetired {
    fn from(former: key_retired::V1) -> KeyRetired {
        let key_retired::V1 { key, valid_until } = former;
        let overlap = Overlap::Former { valid_until: Timestamp(valid_until) };
        KeyRetired { key: PublicKey(key.0), overlap }
    }
}

fn digest(bytes: records::Digest) -> Digest {
    Digest(bytes.0)
}

#[cfg(test)]
mod tests {
    use super::super::{decode, encode};
    use super::*;
    use crate::language::{Accounted, Mood, Use, Utterance};

    fn interpreted(outcome: Outcome) -> Interpreted {
        Interpreted {
            utterance: Utterance::new("Hol den Apfel, 🍎!").unwrap(),
            answer: Answer {
                outcome,
                evidence: Evidence {
                    lifted: vec![LiftedUtterance::parse("put <obj> in <obj=fridge>")],
                    nearest: vec![Near {
                        exemplar: LiftedUtterance::parse("take <obj>"),
                        program: "GOTO <obj:1>; PICKUP <held>".parse().unwrap(),
                        distance: f32::from_bits(0.25_f32.to_bits() + 1),
                        number: 12,
                    }],
                    threshold: 0.42,
                    discarded: vec![Discarded {
                        program: "PICKUP Table".parse().unwrap(),
                        reason: "the Table cannot be picked up".to_owned(),
                    }],
                    reranked: 2,
                    answered_by: vec![Answerer::Grammar, Answerer::Seq2seq],
                    ..Evidence::default()
                },
                mentioned: Some(Symbol::new("Apple")),
                chosen: Vec::new(),
            },
            actions_before: 4,
            scene_after: Digest::of(b"scene after"),
            mind: Digest::of(b"mind"),
        }
    }

    fn outcomes() -> [Outcome; 3] {
        let program = "GOTO Apple; PICKUP Apple";
        let bindings = vec![vec!["Apple 1".to_owned()]; 2];
        let reason = "the apple is in the fridge, which is closed".to_owned();
        [
            Outcome::Understood { program: program.parse().unwrap(), bindings },
            Outcome::Impossible { program: program.parse().unwrap(), step: 1, reason },
            Outcome::NotSure,
        ]
    }

    #[test]
    fn versions_that_never_were_are_unknown_and_former_ones_are_checked_as_todays_are() {
        for kind in [EventKind::Interpreted, EventKind::RetrainCompleted, EventKind::KeyRetired] {
            let (number, newest) = (kind as u16, kind.version());
            for version in [0, newest + 1] {
                let unknown = Err(DecodeError::UnknownVersion { kind, version });
                assert_eq!(decode(number, version, b"\x80"), unknown);
            }
            for version in 1..=newest {
                for body in [&b"\x80"[..], b"", b"\xff", b"\xc0\xc0"] {
                    let wrong = decode(number, version, body).unwrap_err();
                    assert!(matches!(wrong, DecodeError::Body { .. }), "{wrong}");
                    assert!(wrong.to_string().contains("OldLogsOpen"), "{wrong}");
                }
            }
        }
    }

    #[test]
    fn a_retired_key_of_version_1_says_when_its_overlap_ends_and_nothing_of_a_clock() {
        let overlap = Overlap::Former { valid_until: Timestamp(7) };
        let event: Event = KeyRetired { key: PublicKey([1; 32]), overlap }.into();
        // Version 1 wrote this body, and none that is written today is taken for it.
        assert_eq!(decode(EventKind::KeyRetired as u16, 1, &encode(&event)), Ok(event));
        let overlap = Overlap::Read { wall: Timestamp(7), overlap_seconds: 0 };
        let event: Event = KeyRetired { key: PublicKey([1; 32]), overlap }.into();
        let number = EventKind::KeyRetired as u16;
        assert_eq!(decode(number, 2, &encode(&event)), Ok(event.clone()));
        assert!(decode(number, 1, &encode(&event)).is_err());
    }

    #[test]
    fn a_training_of_version_1_does_not_say_which_code_it_was() {
        let event = RetrainCompleted {
            recipe: Digest::of(b"recipe"),
            mind: Digest::of(b"mind"),
            report: Report { exemplars: 45, threshold: 0.5, figures: [("n".into(), 2.0)].into() },
            code: None,
        };
        // The same fields and one more: version 1 reads what it knows of it.
        let body = encode(&Event::RetrainCompleted(event.clone()));
        let read = decode(EventKind::RetrainCompleted as u16, 1, &body);
        assert_eq!(read, Ok(Event::RetrainCompleted(event)));
    }

    #[test]
    fn an_answer_of_version_1_is_what_it_was_and_has_nothing_of_what_came_later() {
        let number = EventKind::Interpreted as u16;
        for outcome in outcomes() {
            let event = interpreted(outcome);
            // Fields without a value are left out, so version 1 wrote these bytes.
            let body = encode(&Event::Interpreted(event.clone()));
            for version in [1, 2] {
                let read = decode(number, version, &body);
                assert_eq!(read, Ok(Event::Interpreted(event.clone())), "version {version}");
            }
            let mut newer = event.clone();
            newer.answer.chosen = vec![vec![Some("Apple 2".to_owned())]];
            newer.answer.evidence.mood = Some(Mood::Asked { word: "did".to_owned() });
            newer.answer.evidence.accounting =
                vec![Accounted { word: "banana".to_owned(), used: Use::Nothing }];
            let body = encode(&Event::Interpreted(newer.clone()));
            assert_eq!(decode(number, 2, &body), Ok(Event::Interpreted(newer)));
            assert_eq!(decode(number, 1, &body), Ok(Event::Interpreted(event)));
        }
    }

    #[test]
    fn a_text_of_version_1_that_is_no_program_and_no_utterance_is_an_error() {
        let number = EventKind::Interpreted as u16;
        let [understood, ..] = outcomes();
        let body = encode(&Event::Interpreted(interpreted(understood)));
        // Texts of the same length, so that everything else in the body stays where it was.
        for (text, wrong) in [
            ("GOTO Apple; PICKUP Apple", "                        "),
            ("PICKUP Table", ";;;;;;;;;;; "),
            ("PICKUP <held>", "PICKUP <obj:0"),
            ("Hol den Apfel", "Hol\u{1} den Apfl"),
        ] {
            assert_eq!(text.len(), wrong.len());
            let mut damaged = body.clone();
            let at = body.windows(text.len()).position(|part| part == text.as_bytes()).unwrap();
            damaged[at..at + text.len()].copy_from_slice(wrong.as_bytes());
            let read = decode(number, 1, &damaged).unwrap_err();
            assert!(matches!(read, DecodeError::Body { .. }), "{wrong:?}: {read}");
        }
    }
}
