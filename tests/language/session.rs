//! The decider: given events, when a command, then events or a refusal. It runs in the toy world of
//! bells, with a log in memory, because only a log gives the receipts that `settle` needs.

use std::sync::Arc;

use apprentice::client::{Command, OnClash, Phase, RejectionCode, Reply, Told};
use apprentice::events::{Event, Record};
use apprentice::ids::{RequestId, Seq, TenantId, Timestamp, UserId};
use apprentice::invariants::Invariant;
use apprentice::learning::{Recipe, train};
use apprentice::replay::{Minds, read_back, rebuild, rebuild_at};
use apprentice::session::{self, Outstanding, Proposed, Rejection, Session};
use apprentice::store::{Store, open_memory};
use apprentice::world::Stage;
use apprentice_testkit::toy::Bells;

/// One person with a session and a log, without an actor.
struct Person {
    session: Session<Bells>,
    store: Store,
    stream: apprentice::ids::StreamId,
    requests: u8,
}

impl Person {
    fn new() -> Person {
        let store = open_memory();
        let user = UserId::new("ada").unwrap();
        let stream = store.keys.stream_id(&TenantId::local(), &user).unwrap();
        let domain = Arc::new(Bells::new());
        let recipe_text = Recipe::builtin("tiny").unwrap().to_owned();
        let recipe = Recipe::parse(&recipe_text).unwrap();
        let mind = Arc::new(train(&*domain, &recipe, &[]).unwrap());
        let session = Session::new(domain);
        let mut person = Person { session, store, stream, requests: 0 };
        let open = session::Command::Open { user, recipe_text, mind: mind.digest() };
        person.accept(open);
        person.session.install(mind);
        person
    }

    /// A person in the given phase.
    fn at(phase: Phase) -> Person {
        let mut person = Person::new();
        if phase == Phase::Closed {
            person.accept(Command::Close { reason: "withdrew".to_owned() });
        }
        if !matches!(phase, Phase::Idle | Phase::Closed) {
            person.start("Brass Glass");
        }
        if matches!(phase, Phase::Teaching | Phase::Learning) {
            person.say("polish the brass bell");
            person.say("ring the brass bell");
            person.accept(Command::Done);
        }
        if phase == Phase::Learning {
            person.teach_last(&[1], OnClash::Ask).unwrap();
            person.accept(Command::FinishTeaching);
        }
        assert_eq!(person.session.phase(), phase);
        person
    }

    fn request(&mut self) -> RequestId {
        self.requests += 1;
        RequestId([self.requests; 16])
    }

    fn give(&mut self, command: impl Into<session::Command>) -> Result<Reply, Rejection> {
        let command = command.into();
        let request = self.request();
        let at = self.session.next_at(Timestamp(1_000));
        let turn = match self.session.propose(&command, request, at)? {
            Proposed::Turn(turn) => turn,
            Proposed::Repeat { .. } => panic!("a fresh request id was answered before"),
            Proposed::Defect(divergence) => panic!("{command:?}: {divergence}"),
        };
        let durable = self.store.log.append(&self.stream, turn.after, turn.batch).wait().unwrap();
        Ok(self.session.settle(&durable).unwrap())
    }

    fn accept(&mut self, command: impl Into<session::Command>) -> Reply {
        let command = command.into();
        self.give(command.clone())
            .unwrap_or_else(|refused| panic!("{command:?} was refused: {refused}"))
    }

    fn start(&mut self, task: &str) {
        let stage = Stage::Task { task: task.to_owned(), seed: 1 };
        self.accept(Command::StartEpisode { stage });
    }

    fn say(&mut self, utterance: &str) -> Reply {
        self.accept(Command::Say { utterance: utterance.to_owned() })
    }

    /// Teaches the first utterance that can still be taught.
    fn teach_last(&mut self, actions: &[u32], on_clash: OnClash) -> Result<Reply, Rejection> {
        let explains = self.session.status().to_teach[0].seq;
        self.give(Command::Teach { explains, actions: actions.to_vec(), on_clash })
    }

    /// Does the outstanding work of the state, as the actor and its trainer do.
    fn learn(&mut self) {
        let Some(Outstanding::Retrain { recipe, lessons }) = self.session.outstanding() else {
            panic!("nothing is due");
        };
        let mind = Arc::new(train(&**self.session.domain(), &recipe, &lessons).unwrap());
        let outcome = Ok((mind.digest(), Default::default()));
        self.accept(session::Command::FinishRetrain { recipe: recipe.digest(), outcome });
        self.session.install(mind);
    }

    fn records(&self) -> Vec<Record> {
        let records = self.store.log.read(&self.stream, Seq::FIRST).unwrap();
        records.map(Result::unwrap).collect()
    }
}

