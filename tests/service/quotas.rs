//! A lab gets no more than its quotas and does not slow down other labs. Tests quotas and fairness
//! between tenants, through real actors, sockets and logs.

use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use apprentice::actors::{
    ActorSettings, ActorSystem, AnswerTo, Failure, Front, Refusals, wall_clock,
};
use apprentice::client::{
    Ask, Client, ClientError, Command, CurveKey, OnClash, Order, PersonAsk, Phase, Query, Quota,
    Response, ServiceAsk, fresh_id,
};
use apprentice::ids::{RequestId, Seq, TenantId, UserId};
use apprentice::learning::Recipe;
use apprentice::limits::KEY_FILE_BYTES;
use apprentice::service::{Data, Service};
use apprentice::store::{self, Store};
use apprentice::tenancy::{Quotas, Role};
use apprentice::world::Stage;
use apprentice_testkit::front::hand_in;
use apprentice_testkit::lab::{self, obey, tenant};
use apprentice_testkit::toy::{Bells, Gate};

const LONG: Duration = Duration::from_secs(30);

fn actors(store: Store, gate: Option<&Arc<Gate>>) -> ActorSystem {
    let domain = gate.map_or_else(Bells::new, |gate| Bells::slow(gate.clone()));
    ActorSystem::start(ActorSettings {
        domain: Arc::new(domain),
        store,
        recipe_text: Recipe::builtin("tiny").unwrap().to_owned(),
        trainers: 1,
        arbiters: 2,
        awake_max: 64,
        failure: Failure::default(),
        clock: wall_clock(),
    })
    .unwrap()
}

fn user(number: usize) -> UserId {
    UserId::new(&format!("person {number}")).unwrap()
}

/// Labs with these quotas.
fn allow(actors: &ActorSystem, labs: &[(&TenantId, Quotas)]) {
    for (tenant, quotas) in labs {
        obey(actors.registrar(), tenant, Order::Add);
        obey(actors.registrar(), tenant, Order::SetQuotas(*quotas));
    }
}

/// A service with an endpoint for keys, and labs with these quotas.
fn service(data: Data, labs: &[(&TenantId, Quotas)]) -> Service {
    let service = Service::start(lab::config(data)).unwrap();
    for (tenant, quotas) in labs {
        obey(service.registrar(), tenant, Order::Add);
        obey(service.registrar(), tenant, Order::SetQuotas(*quotas));
    }
    service
}

/// A key of a lab's gateway.
fn admit(service: &Service, tenant: &TenantId) -> CurveKey {
    lab::admit(service, tenant.as_str(), Role::Gateway)
}

fn connect(service: &Service, key: &CurveKey, number: usize, patience: Duration) -> Client {
    lab::connect(service, key, user(number).as_str()).with_patience(patience)
}

/// Asks once, without a socket.
fn ask(front: &Front, tenant: &TenantId, number: usize, id: RequestId, ask: Ask) -> Response {
    let (sender, receiver) = mpsc::channel();
    send(front, tenant, number, id, ask, &sender);
    receiver.recv_timeout(Duration::from_secs(60)).expect("every request is answered")
}

fn send(
    front: &Front,
    tenant: &TenantId,
    number: usize,
    request: RequestId,
    ask: Ask,
    sender: &mpsc::Sender<Response>,
) {
    let sender = sender.clone();
    let answer = AnswerTo::new(move |response| sender.send(response).unwrap());
    hand_in(front, (tenant.clone(), user(number)), request, ask, answer);
}

fn stage() -> Stage {
    Stage::Task { task: "Brass Glass".to_owned(), seed: 1 }
}

const STATUS: Ask = Ask::Person(PersonAsk::Query(Query::Status));

/// An episode with a lesson, until a training is outstanding.
///
/// - `told`: carries out one command and gives the number of its first record.
fn teach(told: impl Fn(Command) -> Seq) {
    let say = |text: &str| Command::Say { utterance: text.to_owned() };
    told(Command::StartEpisode { stage: stage() });
    let explains = told(say("sterilize the brass bell"));
    told(say("ring the brass bell"));
    told(Command::Done);
    told(Command::Teach { explains, actions: vec![1], on_clash: OnClash::Ask });
    told(Command::FinishTeaching);
}

