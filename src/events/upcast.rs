//! The last step from former bodies, which the museum keeps, to the events of today.

use apprentice_migrations::records::{self, key_retired, retrain_completed};

use super::codec::unpack;
use super::{DecodeError, Event, EventKind, KeyRetired, Overlap, Report, RetrainCompleted};
use crate::ids::{Digest, PublicKey, Timestamp};

/// Reads a body of a version that was released and is not written any more; none when there never
/// was such a version.
pub(super) fn former(
    kind: EventKind,
    version: u16,
    body: &[u8],
) -> Result<Option<Event>, DecodeError> {
    Ok(match (kind, version) {
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

    #[test]
    fn versions_that_never_were_are_unknown_and_former_ones_are_checked_as_todays_are() {
        for kind in [EventKind::RetrainCompleted, EventKind::KeyRetired] {
            let (number, newest) = (kind as u16, kind.version());
            for version in [0, newest + 1] {
                let unknown = Err(DecodeError::UnknownVersion { kind, version });
                assert_eq!(decode(number, version, b"\x80"), unknown);
            }
            for version in 1..=newest {
                for body in [&b"\x80"[..], b"", b"\xff", b"\xc0\xc0"] {
                    let wrong = decode(number, version, body).unwrap_err();
                    assert!(matches!(wrong, DecodeError::Body { .. }), "{wrong}");
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
}
