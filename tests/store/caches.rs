//! Snapshots and kept minds are caches. With them, waking a user reads the tail of the log; without
//! them it costs one fold and one training. Stale and damaged ones are made again and counted, and
//! nothing fails.

use std::fs;
use std::sync::Arc;

use apprentice::client::{Command, OnClash};
use apprentice::events::{Event, Head};
use apprentice::ids::{Digest, RequestId, Seq, StreamId, TenantId, Timestamp, UserId};
use apprentice::invariants::Invariant;
use apprentice::learning::{Recipe, code_digest, train};
use apprentice::replay::{
    Minds, RebuildError, Work, keep_mind, keep_snapshot, mind_origin, rebuild, state_origin,
};
use apprentice::session::{self, Outstanding, Proposed, Session};
use apprentice::store::{CacheCounts, Origin, Store, open};
use apprentice::world::Stage;
use apprentice_testkit::toy::Bells;

/// Ada taught one lesson. Her directory has a snapshot and a kept mind.
struct Ada {
    dir: tempfile::TempDir,
    domain: Arc<Bells>,
    stream: StreamId,
    requests: u8,
}

impl Ada {
    fn new() -> Ada {
        let dir = tempfile::tempdir().unwrap();
        let domain = Arc::new(Bells::new());
        let store = open(dir.path()).unwrap();
        let user = UserId::new("ada").unwrap();
        let stream = store.keys.stream_id(&TenantId::local(), &user).unwrap();
        let mut ada = Ada { dir, domain: domain.clone(), stream, requests: 0 };
        let recipe_text = Recipe::builtin("tiny").unwrap().to_owned();
        let recipe = Recipe::parse(&recipe_text).unwrap();
        let base = Arc::new(train(&*domain, &recipe, &[]).unwrap());
        let mut session = Session::new(domain);
        let open = session::Command::Open { user, recipe_text, mind: base.digest() };
        ada.act(&store, &mut session, open);
        session.install(base);
        ada.talk(&store, &mut session);
        let polish = session.status().to_teach[0].seq;
        let teach = Command::Teach { explains: polish, actions: vec![1], on_clash: OnClash::Ask };
        ada.act(&store, &mut session, teach);
        ada.act(&store, &mut session, Command::FinishTeaching);
        let Some(Outstanding::Retrain { recipe, lessons }) = session.outstanding() else {
            panic!("a training is due")
        };
        let mind = Arc::new(train(&*ada.domain, &recipe, &lessons).unwrap());
        let outcome = Ok((mind.digest(), mind.report().clone()));
        let finish = session::Command::FinishRetrain { recipe: recipe.digest(), outcome };
        ada.act(&store, &mut session, finish);
        session.install(mind.clone());
        keep_mind(&store, &ada.stream, &mind).unwrap();
        keep_snapshot(&store, &ada.stream, &session).unwrap();
        ada
    }

    fn act(
        &mut self,
        store: &Store,
        session: &mut Session<Bells>,
        command: impl Into<session::Command>,
    ) {
        let command = command.into();
        self.requests += 1;
        let at = session.next_at(Timestamp(1_000_000));
        let proposed = session.propose(&command, RequestId([self.requests; 16]), at).unwrap();
        let Proposed::Turn(turn) = proposed else { panic!("{command:?} was answered before") };
        let durable = store.log.append(&self.stream, turn.after, turn.batch).wait().unwrap();
        session.settle(&durable).unwrap();
    }

    /// An episode with one utterance that is not understood and one that is.
    fn talk(&mut self, store: &Store, session: &mut Session<Bells>) {
        let stage = Stage::Task { task: "Brass Glass".to_owned(), seed: 1 };
        self.act(store, session, Command::StartEpisode { stage });
        for utterance in ["polish the brass bell", "ring the brass bell"] {
            self.act(store, session, Command::Say { utterance: utterance.to_owned() });
        }
        self.act(store, session, Command::Done);
    }