#[test]
fn a_lab_over_its_rate_hears_the_numbers_and_the_other_is_answered() {
    let (flood, quiet) = (tenant("flood"), tenant("quiet"));
    let quotas = Quotas { utterances_per_second: Some(5), burst: Some(10), ..Quotas::default() };
    let service = service(Data::Memory, &[(&flood, quotas), (&quiet, Quotas::default())]);
    let [loud_key, quiet_key] = [&flood, &quiet].map(|tenant| admit(&service, tenant));
    let mallory = connect(&service, &loud_key, 0, Duration::from_millis(1));
    let ada = connect(&service, &quiet_key, 0, LONG);
    // After the handshake.
    connect(&service, &loud_key, 0, LONG).hello().unwrap();
    ada.start(stage()).unwrap();
    let (start, mut refused, mut heard) = (Instant::now(), 0, 0);
    for round in 0..500 {
        let say = Command::Say { utterance: "ring the brass bell".to_owned() };
        match mallory.command(say) {
            Err(ClientError::OverQuota { quota, limit, message, .. }) => {
                assert_eq!((quota, limit), (Quota::Utterances, 5), "{message}");
                refused += 1;
            }
            // In the wrong phase: this command costs a token too.
            Ok(_) | Err(ClientError::Rejected { .. }) => heard += 1,
            // Not within a millisecond.
            Err(ClientError::NoAnswer { .. } | ClientError::Busy { .. }) => heard += 1,
            Err(other) => panic!("{other}"),
        }
        if round % 50 == 0 {
            ada.say("ring the brass bell").unwrap();
        }
    }
    // On a busy machine some are still on their way. This one comes after them on the same
    // connection.
    mallory.with_patience(LONG).hello().unwrap();
    let most = 10 + 5 * (start.elapsed().as_secs() as usize + 1);
    let taken = 500 - service.usage()[&flood].refused.utterances as usize;
    assert!((10..=most).contains(&taken), "{taken} of at most {most} went through");
    assert!(refused > 0 && heard > 0, "{refused} refused, {heard} heard");
    assert!(service.counts().over_quota >= refused);
    assert_eq!(service.usage()[&quiet].refused, Refusals::default());
    // A client that waits gets its answer.
    let patient = connect(&service, &loud_key, 1, LONG);
    patient.start(stage()).unwrap();
}

#[test]
fn a_lab_at_its_awake_bound_puts_its_own_people_to_sleep_and_nobody_elses() {
    let (gate, store) = (Arc::<Gate>::default(), store::open_memory());
    let actors = actors(store, Some(&gate));
    let (full, other) = (tenant("full"), tenant("other"));
    let quotas = Quotas { awake_users: Some(2), ..Quotas::default() };
    allow(&actors, &[(&full, quotas), (&other, Quotas::default())]);
    let front = actors.front();
    let status = |tenant: &TenantId, number| ask(&front, tenant, number, fresh_id(), STATUS);
    assert!(matches!(status(&other, 0), Response::Status(_)), "the longest idle of all");
    for number in 0..6 {
        assert!(matches!(status(&full, number), Response::Status(_)), "an idle one makes room");
    }
    assert_eq!(actors.usage()[&full].awake_users, 2);
    assert_eq!(actors.usage()[&other].awake_users, 1, "untouched, though idle for longest");

    // Two users who are learning cannot be put to sleep, so a third user of the lab must wait.
    // Other labs need not wait.
    for number in [4, 5] {
        let told = |command| {
            let id = fresh_id();
            loop {
                match ask(
                    &front,
                    &full,
                    number,
                    id,
                    Ask::Person(PersonAsk::Command(Command::clone(&command))),
                ) {
                    Response::Reply(reply) => return reply.first,
                    Response::Busy(_) => {}
                    other => panic!("{other:?}"),
                }
            }
        };
        teach(told);
    }
    match status(&full, 0) {
        Response::QuotaExceeded(over) => {
            assert_eq!((over.quota, over.used, over.limit), (Quota::AwakeUsers, 2, 2));
            assert!(over.retry_after_ms.is_some());
        }
        other => panic!("{other:?}"),
    }
    for number in 0..10 {
        assert!(matches!(status(&other, number), Response::Status(_)));
    }
    assert_eq!(actors.usage()[&full].refused.awake_users, 1);
    gate.open();
    let wait = Ask::Person(PersonAsk::Wait { seconds: 30 });
    for number in [4, 5] {
        let waited = ask(&front, &full, number, fresh_id(), wait.clone());
        assert!(matches!(waited, Response::Waited(_)), "{waited:?}");
    }
    let end = Instant::now() + Duration::from_secs(30);
    while !matches!(status(&full, 0), Response::Status(_)) {
        assert!(Instant::now() < end, "who has learned makes room");
    }
}

