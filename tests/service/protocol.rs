//! The service from outside: real sockets, real actors, the real log.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use apprentice::client::wire::{Request, decode_response, encode_request};
use apprentice::client::{
    Ask, Client, ClientError, Command, ErrorCode, OnClash, PersonAsk, Phase, RejectionCode, Reply,
    Response, ServiceAsk, Told, fresh_id,
};
use apprentice::ids::{RequestId, UserId};
use apprentice::language::Outcome;
use apprentice::limits::{FRAME_BYTES_MAX, MAILBOX_MAX};
use apprentice::service::{Data, Service, StartError};
use apprentice::world::Stage;
use apprentice_testkit::toy::{Bells, Fickle, config};

const LONG: Duration = Duration::from_secs(60);

fn user(name: &str) -> UserId {
    UserId::new(name).unwrap()
}

/// A service of bells that listens on a free port.
fn bells(data: Data) -> Service {
    let mut config = config(data);
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    Service::start(config).unwrap()
}

fn connect(service: &Service, name: &str) -> Client {
    Client::connect(service.endpoint().unwrap(), user(name)).unwrap()
}

fn task(bells: &str) -> Stage {
    Stage::Task { task: bells.to_owned(), seed: 1 }
}

fn outcome(reply: &Reply) -> Outcome {
    match &reply.told[0] {
        Told::Answered { answer, .. } => answer.outcome.clone(),
        other => panic!("no answer: {other:?}"),
    }
}

/// A socket that can send anything.
struct Stranger {
    socket: zmq::Socket,
}

impl Stranger {
    fn new(service: &Service, kind: zmq::SocketType) -> Stranger {
        let socket = zmq::Context::new().socket(kind).unwrap();
        socket.set_linger(0).unwrap();
        socket.connect(service.endpoint().unwrap()).unwrap();
        Stranger { socket }
    }

    fn send(&self, frames: &[&[u8]]) {
        self.socket.send_multipart(frames, 0).unwrap();
    }

    fn ask(&self, id: RequestId, ask: Ask) {
        self.send(&[&encode_request(&Request { id, user: user("mallory"), ask })]);
    }

    fn answer(&self) -> (RequestId, Response) {
        assert_eq!(self.socket.poll(zmq::POLLIN, 30_000).unwrap(), 1, "an answer within 30 s");
        let frames = self.socket.recv_multipart(0).unwrap();
        assert_eq!(frames.len(), 1);
        decode_response(&frames[0]).unwrap()
    }

    /// After a disconnection. Messages on their way are lost with the connection, so the question
    /// is repeated until a new connection carries it.
    fn is_heard_again(&self) {
        let answered = (0..60).any(|_| {
            self.ask(fresh_id(), Ask::Service(ServiceAsk::Hello));
            self.socket.poll(zmq::POLLIN, 500).unwrap() == 1
        });
        assert!(answered, "an answer within 30 s");
    }

    /// The next answer is to this question: the messages before it got no answer.
    fn nothing_before(&self) {
        let id = fresh_id();
        self.ask(id, Ask::Service(ServiceAsk::Hello));
        let (found, response) = self.answer();
        assert_eq!(found, id);
        assert!(matches!(response, Response::Hello(_)));
    }
}

