//! An audit finds what is wrong and names the first place. If nothing is wrong, it reports nothing.

use std::sync::Arc;

use apprentice::client::Command;
use apprentice::events::{Batch, Event, Head, Record};
use apprentice::ids::{Digest, Seq, StreamId, TenantId};
use apprentice::language::Outcome;
use apprentice::learning::{Recipe, train};
use apprentice::replay::{AuditReport, Difference, Scrutiny, audit, keep_mind, streams_of};
use apprentice::store::{
    AppendError, Draft, EventLog, Pending, ReadError, SealedRecords, SeededEntropy, Store, Walk,
    open, open_memory,
};
use apprentice_testkit::diary::Diary;
use apprentice_testkit::toy::Bells;

const ALL: Scrutiny = Scrutiny { repropose: true, retrain: true };
const PLAIN: Scrutiny = Scrutiny { repropose: false, retrain: false };

fn tiny() -> &'static str {
    Recipe::builtin("tiny").unwrap()
}

/// A history with everything in it: understood, not sure, impossible, achieved and abandoned,
/// taught, declined, forgotten in both phases, and five trainings.
fn life(domain: &Arc<Bells>, store: &Store, user: &str) -> Diary<Bells> {
    let mut diary = Diary::new(domain, store, user, tiny());
    diary.start("Brass Silver Glass");
    diary.say("polish the brass bell");
    diary.say("ring the brass bell");
    diary.say("ring the brass bell");
    diary.say("paint the silver bell");
    diary.say("ring the silver bell");
    diary.done();
    diary.teach(&[1]);
    let explains = diary.session.status().to_teach[0].seq;
    diary.accept(&Command::Teach { explains, actions: vec![], on_clash: Default::default() });
    let paint = diary.teach(&[2]);
    diary.learn();
    diary.start("Glass");
    diary.say("polish the glass bell");
    diary.accept(&Command::Forget { lesson: paint });
    diary.learn();
    diary.start("Glass");
    diary.say("paint the glass bell");
    diary.say("ring the brass bell");
    diary.done();
    let again = diary.teach(&[1]);
    diary.accept(&Command::Forget { lesson: again });
    diary.learn();
    diary.start("Silver");
    diary.say("polish the silver bell");
    diary
}

fn audited(store: &Store, scrutiny: Scrutiny, threads: usize) -> AuditReport {
    let domain = Arc::new(Bells::new());
    let streams = streams_of(store, None).unwrap();
    audit(&domain, store, &streams, scrutiny, threads, &())
}

fn first_difference(store: &Store, scrutiny: Scrutiny) -> Difference {
    let report = audited(store, scrutiny, 1);
    assert_eq!((report.streams.len(), report.counts.streams_differ), (1, 1));
    report.streams[0].difference.clone().expect("something is wrong with this log")
}

/// The audit of the history with one kind of event changed.
fn altered(scrutiny: Scrutiny, change: impl FnMut(Seq, &mut Event)) -> Difference {
    let domain = Arc::new(Bells::new());
    let store = life(&domain, &open_memory(), "ada").doctored(open_memory(), change);
    first_difference(&store, scrutiny)
}

#[test]
fn an_untouched_log_has_no_differences_and_everything_is_counted() {
    let (domain, store) = (Arc::new(Bells::new()), open_memory());
    let diary = life(&domain, &store, "ada");
    let report = audited(&store, ALL, 1);
    let [stream] = &report.streams[..] else { panic!("{report:?}") };
    assert_eq!(stream.difference, None);
    assert_eq!(stream.user.as_ref().unwrap().as_str(), "ada");
    assert_eq!(stream.head, diary.session.head().seq);
    assert_eq!(stream.head_digest, diary.session.head().digest);
    assert_eq!(stream.state_digest, Some(diary.session.state_digest()));
    assert_eq!(stream.mind, diary.session.state().mind);
    let counts = report.counts;
    assert_eq!(counts.records, diary.records().len() as u64);
    assert_eq!((counts.episodes, counts.utterances), (4, 9));
    assert_eq!((counts.retrained, counts.retrained_base), (3, 1));
    assert_eq!(counts.reproposed_utterances, 9);
    // `done` twice, four answers to teaching, two lessons forgotten, teaching finished twice.
    assert_eq!(counts.reproposed, 9 + 2 + 4 + 2 + 2);
    assert_eq!(counts.minds_missing, 0, "retraining gives the minds that deciding again needs");
}

