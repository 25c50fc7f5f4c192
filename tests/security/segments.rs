//! The log is covered with segments and checkpoints. A rewritten log is found by the audit, by the
//! next start, and by anybody who has an earlier checkpoint.

use std::fs;
use std::path::Path;
use std::process::Command as Process;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use apprentice::actors::{
    ActorSettings, ActorSystem, AnswerTo, Failure, OrderError, TenantRegistry, fold_tenant,
    wall_clock,
};
use apprentice::client::{Ask, Command, Query, Response, fresh_id};
use apprentice::events::{Batch, Event, EventKind, Head, Record, SessionClosed};
use apprentice::evidence::{Proof, VerifyError, verify};
use apprentice::ids::{Seq, StreamId, StreamKey, TenantId, UserId};
use apprentice::learning::Recipe;
use apprentice::replay::{
    AuditReport, CheckpointsError, ProveError, Scrutiny, Through, Wanted, audit, due_segments,
    newest_checkpoint, prove, signer_of, streams_of,
};
use apprentice::store::{
    EventLog, MemoryLog, Pending, ReadError, SealedRecords, Store, open, open_memory,
};
use apprentice::world::Stage;
use apprentice_testkit::diary::Diary;
use apprentice_testkit::front::hand_in;
use apprentice_testkit::toy::Bells;

fn tiny() -> &'static str {
    Recipe::builtin("tiny").unwrap()
}

fn local() -> TenantId {
    TenantId::local()
}

/// Two episodes that ended, a lesson, and an episode that is under way: two segments and a rest.
fn life(store: &Store, user: &str) -> Diary<Bells> {
    let mut diary = Diary::new(&Arc::new(Bells::new()), store, user, tiny());
    diary.start("Brass Silver");
    diary.say("ring the brass bell");
    diary.say("polish the silver bell");
    diary.say("ring the silver bell");
    if !diary.session.status().to_teach.is_empty() {
        diary.teach(&[2]);
        diary.learn();
    }
    diary.start("Glass");
    diary.say("ring the brass bell");
    diary.done();
    if let Some(apprentice::session::Outstanding::Retrain { .. }) = diary.session.outstanding() {
        diary.learn();
    }
    diary.start("Glass");
    diary.say("ring the brass bell");
    diary
}

fn ends(records: &[Record]) -> Vec<Seq> {
    let ends = records.iter().filter(|record| record.event.kind() == EventKind::EpisodeEnded);
    ends.map(|record| record.seq).collect()
}

fn audited(store: &Store) -> AuditReport {
    let streams = streams_of(store, None).unwrap();
    let scrutiny = Scrutiny::default();
    audit(&Arc::new(Bells::new()), store, &streams, scrutiny, 1, &())
}

fn differences(store: &Store) -> Vec<String> {
    let report = audited(store);
    report.streams.into_iter().filter_map(|s| s.difference.map(|d| d.to_string())).collect()
}

fn proof(
    store: &Store,
    stream: &StreamId,
    seq: u64,
    since: Option<u64>,
) -> Result<Proof, ProveError> {
    let registry = fold_tenant(store, &local()).unwrap();
    let record = Some((stream, Seq::new(seq).unwrap()));
    prove(store, &local(), &registry, &Wanted { record, reveal: false, since })
}

/// A log in which some streams are replaced.
struct Forged {
    original: Arc<dyn EventLog>,
    forged: MemoryLog,
    streams: Vec<StreamId>,
}

impl Forged {
    fn of(&self, stream: &StreamId) -> &dyn EventLog {
        match self.streams.contains(stream) {
            true => &self.forged,
            false => &*self.original,
        }
    }
}

impl EventLog for Forged {
    fn append(&self, stream: &StreamId, after: Head, batch: Batch) -> Pending {
        self.of(stream).append(stream, after, batch)
    }