#[test]
fn requests_in_flight_are_bounded_for_each_lab() {
    let gate = Arc::<Gate>::default();
    let actors = actors(store::open_memory(), Some(&gate));
    let (full, other) = (tenant("full"), tenant("other"));
    let quotas = Quotas { in_flight: Some(3), ..Quotas::default() };
    allow(&actors, &[(&full, quotas), (&other, Quotas::default())]);
    let front = actors.front();
    let told = |command: Command| match ask(&front, &full, 0, fresh_id(), command.into()) {
        Response::Reply(reply) => reply.first,
        other => panic!("{other:?}"),
    };
    teach(told);
    // Three clients that wait for the training use all three places.
    let (sender, waits) = mpsc::channel();
    for _ in 0..3 {
        send(&front, &full, 0, fresh_id(), Ask::Person(PersonAsk::Wait { seconds: 30 }), &sender);
    }
    match ask(&front, &full, 1, fresh_id(), Ask::Service(ServiceAsk::Hello)) {
        Response::QuotaExceeded(over) => {
            assert_eq!((over.quota, over.used, over.limit), (Quota::InFlight, 3, 3));
        }
        other => panic!("{other:?}"),
    }
    let elsewhere = ask(&front, &other, 1, fresh_id(), STATUS);
    assert!(matches!(elsewhere, Response::Status(_)), "{elsewhere:?}");
    gate.open();
    for _ in 0..3 {
        let waited = waits.recv_timeout(Duration::from_secs(60)).unwrap();
        assert!(matches!(waited, Response::Waited(_)), "{waited:?}");
    }
    assert!(matches!(
        ask(&front, &full, 1, fresh_id(), Ask::Service(ServiceAsk::Hello)),
        Response::Hello(_)
    ));
}

/// Plays episodes until the log is full.
///
/// - returns: how many commands were recorded.
fn fill(client: &Client) -> usize {
    let play = [Command::StartEpisode { stage: stage() }, Command::Done];
    for (count, command) in play.iter().cycle().enumerate() {
        match client.command(command.clone()) {
            Ok(_) => {}
            Err(ClientError::OverQuota { quota: Quota::SealedBytes, used, limit, message }) => {
                assert!(used >= limit && message.contains("operator"), "{message}");
                return count;
            }
            Err(other) => panic!("{other}"),
        }
    }
    unreachable!("the log fills up")
}

#[test]
fn bytes_in_the_log_are_counted_over_a_restart_and_can_be_allowed_again() {
    let dir = tempfile::tempdir().unwrap();
    let data = Data::Directory(dir.path().to_owned());
    let (full, other) = (tenant("full"), tenant("other"));
    let limited = |bytes| Quotas { sealed_bytes: Some(bytes), ..Quotas::default() };
    let first = service(data.clone(), &[(&full, limited(40_000)), (&other, Quotas::default())]);
    let [full_key, other_key] = [&full, &other].map(|tenant| admit(&first, tenant));
    let commands = fill(&connect(&first, &full_key, 0, LONG));
    assert!(commands > 10, "{commands} commands");
    first.stop().unwrap();

    let second = service(data, &[]);
    let ada = connect(&second, &full_key, 0, LONG);
    assert!(matches!(ada.start(stage()), Err(ClientError::OverQuota { .. })));
    ada.status().unwrap();
    connect(&second, &other_key, 0, LONG).start(stage()).unwrap();
    assert!(second.usage()[&full].refused.sealed_bytes > 0);
    obey(second.registrar(), &full, Order::SetQuotas(limited(1_000_000)));
    if ada.status().unwrap().phase == Phase::Interacting {
        ada.done().unwrap();
    }
    ada.start(stage()).unwrap();
    ada.close("the study is over").unwrap();
    second.stop().unwrap();
}

/// What a lab has: bytes as its quota counts them, key files of its people, and streams.
fn holdings(store: &Store, tenant: &TenantId) -> (u64, usize) {
    (store.log.sealed_bytes(tenant).unwrap(), store.log.streams(tenant).unwrap().len())
}

