//! The laws that must always be true. The fold of the log is the oracle, and everything that
//! anybody saw must agree with it. Violations have the names of `crates/core/src/invariants.rs`.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use apprentice::client::Phase;
use apprentice::events::{Event, Record, TenantEvent};
use apprentice::ids::{Digest, PublicKey, RequestId, Seq, StreamId, TenantId};
use apprentice::invariants::Invariant;
use apprentice::replay::{Minds, rebuild};
use apprentice::session::{Session, reply_of};
use apprentice::store::{EventLog, Store};
use apprentice::tenancy::{Registry, Standing};

use crate::people::{Heard, Person};
use apprentice_testkit::toy::Bells;

/// A law that was broken, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Broken {
    pub law: Invariant,
    pub how: String,
}

pub fn broken(law: Invariant, how: impl Into<String>) -> Broken {
    Broken { law, how: how.into() }
}

/// The history of one person in the log, and the state after each record.
pub struct Truth {
    records: Vec<Record>,
    states: BTreeMap<u64, Digest>,
    session: Session<Bells>,
}

impl Truth {
    /// - errors: the log cannot be read or folded.
    pub fn read(
        log: &dyn EventLog,
        domain: &Arc<Bells>,
        stream: &StreamId,
    ) -> Result<Truth, Broken> {
        let unreadable = |error: String| broken(Invariant::Chained, error);
        let records =
            log.read(stream, Seq::FIRST).map_err(|error| unreadable(error.to_string()))?;
        let mut truth = Truth {
            records: Vec::new(),
            states: BTreeMap::new(),
            session: Session::new(domain.clone()),
        };
        truth.states.insert(0, truth.session.state_digest());
        for record in records {
            let record = record.map_err(|error| unreadable(error.to_string()))?;
            let scene = |error: apprentice::session::Divergence| {
                broken(Invariant::SceneAgrees, error.to_string())
            };
            truth.session.apply(&record).map_err(scene)?;
            truth.states.insert(record.seq.get(), truth.session.state_digest());
            truth.records.push(record);
        }
        Ok(truth)
    }

    pub fn phase(&self) -> Phase {
        self.session.phase()
    }

    /// A live session must be a state of the past or the present.
    pub fn knows(&self, session: &Session<Bells>) -> Result<(), Broken> {
        let seq = session.head().seq;
        match self.states.get(&seq) {
            Some(digest) if *digest == session.state_digest() => Ok(()),
            Some(_) => Err(broken(Invariant::FoldAgrees, format!("another state at record {seq}"))),
            None => {
                let law = Invariant::DurableBeforeReply;
                Err(broken(law, format!("a session is at record {seq}, which the log lacks")))
            }
        }
    }

    /// Everything that was acknowledged is in the log in the acknowledged form. Nothing is there
    /// twice, and nothing without a request.
    pub fn honours(&self, person: &Person) -> Result<(), Broken> {
        let mut batches: BTreeMap<RequestId, Vec<Record>> = BTreeMap::new();
        let mut ended = BTreeSet::new();
        let mut last: Option<&Record> = None;
        for record in &self.records {
            if let Some(last) = last.filter(|last| last.request != record.request) {
                ended.insert(last.request);
            }
            if ended.contains(&record.request) {
                let how = format!("request {:?} was appended twice", record.request);
                return Err(broken(Invariant::ExactlyOnce, how));
            }
            if last.is_some_and(|last| last.at > record.at) {
                let how = format!("record {} is older than the one before", record.seq);
                return Err(broken(Invariant::Chained, how));
            }
            batches.entry(record.request).or_default().push(record.clone());
            last = Some(record);
        }
        for asked in &person.asked {
            let batch = batches.remove(&asked.request);
            let Heard::Reply(heard) = &asked.heard else { continue };
            match batch {
                Some(records) if reply_of(&records) == *heard => {}
                Some(_) => {
                    let how =
                        format!("{:?} was told something else than the log has", asked.command);
                    return Err(broken(Invariant::ExactlyOnce, how));
                }
                None => {
                    let how = format!("{:?} was acknowledged and is lost", asked.command);
                    return Err(broken(Invariant::DurableBeforeReply, how));
                }
            }
        }
        for record in batches.values().flatten() {
            // The remaining records must come from inside the service.
            let inside = matches!(
                record.event,
                Event::SessionOpened(_) | Event::RetrainCompleted(_) | Event::RetrainFailed(_)
            );
            if !inside {
                let how = format!("record {} has a request id nobody sent", record.seq);
                return Err(broken(Invariant::ExactlyOnce, how));
            }
        }
        Ok(())
    }

    /// Waking a user with these caches gives the same state as the whole log.
    pub fn wakes_alike(
        &self,
        domain: &Arc<Bells>,
        store: &Store,
        stream: &StreamId,
    ) -> Result<(), Broken> {
        let woken = rebuild(domain, store, stream, &Minds::default())
            .map_err(|error| broken(Invariant::ModelAgrees, error.to_string()))?;
        match woken.state_digest() == self.session.state_digest() {
            true => Ok(()),
            false => Err(broken(Invariant::FoldAgrees, "waking gives another state than the log")),
        }
    }
}