    fn read<'a>(
        &'a self,
        stream: &StreamId,
        from: Seq,
    ) -> Result<Box<dyn Iterator<Item = Result<Record, ReadError>> + 'a>, ReadError> {
        self.of(stream).read(stream, from)
    }

    fn sealed<'a>(&'a self, stream: &StreamId, from: Seq) -> Result<SealedRecords<'a>, ReadError> {
        self.of(stream).sealed(stream, from)
    }

    fn head(&self, stream: &StreamId) -> Result<Head, ReadError> {
        self.of(stream).head(stream)
    }

    fn streams(&self, tenant: &TenantId) -> Result<Vec<StreamId>, ReadError> {
        self.original.streams(tenant)
    }

    fn tenants(&self) -> Result<Vec<TenantId>, ReadError> {
        self.original.tenants()
    }

    fn walk(&self, stream: &StreamId) -> Result<Head, ReadError> {
        self.of(stream).walk(stream)
    }

    fn sealed_bytes(&self, tenant: &TenantId) -> Result<u64, ReadError> {
        self.original.sealed_bytes(tenant)
    }
}

/// The store with the records of one stream rewritten by somebody who has every key. Chains and
/// seals of the copy are valid, like those of the original. What was signed and given out does not
/// change.
///
/// - `anew`: the tenant's own stream, with its closed segments, is written again too.
fn rewritten(
    store: &Store,
    stream: &StreamId,
    change: impl Fn(&mut Vec<Record>),
    anew: bool,
) -> Store {
    let mut streams = vec![stream.clone()];
    streams.extend(anew.then(|| StreamId::of_tenant(&local())));
    let forged = MemoryLog::new(store.keys.clone());
    let read = store.log.read(stream, Seq::FIRST).unwrap();
    let mut records: Vec<Record> = read.map(Result::unwrap).collect();
    change(&mut records);
    let mut head = Head::EMPTY;
    for Record { at, request, event, .. } in records {
        let batch = Batch { request, at, events: vec![event] };
        head = forged.append(stream, head, batch).wait().unwrap().head();
    }
    let log = Forged { original: store.log.clone(), forged, streams };
    let mut copy = Store::around(Arc::new(log), store.keys.clone());
    copy.checkpoints = store.checkpoints.clone();
    copy
}

#[test]
fn segments_are_a_function_of_the_records_and_closing_twice_is_closing_once() {
    let store = open_memory();
    let diary = life(&store, "ada");
    let ends = ends(&diary.records());
    assert_eq!(ends.len(), 2);
    let due = due_segments(&*store.log, &diary.stream, Seq::FIRST, Through::Episodes).unwrap();
    let ranges: Vec<(Seq, Seq)> = due.iter().map(|each| (each.first, each.last)).collect();
    assert_eq!(ranges, [(Seq::FIRST, ends[0]), (ends[0].next(), ends[1])]);
    let mut tenant_registry = TenantRegistry::open(store.clone()).unwrap();
    assert_eq!(tenant_registry.close(&diary.stream, Through::Episodes), Ok(2));
    assert_eq!(tenant_registry.close(&diary.stream, Through::Episodes), Ok(0));
    assert_eq!(tenant_registry.close(&diary.stream, Through::Head), Ok(1), "the episode under way");
    assert_eq!(tenant_registry.close(&diary.stream, Through::Head), Ok(0));
    assert_eq!(tenant_registry.close(&StreamId::of_tenant(&local()), Through::Head), Ok(0));
    let closed: Vec<_> = tenant_registry
        .registry(&local())
        .segments()
        .iter()
        .map(|each| each.closed.clone())
        .collect();
    assert_eq!(closed[..2], due);
    // The next start finds the same.
    let mut again = TenantRegistry::open(store.clone()).unwrap();
    assert_eq!(again.registry(&local()), tenant_registry.registry(&local()));
    assert_eq!(again.close(&diary.stream, Through::Head), Ok(0));
    let note = tenant_registry.checkpoint(&local()).unwrap();
    assert_eq!(again.checkpoint(&local()), Ok(note.clone()), "the same tree is signed once");
    assert_eq!(store.checkpoints.all(&local()), Ok(vec![note]));
}