/// One command of each kind.
fn every_command() -> Vec<session::Command> {
    let recipe = Recipe::parse(Recipe::builtin("tiny").unwrap()).unwrap().digest();
    vec![
        session::Command::Open {
            user: UserId::new("eve").unwrap(),
            recipe_text: Recipe::builtin("tiny").unwrap().to_owned(),
            mind: recipe,
        },
        Command::StartEpisode { stage: Stage::Seed { seed: 3 } }.into(),
        Command::Say { utterance: "ring the silver bell".to_owned() }.into(),
        Command::Done.into(),
        // In Teaching this is the record of "polish the brass bell".
        Command::Teach { explains: Seq::new(3).unwrap(), actions: vec![1], on_clash: OnClash::Ask }
            .into(),
        Command::FinishTeaching.into(),
        Command::Forget { lesson: Seq::new(6).unwrap() }.into(),
        Command::Close { reason: "enough".to_owned() }.into(),
        session::Command::FinishRetrain { recipe, outcome: Err("no room".to_owned()) },
    ]
}

#[test]
fn every_phase_meets_every_command_with_events_or_the_right_refusal() {
    use RejectionCode::*;
    // open, start, say, done, teach, finish teaching, forget, close, finish retrain
    let table: [(Phase, [Option<RejectionCode>; 9]); 5] = [
        (
            Phase::Idle,
            [
                Some(WrongPhase),
                None,
                Some(WrongPhase),
                Some(WrongPhase),
                Some(WrongPhase),
                Some(WrongPhase),
                Some(NoSuchLesson),
                None,
                Some(Internal),
            ],
        ),
        (
            Phase::Interacting,
            [
                Some(WrongPhase),
                Some(WrongPhase),
                None,
                None,
                Some(WrongPhase),
                Some(WrongPhase),
                Some(WrongPhase),
                None,
                Some(Internal),
            ],
        ),
        (
            Phase::Teaching,
            [
                Some(WrongPhase),
                Some(WrongPhase),
                Some(WrongPhase),
                Some(WrongPhase),
                None,
                None,
                Some(NoSuchLesson),
                None,
                Some(Internal),
            ],
        ),
        (
            Phase::Learning,
            [
                Some(WrongPhase),
                Some(StillLearning),
                Some(StillLearning),
                Some(StillLearning),
                Some(StillLearning),
                Some(StillLearning),
                Some(StillLearning),
                None,
                None,
            ],
        ),
        (Phase::Closed, [Some(Closed); 9]),
    ];
    for (phase, expected) in table {
        for (command, expected) in every_command().iter().zip(expected) {
            let mut person = Person::at(phase);
            let before = (person.session.state_digest(), person.records().len());
            let refused = person.give(command.clone()).err();
            let code = refused.as_ref().map(Rejection::code);
            assert_eq!(code, expected, "{phase:?} × {}: {refused:?}", command.name());
            let after = (person.session.state_digest(), person.records().len());
            assert_eq!(refused.is_some(), before == after, "{phase:?} × {}", command.name());
            if let Some(refused) = refused {
                let sentence = refused.to_string();
                assert!(sentence.len() > 20 && !sentence.ends_with('.'), "{sentence}");
            }
        }
    }
}

#[test]
fn a_lesson_is_taught_learned_used_forgotten_and_gone() {
    let mut person = Person::at(Phase::Teaching);
    let base = person.session.state().mind;
    let lesson = match &person.teach_last(&[1], OnClash::Ask).unwrap().told[..] {
        [Told::Taught { lesson, program, .. }] => {
            assert_eq!(program.to_string(), "RING Brass");
            *lesson
        }
        told => panic!("{told:?}"),
    };
    person.accept(Command::FinishTeaching);
    person.learn();
    assert_ne!(person.session.state().mind, base);

    person.start("Glass");
    let reply = person.say("polish the glass bell");
    let ended =
        |told: &Told| matches!(told, Told::EpisodeEnded { to_teach, .. } if to_teach.is_empty());
    assert!(reply.told.iter().any(ended), "the taught words reach the goal: {reply:?}");
    assert_eq!(person.session.phase(), Phase::Idle, "nothing was left to teach");

    person.accept(Command::Forget { lesson });
    assert_eq!(person.session.phase(), Phase::Learning);
    person.learn();
    assert_eq!(
        person.session.state().mind,
        base,
        "forgetting gives the mind of never being taught"
    );
}

#[test]
fn a_teach_that_cannot_be_is_refused_by_what_is_wrong_with_it() {
    let mut person = Person::new();
    person.start("Brass Silver Glass");
    person.say("ring the brass bell");
    person.say("polish the silver bell");
    person.say("ring the silver bell");
    person.say("mute the silver bell");
    person.accept(Command::Done);
    let refusal = |person: &mut Person, actions: &[u32]| {
        person.teach_last(actions, OnClash::Ask).unwrap_err()
    };
    assert!(matches!(refusal(&mut person, &[2, 4]), Rejection::NotContiguous { .. }));
    assert!(matches!(refusal(&mut person, &[3, 2]), Rejection::NotContiguous { .. }));
    assert!(matches!(refusal(&mut person, &[u32::MAX, 1]), Rejection::NotContiguous { .. }));
    assert!(matches!(refusal(&mut person, &[0, 1]), Rejection::NoSuchAction { have: 3, .. }));
    assert!(matches!(refusal(&mut person, &[3, 4]), Rejection::NoSuchAction { last: 4, .. }));
    assert!(matches!(refusal(&mut person, &[1, 2]), Rejection::NotAfter { before: 1, .. }));
    let explains = Seq::new(99).unwrap();
    let nothing = Command::Teach { explains, actions: vec![], on_clash: OnClash::Ask };
    assert!(matches!(person.give(nothing), Err(Rejection::NothingToTeach { .. })));

    let explains = person.session.status().to_teach[0].seq;
    person.teach_last(&[2, 3], OnClash::Ask).unwrap();
    let again = Command::Teach { explains, actions: vec![2], on_clash: OnClash::Ask };
    assert!(matches!(person.give(again), Err(Rejection::TaughtAlready { .. })));
}

