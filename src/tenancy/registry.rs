use std::collections::BTreeMap;

use super::{Order, Refusal, decide};
use crate::events::{
    Batch, Event, Head, Overlap, PersonErased, Quotas, Record, Role, SegmentClosed, TenantEvent,
};
use crate::ids::{PublicKey, RequestId, Seq, StreamKey, Timestamp, WithinTenant};
use crate::store::Durable;

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
    running: Running,
}

/// A key that was ever admitted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    pub role: Role,
    pub label: String,
    pub admitted_at: Timestamp,
    /// None while nobody said otherwise.
    pub retired: Option<Retired>,
}

/// A key that was taken back. It is good while its overlap runs: as long as the wall clock reads
/// `from` or later, and earlier than `until`. The overlap ends for ever with the first reading that
/// is not; no later reading brings the key back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Retired {
    pub from: Timestamp,
    pub until: Timestamp,
    /// A reading has ended the overlap, or there was none.
    pub ended: bool,
}

/// The readings of the wall clock that end no overlap of a tenant's keys: `[from, until)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Running {
    from: Timestamp,
    until: Timestamp,
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
    /// Decides an order. Only reads.
    ///
    /// - `wall`: what the wall clock reads; `request`: of the records.
    /// - returns: what to append after [`Registry::head`]; none when it is so already.
    /// - errors: [`Refusal`].
    pub fn propose(
        &self,
        order: &Order,
        wall: Timestamp,
        request: RequestId,
    ) -> Result<Option<Batch>, Refusal> {
        let events = decide(self, order, wall)?;
        let batch = Batch { request, at: self.next_at(wall), events };
        Ok((!batch.events.is_empty()).then_some(batch))
    }

    /// Makes durable records true.
    ///
    /// - errors: as [`Registry::apply`].
    pub fn settle(&mut self, durable: &Durable) -> Result<(), Disagreement> {
        durable.records().iter().try_for_each(|record| self.apply(record))
    }

    /// Applies one record. Total and pure.
    ///
    /// - errors: [`Disagreement`]; the registry is then not to be used any more.
    pub fn apply(&mut self, record: &Record) -> Result<(), Disagreement> {
        let seq = record.seq;
        let wrong = |reason: String| Err(Disagreement { seq, reason });
        if seq != self.head.next() || record.prev != self.head.digest {
            return wrong(format!("it does not follow record {}", self.head.seq));
        }
        let Event::Tenant(event) = &record.event else {
            return wrong(format!("a {:?} belongs in a user's stream", record.event.kind()));
        };
        if matches!(event, TenantEvent::Opened(_)) == self.opened {
            return wrong("the first record, and only the first, must open the tenant".to_owned());
        }
        // A held time is no reading of a clock. (The other records of a batch have the time of its
        // first one, which was observed.)
        if !record.at.is_held(self.last_at) {
            self.standing.observe(record.at);
        }
        match event {
            TenantEvent::Opened(_) => self.opened = true,
            TenantEvent::KeyAdmitted(event) => {
                let key = Key {
                    role: event.role,
                    label: event.label.clone(),
                    admitted_at: record.at,
                    retired: None,
                };
                self.standing.keys.insert(event.key, key);
            }
            TenantEvent::KeyRetired(event) => {
                if let Overlap::Read { wall, .. } = event.overlap {
                    self.standing.observe(wall);
                }
                if !self.standing.retire(&event.key, event.overlap.span(record.at)) {
                    return wrong(format!("key {} was never admitted", event.key));
                }
            }
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
                        "a segment of records {} to {} cannot follow; the next record is {next}",
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

    /// A time for the next record: the wall clock, but after the last record.
    pub fn next_at(&self, wall: Timestamp) -> Timestamp {
        self.last_at.next(wall)
    }

    /// Whether the time of the next record is held, so that it does not tell what the clock read.
    pub fn holds(&self, wall: Timestamp) -> bool {
        self.next_at(wall).is_held(self.last_at)
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
    /// What `key` may do when the wall clock reads `wall`.
    pub fn admits(&self, key: &PublicKey, wall: Timestamp) -> Option<Role> {
        let known = self.keys.get(key).filter(|known| known.is_good(wall))?;
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

    /// Whether a reading of the wall clock ends an overlap that still ran.
    pub fn is_news(&self, wall: Timestamp) -> bool {
        wall < self.running.from || wall >= self.running.until
    }

    /// Ends the overlaps that a reading of the wall clock ends, for ever.
    pub fn observe(&mut self, wall: Timestamp) {
        if self.is_news(wall) {
            for key in self.keys.values_mut() {
                let good = key.is_good(wall);
                if let Some(retired) = &mut key.retired {
                    retired.ended |= !good;
                }
            }
            self.running = Running::of(&self.keys);
        }
    }

    /// Ends the overlaps that have ended in `before`, of the same tenant.
    pub(super) fn keep_ended(&mut self, before: &Standing) {
        for (key, known) in &mut self.keys {
            let ended = before.keys.get(key).is_some_and(Key::is_gone);
            if let Some(retired) = &mut known.retired {
                retired.ended |= ended;
            }
        }
        self.running = Running::of(&self.keys);
    }

    /// An earlier end stands: a key that is gone does not come back.
    ///
    /// - `span`: see [`Retired`].
    /// - returns: whether there is such a key.
    fn retire(&mut self, key: &PublicKey, (from, until): (Timestamp, Timestamp)) -> bool {
        let Some(known) = self.keys.get_mut(key) else { return false };
        match known.retired {
            Some(retired) if retired.ended || retired.until <= until => {}
            _ => known.retired = Some(Retired { from, until, ended: until <= from }),
        }
        self.running = Running::of(&self.keys);
        true
    }
}

impl Default for Running {
    fn default() -> Running {
        Running { from: Timestamp(0), until: Timestamp(u64::MAX) }
    }
}

impl Running {
    fn of(keys: &BTreeMap<PublicKey, Key>) -> Running {
        let running = keys.values().filter_map(|key| key.retired).filter(|it| !it.ended);
        running.fold(Running::default(), |all, it| Running {
            from: all.from.max(it.from),
            until: all.until.min(it.until),
        })
    }
}

impl Key {
    /// Whether it comes in when the wall clock reads `wall`.
    pub fn is_good(&self, wall: Timestamp) -> bool {
        let runs = |it: Retired| !it.ended && it.from <= wall && wall < it.until;
        self.retired.is_none_or(runs)
    }

    /// Whether it never comes in again, whatever the wall clock reads.
    pub fn is_gone(&self) -> bool {
        self.retired.is_some_and(|retired| retired.ended)
    }
}