#[test]
fn a_record_that_is_not_covered_says_so_and_every_covered_one_is_proved() {
    let store = open_memory();
    let (ada, grace) = (life(&store, "ada"), life(&store, "grace"));
    let (records, ends) = (ada.records(), ends(&ada.records()));
    let uncovered = proof(&store, &ada.stream, 1, None).unwrap_err();
    assert_eq!(uncovered, ProveError::NotCovered { seq: 1, covered: 0 });
    assert!(uncovered.to_string().contains("`apprentice checkpoint`"));
    let mut tenant_registry = TenantRegistry::open(store.clone()).unwrap();
    tenant_registry.close(&ada.stream, Through::Episodes).unwrap();
    assert_eq!(proof(&store, &ada.stream, 1, None).unwrap_err(), ProveError::Unsigned);
    let older = tenant_registry.checkpoint(&local()).unwrap();
    tenant_registry.close(&grace.stream, Through::Episodes).unwrap();
    let unsigned = proof(&store, &grace.stream, 1, None).unwrap_err();
    assert_eq!(unsigned, ProveError::NotSigned { seq: 1 });
    let next = ends[1].next().get();
    let rest = proof(&store, &ada.stream, next, None).unwrap_err();
    assert_eq!(rest, ProveError::NotCovered { seq: next, covered: ends[1].get() });
    let last = records.len() as u64;
    let absent = proof(&store, &ada.stream, last + 1, None).unwrap_err();
    assert_eq!(absent, ProveError::Absent { seq: last + 1, last });
    tenant_registry.sign(&local(), Through::Head).unwrap();
    let key = signer_of(&store, &local()).unwrap().public();
    for diary in [&ada, &grace] {
        for record in diary.records() {
            let proof = proof(&store, &diary.stream, record.seq.get(), Some(2)).unwrap();
            let proof = Proof::parse(proof.to_text().as_bytes()).unwrap();
            let verified = verify(&proof, &key, Some(&older)).unwrap();
            let found = verified.record.unwrap();
            assert_eq!((found.digest, found.body), (record.digest, None));
            assert_eq!(verified.since, Some(2));
        }
    }
    assert_eq!(differences(&store), Vec::<String>::new());
    assert_eq!(audited(&store).counts.segments, 6);
}

