//! Every queue is bounded. At the bound the answer is Busy: nothing is dropped, and nothing waits
//! without end. A service that has failed does not wait for anything either.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use apprentice::client::wire::{Request, decode_response, encode_request};
use apprentice::client::{Ask, Command, OnClash, PersonAsk, Phase, Query, Response, fresh_id};
use apprentice::ids::{RequestId, Seq, UserId};
use apprentice::limits::{GATEWAY_IN_FLIGHT_MAX, TRAIN_QUEUE_MAX, WAIT_S_MAX, WAITERS_MAX};
use apprentice::service::{Data, Service};
use apprentice::store::{Fault, FaultPlan};
use apprentice::world::Stage;

use apprentice_testkit::toy::{self, Bells, Gate};

/// A few sockets that speak for many people. Each has fewer answers under way than the service
/// keeps for a client that does not read.
struct Crowd(Vec<zmq::Socket>);

const SOCKETS: usize = 16;
/// Requests of [`Crowd::all_ask`] under way at once.
const WINDOW: usize = 256;

impl Crowd {
    fn new(service: &Service) -> Crowd {
        let context = zmq::Context::new();
        let open = |_| {
            let socket = context.socket(zmq::DEALER).unwrap();
            socket.set_linger(0).unwrap();
            socket.connect(service.endpoint().unwrap()).unwrap();
            socket
        };
        Crowd((0..SOCKETS).map(open).collect())
    }

    fn send(&self, person: usize, id: RequestId, ask: &Ask) {
        let user = UserId::new(&format!("person {person}")).unwrap();
        let bytes = encode_request(&Request { id, user, ask: ask.clone() });
        self.0[person % SOCKETS].send(bytes, 0).unwrap();
    }

    fn hear(&self) -> (RequestId, Response) {
        let mut items: Vec<_> =
            self.0.iter().map(|socket| socket.as_poll_item(zmq::POLLIN)).collect();
        assert!(zmq::poll(&mut items, 60_000).unwrap() > 0, "an answer within a minute");
        let first = items.iter().position(|item| item.is_readable()).unwrap();
        decode_response(&self.0[first].recv_bytes(0).unwrap()).unwrap()
    }

    /// Everybody asks the same, and asks again while the service is busy. A refusal is a failure.
    fn all_ask(&self, people: usize, ask: &Ask) -> Vec<Response> {
        let mut open: BTreeMap<RequestId, usize> = BTreeMap::new();
        let (mut answers, mut next) = (Vec::new(), 0);
        while answers.len() < people {
            while next < people && open.len() < WINDOW {
                let id = fresh_id();
                open.insert(id, next);
                self.send(next, id, ask);
                next += 1;
            }
            match self.hear() {
                (id, Response::Busy(_)) => self.send(open[&id], id, ask),
                (_, refusal @ (Response::Rejected(_) | Response::Error(_))) => {
                    panic!("{refusal:?}")
                }
                (id, answer) => {
                    // Late answers to requests that were given up; nobody waits for them.
                    answers.extend(open.remove(&id).map(|_| answer));
                }
            }
        }
        answers
    }

    /// Everybody teaches one lesson and is learning when this returns.
    fn all_teach(&self, people: usize) {
        let say = |text: &str| Command::Say { utterance: text.to_owned() };
        let explains = Seq::new(3).unwrap();
        for command in [
            Command::StartEpisode { stage: Stage::Task { task: "Brass Glass".into(), seed: 1 } },
            say("sterilize the brass bell"),
            say("ring the brass bell"),
            Command::Done,
            Command::Teach { explains, actions: vec![1], on_clash: OnClash::Ask },
            Command::FinishTeaching,
        ] {
            self.all_ask(people, &Ask::Person(PersonAsk::Command(command)));
        }
    }
}

fn service(gate: &Arc<Gate>, faults: Option<FaultPlan>) -> Service {
    let mut config = toy::config(Data::Memory);
    config.domain = Arc::new(Bells::slow(gate.clone()));
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    config.faults = faults;
    Service::start(config).unwrap()
}

fn phases(answers: &[Response]) -> Vec<Phase> {
    let phase = |answer: &Response| match answer {
        Response::Status(status) => status.phase,
        other => panic!("{other:?}"),
    };
    answers.iter().map(phase).collect()
}

#[test]
fn at_every_bound_there_is_an_honest_busy_and_everybody_is_served_in_the_end() {
    // More trainings than the trainers' queue can take, while none of them ends.
    let gate = Arc::<Gate>::default();
    let service = service(&gate, None);
    let crowd = Crowd::new(&service);
    let people = TRAIN_QUEUE_MAX + 6;
    crowd.all_teach(people);
    let status = Ask::Person(PersonAsk::Query(Query::Status));
    assert!(phases(&crowd.all_ask(people, &status)).iter().all(|&p| p == Phase::Learning));

    // More waiters than one person may have, and more requests than the gateway accepts.
    let wait = Ask::Person(PersonAsk::Wait { seconds: WAIT_S_MAX });
    let waits = people * WAITERS_MAX + 1;
    assert!(waits > GATEWAY_IN_FLIGHT_MAX);
    crowd.send(0, fresh_id(), &wait);
    for person in (0..people).flat_map(|person| [person; WAITERS_MAX]) {
        crowd.send(person, fresh_id(), &wait);
    }
    let busy = waits - GATEWAY_IN_FLIGHT_MAX;
    for _ in 0..busy {
        let (_, answer) = crowd.hear();
        assert!(matches!(&answer, Response::Busy(busy) if busy.retry_after_ms > 0), "{answer:?}");
    }
    assert!(service.counts().busy > 0, "the gateway itself turned some away");

    // Nobody was dropped. Those for whom the queue had no space get their answer too.
    gate.open();
    for _ in 0..waits - busy {
        let (_, answer) = crowd.hear();
        assert!(matches!(&answer, Response::Waited(_) | Response::Busy(_)), "{answer:?}");
    }
    let learned = |answers: Vec<Response>| phases(&answers).iter().all(|&p| p == Phase::Idle);
    let until = Instant::now() + Duration::from_secs(60);
    while !learned(crowd.all_ask(people, &status)) {
        assert!(Instant::now() < until, "a training was forgotten");
        crowd.all_ask(people, &Ask::Person(PersonAsk::Wait { seconds: 5 }));
    }
    service.stop().unwrap();
}

#[test]
fn a_failed_service_does_not_wait_for_a_training() {
    let gate = Arc::<Gate>::default();
    // Until they learn, two people need seven appends each, and their tenant needs some for the
    // segments that their episodes close. The next append fails.
    let mut script = vec![Fault::None; 24];
    script.push(Fault::CrashAfter);
    let service = service(&gate, Some(FaultPlan { script, ..FaultPlan::default() }));
    let crowd = Crowd::new(&service);
    crowd.all_teach(2);
    let stage = Stage::Task { task: "Brass Glass".into(), seed: 1 };
    let begin = Ask::Person(PersonAsk::Command(Command::StartEpisode { stage }));
    (2..14).for_each(|person| crowd.send(person, fresh_id(), &begin));
    let reason = service.wait().expect("its log is gone");
    let start = Instant::now();
    assert_eq!(service.stop(), Err(reason));
    let took = start.elapsed();
    gate.open();
    assert!(took < Duration::from_secs(1), "stopping took {took:?} with a training under way");
}
