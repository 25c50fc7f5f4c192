//! What every backend of [`EventLog`] must do. One suite; `tests/store/log_conformance.rs` runs it for
//! each backend we have, and each new backend must pass it.

use std::sync::Arc;

use crate::events::{
    Batch, Event, Head, Header, Record, RetrainFailed, SessionClosed, commitment, encode,
};
use crate::ids::{Digest, RequestId, Seq, StreamId, StreamKey, TenantId, Timestamp, UserId};
use crate::limits::{BATCH_EVENTS_MAX, KEY_FILE_BYTES, RECORD_BYTES_MAX, STORE_VALUE_BYTES_MAX};
use crate::store::caches::cache::MemoryCache;
use crate::store::directory::store::Store;
use crate::store::log::{AppendError, Durable, EventLog, ReadError, SealedRecord};
use crate::store::sealing::entropy::OsEntropy;
use crate::store::sealing::keys::Keys;

/// A backend under test: an empty store, and how to open the same one again if it outlives its
/// process.
pub struct Subject {
    pub store: Store,
    /// Called after every handle of the store was dropped.
    pub reopen: Option<Box<dyn Fn() -> Store>>,
}

type Check = (&'static str, fn(Subject));

const CHECKS: &[Check] = &[
    ("an unknown stream is empty", an_unknown_stream_is_empty),
    ("appended records are read back", appended_records_are_read_back),
    ("a batch of no events changes nothing", a_batch_of_no_events_changes_nothing),
    ("a wrong head is a conflict", a_wrong_head_is_a_conflict),
    ("a batch is appended whole or not at all", a_batch_is_appended_whole_or_not_at_all),
    ("a read starts anywhere", a_read_starts_anywhere),
    ("large records come back whole", large_records_come_back_whole),
    ("streams are listed by tenant", streams_are_listed_by_tenant),
    ("writers of different streams do not disturb each other", many_writers),
    ("of two writers of one stream one wins", of_two_writers_one_wins),
    ("readers see whole records while others write", readers_see_whole_records),
    ("an erased person's stream is closed and keeps its head", an_erased_stream_is_closed),
    ("sealed bytes are counted for each tenant", sealed_bytes_are_counted),
    ("everything is there after reopening", everything_is_there_after_reopening),
];

/// Runs every check on a subject of its own.
///
/// - panics: when the backend breaks the contract; the check's name is printed before it runs.
pub fn check(make: &dyn Fn() -> Subject) {
    for (name, check) in CHECKS {
        println!("conformance: {name}");
        check(make());
    }
}

/// One event that carries `reason`.
pub fn event(reason: &str) -> Event {
    Event::RetrainFailed(RetrainFailed { recipe: Digest::ZERO, reason: reason.to_owned() })
}

/// A batch of such events.
pub fn batch<'r>(reasons: impl IntoIterator<Item = &'r str>) -> Batch {
    let events = reasons.into_iter().map(event).collect();
    Batch { request: RequestId([5; 16]), at: Timestamp(1_000_000), events }
}

/// The stream of a person, in a tenant that is made if need be.
pub fn stream(keys: &Keys, tenant: &str, user: &str) -> StreamId {
    let tenant = TenantId::new(tenant).expect("the suite names tenants well");
    keys.make_tenant(&tenant).expect("the backend makes tenants");
    let user = UserId::new(user).expect("the suite names users well");
    keys.stream_id(&tenant, &user).expect("the tenant was just made")
}

