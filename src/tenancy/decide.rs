use super::{Order, Registry};
use crate::events::{
    Event, KeyAdmitted, KeyRetired, Overlap, PersonErased, QuotasSet, Role, TenantDisabled,
    TenantEnabled, TenantEvent, TenantOpened,
};
use crate::ids::{PublicKey, Seq, StreamKey, Timestamp};
use crate::limits::{LABEL_BYTES_MAX, OVERLAP_S_MAX, TENANT_KEYS_MAX};
use crate::plain::{self, Hidden};

/// Why an order is not carried out. Nothing was recorded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    #[error("the tenant does not exist yet; add it first")]
    NotOpen,
    #[error("key {key} is already admitted as {held}; admit another key as {wanted}")]
    OtherRole { key: PublicKey, held: Role, wanted: Role },
    #[error("key {key} is retired and cannot be admitted again; make a new key")]
    Retired { key: PublicKey },
    #[error("key {key} does not belong to this tenant; `apprentice tenant list` shows its keys")]
    UnknownKey { key: PublicKey },
    #[error("the old and the new key are the same: {key}")]
    SameKey { key: PublicKey },
    #[error(
        "an overlap has at most {max} seconds ({} days), but this one has {found}; give a shorter one",
        max / 86_400
    )]
    TooLongOverlap { max: u64, found: u64 },
    #[error("this tenant already has {max} keys, which is the limit; retired keys count too")]
    TooManyKeys { max: usize },
    #[error("a {what} has at most {max} bytes, but this one has {found}")]
    TooLong { what: &'static str, max: usize, found: usize },
    #[error("in the {what}, {hidden}")]
    Hidden { what: &'static str, hidden: Hidden },
    #[error("a quota of 0 {what} would block everyone; disable the tenant instead")]
    NothingAllowed { what: &'static str },
    #[error(
        "the segment begins at record {found}, but the first record without a segment is {wanted}"
    )]
    Segment { wanted: Seq, found: Seq },
    #[error("stream {stream} is the tenant's own stream, not a user's")]
    TenantsOwn { stream: StreamKey },
}

/// What an order leads to: the events to be appended together; none when it is so already.
///
/// - `wall`: what the wall clock reads; overlaps count from it. The time of the record is
///   [`Registry::next_at`] of it.
/// - errors: [`Refusal`].
pub fn decide(registry: &Registry, order: &Order, wall: Timestamp) -> Result<Vec<Event>, Refusal> {
    let inside = matches!(order, Order::NoteErasure { .. } | Order::CloseSegment(_));
    let mut events: Vec<Event> = Vec::new();
    if !registry.is_open() {
        // What happens to people needs no operator before it.
        if !inside && *order != Order::Open {
            return Err(Refusal::NotOpen);
        }
        events.push(TenantOpened {}.into());
    }
    events.extend(match order {
        Order::Open => vec![],
        Order::Admit { key, role, label } => {
            check_text("label", label)?;
            admit(registry, *key, *role, label, wall)?
        }
        Order::Retire { key, overlap_seconds } => retire(registry, *key, *overlap_seconds, wall)?,
        Order::Rotate { old, new, overlap_seconds } => {
            rotate(registry, *old, *new, *overlap_seconds, wall)?
        }
        Order::Disable { reason } => {
            check_text("reason", reason)?;
            match registry.standing().disabled() {
                Some(_) => vec![],
                None => vec![TenantDisabled { reason: reason.clone() }.into()],
            }
        }
        Order::Enable if registry.standing().disabled().is_none() => vec![],
        Order::Enable => vec![TenantEnabled {}.into()],
        Order::SetQuotas(quotas) if quotas == registry.standing().quotas() => vec![],
        Order::SetQuotas(quotas) => {
            let nothing = [
                ("people awake", quotas.awake_users),
                ("requests in flight", quotas.in_flight),
                ("utterances a second", quotas.utterances_per_second),
                ("utterances at once", quotas.burst),
                ("trainings waiting", quotas.trainings_waiting),
            ];
            if let Some((what, _)) = nothing.into_iter().find(|(_, limit)| *limit == Some(0)) {
                return Err(Refusal::NothingAllowed { what });
            }
            vec![QuotasSet { quotas: *quotas }.into()]
        }
        Order::NoteErasure { stream, last, head, signature } => {
            persons(*stream)?;
            let (stream, last, head, signature) = (*stream, *last, *head, *signature);
            match registry.erased().contains_key(&stream) {
                true => vec![],
                false => vec![PersonErased { stream, last, head, signature }.into()],
            }
        }
        Order::CloseSegment(segment) => {
            persons(segment.stream)?;
            let wanted = registry.uncovered(segment.stream);
            if segment.last < wanted {
                vec![]
            } else if segment.first == wanted {
                vec![segment.clone().into()]
            } else {
                return Err(Refusal::Segment { wanted, found: segment.first });
            }
        }
    });
    if !events.is_empty() {
        events.extend(ended_meanwhile(registry, &events, wall));
    }
    Ok(events)
}