    fn open(&self) -> Store {
        open(self.dir.path()).unwrap()
    }

    /// Wakes ada with nothing in memory.
    fn wake(&self, store: &Store) -> (Session<Bells>, Work) {
        let minds = Minds::default();
        let session = rebuild(&self.domain, store, &self.stream, &minds).unwrap();
        assert_eq!(session.mind().unwrap().digest(), session.state().mind.unwrap());
        (session, minds.work())
    }
}

fn stale() -> CacheCounts {
    CacheCounts { stale: 1, ..CacheCounts::default() }
}

fn damaged() -> CacheCounts {
    CacheCounts { damaged: 1, ..CacheCounts::default() }
}

fn absent() -> CacheCounts {
    CacheCounts { absent: 1, ..CacheCounts::default() }
}

#[test]
fn waking_with_caches_folds_the_tail_and_trains_nothing() {
    let mut ada = Ada::new();
    let store = ada.open();
    let (mut session, work) = ada.wake(&store);
    assert_eq!(work, Work { rebuilds: 1, ..Work::default() }, "not one record is folded");
    let before = session.head().seq;
    ada.talk(&store, &mut session);
    let tail = session.head().seq - before;
    assert!(tail >= 4);
    let (again, work) = ada.wake(&store);
    assert_eq!(work, Work { rebuilds: 1, events_folded: tail, ..Work::default() });
    assert_eq!(again.state_digest(), session.state_digest());
    let counts = CacheCounts { used: 2, ..CacheCounts::default() };
    assert_eq!((store.snapshots.counts(), store.models.counts()), (counts, counts));
}

#[test]
fn waking_without_caches_is_one_fold_and_one_training() {
    let ada = Ada::new();
    let (expected, _) = ada.wake(&ada.open());
    fs::remove_dir_all(ada.dir.path().join("cache")).unwrap();
    let store = ada.open();
    let (session, work) = ada.wake(&store);
    let all = session.head().seq;
    let once = Work { rebuilds: 1, events_folded: all, trainings: 1, not_reproduced: 0 };
    assert_eq!(work, once);
    assert_eq!(session.state_digest(), expected.state_digest());
    assert_eq!((store.snapshots.counts(), store.models.counts()), (absent(), absent()));
    // The mind was kept again, so the next waking trains nothing.
    let (_, work) = ada.wake(&store);
    assert_eq!(work, Work { trainings: 0, ..once });
    assert_eq!(store.models.counts().used, 1);
}

#[test]
fn what_other_code_another_form_or_another_recipe_left_is_made_again_and_counted() {
    let ada = Ada::new();
    let (expected, _) = ada.wake(&ada.open());
    let recipe = expected.recipe().digest();
    let (mind, all) = (expected.mind().unwrap(), expected.head().seq);
    let other = Digest::of(b"something else");
    let (state_now, mind_now) = (state_origin(&*ada.domain, recipe), mind_origin(recipe));
    assert_eq!((state_now.code, mind_now.code), (code_digest(), code_digest()));
    let differently = |origin: Origin| {
        [
            Origin { code: other, ..origin },
            Origin { schema: other, ..origin },
            Origin { recipe: other, ..origin },
        ]
    };
    for (state_then, mind_then) in differently(state_now).into_iter().zip(differently(mind_now)) {
        let store = ada.open();
        let (head, state) = (expected.head(), expected.state());
        store.snapshots.put(&ada.stream, &state_then, head, state).unwrap();
        store.models.put(&ada.stream, &mind_then, mind.digest(), &mind.to_bytes()).unwrap();
        let (session, work) = ada.wake(&store);
        let once = Work { rebuilds: 1, events_folded: all, trainings: 1, not_reproduced: 0 };
        assert_eq!(work, once, "{state_then:?}");
        assert_eq!(session.state_digest(), expected.state_digest());
        let counts = (store.snapshots.counts(), store.models.counts());
        assert_eq!(counts, (stale(), stale()), "{state_then:?}");
    }
}