#[test]
fn missing_minds_are_trained_again_and_counted_and_cached_ones_are_not() {
    let (domain, store) = (Arc::new(Bells::new()), open_memory());
    let diary = life(&domain, &store, "ada");
    let repropose = Scrutiny { repropose: true, retrain: false };
    let report = audited(&store, repropose, 1);
    assert_eq!(report.streams[0].difference, None);
    assert_eq!(report.counts.minds_missing, 2, "one that answered in each later episode");
    let mind = diary.session.mind().unwrap();
    keep_mind(&store, &diary.stream, mind).unwrap();
    let cached = audited(&store, repropose, 1);
    assert_eq!(cached.streams[0].difference, None);
    assert!(cached.counts.minds_missing < 2, "{:?}", cached.counts);
}

#[test]
fn the_report_is_the_same_on_any_number_of_threads_and_for_a_copy_of_the_store() {
    let (domain, dir) = (Arc::new(Bells::new()), tempfile::tempdir().unwrap());
    let store = open(dir.path()).unwrap();
    for user in ["ada", "grace", "mary", "joan", "karen"] {
        life(&domain, &store, user);
    }
    let one = serde_json::to_string(&audited(&store, ALL, 1)).unwrap();
    for threads in [2, 8] {
        assert_eq!(serde_json::to_string(&audited(&store, ALL, threads)).unwrap(), one);
    }
    drop(store);
    let copy = apprentice::store::copy_private(dir.path()).unwrap();
    let copied = copy.open().unwrap();
    assert_eq!(serde_json::to_string(&audited(&copied, ALL, 2)).unwrap(), one);
}

#[test]
fn a_wrong_answer_is_found_by_deciding_again_and_only_so() {
    let mut changed = None;
    let mut change = |seq: Seq, event: &mut Event| {
        if let Event::Interpreted(said) = event
            && said.answer.outcome == Outcome::NotSure
            && changed.is_none()
        {
            changed = Some(seq);
            let nearest = &mut said.answer.evidence.nearest[0];
            nearest.distance = f32::from_bits(nearest.distance.to_bits() ^ 1);
        }
    };
    let domain = Arc::new(Bells::new());
    let store = life(&domain, &open_memory(), "ada").doctored(open_memory(), &mut change);
    assert_eq!(audited(&store, PLAIN, 1).counts.streams_differ, 0, "one bit of evidence");
    let found = first_difference(&store, ALL);
    assert_eq!(found.seq, changed.unwrap().get());
    assert_eq!(found.field, "answer.evidence.nearest[0].distance");
    assert_ne!(found.recorded, found.recomputed);
    assert_eq!(audited(&store, ALL, 1).counts.proposals_differ, 1, "the others stand");
}

#[test]
fn an_answer_of_another_outcome_is_named_by_its_outcome() {
    let found = altered(ALL, |seq, event| {
        if let Event::Interpreted(said) = event
            && seq.get() == 3
        {
            said.answer.outcome = Outcome::Impossible {
                program: "RING Brass".parse().unwrap(),
                step: 0,
                reason: "it is too late".to_owned(),
            };
        }
    });
    assert_eq!((found.seq, found.field.as_str()), (3, "answer.outcome"));
    assert_eq!(found.recomputed, "not_sure");
    assert!(found.recorded.contains("RING Brass"), "{found}");
}

#[test]
fn a_wrong_scene_digest_is_found_without_asking_a_mind() {
    let found = altered(PLAIN, |seq, event| {
        if let (Event::Interpreted(said), 4) = (event, seq.get()) {
            said.scene_after = Digest::of(b"another room");
        }
    });
    assert_eq!((found.seq, found.field.as_str()), (4, "scene digest"));
    assert_eq!(found.recorded, Digest::of(b"another room").to_string());
}

#[test]
fn a_wrong_program_and_wrong_counts_are_found_by_the_fold() {
    let found = altered(PLAIN, |_, event| {
        if let Event::DecompositionTaught(taught) = event {
            taught.program = "MUTE Glass".parse().unwrap();
        }
    });
    assert_eq!((found.field.as_str(), found.recorded.as_str()), ("taught program", "MUTE Glass"));
    let found = altered(PLAIN, |_, event| {
        if let Event::EpisodeEnded(ended) = event {
            ended.utterances += 1;
        }
    });
    assert_eq!((found.field.as_str(), found.recomputed.as_str()), ("utterances", "5"));
}

