//! The actors without sockets: the log refuses, another process writes, the process is about to
//! die, or a training fails.

use std::sync::{Arc, mpsc};
use std::time::Duration;

use apprentice::actors::{ActorSettings, ActorSystem, AnswerTo, Failure, Front, wall_clock};
use apprentice::client::{
    Ask, Command, ErrorCode, OnClash, PersonAsk, Phase, Query, RejectionCode, Response, Told,
    fresh_id,
};
use apprentice::events::{Batch, Event, SessionClosed};
use apprentice::ids::{RequestId, Seq, TenantId, Timestamp, UserId};
use apprentice::learning::Recipe;
use apprentice::service::{Data, Service};
use apprentice::store::{self, Fault, FaultPlan, FaultyLog, Store};
use apprentice::world::Stage;
use apprentice_testkit::front::hand_in;
use apprentice_testkit::toy::{self, Bells};

fn settings(store: Store, failure: &Failure) -> ActorSettings<Bells> {
    ActorSettings {
        domain: Arc::new(Bells::new()),
        store,
        recipe_text: Recipe::builtin("tiny").unwrap().to_owned(),
        trainers: 1,
        arbiters: 2,
        awake_max: 8,
        failure: failure.clone(),
        clock: wall_clock(),
    }
}

fn actors(store: Store, failure: &Failure) -> ActorSystem {
    ActorSystem::start(settings(store, failure)).unwrap()
}

/// A store in memory whose first appends fail as the test says.
fn faulty(script: &[Fault]) -> Store {
    let store = store::open_memory();
    let plan = FaultPlan { script: script.to_vec(), ..FaultPlan::default() };
    let log = Arc::new(FaultyLog::new(store.log.clone(), plan));
    Store::around(log, store.keys)
}

fn ada() -> UserId {
    UserId::new("ada").unwrap()
}

/// Asks once.
fn ask(front: &Front, request: RequestId, ask: Ask) -> Response {
    ask_as(front, (TenantId::local(), ada()), request, ask)
}

fn ask_as(front: &Front, who: (TenantId, UserId), request: RequestId, ask: Ask) -> Response {
    let (sender, receiver) = mpsc::channel();
    let answer = AnswerTo::new(move |response| sender.send(response).unwrap());
    hand_in(front, who, request, ask, answer);
    receiver.recv_timeout(Duration::from_secs(60)).expect("every request is answered")
}

/// Asks until the answer is not Busy, as a client does, always with the same id.
fn insist(front: &Front, command: Command) -> Response {
    insist_as(front, (TenantId::local(), ada()), command)
}

fn insist_as(front: &Front, who: (TenantId, UserId), command: Command) -> Response {
    let request = fresh_id();
    loop {
        match ask_as(front, who.clone(), request, Ask::Person(PersonAsk::Command(command.clone())))
        {
            Response::Busy(busy) => {
                std::thread::sleep(Duration::from_millis(u64::from(busy.retry_after_ms)));
            }
            response => return response,
        }
    }
}

fn start() -> Command {
    Command::StartEpisode { stage: Stage::Task { task: "Brass Glass".to_owned(), seed: 1 } }
}

fn say(utterance: &str) -> Command {
    Command::Say { utterance: utterance.to_owned() }
}

#[test]
fn a_log_that_is_busy_says_so_and_the_same_request_gets_through() {
    let failure = Failure::default();
    // The first append opens the stream, the second starts the episode.
    let actors = actors(faulty(&[Fault::None, Fault::None, Fault::Refused]), &failure);
    let front = actors.front();
    assert!(matches!(insist(&front, start()), Response::Reply(_)));
    let request = fresh_id();
    let first = ask(&front, request, Ask::Person(PersonAsk::Command(say("ring the brass bell"))));
    assert!(matches!(first, Response::Busy(_)), "{first:?}");
    let second = ask(&front, request, Ask::Person(PersonAsk::Command(say("ring the brass bell"))));
    let Response::Reply(reply) = second else { panic!("{second:?}") };
    assert_eq!(reply.first.get(), 3);
    assert_eq!(failure.reason(), None);
}

#[test]
fn opening_a_stream_is_tried_again_when_the_log_was_busy() {
    let failure = Failure::default();
    let actors = actors(faulty(&[Fault::Refused]), &failure);
    let Response::Reply(reply) = insist(&actors.front(), start()) else { panic!("not started") };
    assert_eq!(reply.first.get(), 2);
}

#[test]
fn somebody_elses_append_is_noticed_and_a_new_actor_reads_it() {
    let (store, failure) = (store::open_memory(), Failure::default());
    let actors = actors(store.clone(), &failure);
    let front = actors.front();
    assert!(matches!(insist(&front, start()), Response::Reply(_)));
    let stream = store.keys.stream_id(&TenantId::local(), &ada()).unwrap();
    let after = store.log.head(&stream).unwrap();
    let closed = Event::SessionClosed(SessionClosed { reason: "elsewhere".to_owned() });
    let at = Timestamp(u64::MAX / 2);
    let batch = Batch { request: fresh_id(), at, events: vec![closed] };
    store.log.append(&stream, after, batch).wait().unwrap();

    let first =
        ask(&front, fresh_id(), Ask::Person(PersonAsk::Command(say("ring the brass bell"))));
    assert!(matches!(first, Response::Busy(_)), "{first:?}");
    let answer = insist(&front, say("ring the brass bell"));
    assert!(
        matches!(&answer, Response::Rejected(r) if r.code == RejectionCode::Closed),
        "the new actor knows what the other writer wrote: {answer:?}"
    );
    assert_eq!(failure.reason(), None);
    assert_eq!(store.log.head(&stream).unwrap().seq, 3, "nothing was appended to a stale head");
}