fn sealed_bytes_are_counted(subject: Subject) {
    let Subject { store, reopen } = subject;
    let (ada, bob) = (stream(&store.keys, "one", "ada"), stream(&store.keys, "two", "bob"));
    let count =
        |store: &Store, who: &StreamId| store.log.sealed_bytes(&who.tenant).expect("counts");
    assert_eq!(count(&store, &ada), 0);
    let long = "x".repeat(3 * STORE_VALUE_BYTES_MAX);
    let first = append(&*store.log, &ada, Head::EMPTY, batch(["a", &long])).head();
    let two = count(&store, &ada);
    let bare = (2 * Header::BYTES + long.len()) as u64 + KEY_FILE_BYTES;
    assert!((bare..bare + 400).contains(&two), "{two} bytes for {bare}");
    append(&*store.log, &bob, Head::EMPTY, batch(["b"]));
    append(&*store.log, &ada, first, batch(["c"]));
    let (three, one) = (count(&store, &ada), count(&store, &bob));
    let record = one - KEY_FILE_BYTES;
    assert!(three > two && three < two + 400, "no second key: {two}, {three}");
    assert!(record < 400 && record > Header::BYTES as u64, "{record}");
    let Some(reopen) = reopen else { return };
    drop(store);
    let store = reopen();
    // Asked for the first time after something came on top.
    append(&*store.log, &bob, store.log.head(&bob).expect("a head"), batch(["d"]));
    assert_eq!(count(&store, &ada), three);
    assert!(count(&store, &bob) > one, "{} after {one}", count(&store, &bob));
    assert!(count(&store, &bob) < one + record + 8, "no second key");
}

/// Reads a stream to its end and insists on the laws that a reader relies on.
pub fn read_all(log: &dyn EventLog, stream: &StreamId) -> Vec<Record> {
    let records = log.read(stream, Seq::FIRST).expect("the stream can be read");
    let records: Vec<Record> = records.map(|record| record.expect("each record reads")).collect();
    let mut head = Head::EMPTY;
    for record in &records {
        assert_eq!(record.seq, head.next(), "sequence numbers are dense");
        assert_eq!(record.prev, head.digest, "records are chained");
        head = Head { seq: record.seq.get(), digest: record.digest };
    }
    records
}

fn append(log: &dyn EventLog, stream: &StreamId, after: Head, batch: Batch) -> Durable {
    log.append(stream, after, batch).wait().expect("the append succeeds")
}

fn reasons(records: &[Record]) -> Vec<&str> {
    let reasons = records.iter().map(|record| match &record.event {
        Event::RetrainFailed(failed) => failed.reason.as_str(),
        other => panic!("the suite appends no {:?}", other.kind()),
    });
    reasons.collect()
}

fn an_unknown_stream_is_empty(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    let nobody = stream(&keys, "one", "nobody");
    assert_eq!(log.head(&nobody), Ok(Head::EMPTY));
    assert_eq!(read_all(&*log, &nobody), []);
    assert_eq!(log.streams(&nobody.tenant), Ok(vec![]));
    assert_eq!(log.streams(&TenantId::new("never-heard-of").unwrap()), Ok(vec![]));
}

fn appended_records_are_read_back(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    let ada = stream(&keys, "one", "ada");
    let first = append(&*log, &ada, Head::EMPTY, batch(["a", "b"]));
    assert_eq!(first.head().seq, 2);
    let closed = SessionClosed { reason: "moved".to_owned() };
    let last = Batch {
        request: RequestId([6; 16]),
        at: Timestamp(7),
        events: vec![Event::SessionClosed(closed)],
    };
    let second = append(&*log, &ada, first.head(), last);
    assert_eq!(log.head(&ada), Ok(second.head()));
    let read = read_all(&*log, &ada);
    assert_eq!(read, [first.records(), second.records()].concat());
    assert_eq!(read[2].request, RequestId([6; 16]));
    assert_eq!(read[2].at, Timestamp(7));
    assert_eq!(second.head(), Head { seq: 3, digest: read[2].digest });
}

fn a_batch_of_no_events_changes_nothing(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    let ada = stream(&keys, "one", "ada");
    let nothing = append(&*log, &ada, Head::EMPTY, batch([]));
    assert_eq!((nothing.records(), nothing.head()), (&[][..], Head::EMPTY));
    assert_eq!(log.streams(&ada.tenant), Ok(vec![]));
    let head = append(&*log, &ada, Head::EMPTY, batch(["a"])).head();
    assert_eq!(append(&*log, &ada, head, batch([])).head(), head);
}

