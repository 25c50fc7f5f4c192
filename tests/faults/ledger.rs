//! What people asked and which answers they got, kept outside the service, and compared with the
//! store.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard};

use apprentice::client::wire::encode_response;
use apprentice::client::{Command, Reply, Response};
use apprentice::events::{Event, Record};
use apprentice::ids::{RequestId, Seq, TenantId, UserId};
use apprentice::session::reply_of;
use apprentice::store::Store;

/// One command and its answer.
#[derive(Clone)]
pub struct Entry {
    pub id: RequestId,
    pub command: Command,
    pub heard: Outcome,
}

#[derive(Clone)]
pub enum Outcome {
    /// Nothing yet: it may be recorded or not.
    Open,
    /// Acknowledged, with these bytes. Nothing may undo it.
    Reply { bytes: Vec<u8>, reply: Reply },
    /// Declined: nothing was recorded.
    Rejected,
}

/// One person's ledger. The person's thread writes it, and the judge reads it.
#[derive(Clone)]
pub struct Ledger {
    pub user: UserId,
    entries: Arc<Mutex<Vec<Entry>>>,
}

/// What the store contains of one person.
#[derive(Debug, Default, Clone, PartialEq)]
pub struct Found {
    pub records: usize,
    pub acknowledged: usize,
    /// Records of more than one chunk.
    pub large: usize,
    pub minds: usize,
    /// A training was scheduled and has not ended.
    pub learning: bool,
}

/// A scene of this many bytes of JSON has several chunks.
const LARGE_BYTES: usize = 12 * 1024;

impl Ledger {
    pub fn new(user: &str) -> Ledger {
        Ledger { user: UserId::new(user).unwrap(), entries: Arc::default() }
    }

    pub fn entries(&self) -> MutexGuard<'_, Vec<Entry>> {
        self.entries.lock().unwrap()
    }

    /// The requests that were acknowledged until now.
    pub fn acknowledged(&self) -> BTreeSet<RequestId> {
        let entries = self.entries();
        let acknowledged =
            entries.iter().filter(|entry| matches!(entry.heard, Outcome::Reply { .. }));
        acknowledged.map(|entry| entry.id).collect()
    }

    /// Compares the records of a store with the ledger.
    ///
    /// - `promised`: the requests that must be there. Others may be there too.
    /// - errors: a sentence about the first promise that was broken.
    pub fn check(&self, store: &Store, promised: &BTreeSet<RequestId>) -> Result<Found, String> {
        let say = |what: String| format!("{}: {what}", self.user.as_str());
        let records = self.records(store).map_err(say)?;
        self.compare(&records, promised).map_err(say)
    }

    /// The ledger of a person of whom nothing more was recorded than this.
    pub fn as_of(&self, records: &[Record]) -> Ledger {
        let recorded: BTreeSet<RequestId> = records.iter().map(|record| record.request).collect();
        let mut entries = self.entries().clone();
        entries.retain(|entry| recorded.contains(&entry.id));
        Ledger { user: self.user.clone(), entries: Arc::new(Mutex::new(entries)) }
    }

    pub fn records(&self, store: &Store) -> Result<Vec<Record>, String> {
        let stream = store.keys.stream_id(&TenantId::local(), &self.user);
        let stream = stream.map_err(|error| error.to_string())?;
        let records = store.log.read(&stream, Seq::FIRST).map_err(|error| error.to_string())?;
        records.collect::<Result<_, _>>().map_err(|error| error.to_string())
    }

    fn compare(&self, records: &[Record], promised: &BTreeSet<RequestId>) -> Result<Found, String> {
        let mut turns: BTreeMap<RequestId, &[Record]> = BTreeMap::new();
        for turn in records.chunk_by(|one, next| one.request == next.request) {
            if turns.insert(turn[0].request, turn).is_some() {
                return Err(format!("the request of record {} was recorded twice", turn[0].seq));
            }
        }
        let entries = self.entries();
        let mut found = Found { records: records.len(), ..Found::default() };
        for entry in entries.iter() {
            let turn = turns.remove(&entry.id);
            match (&entry.heard, turn) {
                (Outcome::Reply { bytes, reply }, Some(turn)) => {
                    let now = reply_of(turn);
                    if now != *reply {
                        return Err(format!("{reply:?} was answered, now it reads {now:?}"));
                    }
                    if encode_response(entry.id, Response::Reply(now)) != *bytes {
                        return Err(format!("the bytes of reply {} are others now", reply.first));
                    }
                    found.acknowledged += 1;
                }
                (Outcome::Reply { reply, .. }, None) if promised.contains(&entry.id) => {
                    let (first, last) = (reply.first, reply.last);
                    return Err(format!(
                        "records {first} to {last} were acknowledged and are lost"
                    ));
                }
                (Outcome::Rejected, Some(turn)) => {
                    return Err(format!("{:?} was rejected and is recorded", turn[0].event));
                }
                (_, None) | (Outcome::Open, Some(_)) => {}
            }
        }
        let stranger = turns.values().flat_map(|turn| turn.iter()).find(|record| {
            use Event::{RetrainCompleted, RetrainFailed, SessionOpened};
            !matches!(record.event, SessionOpened(_) | RetrainCompleted(_) | RetrainFailed(_))
        });
        if let Some(record) = stranger {
            return Err(format!("nobody asked for record {}: {:?}", record.seq, record.event));
        }
        for record in records {
            match &record.event {
                Event::EpisodeStarted(event) => {
                    found.large +=
                        usize::from(event.scene.as_json().to_string().len() > LARGE_BYTES);
                }
                Event::RetrainScheduled(_) => {
                    let before = std::mem::replace(&mut found.learning, true);
                    if before {
                        return Err(format!(
                            "record {}: the last training never ended",
                            record.seq
                        ));
                    }
                }
                Event::RetrainCompleted(_) | Event::RetrainFailed(_) => {
                    if !std::mem::replace(&mut found.learning, false) {
                        return Err(format!("record {}: a training ended twice", record.seq));
                    }
                    found.minds += 1;
                }
                _ => {}
            }
        }
        Ok(found)
    }
}