/// Where the time of the next record is held, it does not tell what the wall clock reads. If that
/// ends an overlap, a record says so: after a restart the key must not come back. One is enough:
/// its reading ends all overlaps that it ends.
fn ended_meanwhile(registry: &Registry, events: &[Event], wall: Timestamp) -> Option<Event> {
    let told = |event: &Event| matches!(event, Event::Tenant(TenantEvent::KeyRetired(_)));
    if !registry.holds(wall) || events.iter().any(told) {
        return None;
    }
    let mut keys = registry.standing().keys().iter();
    let (key, _) = keys.find(|(_, known)| !known.is_gone() && !known.is_good(wall))?;
    Some(retired(*key, wall, 0))
}

fn retired(key: PublicKey, wall: Timestamp, overlap_seconds: u64) -> Event {
    KeyRetired { key, overlap: Overlap::Read { wall, overlap_seconds } }.into()
}

fn admit(
    registry: &Registry,
    key: PublicKey,
    role: Role,
    label: &str,
    wall: Timestamp,
) -> Result<Vec<Event>, Refusal> {
    match registry.standing().keys().get(&key) {
        Some(known) if !known.is_good(wall) => Err(Refusal::Retired { key }),
        Some(known) if known.role != role => {
            Err(Refusal::OtherRole { key, held: known.role, wanted: role })
        }
        Some(_) => Ok(vec![]),
        None if registry.standing().keys().len() >= TENANT_KEYS_MAX => {
            Err(Refusal::TooManyKeys { max: TENANT_KEYS_MAX })
        }
        None => Ok(vec![KeyAdmitted { key, role, label: label.to_owned() }.into()]),
    }
}

fn retire(
    registry: &Registry,
    key: PublicKey,
    overlap_seconds: u64,
    wall: Timestamp,
) -> Result<Vec<Event>, Refusal> {
    let known = registry.standing().keys().get(&key).ok_or(Refusal::UnknownKey { key })?;
    if overlap_seconds > OVERLAP_S_MAX {
        return Err(Refusal::TooLongOverlap { max: OVERLAP_S_MAX, found: overlap_seconds });
    }
    Ok(match known.retired {
        Some(_) if known.is_gone() => vec![],
        // Its overlap is over, and no record says so yet.
        Some(_) if !known.is_good(wall) => vec![retired(key, wall, 0)],
        // An earlier end stands.
        Some(running) if running.until <= wall.plus_seconds(overlap_seconds) => vec![],
        _ => vec![retired(key, wall, overlap_seconds)],
    })
}

