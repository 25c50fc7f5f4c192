use std::collections::BTreeMap;

use crate::events::{Event, Head, PersonErased, Quotas, Record, Role, SegmentClosed, TenantEvent};
use crate::ids::{PublicKey, Seq, StreamKey, Timestamp, WithinTenant};

/// A tenant's stream, folded.
#[derive(Debug, Clone, PartialEq)]
pub struct Registry {
    head: Head,
    last_at: Timestamp,
    opened: bool,
    standing: Standing,
    erased: WithinTenant<PersonErased>,
    segments: Vec<Segment>,
    covered: WithinTenant<Seq>,
}

/// What the doors must know of a tenant.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Standing {
    disabled: Option<String>,
    keys: BTreeMap<PublicKey, Key>,
    quotas: Quotas,
}

/// A key that was ever admitted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    pub role: Role,
    pub label: String,
    pub admitted_at: Timestamp,
    /// None while nobody said otherwise.
    pub valid_until: Option<Timestamp>,
}

/// A leaf of the tenant's tree, and the record that made it one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    pub closed: SegmentClosed,
    /// In the tenant's stream.
    pub seq: Seq,
}

/// Why a record cannot follow in a tenant's stream.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("record {seq} of the tenant's stream: {reason}")]
pub struct Disagreement {
    pub seq: Seq,
    pub reason: String,
}

impl Default for Registry {
    fn default() -> Registry {
        Registry {
            head: Head::EMPTY,
            last_at: Timestamp::default(),
            opened: false,
            standing: Standing::default(),
            erased: WithinTenant::new(),
            segments: Vec::new(),
            covered: WithinTenant::new(),
        }
    }
}

impl Registry {
    /// Applies one record. Total and pure.
    ///
    /// - errors: [`Disagreement`]; the registry is then not to be used any more.
    pub fn apply(&mut self, record: &Record) -> Result<(), Disagreement> {
        let seq = record.seq;
        let wrong = |reason: String| Err(Disagreement { seq, reason });
        if seq != self.head.next() || record.prev != self.head.digest {
            return wrong(format!("it does not follow on record {}", self.head.seq));
        }
        let Event::Tenant(event) = &record.event else {
            return wrong(format!("{:?} is of a person's life", record.event.kind()));
        };
        if matches!(event, TenantEvent::Opened(_)) == self.opened {
            return wrong("a tenant is opened once, and first".to_owned());
        }
        match event {
            TenantEvent::Opened(_) => self.opened = true,
            TenantEvent::KeyAdmitted(event) => {
                let key = Key {
                    role: event.role,
                    label: event.label.clone(),
                    admitted_at: record.at,
                    valid_until: None,
                };
                self.standing.keys.insert(event.key, key);
            }
            TenantEvent::KeyRetired(event) => match self.standing.keys.get_mut(&event.key) {
                Some(key) => key.valid_until = Some(event.valid_until),
                None => return wrong(format!("key {} was never admitted", event.key)),
            },
            TenantEvent::Disabled(event) => self.standing.disabled = Some(event.reason.clone()),
            TenantEvent::Enabled(_) => self.standing.disabled = None,
            TenantEvent::QuotasSet(event) => self.standing.quotas = event.quotas,
            TenantEvent::PersonErased(event) => {
                self.erased.insert(event.stream, event.clone());
            }
            TenantEvent::SegmentClosed(event) => {
                let next = self.uncovered(event.stream);
                if event.first != next || event.last < event.first {
                    return wrong(format!(
                        "a segment of records {} to {} cannot follow where {next} is next",
                        event.first, event.last
                    ));
                }
                self.covered.insert(event.stream, event.last);
                self.segments.push(Segment { closed: event.clone(), seq });
            }
        }
        self.head = Head { seq: seq.get(), digest: record.digest };
        self.last_at = record.at;
        Ok(())
    }

    /// What the doors must know.
    pub fn standing(&self) -> &Standing {
        &self.standing
    }

    pub fn is_open(&self) -> bool {
        self.opened
    }

    /// Where the tenant's stream ends.
    pub fn head(&self) -> Head {
        self.head
    }

    /// A moment for the next record: never before the last one.
    pub fn next_at(&self, clock: Timestamp) -> Timestamp {
        clock.max(self.last_at)
    }

    /// Everybody who was erased, by their stream.
    pub fn erased(&self) -> &WithinTenant<PersonErased> {
        &self.erased
    }

    /// The leaves of the tenant's tree, in its order.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The first record of a person's stream that no segment covers.
    pub fn uncovered(&self, stream: StreamKey) -> Seq {
        self.covered.get(&stream).map_or(Seq::FIRST, |last| last.next())
    }
}

impl Standing {
    /// What `key` may do at `now`.
    pub fn admits(&self, key: &PublicKey, now: Timestamp) -> Option<Role> {
        let known = self.keys.get(key).filter(|known| known.is_good(now))?;
        self.disabled.is_none().then_some(known.role)
    }

    /// Why nobody comes in, if so.
    pub fn disabled(&self) -> Option<&str> {
        self.disabled.as_deref()
    }

    /// Every key that was ever admitted, in the order of their bytes.
    pub fn keys(&self) -> &BTreeMap<PublicKey, Key> {
        &self.keys
    }

    pub fn quotas(&self) -> &Quotas {
        &self.quotas
    }
}

impl Key {
    pub fn is_good(&self, now: Timestamp) -> bool {
        self.valid_until.is_none_or(|until| now < until)
    }
}