/// Waits until another thread makes a condition true.
fn eventually(what: &str, condition: impl Fn() -> bool) {
    let end = Instant::now() + LONG;
    while !condition() {
        assert!(Instant::now() < end, "{what}");
        thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn an_episode_is_played_taught_and_used_again() {
    let service = bells(Data::Memory);
    let ada = connect(&service, "ada");
    assert_eq!(ada.hello().unwrap().domain, "bells");
    assert_eq!(service.awake(), 0, "hello wakes nobody");
    assert_eq!(ada.status().unwrap().phase, Phase::Idle);

    ada.start(task("Brass Glass")).unwrap();
    let unknown = ada.say("sterilize the brass bell").unwrap();
    assert_eq!(outcome(&unknown), Outcome::NotSure);
    let rung = ada.say("ring the brass bell").unwrap();
    assert!(matches!(outcome(&rung), Outcome::Understood { .. }));
    assert_eq!(ada.look().unwrap().things[0].states, ["ringing"]);
    let again = ada.say("ring the brass bell").unwrap();
    assert!(matches!(outcome(&again), Outcome::Impossible { .. }), "{again:?}");
    let last = ada.say("ring the glass bell").unwrap();
    assert!(matches!(last.told[1], Told::EpisodeEnded { .. }));

    ada.teach(unknown.first, vec![1], OnClash::Ask).unwrap();
    ada.finish_teaching().unwrap();
    let waited = ada.wait_until_learned(LONG).unwrap();
    assert!(matches!(waited.told[..], [Told::Learned { .. }]), "{waited:?}");
    assert_eq!((waited.status.phase, waited.status.lessons), (Phase::Idle, 1));
    assert_eq!(ada.known().unwrap().last().unwrap().lesson.map(|seq| seq.get()), Some(8));

    ada.start(task("Silver")).unwrap();
    let reused = ada.say("sterilize the silver bell").unwrap();
    let Outcome::Understood { program, .. } = outcome(&reused) else { panic!("{reused:?}") };
    assert_eq!(program.to_string(), "RING Silver");
    service.stop().unwrap();
}

#[test]
fn malformed_messages_are_dropped_and_counted_and_the_next_one_is_answered() {
    let service = bells(Data::Memory);
    let stranger = Stranger::new(&service, zmq::DEALER);
    let fine = encode_request(&Request {
        id: fresh_id(),
        user: user("m"),
        ask: Ask::Service(ServiceAsk::Hello),
    });
    let many: Vec<&[u8]> = vec![&fine; 1_000];
    for frames in [&[&b""[..]][..], &[&b"\xff\xfe\x00"[..]], &[&fine, &fine], &many] {
        stranger.send(frames);
    }
    stranger.nothing_before();
    // The answer is counted after it was sent, so it may arrive before its count changes.
    eventually("the answer is counted", || service.counts().answered == 1);
    assert_eq!((service.counts().received, service.counts().dropped), (5, 4));
}

#[test]
fn faults_are_answered_when_the_id_can_be_read() {
    let service = bells(Data::Memory);
    let stranger = Stranger::new(&service, zmq::DEALER);
    let id = fresh_id();
    let ask = Ask::Person(PersonAsk::Command(Command::Done));
    let good = encode_request(&Request { id, user: user("m"), ask });
    let replace = |from: &[u8], to: &[u8]| {
        let place = good.windows(from.len()).position(|window| window == from).unwrap();
        [&good[..place], to, &good[place + from.len()..]].concat()
    };
    for (bytes, code) in [
        (replace(b"\xa1v\x01", b"\xa1v\x07"), ErrorCode::UnsupportedVersion),
        (replace(b"done", b"dine"), ErrorCode::UnknownVerb),
        (replace(b"done", b"open"), ErrorCode::InternalVerb),
        (replace(b"\xa4done", b"\x81\xaefinish_retrain\x80"), ErrorCode::InternalVerb),
        (replace(b"\xa1m", b"\xa1\xff"), ErrorCode::Malformed),
    ] {
        stranger.send(&[&bytes]);
        let (found, response) = stranger.answer();
        assert_eq!(found, id);
        assert!(
            matches!(&response, Response::Error(failed) if failed.code == code),
            "{response:?}"
        );
    }
    assert_eq!(service.counts().refused, 5);
    assert_eq!(service.awake(), 0, "nobody was woken by any of them");
}

#[test]
fn oversized_frames_get_a_sentence_and_huge_ones_are_cut_off() {
    let service = bells(Data::Memory);
    let stranger = Stranger::new(&service, zmq::DEALER);
    let id = fresh_id();
    let utterance = "x".repeat(FRAME_BYTES_MAX);
    stranger
        .ask(id, Ask::Person(PersonAsk::Command(Command::Say { utterance: utterance.clone() })));
    let (found, response) = stranger.answer();
    assert_eq!(found, id);
    assert!(matches!(&response, Response::Error(failed) if failed.code == ErrorCode::TooLarge));

    let huge = Stranger::new(&service, zmq::DEALER);
    huge.send(&[&vec![0; 3 * FRAME_BYTES_MAX]]);
    huge.is_heard_again();
    assert_eq!(service.counts().dropped, 0, "the huge frame never reached the gateway");

    let client = connect(&service, "ada");
    let refused = client.say(&utterance).unwrap_err();
    assert!(matches!(refused, ClientError::TooLarge { .. }), "{refused}");
    service.stop().unwrap();
}

#[test]
fn a_plain_req_socket_is_answered_too() {
    let service = bells(Data::Memory);
    Stranger::new(&service, zmq::REQ).nothing_before();
}

#[test]
fn bad_utterances_and_wrong_phases_get_one_sentence_and_no_record() {
    let service = bells(Data::Memory);
    let ada = connect(&service, "ada");
    let code = |result: Result<Reply, ClientError>| match result {
        Err(ClientError::Rejected { code, message }) => {
            assert!(!message.is_empty() && !message.contains('\n'), "{message:?}");
            code
        }
        other => panic!("not rejected: {other:?}"),
    };
    assert_eq!(code(ada.say("ring the brass bell")), RejectionCode::WrongPhase);
    assert_eq!(code(ada.start(task("Wood"))), RejectionCode::BadStage);
    ada.start(task("Brass Glass")).unwrap();
    let before = ada.status().unwrap().seq;
    for bad in ["", " ", "🤖", "a\u{0}b", &"go ".repeat(10_000)] {
        assert_eq!(code(ada.say(bad)), RejectionCode::BadUtterance, "{bad:.20}");
    }
    assert_eq!(code(ada.finish_teaching()), RejectionCode::WrongPhase);
    assert_eq!(ada.status().unwrap().seq, before, "no refusal is recorded");
    for odd in ["ring <b>the</b> brass bell 🔔", "ring ring ring", "ünïcödé wörds"] {
        ada.say(odd).unwrap();
    }
    assert_eq!(ada.status().unwrap().seq, before + 3, "every well-formed utterance is recorded");
}

#[test]
fn the_same_request_again_gets_the_first_reply_and_appends_nothing() {
    let service = bells(Data::Memory);
    let ada = connect(&service, "ada");
    ada.start(task("Brass Glass")).unwrap();
    let (id, command) = (fresh_id(), Command::Say { utterance: "ring the brass bell".to_owned() });
    let first = ada.command_again(id, command.clone()).unwrap();
    let seq = ada.status().unwrap().seq;
    let again = ada.command_again(id, command.clone()).unwrap();
    assert_eq!(first, again);
    // Also when the session has moved on, and from another connection.
    ada.say("mute the brass bell").unwrap();
    assert_eq!(connect(&service, "ada").command_again(id, command).unwrap(), first);
    assert_eq!(ada.status().unwrap().seq, seq + 1);
}

#[test]
fn requests_sent_at_once_are_carried_out_once_each() {
    let service = bells(Data::Memory);
    connect(&service, "mallory").start(task("Brass Glass")).unwrap();
    let stranger = Stranger::new(&service, zmq::DEALER);
    let ids: Vec<RequestId> = (0..8).map(|_| fresh_id()).collect();
    for _ in 0..3 {
        for (index, id) in ids.iter().enumerate() {
            let verb = if index % 2 == 0 { "ring" } else { "mute" };
            let utterance = format!("{verb} the silver bell");
            stranger.ask(*id, Ask::Person(PersonAsk::Command(Command::Say { utterance })));
        }
    }
    let mut replies = std::collections::BTreeMap::new();
    for _ in 0..3 * ids.len() {
        let (id, response) = stranger.answer();
        let Response::Reply(reply) = response else { panic!("{response:?}") };
        let known = replies.entry(id).or_insert_with(|| reply.clone());
        assert_eq!(*known, reply);
    }
    let firsts: Vec<u64> = ids.iter().map(|id| replies[id].first.get()).collect();
    assert_eq!(firsts, (3..11).collect::<Vec<u64>>(), "in the order they were sent");
}

#[test]
fn a_full_mailbox_is_an_honest_busy_and_retries_get_through() {
    let service = bells(Data::Memory);
    connect(&service, "mallory").start(task("Brass Glass")).unwrap();
    let stranger = Stranger::new(&service, zmq::DEALER);
    let count = 20 * MAILBOX_MAX;
    let utterance = "polish the silver bell".to_owned();
    let mut open: Vec<RequestId> = (0..count).map(|_| fresh_id()).collect();
    while !open.is_empty() {
        for id in &open {
            stranger.ask(
                *id,
                Ask::Person(PersonAsk::Command(Command::Say { utterance: utterance.clone() })),
            );
        }
        let sent = open.len();
        for _ in 0..sent {
            match stranger.answer() {
                (id, Response::Reply(_)) => open.retain(|other| *other != id),
                (_, Response::Busy(busy)) => assert!(busy.retry_after_ms > 0),
                (_, Response::Rejected(rejected)) => {
                    assert_eq!(rejected.code, RejectionCode::LimitReached);
                    open.clear();
                    break;
                }
                (_, other) => panic!("{other:?}"),
            }
        }
    }
    let status = connect(&service, "mallory").status().unwrap();
    assert_eq!(u64::from(status.utterances) + 2, status.seq, "one record for each utterance");
}

#[test]
fn several_people_at_once_do_not_meet() {
    let service = bells(Data::Memory);
    let endpoint = service.endpoint().unwrap().to_owned();
    let people: Vec<_> = (0..12)
        .map(|number: usize| {
            let endpoint = endpoint.clone();
            thread::spawn(move || {
                let me = Client::connect(&endpoint, user(&format!("person {number}"))).unwrap();
                let word = format!("verb{number}");
                me.start(task("Brass Glass")).unwrap();
                let unknown = me.say(&format!("{word} the brass bell")).unwrap();
                assert_eq!(outcome(&unknown), Outcome::NotSure);
                me.say("ring the brass bell").unwrap();
                me.done().unwrap();
                me.teach(unknown.first, vec![1], OnClash::Ask).unwrap();
                me.finish_teaching().unwrap();
                let waited = me.wait_until_learned(LONG).unwrap();
                assert_eq!(waited.status.lessons, 1);
                let known = me.known().unwrap();
                let mine = known.iter().filter(|known| known.lesson.is_some());
                let mine: Vec<String> =
                    mine.map(|known| known.exemplar.utterance.to_string()).collect();
                assert_eq!(mine, [format!("{word} the <obj>")]);
            })
        })
        .collect();
    people.into_iter().for_each(|person| person.join().unwrap());
    service.stop().unwrap();
}

#[test]
fn more_people_than_may_be_awake_take_turns() {
    let mut config = config(Data::Memory);
    config.awake_max = 2;
    let service = Service::start(config).unwrap();
    let people: Vec<Client> =
        (0..6).map(|n| service.connect(user(&format!("person {n}"))).unwrap()).collect();
    for person in &people {
        person.start(task("Brass Glass")).unwrap();
    }
    for (round, person) in (0..3).flat_map(|round| people.iter().map(move |p| (round, p))) {
        let verb = if round % 2 == 0 { "ring" } else { "mute" };
        let reply = person.say(&format!("{verb} the silver bell")).unwrap();
        assert!(matches!(outcome(&reply), Outcome::Understood { .. }), "{reply:?}");
        assert_eq!(reply.first.get(), 3 + round);
    }
    eventually("those told to sleep sleep", || service.awake() <= 2);
    service.stop().unwrap();
}

#[test]
fn a_retry_across_a_restart_gets_the_first_reply() {
    let directory = tempfile::tempdir().unwrap();
    let data = || Data::Directory(directory.path().join("data"));
    let (id, command) = (fresh_id(), Command::Say { utterance: "ring the brass bell".to_owned() });
    let service = bells(data());
    let ada = connect(&service, "ada");
    ada.start(task("Brass Glass")).unwrap();
    let first = ada.command_again(id, command.clone()).unwrap();
    let status = ada.status().unwrap();
    service.stop().unwrap();

    let service = bells(data());
    let ada = connect(&service, "ada");
    assert_eq!(ada.status().unwrap(), status, "the conversation goes on where it was");
    assert_eq!(ada.command_again(id, command).unwrap(), first);
    assert_eq!(ada.status().unwrap().seq, status.seq);
    service.stop().unwrap();
}

#[test]
fn a_client_survives_a_restart_of_the_service() {
    let directory = tempfile::tempdir().unwrap();
    let socket = format!("ipc://{}", directory.path().join("socket").display());
    let start = || {
        let mut config = config(Data::Directory(directory.path().join("data")));
        config.listen = vec![socket.clone()];
        Service::start(config).unwrap()
    };
    let service = start();
    let ada = Client::connect(&socket, user("ada")).unwrap();
    ada.start(task("Brass Glass")).unwrap();
    service.stop().unwrap();
    let waiting = thread::spawn(move || ada.say("ring the brass bell").map(|reply| (ada, reply)));
    let service = start();
    let (ada, reply) = waiting.join().unwrap().unwrap();
    assert_eq!(reply.first.get(), 3);
    assert_eq!(ada.status().unwrap().seq, 3);
    service.stop().unwrap();
}

#[test]
fn a_lesson_is_still_known_after_a_restart() {
    let directory = tempfile::tempdir().unwrap();
    let data = || Data::Directory(directory.path().join("data"));
    let service = bells(data());
    let ada = connect(&service, "ada");
    ada.start(task("Brass Glass")).unwrap();
    let unknown = ada.say("sterilize the brass bell").unwrap();
    ada.say("ring the brass bell").unwrap();
    ada.done().unwrap();
    ada.teach(unknown.first, vec![1], OnClash::Ask).unwrap();
    // Stopped while the training may still run: the log says that it is outstanding.
    ada.finish_teaching().unwrap();
    service.stop().unwrap();

    let service = bells(data());
    let ada = connect(&service, "ada");
    let waited = ada.wait_until_learned(LONG).unwrap();
    assert_eq!((waited.status.phase, waited.status.lessons), (Phase::Idle, 1));
    ada.start(task("Glass")).unwrap();
    let reused = ada.say("sterilize the glass bell").unwrap();
    assert!(matches!(outcome(&reused), Outcome::Understood { .. }), "{reused:?}");
    service.stop().unwrap();
}

#[test]
fn a_defect_costs_one_answer_and_nothing_that_was_recorded() {
    let service = bells(Data::Memory);
    let ada = connect(&service, "ada");
    ada.start(task("Brass Glass")).unwrap();
    ada.say("ring the brass bell").unwrap();
    let seq = ada.status().unwrap().seq;
    let failed = ada.say("break the silver bell").unwrap_err();
    assert!(
        matches!(&failed, ClientError::Failed { code: ErrorCode::Internal, message }
            if message.contains("the bell broke")),
        "{failed:?}"
    );
    assert_eq!(ada.status().unwrap().seq, seq, "rebuilt from the log, nothing recorded");
    ada.say("mute the brass bell").unwrap();
    assert_eq!(service.failed(), None);
    service.stop().unwrap();
}

#[test]
fn what_cannot_be_applied_is_not_appended_and_its_person_goes_on() {
    let fickle = Arc::new(Fickle::default());
    let mut config = config(Data::Memory);
    config.domain = Arc::new(Bells::fickle(fickle.clone()));
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    let service = Service::start(config).unwrap();
    let ada = connect(&service, "ada");
    ada.start(task("Brass Glass")).unwrap();
    let seq = ada.status().unwrap().seq;
    fickle.is_on.store(true, Ordering::SeqCst);
    for command in [
        Command::Say { utterance: "ring the brass bell".to_owned() },
        Command::Say { utterance: "flibbertigibbet".to_owned() },
    ] {
        let failed = ada.command(command).unwrap_err();
        assert!(
            matches!(&failed, ClientError::Failed { code: ErrorCode::Internal, message }
                if message.contains("nothing was recorded") && message.contains("scene digest")),
            "{failed:?}"
        );
        assert_eq!(ada.status().unwrap().seq, seq, "nothing was appended");
    }
    fickle.is_on.store(false, Ordering::SeqCst);
    let rung = ada.say("ring the brass bell").unwrap();
    assert_eq!(rung.first.get(), seq + 1);
    assert_eq!(service.failed(), None);
    service.stop().unwrap();
}

#[test]
fn only_this_machine_can_knock() {
    for endpoint in ["tcp://0.0.0.0:5555", "tcp://*:5555", "tcp://10.0.0.1:5555"] {
        let mut config = config(Data::Memory);
        config.listen = vec![endpoint.to_owned()];
        let error = Service::start(config).err().expect("it must not start");
        assert!(matches!(error, StartError::Endpoint(_)), "{error}");
        assert!(error.to_string().contains("127.0.0.1"), "{error}");
    }
    let first = bells(Data::Memory);
    let mut config = config(Data::Memory);
    config.listen = vec![first.endpoint().unwrap().to_owned()];
    let error = Service::start(config).err().expect("the port is taken");
    assert!(matches!(error, StartError::Gateway(_)), "{error}");
}

#[test]
fn a_directory_in_use_and_a_bad_recipe_are_start_errors() {
    let directory = tempfile::tempdir().unwrap();
    let data = || Data::Directory(directory.path().to_owned());
    let service = bells(data());
    let error = Service::start(config(data())).err().expect("it is in use");
    assert!(error.to_string().contains("in use"), "{error}");
    service.stop().unwrap();
    let mut bad = config(data());
    bad.recipe_text = "name = ".to_owned();
    let error = Service::start(bad).err().expect("the recipe is broken");
    assert!(matches!(error, StartError::Actors(_)), "{error}");
    bells(data()).stop().unwrap();
}

#[test]
fn nobody_answering_is_said_within_the_clients_patience() {
    let service = bells(Data::Memory);
    let endpoint = service.endpoint().unwrap().to_owned();
    service.stop().unwrap();
    let client = Client::connect(&endpoint, user("ada")).unwrap();
    let error = client.with_patience(Duration::from_millis(300)).hello().unwrap_err();
    assert!(matches!(error, ClientError::NoAnswer { .. }), "{error}");
}

/// Without CURVE the service could only listen on loopback; see `deploy/libzmq`.
#[test]
fn libzmq_was_built_with_curve() {
    assert_eq!(zmq::has("curve"), Some(true));
    let pair = zmq::CurveKeyPair::new().unwrap();
    assert_ne!(pair.public_key, pair.secret_key);
    assert_eq!(zmq::version(), (4, 3, 5));
}