/// Tests the judge: it finds what it must find.
mod tests {
    use apprentice::events::{Batch, RetrainScheduled, SessionClosed};
    use apprentice::ids::{Digest, Timestamp};
    use apprentice::store::open_memory;

    use super::*;

    fn said(reason: &str) -> Event {
        Event::SessionClosed(SessionClosed { reason: reason.to_owned() })
    }

    fn answered(records: &[Record], id: RequestId) -> Outcome {
        let turn: Vec<Record> =
            records.iter().filter(|record| record.request == id).cloned().collect();
        let reply = reply_of(&turn);
        let bytes = encode_response(id, Response::Reply(reply.clone()));
        Outcome::Reply { bytes, reply }
    }

    /// Three acknowledged requests of one record each, and their records.
    fn history() -> (Ledger, Vec<Record>) {
        let (store, ledger) = (open_memory(), Ledger::new("ada"));
        let stream = store.keys.stream_id(&TenantId::local(), &ledger.user).unwrap();
        for number in 1..=3 {
            let events = vec![said(&format!("turn {number}"))];
            let batch = Batch { request: RequestId([number; 16]), at: Timestamp(1), events };
            store.log.append(&stream, store.log.head(&stream).unwrap(), batch).wait().unwrap();
        }
        let records = ledger.records(&store).unwrap();
        for record in &records {
            let heard = answered(&records, record.request);
            ledger.entries().push(Entry { id: record.request, command: Command::Done, heard });
        }
        (ledger, records)
    }

    #[test]
    fn the_judge_sees_every_broken_promise() {
        let (ledger, records) = history();
        let promised = ledger.acknowledged();
        let found = ledger.compare(&records, &promised).unwrap();
        assert_eq!((found.records, found.acknowledged), (3, 3));
        let broken = |change: &dyn Fn(&mut Vec<Record>)| {
            let mut records = records.clone();
            change(&mut records);
            ledger.compare(&records, &promised).expect_err("it must be seen")
        };
        assert!(broken(&|records| drop(records.pop())).contains("are lost"));
        assert!(broken(&|records| records[1].event = said("another")).contains("now it reads"));
        let stranger = RequestId([9; 16]);
        assert!(broken(&|records| records[2].request = stranger).contains("are lost"));
        let again = |records: &mut Vec<Record>| records.push(records[0].clone());
        assert!(broken(&again).contains("recorded twice"));
        let nobody = |records: &mut Vec<Record>| {
            records.push(Record { request: stranger, ..records[0].clone() });
        };
        assert!(broken(&nobody).contains("nobody asked"));
        let unpromised = ledger.compare(&records[..2], &BTreeSet::new()).unwrap();
        assert_eq!(unpromised.acknowledged, 2);
        ledger.entries()[0].heard = Outcome::Rejected;
        assert!(broken(&|_| {}).contains("was rejected and is recorded"));
    }

    #[test]
    fn the_judge_sees_a_forgotten_training() {
        let (ledger, mut records) = history();
        let due = RetrainScheduled { recipe: Digest::ZERO, lessons: vec![] };
        for record in &mut records[..2] {
            record.event = Event::RetrainScheduled(due.clone());
        }
        for (entry, record) in ledger.entries().iter_mut().zip(&records) {
            entry.heard = answered(&records, record.request);
        }
        let forgotten = ledger.compare(&records, &BTreeSet::new()).unwrap_err();
        assert!(forgotten.contains("never ended"), "{forgotten}");
        assert!(ledger.compare(&records[..1], &BTreeSet::new()).unwrap().learning);
    }
}