#[test]
fn a_wrong_mind_digest_is_found_by_training_again() {
    for (base, field) in [(true, "mind"), (false, "mind")] {
        let wrong = Digest::of(b"another mind");
        let mut at = None;
        let change = |seq: Seq, event: &mut Event| match event {
            Event::SessionOpened(event) if base => {
                at = Some(seq);
                event.mind = wrong;
            }
            Event::RetrainCompleted(event) if !base && at.is_none() => {
                at = Some(seq);
                event.mind = wrong;
            }
            // The record says that this mind answered.
            Event::Interpreted(_) => {}
            _ => {}
        };
        let domain = Arc::new(Bells::new());
        let store = life(&domain, &open_memory(), "ada").doctored(open_memory(), change);
        let retrain = Scrutiny { retrain: true, repropose: false };
        let found = first_difference(&store, retrain);
        assert_eq!((found.seq, found.field.as_str()), (at.unwrap().get(), field));
        assert_eq!(found.recorded, wrong.to_string());
        // Deciding again needs the mind, which cannot be made.
        let repropose = Scrutiny { retrain: false, repropose: true };
        let found = first_difference(&store, repropose);
        assert_eq!((found.seq, found.field.as_str()), (at.unwrap().get(), field));
        assert_eq!(found.recorded, wrong.to_string());
    }
}

#[test]
fn a_wrong_report_of_a_training_is_found_too() {
    let found = altered(Scrutiny { retrain: true, repropose: false }, |_, event| {
        if let Event::RetrainCompleted(event) = event {
            event.report.threshold += 0.125;
        }
    });
    assert_eq!(found.field, "report.threshold");
}

#[test]
fn a_recipe_that_does_not_have_its_digest_is_named() {
    let found = altered(ALL, |_, event| {
        if let Event::SessionOpened(event) = event {
            event.recipe_text = Recipe::builtin("paper").unwrap().to_owned();
        }
    });
    assert_eq!(found.seq, 1);
    assert!(["mind", "recipe_digest"].contains(&found.field.as_str()), "{found}");
}

#[test]
fn lessons_that_were_not_live_and_things_out_of_place_are_found() {
    let found = altered(PLAIN, |_, event| {
        if let Event::RetrainScheduled(event) = event {
            event.lessons.reverse();
        }
    });
    assert_eq!(found.field, "live lessons");
    let found = altered(PLAIN, |seq, event| {
        if seq.get() == 2 {
            *event = Event::RetrainFailed(apprentice::events::RetrainFailed {
                recipe: Digest::ZERO,
                reason: "no room".to_owned(),
            });
        }
    });
    assert_eq!((found.seq, found.field.as_str()), (3, "place in history"));
}

/// A log whose frames were changed below the seals.
struct Tampered {
    inner: Store,
    stream: StreamId,
    frames: Vec<Vec<u8>>,
}

impl EventLog for Tampered {
    fn append(&self, stream: &StreamId, after: Head, batch: Batch) -> Pending {
        self.inner.log.append(stream, after, batch)
    }

    fn read<'a>(
        &'a self,
        stream: &StreamId,
        _: Seq,
    ) -> Result<Box<dyn Iterator<Item = Result<Record, ReadError>> + 'a>, ReadError> {
        let key = self.inner.keys.user_key(stream).unwrap();
        let mut walk = Walk::after(stream.key, Head::EMPTY);
        let mut failed = false;
        Ok(Box::new(self.frames.iter().map_while(move |frame| {
            (!failed).then(|| walk.open(&key, frame)).inspect(|record| failed = record.is_err())
        })))
    }

    fn sealed<'a>(&'a self, stream: &StreamId, from: Seq) -> Result<SealedRecords<'a>, ReadError> {
        self.inner.log.sealed(stream, from)
    }

    fn head(&self, stream: &StreamId) -> Result<Head, ReadError> {
        self.inner.log.head(stream)
    }

    fn streams(&self, _: &TenantId) -> Result<Vec<StreamId>, ReadError> {
        Ok(vec![self.stream.clone()])
    }

    fn tenants(&self) -> Result<Vec<TenantId>, ReadError> {
        Ok(vec![self.stream.tenant.clone()])
    }

    fn walk(&self, stream: &StreamId) -> Result<Head, ReadError> {
        self.inner.log.walk(stream)
    }

    fn sealed_bytes(&self, tenant: &TenantId) -> Result<u64, ReadError> {
        self.inner.log.sealed_bytes(tenant)
    }
}

/// Seals `record` again, as the record after `after`.
fn sealed(store: &Store, stream: &StreamId, record: &Record, after: Head) -> Vec<u8> {
    let key = store.keys.user_key(stream).unwrap();
    let Record { at, request, event, .. } = record.clone();
    let draft: Result<Draft, AppendError> =
        Draft::encode(Batch { request, at, events: vec![event] });
    draft.unwrap().seal(&key, &SeededEntropy::new(7), stream.key, after).frames.remove(0)
}