fn a_wrong_head_is_a_conflict(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    let ada = stream(&keys, "one", "ada");
    let first = append(&*log, &ada, Head::EMPTY, batch(["a"])).head();
    let head = append(&*log, &ada, first, batch(["b"])).head();
    let ahead = Head { seq: 9, ..head };
    let elsewhere = Head { digest: Digest::of(b"another history"), ..head };
    for wrong in [Head::EMPTY, first, ahead, elsewhere] {
        let error = log.append(&ada, wrong, batch(["c"])).wait().unwrap_err();
        let (expected, found) = (wrong.seq, 2);
        assert_eq!(error, AppendError::Conflict { stream: ada.clone(), expected, found });
    }
    assert_eq!(reasons(&read_all(&*log, &ada)), ["a", "b"]);
    append(&*log, &ada, head, batch(["c"]));
}

fn a_batch_is_appended_whole_or_not_at_all(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    let ada = stream(&keys, "one", "ada");
    let too_large = "x".repeat(RECORD_BYTES_MAX);
    let refused = log.append(&ada, Head::EMPTY, batch(["a", "b", &too_large])).wait();
    assert!(matches!(refused, Err(AppendError::TooLarge { .. })), "{refused:?}");
    let many = ["a"; BATCH_EVENTS_MAX + 1];
    let refused = log.append(&ada, Head::EMPTY, batch(many)).wait();
    assert!(matches!(refused, Err(AppendError::TooLarge { .. })), "{refused:?}");
    assert_eq!(log.head(&ada), Ok(Head::EMPTY));
    let whole = append(&*log, &ada, Head::EMPTY, batch(["a"; BATCH_EVENTS_MAX]));
    assert_eq!(whole.records().len(), BATCH_EVENTS_MAX);
    assert_eq!(read_all(&*log, &ada), whole.records());
}

fn a_read_starts_anywhere(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    let ada = stream(&keys, "one", "ada");
    let mut head = Head::EMPTY;
    for reason in ["a", "b", "c", "d"] {
        head = append(&*log, &ada, head, batch([reason])).head();
    }
    let all = read_all(&*log, &ada);
    for from in 1..=6 {
        let records = log.read(&ada, Seq::new(from).expect("from 1 on")).expect("it reads");
        let records: Vec<Record> = records.map(|record| record.expect("it reads")).collect();
        let skipped = usize::try_from(from - 1).expect("a small number").min(all.len());
        assert_eq!(records, all[skipped..], "from {from}");
        let sealed = log.sealed(&ada, Seq::new(from).expect("from 1 on")).expect("it reads");
        let sealed: Vec<SealedRecord> = sealed.map(|record| record.expect("it reads")).collect();
        let key = keys.user_key(&ada).expect("she is here");
        let opened: Vec<(Seq, Digest)> =
            sealed.iter().map(|record| (record.header.seq, record.digest)).collect();
        let wanted: Vec<(Seq, Digest)> =
            records.iter().map(|record| (record.seq, record.digest)).collect();
        assert_eq!(opened, wanted, "sealed, from {from}");
        for (sealed, record) in sealed.iter().zip(&records) {
            assert_eq!(Digest::of(&sealed.frame), sealed.digest);
            let body = &sealed.frame[Header::BYTES..];
            let (salt, body) = key.reveal(&sealed.header, body).expect("it is hers");
            assert_eq!(body, encode(&record.event));
            assert_eq!(commitment(&salt, &body), sealed.header.commitment);
        }
    }
}