fn rotate(
    registry: &Registry,
    old: PublicKey,
    new: PublicKey,
    overlap_seconds: u64,
    wall: Timestamp,
) -> Result<Vec<Event>, Refusal> {
    if old == new {
        return Err(Refusal::SameKey { key: old });
    }
    let known = registry.standing().keys().get(&old).ok_or(Refusal::UnknownKey { key: old })?;
    if !known.is_good(wall) {
        // Asked again after the overlap, it is done already; else somebody wants a gone key's place.
        return match registry.standing().keys().get(&new) {
            Some(heir) if heir.role == known.role && heir.is_good(wall) => Ok(vec![]),
            _ => Err(Refusal::Retired { key: old }),
        };
    }
    // The label was checked by the rule of its time.
    let mut events = admit(registry, new, known.role, &known.label, wall)?;
    events.extend(retire(registry, old, overlap_seconds, wall)?);
    Ok(events)
}

fn persons(stream: StreamKey) -> Result<(), Refusal> {
    match stream == StreamKey::TENANT {
        true => Err(Refusal::TenantsOwn { stream }),
        false => Ok(()),
    }
}

/// A free text of an operator.
fn check_text(what: &'static str, text: &str) -> Result<(), Refusal> {
    if text.len() > LABEL_BYTES_MAX {
        return Err(Refusal::TooLong { what, max: LABEL_BYTES_MAX, found: text.len() });
    }
    plain::check(text).map_err(|hidden| Refusal::Hidden { what, hidden })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::{Quotas, Record, SegmentClosed};
    use crate::ids::{Digest, RequestId};

    /// Decides and applies, as a book does.
    fn obey(registry: &mut Registry, order: Order, wall: u64) -> Result<usize, Refusal> {
        let wall = Timestamp(wall);
        let events = decide(registry, &order, wall)?;
        let (count, at) = (events.len(), registry.next_at(wall));
        for event in events {
            let seq = registry.head().next();
            let record = Record {
                seq,
                at,
                request: RequestId([0; 16]),
                prev: registry.head().digest,
                digest: Digest::of(&seq.get().to_be_bytes()),
                event,
            };
            registry.apply(&record).unwrap();
        }
        Ok(count)
    }

    const A: PublicKey = PublicKey([1; 32]);
    const B: PublicKey = PublicKey([2; 32]);
    const SECOND: u64 = 1_000_000;

    fn admit_a() -> Order {
        Order::Admit { key: A, role: Role::Gateway, label: "lab door".to_owned() }
    }

    fn opened() -> Registry {
        let mut registry = Registry::default();
        assert_eq!(obey(&mut registry, Order::Open, 1), Ok(1));
        registry
    }

    #[test]
    fn a_tenant_is_opened_before_anything_else_and_once() {
        assert_eq!(obey(&mut Registry::default(), admit_a(), 1), Err(Refusal::NotOpen));
        assert_eq!(obey(&mut opened(), Order::Open, 2), Ok(0));
    }

    #[test]
    fn an_order_given_twice_is_recorded_once() {
        let mut registry = opened();
        let quotas = Quotas { awake_users: Some(3), ..Quotas::default() };
        for order in [
            admit_a(),
            Order::SetQuotas(quotas),
            Order::Disable { reason: "unpaid".to_owned() },
            Order::Enable,
            Order::Rotate { old: A, new: B, overlap_seconds: 9 },
            Order::Retire { key: B, overlap_seconds: 0 },
        ] {
            assert!(obey(&mut registry, order.clone(), 5).unwrap() > 0, "{order:?}");
            assert_eq!(obey(&mut registry, order.clone(), 5), Ok(0), "{order:?}");
        }
    }

    #[test]
    fn a_rotation_keeps_both_keys_for_the_overlap_and_then_one() {
        let mut registry = opened();
        obey(&mut registry, admit_a(), SECOND).unwrap();
        let rotate = Order::Rotate { old: A, new: B, overlap_seconds: 10 };
        obey(&mut registry, rotate.clone(), 2 * SECOND).unwrap();
        let roles =
            |at: u64| [A, B].map(|key| registry.standing().admits(&key, Timestamp(at * SECOND)));
        assert_eq!(roles(11), [Some(Role::Gateway); 2]);
        assert_eq!(roles(12), [None, Some(Role::Gateway)]);
        assert_eq!(obey(&mut registry, rotate, 20 * SECOND), Ok(0));
        assert_eq!(obey(&mut registry, admit_a(), 20 * SECOND), Err(Refusal::Retired { key: A }));
    }

    #[test]
    fn a_retired_key_is_never_given_more_time() {
        let mut registry = opened();
        obey(&mut registry, admit_a(), 1).unwrap();
        obey(&mut registry, Order::Retire { key: A, overlap_seconds: 0 }, 5).unwrap();
        let later = Order::Retire { key: A, overlap_seconds: 100 };
        assert_eq!(obey(&mut registry, later, 6), Ok(0));
        assert_eq!(registry.standing().admits(&A, Timestamp(6)), None);
    }

    #[test]
    fn a_disabled_tenant_lets_nobody_in_until_it_is_enabled() {
        let mut registry = opened();
        obey(&mut registry, admit_a(), 1).unwrap();
        obey(&mut registry, Order::Disable { reason: "unpaid".to_owned() }, 2).unwrap();
        assert_eq!(registry.standing().admits(&A, Timestamp(3)), None);
        obey(&mut registry, Order::Enable, 4).unwrap();
        assert_eq!(registry.standing().admits(&A, Timestamp(5)), Some(Role::Gateway));
    }

    #[test]
    fn orders_that_make_no_sense_are_refused_by_name() {
        let mut registry = opened();
        obey(&mut registry, admit_a(), 1).unwrap();
        let mut refused = |order| obey(&mut registry, order, 2).unwrap_err().to_string();
        let auditor = Order::Admit { key: A, role: Role::Auditor, label: String::new() };
        assert!(refused(auditor).contains("already admitted as gateway"));
        let unknown = Order::Retire { key: B, overlap_seconds: 0 };
        assert!(refused(unknown).contains("does not belong to this tenant"));
        let same = Order::Rotate { old: A, new: A, overlap_seconds: 0 };
        assert!(refused(same).contains("are the same"));
        let long = Order::Disable { reason: "x".repeat(LABEL_BYTES_MAX + 1) };
        assert!(refused(long).contains("at most"));
        let forged = Order::Disable { reason: "unpaid\nlab: enabled".to_owned() };
        assert!(refused(forged).starts_with("in the reason, character 7 is U+000A"));
        let label = "door\u{202e}".to_owned();
        let forged = Order::Admit { key: B, role: Role::Auditor, label };
        assert!(refused(forged).starts_with("in the label, character 5 is U+202E"));
        let nothing = Quotas { in_flight: Some(0), ..Quotas::default() };
        assert!(refused(Order::SetQuotas(nothing)).contains("disable the tenant"));
    }

    #[test]
    fn segments_follow_one_another_without_a_gap() {
        let mut registry = Registry::default();
        let segment = |first: u64, last: u64| {
            Order::CloseSegment(SegmentClosed {
                stream: StreamKey([7; 16]),
                first: Seq::new(first).unwrap(),
                last: Seq::new(last).unwrap(),
                root: Digest::ZERO,
                head: Digest::ZERO,
            })
        };
        assert_eq!(obey(&mut registry, segment(1, 4), 1), Ok(2), "the tenant is opened by it");
        assert_eq!(obey(&mut registry, segment(1, 4), 1), Ok(0));
        assert!(matches!(obey(&mut registry, segment(6, 9), 1), Err(Refusal::Segment { .. })));
        assert_eq!(obey(&mut registry, segment(5, 9), 1), Ok(1));
        assert_eq!(registry.segments().len(), 2);
        assert_eq!(registry.uncovered(StreamKey([7; 16])).get(), 10);
    }
}
