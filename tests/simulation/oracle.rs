//! The laws that must always be true. The fold of the log is the oracle, and everything that
//! anybody saw must agree with it. Violations have the names of `crates/core/src/invariants.rs`.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use apprentice::client::Phase;
use apprentice::events::{Event, Record};
use apprentice::ids::{Digest, RequestId, Seq, StreamId};
use apprentice::invariants::Invariant;
use apprentice::replay::{Minds, rebuild};
use apprentice::session::{Session, reply_of};
use apprentice::store::{EventLog, Store};

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