#[test]
fn a_question_makes_nobody_and_what_is_declined_does_not_either() {
    let store = store::open_memory();
    let actors = actors(store.clone(), None);
    let lab = tenant("lab");
    allow(&actors, &[(&lab, Quotas::default())]);
    let (front, before) = (actors.front(), holdings(&store, &lab));
    let wait = Ask::Person(PersonAsk::Wait { seconds: 1 });
    for number in 0..50 {
        for asked in [
            STATUS,
            Ask::Person(PersonAsk::Query(Query::Known)),
            Ask::Person(PersonAsk::Query(Query::Look)),
            wait.clone(),
        ] {
            match ask(&front, &lab, number, fresh_id(), asked) {
                Response::Status(status) => {
                    assert_eq!((status.phase, status.seq, status.episodes), (Phase::Idle, 0, 0));
                    assert_eq!((&*status.recipe, status.lessons), ("tiny", 0));
                }
                Response::Known(known) => assert!(!known.is_empty(), "what everybody starts with"),
                Response::Rejected(rejected) => {
                    assert!(rejected.message.contains("nothing to see"))
                }
                Response::Waited(waited) => assert_eq!(waited.status.seq, 0),
                other => panic!("{other:?}"),
            }
        }
        let declined = [
            Command::Done,
            Command::Say { utterance: "ring the bell".to_owned() },
            Command::Close { reason: "a name mistyped".to_owned() },
            Command::Forget { lesson: Seq::FIRST },
            Command::FinishTeaching,
            Command::StartEpisode { stage: Stage::Task { task: "no such".to_owned(), seed: 1 } },
        ];
        for command in declined {
            let name = format!("{command:?}");
            let response = ask(&front, &lab, number, fresh_id(), command.into());
            assert!(matches!(response, Response::Rejected(_)), "{name}: {response:?}");
        }
    }
    assert_eq!(holdings(&store, &lab), before, "nothing was written");
    // Their first command makes the user, and what the queries said before was true.
    let told = |asked| ask(&front, &lab, 7, fresh_id(), asked);
    let (Response::Status(seen), Response::Known(known)) =
        (told(STATUS), told(Ask::Person(PersonAsk::Query(Query::Known))))
    else {
        panic!("a status and exemplars")
    };
    match told(Ask::Person(PersonAsk::Command(Command::StartEpisode { stage: stage() }))) {
        Response::Reply(reply) => assert_eq!(reply.first.get(), 2, "opened before"),
        other => panic!("{other:?}"),
    }
    let (Response::Status(now), Response::Known(known_now)) =
        (told(STATUS), told(Ask::Person(PersonAsk::Query(Query::Known))))
    else {
        panic!("a status and exemplars")
    };
    assert_eq!((seen.recipe, seen.mind, seen.exemplars), (now.recipe, now.mind, now.exemplars));
    assert_eq!(known, known_now);
    assert_eq!((now.seq, now.phase), (2, Phase::Interacting));
    let (bytes, streams) = holdings(&store, &lab);
    assert_eq!(streams, before.1 + 1);
    assert!(bytes > before.0 + KEY_FILE_BYTES, "a key is counted with its person");
}

#[test]
fn a_full_lab_closes_erases_and_takes_keys_back_and_writes_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let data = Data::Directory(dir.path().to_owned());
    let full = tenant("full");
    let quotas = Quotas { sealed_bytes: Some(40_000), ..Quotas::default() };
    let service = service(data, &[(&full, quotas)]);
    let gateway = admit(&service, &full);
    let operator = CurveKey::new().unwrap();
    let new_operator =
        Order::Admit { key: *operator.public(), role: Role::Operator, label: String::new() };
    obey(service.registrar(), &full, new_operator);
    let [ada, bob] = [0, 1].map(|number| connect(&service, &gateway, number, LONG));
    bob.start(stage()).unwrap();
    fill(&ada);
    // Recorded after the segments that the end of her last episode closes.
    let noted = Quotas { sealed_bytes: Some(39_999), ..Quotas::default() };
    obey(service.registrar(), &full, Order::SetQuotas(noted));
    let keys = || std::fs::read_dir(dir.path().join("keys/users/full")).unwrap().count();
    let operator = connect(&service, &operator, 0, LONG);
    let before = (keys(), operator.heads().unwrap());
    for number in 2..30 {
        let stranger = connect(&service, &gateway, number, LONG);
        assert_eq!(stranger.status().unwrap().seq, 0);
        let closed = stranger.close("never begun").unwrap_err();
        assert!(matches!(closed, ClientError::Rejected { .. }), "{closed}");
        assert!(matches!(stranger.start(stage()), Err(ClientError::OverQuota { .. })));
    }
    // An operator may not give commands, and looking at a name makes no user either.
    let seen = operator.status().unwrap();
    assert!(seen.seq > 0, "the same person as the gateway's");
    let admit = Order::Admit {
        key: *CurveKey::new().unwrap().public(),
        role: Role::Auditor,
        label: String::new(),
    };
    assert!(matches!(operator.order(None, admit), Err(ClientError::OverQuota { .. })));
    assert_eq!((keys(), operator.heads().unwrap()), before, "nothing was written");

    bob.close("enough").unwrap();
    let again = bob.close("once more").unwrap_err();
    assert!(matches!(again, ClientError::Rejected { .. }), "{again}");
    operator.erase(None, user(0)).unwrap();
    let retire = Order::Retire { key: *gateway.public(), overlap_seconds: 0 };
    assert_eq!(operator.order(None, retire).unwrap().recorded, 1);
    service.stop().unwrap();
}