#[test]
fn changed_removed_and_reordered_records_are_caught_whoever_holds_the_keys() {
    let store = open_memory();
    let (ada, grace) = (life(&store, "ada"), life(&store, "grace"));
    let mut tenant_registry = TenantRegistry::open(store.clone()).unwrap();
    let signed = tenant_registry.sign(&local(), Through::Head).unwrap();
    let key = signer_of(&store, &local()).unwrap().public();
    let said = |record: &Record| record.event.kind() == EventKind::Interpreted;
    type Change<'c> = &'c dyn Fn(&mut Vec<Record>);
    let changes: [(&str, Change<'_>); 4] = [
        ("changed", &|records| {
            let last = records.iter_mut().rfind(|record| said(record)).unwrap();
            let Event::Interpreted(event) = &mut last.event else { unreachable!() };
            event.utterance = apprentice::language::Utterance::new("something else").unwrap();
        }),
        ("removed", &|records| {
            let at = records.iter().position(said).unwrap();
            records.remove(at);
        }),
        ("reordered", &|records| {
            let at = records.iter().position(said).unwrap();
            records.swap(at, at + 1);
        }),
        ("cut", &|records| records.truncate(4)),
    ];
    for (name, change) in changes {
        // The segments are unchanged, so the records no longer give their roots.
        let lazy = rewritten(&store, &ada.stream, change, false);
        let found = differences(&lazy);
        assert!(found.iter().any(|each| each.contains("segment of stream")), "{name}: {found:?}");
        let refused = proof(&lazy, &ada.stream, 3, None).unwrap_err();
        assert!(matches!(refused, ProveError::Segment(_)), "{name}: {refused}");
        // A record of another person can still be proved.
        let other = proof(&lazy, &grace.stream, 3, None).unwrap();
        assert!(verify(&other, &key, Some(&signed)).is_ok(), "{name}");
        // The segments are closed again, so the tree is not the one that was signed. Then neither a
        // service nor a signature continues.
        let mut thorough = rewritten(&store, &ada.stream, change, true);
        let kept = std::mem::take(&mut thorough.checkpoints);
        let mut tenant_registry = TenantRegistry::open(thorough.clone()).unwrap();
        let forged = tenant_registry.sign(&local(), Through::Head).unwrap();
        thorough.checkpoints = kept;
        let found = differences(&thorough);
        assert!(found.iter().any(|each| each.contains("newest checkpoint")), "{name}: {found:?}");
        let refused = TenantRegistry::open(thorough.clone()).map(|_| ()).unwrap_err();
        assert!(matches!(refused, OrderError::Evidence { .. }), "{name}: {refused}");
        // Even if the published checkpoints are forged too, an earlier checkpoint shows it.
        let mut deceiving = thorough;
        deceiving.checkpoints = Arc::default();
        deceiving.checkpoints.append(&local(), &forged).unwrap();
        let size =
            TenantRegistry::open(store.clone()).unwrap().registry(&local()).segments().len() as u64;
        let shown = proof(&deceiving, &grace.stream, 3, None).unwrap();
        assert!(verify(&shown, &key, None).is_ok(), "{name}: the forger's own tree is in order");
        let caught = verify(&shown, &key, Some(&signed)).unwrap_err();
        let expected = [VerifyError::Forked { older: size, newer: size }];
        let shorter = matches!(caught, VerifyError::RolledBack { .. });
        assert!(expected.contains(&caught) || (name == "cut" && shorter), "{name}: {caught}");
    }
}

#[test]
fn a_log_that_was_rolled_back_is_not_opened_not_signed_and_not_believed() {
    let dir = tempfile::tempdir().unwrap();
    let (now, then) = (dir.path().join("now"), dir.path().join("then"));
    let store = open(&now).unwrap();
    let diary = life(&store, "ada");
    TenantRegistry::open(store.clone()).unwrap().sign(&local(), Through::Episodes).unwrap();
    let stream = diary.stream.clone();
    drop((diary, store));
    copy(&now, &then);
    // Later a checkpoint is given out.
    let store = open(&now).unwrap();
    let mut tenant_registry = TenantRegistry::open(store.clone()).unwrap();
    let newest = tenant_registry.sign(&local(), Through::Head).unwrap();
    drop((tenant_registry, store));
    // Somebody restores the old log, with today's checkpoints.
    fs::remove_dir_all(then.join("checkpoints")).unwrap();
    copy(&now.join("checkpoints"), &then.join("checkpoints"));
    let store = open(&then).unwrap();
    let found = differences(&store);
    assert!(found.iter().any(|each| each.contains("was rolled back")), "{found:?}");
    let refused = TenantRegistry::open(store.clone()).map(|_| ()).unwrap_err();
    let error = CheckpointsError::RolledBack { signed: 3, found: 2 };
    assert_eq!(refused, OrderError::Evidence { tenant: local(), error });
    assert!(matches!(proof(&store, &stream, 1, None), Err(ProveError::Checkpoints(_))));
    drop(store);
    let output = Process::new(env!("CARGO_BIN_EXE_apprentice"))
        .args(["checkpoint", "--data"])
        .arg(&then)
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("rolled back") && said.lines().count() == 1, "{said}");
    // With its own old checkpoints it looks valid, but not compared with a newer one.
    fs::remove_dir_all(then.join("checkpoints")).unwrap();
    let store = open(&then).unwrap();
    TenantRegistry::open(store.clone()).unwrap().sign(&local(), Through::Episodes).unwrap();
    let shown = proof(&store, &stream, 1, None).unwrap();
    let key = signer_of(&store, &local()).unwrap().public();
    let caught = verify(&shown, &key, Some(&newest)).unwrap_err();
    assert_eq!(caught, VerifyError::RolledBack { older: 3, newer: 2 });
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &target),
            false => drop(fs::copy(entry.path(), target).unwrap()),
        }
    }
}