/// The history of one lab as the log has it, and what it folds to.
pub struct Lab {
    tenant: TenantId,
    records: Vec<Record>,
    registry: Registry,
}

impl Lab {
    /// - errors: the log cannot be read or folded, or admits a key twice.
    pub fn read(log: &dyn EventLog, tenant: &TenantId) -> Result<Lab, Broken> {
        let (tenant, registry) = (tenant.clone(), Registry::default());
        let mut lab = Lab { tenant, records: Vec::new(), registry };
        // A lab that nobody opened has no secret.
        let Ok(records) = log.read(&StreamId::of_tenant(&lab.tenant), Seq::FIRST) else {
            return Ok(lab);
        };
        let mut admitted: BTreeSet<PublicKey> = BTreeSet::new();
        for record in records {
            let record = record.map_err(|error| broken(Invariant::Chained, error.to_string()))?;
            if let Event::Tenant(TenantEvent::KeyAdmitted(event)) = &record.event
                && !admitted.insert(event.key)
            {
                let how = format!("key {} was admitted twice", event.key);
                return Err(broken(Invariant::ExactlyOnce, how));
            }
            lab.apply(record)?;
        }
        Ok(lab)
    }

    fn apply(&mut self, record: Record) -> Result<(), Broken> {
        let disagrees = |error| broken(Invariant::FoldAgrees, format!("{error}"));
        self.registry.apply(&record).map_err(disagrees)?;
        self.records.push(record);
        Ok(())
    }

    pub fn tenant(&self) -> &TenantId {
        &self.tenant
    }

    pub fn records(&self) -> u64 {
        self.records.len() as u64
    }

    pub fn registry(&self) -> &Registry {
        &self.registry
    }

    /// Whether these were appended together; nothing always was.
    pub fn has(&self, events: &[Event]) -> bool {
        let batches = self.records.chunk_by(|one, other| one.request == other.request);
        let same = |batch: &[Record]| batch.iter().map(|record| &record.event).eq(events);
        events.is_empty() || batches.into_iter().any(same)
    }

    /// A registry must be a state of the past or the present.
    pub fn knows(&self, registry: &Registry) -> Result<(), Broken> {
        let seq = registry.head().seq;
        if seq > self.records() {
            let how = format!("a registry is at record {seq}, which the log lacks");
            return Err(broken(Invariant::DurableBeforeReply, how));
        }
        let (tenant, records) = (self.tenant.clone(), Vec::new());
        let mut then = Lab { tenant, records, registry: Registry::default() };
        for record in &self.records[..seq as usize] {
            then.apply(record.clone())?;
        }
        match then.registry == *registry {
            true => Ok(()),
            false => {
                Err(broken(Invariant::FoldAgrees, format!("another registry at record {seq}")))
            }
        }
    }

    /// The doors go by the registry, but for the overlaps that they have seen end.
    pub fn is_told(registry: &Registry, doors: Option<Standing>) -> Result<(), Broken> {
        let seen = |standing: &Standing| {
            let keys = standing.keys().iter().map(|(key, known)| {
                let span = known.retired.map(|retired| (retired.from, retired.until));
                (*key, known.role, known.label.clone(), known.admitted_at, span)
            });
            let disabled = standing.disabled().map(str::to_owned);
            (disabled, *standing.quotas(), keys.collect::<Vec<_>>())
        };
        match doors.is_some_and(|doors| seen(&doors) == seen(registry.standing())) {
            true => Ok(()),
            false => Err(broken(Invariant::FoldAgrees, "the doors go by another state")),
        }
    }

    /// Whose erasure is on record, their key is destroyed, and their stream has ended there.
    pub fn says_who_is_erased(&self, store: &Store, log: &dyn EventLog) -> Result<(), Broken> {
        let destroyed = store.keys.erased(&self.tenant).expect("they are in memory");
        for (key, noted) in self.registry.erased().iter() {
            let stream = StreamId { tenant: self.tenant.clone(), key };
            let end = log.walk(&stream).expect("it is in memory");
            if !destroyed.contains(&stream) {
                let how = format!("the erasure of {stream} is on record, and the key is there");
                return Err(broken(Invariant::NoLostWork, how));
            }
            if (noted.last.get(), noted.head) != (end.seq, end.digest) {
                let how = format!("{stream} goes on after its erasure");
                return Err(broken(Invariant::SingleWriter, how));
            }
        }
        Ok(())
    }

    /// Whoever had records and whose key was destroyed, that is on record.
    pub fn has_noted_all(&self, store: &Store, log: &dyn EventLog) -> Result<(), Broken> {
        for stream in store.keys.erased(&self.tenant).expect("they are in memory") {
            let records = log.walk(&stream).expect("it is in memory").seq;
            if records > 0 && !self.registry.erased().contains_key(&stream.key) {
                return Err(broken(Invariant::NoLostWork, "an erasure is not on record"));
            }
        }
        Ok(())
    }
}