#[test]
fn a_log_that_dies_stops_the_service_and_nobody_gets_a_reply() {
    for fault in [Fault::CrashBefore, Fault::CrashAfter, Fault::Unacknowledged] {
        let failure = Failure::default();
        let actors = actors(faulty(&[Fault::None, Fault::None, fault]), &failure);
        let front = actors.front();
        assert!(matches!(insist(&front, start()), Response::Reply(_)));
        let answer =
            ask(&front, fresh_id(), Ask::Person(PersonAsk::Command(say("ring the brass bell"))));
        assert!(
            matches!(&answer, Response::Error(e) if e.code == ErrorCode::Unavailable),
            "{fault:?}: {answer:?}"
        );
        assert!(failure.reason().is_some(), "{fault:?}");
    }
}

#[test]
fn a_training_that_panics_leaves_the_mind_as_it_was() {
    let mut config = toy::config(Data::Memory);
    config.domain = Arc::new(Bells::brittle());
    let service = Service::start(config).unwrap();
    let ada = service.connect(ada()).unwrap();
    let Command::StartEpisode { stage } = start() else { unreachable!() };
    ada.start(stage.clone()).unwrap();
    let mind = ada.status().unwrap().mind;
    let unknown = ada.say("sterilize the brass bell").unwrap().first;
    ada.say("ring the brass bell").unwrap();
    ada.done().unwrap();
    ada.teach(unknown, vec![1], OnClash::Ask).unwrap();
    ada.finish_teaching().unwrap();
    let waited = ada.wait_until_learned(Duration::from_secs(60)).unwrap();
    let [Told::LearningFailed { reason }] = &waited.told[..] else { panic!("{waited:?}") };
    assert!(reason.contains("the world is brittle"), "{reason}");
    assert_eq!((waited.status.phase, waited.status.mind), (Phase::Idle, mind));
    // The trainer's thread survived, and so did all other threads.
    ada.start(stage).unwrap();
    ada.say("ring the brass bell").unwrap();
    service.stop().unwrap();
}

#[test]
fn a_sleeping_user_wakes_with_the_same_state() {
    let (store, failure) = (store::open_memory(), Failure::default());
    let status = |actors: &ActorSystem| match ask(
        &actors.front(),
        fresh_id(),
        Ask::Person(PersonAsk::Query(Query::Status)),
    ) {
        Response::Status(status) => status,
        other => panic!("{other:?}"),
    };
    let mut first = actors(store.clone(), &failure);
    assert!(matches!(insist(&first.front(), start()), Response::Reply(_)));
    assert!(matches!(insist(&first.front(), say("ring the brass bell")), Response::Reply(_)));
    let before = status(&first);
    assert_eq!(first.awake(), 1);
    first.stop();
    assert_eq!(first.awake(), 0);
    // With the snapshot that was kept when the user was put to sleep, and without it.
    let stream = store.keys.stream_id(&TenantId::local(), &ada()).unwrap();
    assert_eq!(status(&actors(store.clone(), &Failure::default())), before);
    store.snapshots.forget(&stream).unwrap();
    assert_eq!(status(&actors(store, &Failure::default())), before);
}

/// A person of a lab.
fn person(lab: &str, number: usize) -> (TenantId, UserId) {
    (TenantId::new(lab).unwrap(), UserId::new(&format!("person {number}")).unwrap())
}

/// Plays and teaches until a training is due.
fn teach(front: &Front, who: &(TenantId, UserId)) {
    let told = |command: Command| match insist_as(front, who.clone(), command) {
        Response::Reply(reply) => reply.first,
        other => panic!("{other:?}"),
    };
    told(start());
    let explains = told(say("sterilize the brass bell"));
    told(say("ring the brass bell"));
    told(Command::Done);
    told(Command::Teach { explains, actions: vec![1], on_clash: OnClash::Ask });
    told(Command::FinishTeaching);
}

#[test]
fn one_labs_flood_of_trainings_delays_anothers_by_the_one_that_runs() {
    const FLOOD: usize = 20;
    let (store, failure, gate) = (store::open_memory(), Failure::default(), Arc::default());
    let actors = ActorSystem::start(ActorSettings {
        domain: Arc::new(Bells::slow(Arc::clone(&gate))),
        awake_max: 2 * FLOOD,
        ..settings(store.clone(), &failure)
    })
    .unwrap();
    let front = actors.front();
    let people: Vec<_> =
        (0..FLOOD).map(|n| person("flood", n)).chain([person("quiet", 0)]).collect();
    people.iter().for_each(|who| teach(&front, who));
    // One training of the flood runs and waits at the gate. The others and that of the quiet lab
    // are in the queue.
    gate.open();
    let mut ends: Vec<(Timestamp, TenantId)> = people
        .iter()
        .map(|who| {
            let waited = ask_as(
                &front,
                who.clone(),
                fresh_id(),
                Ask::Person(PersonAsk::Wait { seconds: 30 }),
            );
            let Response::Waited(waited) = waited else { panic!("{waited:?}") };
            assert_eq!(waited.status.phase, Phase::Idle);
            let stream = store.keys.stream_id(&who.0, &who.1).unwrap();
            let mut records = store.log.read(&stream, Seq::FIRST).unwrap().map(Result::unwrap);
            let done = records.find(|r| matches!(r.event, Event::RetrainCompleted(_))).unwrap();
            (done.at, who.0.clone())
        })
        .collect();
    ends.sort();
    let place = ends.iter().position(|(_, lab)| lab.as_str() == "quiet").unwrap();
    // Second in its turn. Other actors may record their trainings a moment earlier.
    assert!(place <= 4, "the quiet lab's training was number {place} of {}", ends.len());
}