#[test]
fn an_erased_person_leaves_every_proof_as_good_as_it_was() {
    let store = open_memory();
    let (ada, grace) = (life(&store, "ada"), life(&store, "grace"));
    let mut tenant_registry = TenantRegistry::open(store.clone()).unwrap();
    let older = tenant_registry.sign(&local(), Through::Head).unwrap();
    let key = signer_of(&store, &local()).unwrap().public();
    let before = proof(&store, &ada.stream, 3, None).unwrap();
    store.erase(&ada.stream).unwrap();
    assert_eq!(differences(&store), Vec::<String>::new());
    for stream in [&ada.stream, &grace.stream] {
        let after = proof(&store, stream, 3, None).unwrap();
        assert!(verify(&after, &key, Some(&older)).is_ok());
    }
    assert_eq!(proof(&store, &ada.stream, 3, None).unwrap(), before);
    let registry = tenant_registry.registry(&local());
    let record = Some((&ada.stream, Seq::new(3).unwrap()));
    let wanted = Wanted { record, reveal: true, since: None };
    let refused = prove(&store, &local(), &registry, &wanted).unwrap_err();
    assert!(refused.to_string().contains("was erased"), "{refused}");
}

fn actors(store: Store) -> ActorSystem {
    ActorSystem::start(ActorSettings {
        domain: Arc::new(Bells::new()),
        store,
        recipe_text: tiny().to_owned(),
        trainers: 1,
        arbiters: 1,
        awake_max: 8,
        failure: Failure::default(),
        clock: wall_clock(),
    })
    .unwrap()
}

fn ask(actors: &ActorSystem, ask: Ask) -> Response {
    let (sender, receiver) = mpsc::channel();
    let answer = AnswerTo::new(move |response| sender.send(response).unwrap());
    let (tenant, user) = (local(), UserId::new("ada").unwrap());
    hand_in(&actors.front(), (tenant, user), fresh_id(), ask, answer);
    receiver.recv_timeout(Duration::from_secs(60)).expect("every request is answered")
}

/// Returns when the registrar has done everything that was asked before.
fn settled(actors: &ActorSystem) {
    let (sender, receiver) = mpsc::channel();
    let order = apprentice::tenancy::Order::Open;
    actors.registrar().order(local(), order, move |obeyed| sender.send(obeyed).unwrap());
    receiver.recv_timeout(Duration::from_secs(60)).unwrap().unwrap();
}

#[test]
fn a_running_service_closes_segments_and_signs_by_itself() {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path()).unwrap();
    let mut service = actors(store);
    let commands = [
        Command::StartEpisode { stage: Stage::Task { task: "Glass".to_owned(), seed: 1 } },
        Command::Say { utterance: "ring the brass bell".to_owned() },
        Command::Done,
        Command::StartEpisode { stage: Stage::Task { task: "Glass".to_owned(), seed: 1 } },
        Command::Done,
    ];
    for command in commands {
        let response = ask(&service, command.clone().into());
        assert!(matches!(response, Response::Reply(_)), "{command:?}: {response:?}");
    }
    settled(&service);
    service.stop();
    drop(service);
    let store = open(dir.path()).unwrap();
    let registry = fold_tenant(&store, &local()).unwrap();
    let stream = store.keys.stream_id(&local(), &UserId::new("ada").unwrap()).unwrap();
    let last = store.log.head(&stream).unwrap().seq;
    assert_eq!(registry.segments().len(), 2);
    assert_eq!(registry.uncovered(stream.key).get(), last + 1);
    let (_, newest) = newest_checkpoint(&store, &local(), &registry).unwrap().unwrap();
    assert_eq!(newest.size, 2, "the end of the service signed what was not signed yet");
    assert_eq!(differences(&store), Vec::<String>::new());
}

#[test]
fn what_a_crash_kept_from_being_closed_is_closed_at_the_next_waking() {
    let store = open_memory();
    let diary = life(&store, "ada");
    let ends = ends(&diary.records());
    let mut service = actors(store.clone());
    let response = ask(&service, Query::Status.into());
    assert!(!matches!(response, Response::Error(_)), "{response:?}");
    settled(&service);
    service.stop();
    let registry = fold_tenant(&store, &local()).unwrap();
    assert_eq!(registry.segments().len(), 2);
    assert_eq!(registry.uncovered(diary.stream.key), ends[1].next());
}