fn large_records_come_back_whole(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    let ada = stream(&keys, "one", "ada");
    let overhead = encode(&event(&"x".repeat(RECORD_BYTES_MAX))).len() - RECORD_BYTES_MAX;
    let largest = RECORD_BYTES_MAX - overhead;
    let around = STORE_VALUE_BYTES_MAX - 1_000..STORE_VALUE_BYTES_MAX + 1_000;
    let lengths = around.step_by(50).chain([40_000, 300_000, largest, 10]);
    let mut head = Head::EMPTY;
    let mut written = Vec::new();
    for (number, length) in lengths.enumerate() {
        // Text that differs from place to place, so that a chunk in the wrong place shows.
        let text: String = (0..)
            .map(|i| char::from(b'a' + (i * 7 + i / 4096 + number) as u8 % 26))
            .take(length)
            .collect();
        head = append(&*log, &ada, head, batch([text.as_str()])).head();
        written.push(text);
    }
    assert_eq!(reasons(&read_all(&*log, &ada)), written);
    let above = "x".repeat(largest + 1);
    let refused = log.append(&ada, head, batch([above.as_str()])).wait();
    assert!(matches!(refused, Err(AppendError::TooLarge { .. })), "{refused:?}");
    assert_eq!(log.head(&ada), Ok(head));
}

fn streams_are_listed_by_tenant(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    let ada = stream(&keys, "one", "ada");
    let mut ones = vec![ada.clone(), stream(&keys, "one", "grace")];
    // The same key in another tenant is another stream.
    let twin = StreamId { tenant: stream(&keys, "two", "x").tenant, key: ada.key };
    let edge = StreamId { tenant: ada.tenant.clone(), key: StreamKey([0xff; 16]) };
    ones.push(edge);
    for one in &ones {
        append(&*log, one, Head::EMPTY, batch(["a", "b"]));
    }
    let head = append(&*log, &twin, Head::EMPTY, batch(["c"])).head();
    ones.sort();
    assert_eq!(log.streams(&ada.tenant), Ok(ones));
    assert_eq!(log.streams(&twin.tenant), Ok(vec![twin.clone()]));
    assert_eq!(log.tenants(), Ok(vec![ada.tenant.clone(), twin.tenant.clone()]));
    assert_eq!(log.head(&twin), Ok(head));
    assert_eq!(log.walk(&twin), Ok(head));
    assert_eq!(reasons(&read_all(&*log, &twin)), ["c"]);
    assert_eq!(reasons(&read_all(&*log, &ada)), ["a", "b"]);
}

fn many_writers(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    std::thread::scope(|scope| {
        for writer in 0..16 {
            let (log, keys) = (&log, &keys);
            scope.spawn(move || {
                let tenant = if writer % 2 == 0 { "one" } else { "two" };
                let mine = stream(keys, tenant, &format!("writer {writer}"));
                let mut head = Head::EMPTY;
                for round in 0..10 {
                    let text = format!("{writer} {round}");
                    head = append(&**log, &mine, head, batch([text.as_str(), "and"])).head();
                }
                let records = read_all(&**log, &mine);
                let expected: Vec<String> = (0..10)
                    .flat_map(|round| [format!("{writer} {round}"), "and".to_owned()])
                    .collect();
                assert_eq!(reasons(&records), expected);
            });
        }
    });
}

fn of_two_writers_one_wins(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    let ada = stream(&keys, "one", "ada");
    let write = |name: &str| {
        let (mut won, mut head) = (0, Head::EMPTY);
        while won < 10 {
            match log.append(&ada, head, batch([name])).wait() {
                Ok(durable) => (won, head) = (won + 1, durable.head()),
                Err(AppendError::Conflict { .. }) => head = log.head(&ada).expect("it reads"),
                Err(error) => panic!("{error}"),
            }
        }
    };
    std::thread::scope(|scope| {
        let one = scope.spawn(|| write("one"));
        let two = scope.spawn(|| write("two"));
        one.join().expect("writer one");
        two.join().expect("writer two");
    });
    let records = read_all(&*log, &ada);
    let by = |name| reasons(&records).iter().filter(|&&reason| reason == name).count();
    assert_eq!((by("one"), by("two"), records.len()), (10, 10, 20));
}