fn tampered(change: impl FnOnce(&Store, &StreamId, &[Record], &mut Vec<Vec<u8>>)) -> Difference {
    let (domain, inner) = (Arc::new(Bells::new()), open_memory());
    let diary = life(&domain, &inner, "ada");
    let records = diary.records();
    let mut head = Head::EMPTY;
    let mut frames = Vec::new();
    for record in &records {
        let frame = sealed(&inner, &diary.stream, record, head);
        head = Head { seq: record.seq.get(), digest: Digest::of(&frame) };
        frames.push(frame);
    }
    let (stream, keys) = (diary.stream.clone(), inner.keys.clone());
    let untouched = Tampered { inner: inner.clone(), stream: stream.clone(), frames };
    let untouched = Arc::new(untouched);
    let report = audited(&Store::around(untouched.clone(), keys.clone()), ALL, 1);
    assert_eq!(report.counts.streams_differ, 0, "sealing again changes nothing: {report:?}");
    let mut frames = untouched.frames.clone();
    change(&inner, &stream, &records, &mut frames);
    let log = Tampered { inner, stream, frames };
    first_difference(&Store::around(Arc::new(log), keys), ALL)
}

#[test]
fn a_gap_is_named() {
    let found = tampered(|_, _, _, frames| drop(frames.remove(6)));
    assert_eq!((found.seq, found.field.as_str()), (7, "sequence number"));
    assert_eq!((found.recorded.as_str(), found.recomputed.as_str()), ("8", "7"));
}

#[test]
fn a_broken_chain_is_named() {
    let found = tampered(|store, stream, records, frames| {
        let forged = Head { seq: 4, digest: Digest::of(b"forged") };
        frames[4] = sealed(store, stream, &records[4], forged);
    });
    assert_eq!((found.seq, found.field.as_str()), (5, "predecessor"));
    assert_eq!(found.recorded, Digest::of(b"forged").to_string());
}

#[test]
fn a_flipped_bit_is_named() {
    let found = tampered(|_, _, _, frames| *frames[9].last_mut().unwrap() ^= 1);
    assert_eq!((found.seq, found.field.as_str()), (10, "checksum"));
    assert_ne!(found.recorded, found.recomputed);
}

#[test]
fn of_an_erased_person_the_chain_is_checked_and_nothing_else() {
    let (domain, store) = (Arc::new(Bells::new()), open_memory());
    let diary = life(&domain, &store, "ada");
    store.erase(&diary.stream).unwrap();
    let report = audited(&store, ALL, 2);
    let [stream] = &report.streams[..] else { panic!("{report:?}") };
    assert_eq!((stream.erased, &stream.difference, &stream.user), (true, &None, &None));
    assert_eq!((stream.head, stream.head_digest), {
        let head = diary.session.head();
        (head.seq, head.digest)
    });
    assert_eq!(report.counts.erased_streams, 1);
}

/// Two binaries that ship different recipes: the log contains the recipe of each person.
#[test]
fn a_log_of_another_recipe_is_read_with_the_recipe_that_it_carries() {
    let (domain, store) = (Arc::new(Bells::new()), open_memory());
    let other = tiny().replace("name = \"tiny\"", "name = \"tiny-of-another-release\"");
    let other = other.replace("learning_rate = 0.02\n", "learning_rate = 0.025\n");
    assert_ne!(Recipe::parse(&other).unwrap().digest(), Recipe::parse(tiny()).unwrap().digest());
    life(&domain, &store, "ada");
    let mut grace = Diary::new(&domain, &store, "grace", &other);
    grace.start("Brass Silver");
    grace.say("polish the brass bell");
    grace.say("ring the brass bell");
    grace.done();
    grace.teach(&[1]);
    let mind = grace.learn();
    let report = audited(&store, ALL, 2);
    assert_eq!(report.counts.streams_differ, 0, "{report:?}");
    assert_eq!(report.counts.retrained_base, 2);
    let minds = apprentice::replay::Minds::default();
    let woken = apprentice::replay::rebuild(&domain, &store, &grace.stream, &minds).unwrap();
    assert_eq!(woken.mind().unwrap().digest(), mind.digest());
    assert_eq!(woken.recipe().name(), "tiny-of-another-release");
    let with_tiny = Recipe::parse(tiny()).unwrap();
    let theirs = train(&*domain, &with_tiny, &grace.session.trained_lessons()).unwrap();
    assert_ne!(theirs.digest(), mind.digest(), "the recipe matters");
}