#[test]
fn a_life_that_ended_is_covered_to_its_last_record() {
    let store = open_memory();
    let stream = store.keys.stream_id(&local(), &UserId::new("ada").unwrap()).unwrap();
    let closed = Event::SessionClosed(SessionClosed { reason: "moved away".to_owned() });
    let batch = Batch { request: fresh_id(), at: Default::default(), events: vec![closed] };
    store.log.append(&stream, Head::EMPTY, batch).wait().unwrap();
    let due = due_segments(&*store.log, &stream, Seq::FIRST, Through::Episodes).unwrap();
    assert_eq!((due.len(), due[0].stream, due[0].last), (1, stream.key, Seq::FIRST));
    let nobody = StreamId { tenant: local(), key: StreamKey([9; 16]) };
    let due = due_segments(&*store.log, &nobody, Seq::FIRST, Through::Head).unwrap();
    assert!(due.is_empty());
}

#[test]
fn the_commands_cover_prove_and_verify() {
    let dir = tempfile::tempdir().unwrap();
    let data = dir.path().join("lab");
    let store = open(&data).unwrap();
    let ends = ends(&life(&store, "ada").records());
    drop(store);
    let run = |arguments: &[&str]| {
        let mut process = Process::new(env!("CARGO_BIN_EXE_apprentice"));
        let output = process.current_dir(dir.path()).args(arguments).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
    };
    let ada = ["--data", "lab", "--user", "ada", "--seq", "4"];
    let (code, _, said) = run(&[&["proof"], &ada[..]].concat());
    assert_eq!(code, 1, "{said}");
    assert!(said.contains("not yet covered") && said.contains("apprentice checkpoint"), "{said}");
    let named = ["checkpoint", "--data", "lab", "--origin", "lab.example.org"];
    let (code, note, said) = run(&named);
    assert_eq!(code, 0, "{said}");
    assert!(note.starts_with("lab.example.org/local\n3\n"), "{note}");
    fs::write(dir.path().join("old"), &note).unwrap();
    let (code, again, _) = run(&["checkpoint", "--data", "lab"]);
    assert_eq!((code, again), (0, note));
    let (code, _, said) = run(&["checkpoint", "--data", "lab", "--origin", "else"]);
    assert!(code == 2 && said.contains("already called lab.example.org"), "{said}");
    let (code, key, _) = run(&["checkpoint", "--data", "lab", "--public-key"]);
    assert!(code == 0 && key.starts_with("lab.example.org/local+"), "{key}");
    fs::write(dir.path().join("lab.pub"), key).unwrap();
    let out = ["--reveal", "--since", "old", "--out", "ada.proof"];
    let (code, _, said) = run(&[&["proof"], &ada[..], &out[..]].concat());
    assert_eq!(code, 0, "{said}");
    let check = ["verify", "ada.proof", "--key", "lab.pub", "--since", "old", "--json"];
    let (code, shown, said) = run(&check);
    assert_eq!(code, 0, "{said}");
    let shown: serde_json::Value = serde_json::from_str(&shown).unwrap();
    assert_eq!((&shown["since"], &shown["record"]["seq"]), (&3.into(), &4.into()));
    assert!(shown["record"]["event"].is_object(), "{shown}");
    let (code, _, said) = run(&["checkpoint", "--data", "lab", "--since", "old", "--out", "grown"]);
    assert_eq!(code, 0, "{said}");
    let (code, shown, _) = run(&["verify", "grown", "--key", "lab.pub", "--since", "old"]);
    assert!(code == 0 && shown.contains("only grew, from 3 segments to 3"), "{shown}");
    let (code, _, said) = run(&["checkpoint", "--data", "nowhere"]);
    assert!(code == 2 && said.contains("no data directory"), "{said}");
    assert!(!dir.path().join("nowhere").exists());
    let beyond = ["--data", "lab", "--user", "ada", "--seq", "999"];
    let (code, _, said) = run(&[&["proof"], &beyond[..]].concat());
    assert!(code == 2 && said.contains("there is no record 999"), "{said}");
    assert!(ends[1].get() > 4);
}