#[test]
fn a_snapshot_of_another_record_than_it_says_is_not_used() {
    let ada = Ada::new();
    let store = ada.open();
    let (expected, _) = ada.wake(&store);
    let origin = state_origin(&*ada.domain, expected.recipe().digest());
    let first = store.log.read(&ada.stream, Seq::FIRST).unwrap().next().unwrap().unwrap();
    let early = Head { seq: first.seq.get(), digest: first.digest };
    store.snapshots.put(&ada.stream, &origin, early, expected.state()).unwrap();
    let (session, work) = ada.wake(&store);
    assert_eq!(work.events_folded, session.head().seq, "{}", Invariant::FoldAgrees);
    assert_eq!(session.state_digest(), expected.state_digest());
}

#[test]
fn damaged_caches_are_made_again_and_counted() {
    let ada = Ada::new();
    let store = ada.open();
    let (expected, _) = ada.wake(&store);
    drop(store);
    let store = ada.open();
    let recipe = expected.recipe().digest();
    let origin = state_origin(&*ada.domain, recipe);
    store.snapshots.put(&ada.stream, &origin, expected.head(), &"no state").unwrap();
    let mind = expected.mind().unwrap();
    let mut bytes = mind.to_bytes();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    store.models.put(&ada.stream, &mind_origin(recipe), mind.digest(), &bytes).unwrap();
    let (session, work) = ada.wake(&store);
    assert_eq!((work.events_folded, work.trainings), (session.head().seq, 1));
    assert_eq!(session.state_digest(), expected.state_digest());
    assert_eq!((store.snapshots.counts(), store.models.counts()), (damaged(), damaged()));
}

#[test]
fn a_mind_that_this_code_trains_differently_is_used_as_it_was_kept() {
    let mut ada = Ada::new();
    let store = ada.open();
    let (mut session, _) = ada.wake(&store);
    // A history as other code would have left it: the record says that a training without lessons
    // gave the mind of one lesson.
    let mind = session.mind().unwrap().clone();
    let lesson: Seq = session.state().lessons[0].seq;
    ada.act(&store, &mut session, Command::Forget { lesson });
    let outcome = Ok((mind.digest(), mind.report().clone()));
    let finish = session::Command::FinishRetrain { recipe: mind.recipe(), outcome };
    ada.act(&store, &mut session, finish);
    let then = Origin { code: Digest::of(b"other code"), ..mind_origin(mind.recipe()) };
    store.models.put(&ada.stream, &then, mind.digest(), &mind.to_bytes()).unwrap();
    let (session, work) = ada.wake(&store);
    assert_eq!((work.trainings, work.not_reproduced), (1, 1));
    assert_eq!(session.mind().unwrap().digest(), mind.digest(), "what the log names");
    // When it is known that the mind cannot be made again, waking does not try to train it.
    let (_, work) = ada.wake(&store);
    assert_eq!((work.trainings, work.not_reproduced), (0, 0));
    // Once at the first waking of this test, and once just now.
    assert_eq!(store.models.counts(), CacheCounts { used: 2, ..stale() });

    // Without the bytes the mind cannot be made again, and the service says so.
    store.models.keep_only(&ada.stream, &[]).unwrap();
    let lost = rebuild(&ada.domain, &store, &ada.stream, &Minds::default());
    assert!(matches!(lost, Err(RebuildError::Mind { .. })), "{:?}", lost.err());
}

#[test]
fn a_training_is_recorded_with_the_code_that_did_it() {
    let ada = Ada::new();
    let store = ada.open();
    let records = store.log.read(&ada.stream, Seq::FIRST).unwrap();
    let trained: Vec<Option<Digest>> = records
        .filter_map(|record| match record.unwrap().event {
            Event::RetrainCompleted(event) => Some(event.code),
            _ => None,
        })
        .collect();
    assert_eq!(trained, [Some(code_digest())]);
}