fn readers_see_whole_records(subject: Subject) {
    let Store { log, keys, .. } = subject.store;
    let ada = stream(&keys, "one", "ada");
    let long = "y".repeat(3 * STORE_VALUE_BYTES_MAX);
    let mut head = append(&*log, &ada, Head::EMPTY, batch(["0", long.as_str()])).head();
    // A reader that started early shows what stood then.
    let early = log.read(&ada, Seq::FIRST).expect("it reads");
    std::thread::scope(|scope| {
        let (log, ada) = (&log, &ada);
        let writer = scope.spawn(move || {
            for _ in 0..20 {
                head = append(&**log, ada, head, batch(["x", long.as_str()])).head();
            }
        });
        let mut seen = 0;
        while !writer.is_finished() {
            let records = read_all(&**log, ada);
            assert!(records.len() >= seen, "what was there stays there");
            assert_eq!(records.len() % 2, 0, "batches are seen whole");
            seen = records.len();
        }
    });
    assert_eq!(early.count(), 2);
    assert_eq!(read_all(&*log, &ada).len(), 42);
}

fn an_erased_stream_is_closed(subject: Subject) {
    let store = subject.store;
    let Store { log, keys, .. } = &store;
    let (ada, grace) = (stream(keys, "one", "ada"), stream(keys, "one", "grace"));
    let head = append(&**log, &ada, Head::EMPTY, batch(["a"])).head();
    append(&**log, &grace, Head::EMPTY, batch(["b"]));
    store.erase(&ada).expect("a person can be erased");
    assert!(matches!(log.read(&ada, Seq::FIRST).map(|_| ()), Err(ReadError::Erased)));
    assert_eq!(log.append(&ada, head, batch(["c"])).wait(), Err(AppendError::Erased));
    assert_eq!(log.head(&ada), Ok(head));
    let sealed = log.sealed(&ada, Seq::FIRST).expect("that needs no key");
    let sealed: Vec<Digest> = sealed.map(|record| record.expect("it reads").digest).collect();
    assert_eq!(sealed, [head.digest]);
    assert_eq!(reasons(&read_all(&**log, &grace)), ["b"]);
}

fn everything_is_there_after_reopening(subject: Subject) {
    let Some(reopen) = subject.reopen else { return };
    let (mut heads, mut written) = (Vec::new(), Vec::new());
    let store = subject.store;
    let Store { log, keys, .. } = &store;
    for (tenant, user) in [("one", "ada"), ("one", "grace"), ("two", "ada")] {
        let who = stream(keys, tenant, user);
        let long = user.repeat(STORE_VALUE_BYTES_MAX);
        let first = append(&**log, &who, Head::EMPTY, batch([user, long.as_str()]));
        let second = append(&**log, &who, first.head(), batch([tenant]));
        written.push([first.records(), second.records()].concat());
        heads.push((who, second.head()));
    }
    drop(store);
    for round in 0..2 {
        let Store { log, .. } = reopen();
        for ((who, head), records) in heads.iter_mut().zip(&mut written) {
            assert_eq!(log.head(who), Ok(*head), "round {round}");
            assert_eq!(&read_all(&*log, who), records, "round {round}");
            let stale = log.append(who, Head::EMPTY, batch(["x"])).wait();
            assert!(matches!(stale, Err(AppendError::Conflict { .. })), "{stale:?}");
            let more = append(&*log, who, *head, batch(["more"]));
            *head = more.head();
            records.extend_from_slice(more.records());
        }
    }
}

impl Store {
    /// In memory, around another log: one with faults, or a seeded one.
    pub fn around(log: Arc<dyn EventLog>, keys: Arc<Keys>) -> Store {
        Store::of(log, Arc::new(MemoryCache::default()), keys)
    }
}

/// A store in memory around any log; shorthand for backends without a disk.
pub fn in_memory(wrap: impl FnOnce(Arc<Keys>) -> Arc<dyn EventLog>) -> Subject {
    let keys = Arc::new(Keys::in_memory(Arc::new(OsEntropy)));
    Subject { store: Store::around(wrap(keys.clone()), keys), reopen: None }
}