#[test]
fn a_clash_is_put_to_the_person_and_replacing_forgets_the_old_lesson() {
    let mut person = Person::at(Phase::Teaching);
    person.teach_last(&[1], OnClash::Ask).unwrap();
    person.accept(Command::FinishTeaching);
    // Nothing else can be taught while learning. So the second meaning comes from a world in which
    // the first one cannot run, because the bell rings already.
    person.learn();
    person.start("Brass Silver");
    person.say("ring the brass bell");
    person.say("polish the brass bell");
    person.say("mute the brass bell");
    person.accept(Command::Done);
    let clash = person.teach_last(&[2], OnClash::Ask).unwrap_err();
    assert!(matches!(clash, Rejection::Clash { lesson: Some(_), .. }), "{clash}");
    let reply = person.teach_last(&[2], OnClash::Replace).unwrap();
    assert!(matches!(reply.told[..], [Told::Forgotten { .. }, Told::Taught { .. }]), "{reply:?}");
    assert_eq!(person.session.state().lessons.len(), 1);
}

#[test]
fn a_repeated_request_is_answered_from_the_log() {
    let mut person = Person::at(Phase::Interacting);
    let command = Command::Say { utterance: "ring the silver bell".to_owned() };
    let reply = person.accept(command.clone());
    let request = RequestId([person.requests; 16]);
    let again = person.session.propose(&command.into(), request, Timestamp(2_000)).unwrap();
    assert_eq!(again, Proposed::Repeat { first: reply.first, last: reply.last });
    let records = (reply.first, reply.last);
    read_back(&*person.store.log, &person.stream, request, records).unwrap();
    let other = RequestId([99; 16]);
    let error = read_back(&*person.store.log, &person.stream, other, records).unwrap_err();
    assert!(error.contains(&Invariant::ExactlyOnce.to_string()), "{error}");
}

#[test]
fn folding_from_any_record_on_and_from_the_start_agree() {
    let mut person = Person::at(Phase::Learning);
    person.learn();
    person.start("Glass");
    person.say("polish the glass bell");
    let (domain, minds) = (person.session.domain().clone(), Minds::default());
    let rebuilt = rebuild(&domain, &person.store, &person.stream, &minds).unwrap();
    assert_eq!(rebuilt.state_digest(), person.session.state_digest());
    assert_eq!(rebuilt.mind_wanted(), None, "the mind is there again, by bytes or by training");
    for record in person.records() {
        let past = rebuild_at(&domain, &person.store, &person.stream, &minds, record.seq).unwrap();
        assert_eq!(past.head().seq, record.seq.get());
    }
    let beyond = Seq::new(999).unwrap();
    let error = rebuild_at(&domain, &person.store, &person.stream, &minds, beyond).err().unwrap();
    assert!(error.to_string().contains("999"), "{error}");
}

#[test]
fn a_past_that_this_binary_computes_otherwise_is_a_divergence_not_a_guess() {
    let mut person = Person::at(Phase::Interacting);
    person.say("ring the silver bell");
    for mut record in person.records() {
        let Event::Interpreted(said) = &mut record.event else { continue };
        said.scene_after = apprentice::ids::Digest::ZERO;
        let mut session = Session::new(person.session.domain().clone());
        let before = person.records().into_iter().take_while(|past| past.seq < record.seq);
        before.for_each(|past| session.apply(&past).unwrap());
        let divergence = session.apply(&record).unwrap_err();
        assert_eq!((divergence.seq, divergence.field), (record.seq, "scene digest"));
        assert_eq!(divergence.law(), Some(Invariant::SceneAgrees));
        return;
    }
    panic!("nothing was said");
}

#[test]
#[should_panic(expected = "ModelAgrees")]
fn another_mind_than_the_state_names_is_not_installed() {
    let mut person = Person::at(Phase::Learning);
    let before = person.session.mind().unwrap().clone();
    person.learn();
    person.session.install(before);
}

#[test]
#[should_panic(expected = "NoLostWork")]
fn a_training_that_lost_a_lesson_does_not_run_without_it() {
    let person = Person::at(Phase::Learning);
    let mut state = person.session.state().clone();
    state.lessons.clear();
    Session::resume(person.session.domain().clone(), state).outstanding();
}
