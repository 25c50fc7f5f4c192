//! The feed through real sockets: a follower gets every record of its lab, and no record of another
//! lab.

use std::time::{Duration, Instant};

use apprentice::client::{
    BEAT, Client, ClientError, CurveKey, ErrorCode, FeedMessage, FollowError, Followed, Follower,
};
use apprentice::ids::{Seq, WithinTenant};
use apprentice::service::{Data, Service, StartError};
use apprentice::tenancy::{Order, Role};
use apprentice::world::Stage;
use apprentice_testkit::lab::{self, FREE_PORT, admit, connect, order, tenant};
use apprentice_testkit::toy;

const BOUND: Duration = Duration::from_secs(60);
/// A word that only this lab's people say.
const CANARY: &str = "zyxquuxlab";

fn service(waiting_max: i32) -> Service {
    let mut config = lab::config(Data::Memory);
    config.feed = Some(FREE_PORT.to_owned());
    config.feed_waiting_max = waiting_max;
    Service::start(config).unwrap()
}

fn begin(client: &Client) {
    client.start(Stage::Task { task: "Brass Glass".to_owned(), seed: 1 }).unwrap();
}

fn say(client: &Client, times: usize) {
    (0..times).for_each(|time| drop(client.say(&format!("{CANARY} the bell {time}")).unwrap()));
}

/// The endpoint of a feed, once it is open.
fn endpoint(service: &Service, name: &str, plain: bool) -> String {
    let end = Instant::now() + BOUND;
    loop {
        let all = service.feed_endpoints();
        let found = all.into_iter().find(|it| (&it.0, it.1) == (&tenant(name), plain));
        if let Some((_, _, endpoint)) = found {
            return endpoint;
        }
        assert!(Instant::now() < end, "no feed of {name} within {BOUND:?}");
        std::thread::yield_now();
    }
}

/// A socket that reads every message.
fn subscribe(service: &Service, key: &CurveKey, endpoint: &str) -> zmq::Socket {
    let socket = lab::socket(service, key, zmq::SUB);
    socket.set_subscribe(b"").unwrap();
    socket.connect(endpoint).unwrap();
    socket
}

/// All messages, until a beat says that this number of records was published.
fn read_until(socket: &zmq::Socket, number: u64) -> Vec<(FeedMessage, Vec<u8>)> {
    let mut read = Vec::new();
    socket.set_rcvtimeo(BOUND.as_millis() as i32).unwrap();
    loop {
        let frames = socket.recv_multipart(0).expect("a beat within the bound");
        let message = FeedMessage::decode(&frames[1]).unwrap();
        let is_beat = frames[0] == BEAT.as_bytes();
        if is_beat && message.number >= number {
            return read;
        }
        read.push((message, frames.concat()));
    }
}

/// How many records a tenant has, as an auditor sees it.
fn heads(client: &Client) -> WithinTenant<u64> {
    client.heads().unwrap().into_iter().map(|head| (head.stream, head.seq.get())).collect()
}

/// Follows until every record in the log was given, and compares it with the log.
fn drain(follower: &mut Follower, heads: &WithinTenant<u64>, seen: &mut Vec<Followed>) {
    let end = Instant::now() + BOUND;
    let arrived = |follower: &Follower| {
        heads.iter().all(|(stream, seq)| {
            follower.positions().get(&stream).is_some_and(|at| at.seq.get() >= *seq)
        })
    };
    while !arrived(follower) {
        assert!(Instant::now() < end, "not everything within {BOUND:?}");
        seen.extend(follower.next(Duration::from_millis(200)).unwrap());
    }
    while let Some(followed) = follower.next(Duration::ZERO).unwrap() {
        seen.push(followed);
    }
}

/// Each record once, and none missing.
fn assert_whole(seen: &[Followed], heads: &WithinTenant<u64>) {
    let mut counts: WithinTenant<u64> = WithinTenant::new();
    for followed in seen {
        let (stream, seq) = match followed {
            Followed::Sealed(record) => (record.stream, record.seq),
            Followed::Plain(record) => (record.stream, record.seq),
            Followed::Erased { .. } => panic!("nobody was erased"),
        };
        let count = counts.entry(stream).or_default();
        *count += 1;
        assert_eq!(seq.get(), *count, "stream {stream} in its order, each record once");
    }
    for (stream, seq) in heads.iter() {
        assert!(counts.get(&stream).is_some_and(|count| count >= seq), "stream {stream}: {seq}");
    }
}

fn contains(bytes: &[u8], part: &str) -> bool {
    bytes.windows(part.len()).any(|window| window == part.as_bytes())
}

#[test]
fn a_follower_that_starts_late_is_starved_and_stopped_misses_nothing() {
    let service = service(1);
    let (gateway, auditor) =
        (admit(&service, "lab-a", Role::Gateway), admit(&service, "lab-a", Role::Auditor));
    let people = ["ada", "grace", "edith"].map(|name| connect(&service, &gateway, name));
    people.iter().for_each(begin);
    people.iter().for_each(|client| say(client, 5));
    let asks = connect(&service, &auditor, "auditor");
    let follow = |positions| {
        Follower::sealed(connect(&service, &auditor, "auditor"), positions).with_waiting_max(1)
    };
    let (mut follower, mut seen) = (follow(WithinTenant::new()), Vec::new());
    drain(&mut follower, &heads(&asks), &mut seen);
    assert!(follower.fetched() >= 18, "what was before it came was asked for");
    // Nobody reads now, and the queue takes one message.
    people.iter().for_each(|client| say(client, 40));
    drain(&mut follower, &heads(&asks), &mut seen);
    // Now the follower is away.
    let positions = follower.positions().clone();
    println!("starved: {} of {} records were asked for", follower.fetched(), seen.len());
    drop(follower);
    people.iter().for_each(|client| say(client, 10));
    let mut follower = follow(positions);
    drain(&mut follower, &heads(&asks), &mut seen);
    assert!(follower.fetched() >= 30, "what was missed was asked for");
    assert_whole(&seen, &heads(&asks));
    service.stop().unwrap();
}

#[test]
fn what_is_recorded_is_published_with_dense_numbers_and_without_being_asked_for() {
    let service = service(1_000);
    let (gateway, auditor) =
        (admit(&service, "lab-a", Role::Gateway), admit(&service, "lab-a", Role::Auditor));
    let socket = subscribe(&service, &auditor, &endpoint(&service, "lab-a", false));
    read_until(&socket, 0);
    let ada = connect(&service, &gateway, "ada");
    begin(&ada);
    say(&ada, 10);
    let read = read_until(&socket, 12 + 2);
    let mut numbers = Vec::new();
    for (message, _) in &read {
        let Some(record) = &message.sealed else { continue };
        numbers.push(message.number);
        assert_eq!(message.start, read[0].0.start);
        let record_prev = apprentice::events::Header::unframe(&record.frame.0).unwrap().0.prev;
        assert_eq!(record.check(record_prev), Ok(()));
    }
    assert!(numbers.len() >= 12, "{numbers:?}");
    assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "{numbers:?}");
    service.stop().unwrap();
}

#[test]
fn an_operator_follows_words_and_an_auditor_of_either_lab_sees_none_of_them() {
    let service = service(1_000);
    let keys = |lab: &str| {
        [Role::Gateway, Role::Operator, Role::Auditor].map(|role| admit(&service, lab, role))
    };
    let ([gateway, operator, auditor], [_, other_operator, other_auditor]) =
        (keys("lab-a"), keys("lab-b"));
    let [sealed, plain] = [false, true].map(|plain| endpoint(&service, "lab-a", plain));
    // Clients that are not admitted also try to connect, at every endpoint of the lab.
    let strangers: Vec<zmq::Socket> = [&other_operator, &other_auditor, &gateway]
        .into_iter()
        .flat_map(|key| [&sealed, &plain].map(|endpoint| subscribe(&service, key, endpoint)))
        .chain([subscribe(&service, &auditor, &plain)])
        .collect();
    let audited = subscribe(&service, &auditor, &sealed);
    let others = subscribe(&service, &other_auditor, &endpoint(&service, "lab-b", false));
    read_until(&audited, 0);
    read_until(&others, 0);

    let ada = connect(&service, &gateway, "ada");
    begin(&ada);
    say(&ada, 5);
    let stream = heads(&connect(&service, &auditor, "a")).keys().nth(1).unwrap();
    let mut follower = Follower::plain(connect(&service, &operator, "o"), WithinTenant::new());
    let mut seen = Vec::new();
    drain(&mut follower, &heads(&connect(&service, &operator, "o")), &mut seen);
    let said = |followed: &&Followed| match followed {
        Followed::Plain(record) => record.event.to_string().contains(CANARY),
        _ => false,
    };
    assert_eq!(seen.iter().filter(said).count(), 5, "the operator reads what was said");
    say(&ada, 3);
    drain(&mut follower, &heads(&connect(&service, &operator, "o")), &mut seen);
    assert_eq!(seen.iter().filter(said).count(), 8);

    let sealed = read_until(&audited, 10);
    assert!(sealed.iter().filter(|(message, _)| message.sealed.is_some()).count() >= 8);
    assert!(sealed.iter().all(|(_, bytes)| !contains(bytes, CANARY)), "sealed is sealed");
    for (message, bytes) in read_until(&others, 0) {
        assert!(message.sealed.is_none() && !contains(bytes.as_slice(), &stream.to_hex()));
    }
    for socket in &strangers {
        assert_eq!(socket.poll(zmq::POLLIN, 0).unwrap(), 0, "not even a beat");
    }

    // At the service's endpoint as well.
    let from_the_service = |key: &CurveKey, plain: bool| {
        let client = connect(&service, key, "x");
        match plain {
            true => client.plain_records(stream, Seq::FIRST).map(|read| read.records.len()),
            false => client.records(stream, Seq::FIRST).map(|read| read.records.len()),
        }
    };
    assert!(from_the_service(&auditor, false).unwrap() >= 10);
    assert!(from_the_service(&operator, true).unwrap() >= 10);
    for key in [&other_auditor, &other_operator] {
        assert_eq!(from_the_service(key, false), Ok(0), "the same stream of another lab is empty");
        assert!(!heads(&connect(&service, key, "x")).contains_key(&stream));
    }
    for (key, plain) in [(&auditor, true), (&gateway, false), (&gateway, true)] {
        let denied = from_the_service(key, plain).unwrap_err();
        assert!(matches!(denied, ClientError::Failed { code: ErrorCode::Denied, .. }), "{denied}");
    }
    assert_eq!(connect(&service, &auditor, "x").feed().unwrap().plain, None);
    service.stop().unwrap();
}

#[test]
fn a_key_that_is_taken_back_hears_nothing_more_and_the_others_go_on() {
    let service = service(1_000);
    let [gateway, stays, goes] =
        [Role::Gateway, Role::Auditor, Role::Auditor].map(|role| admit(&service, "lab-a", role));
    let endpoint = endpoint(&service, "lab-a", false);
    let heard = subscribe(&service, &goes, &endpoint);
    read_until(&heard, 0);
    let mut follower = Follower::sealed(connect(&service, &stays, "s"), WithinTenant::new());
    let mut gone = Follower::sealed(connect(&service, &goes, "g"), WithinTenant::new());
    let (ada, mut seen) = (connect(&service, &gateway, "ada"), Vec::new());
    begin(&ada);
    let stays = connect(&service, &stays, "s");
    drain(&mut follower, &heads(&stays), &mut seen);
    drain(&mut gone, &heads(&stays), &mut Vec::new());
    while heard.poll(zmq::POLLIN, 0).unwrap() > 0 {
        heard.recv_multipart(0).unwrap();
    }
    order(&service, "lab-a", Order::Retire { key: *goes.public(), overlap_seconds: 0 });
    let retired = heads(&stays);
    say(&ada, 30);
    drain(&mut follower, &heads(&stays), &mut seen);
    assert_whole(&seen, &heads(&stays));
    while heard.poll(zmq::POLLIN, 0).unwrap() > 0 {
        let frames = heard.recv_multipart(0).unwrap();
        let record = FeedMessage::decode(&frames[1]).unwrap().sealed;
        let late = record.filter(|record| {
            retired.get(&record.stream).is_none_or(|seq| record.seq.get() >= *seq)
        });
        assert_eq!(late, None, "a record came after its key was taken back");
    }
    let end = Instant::now() + BOUND;
    let error = loop {
        assert!(Instant::now() < end, "not told within {BOUND:?}");
        match gone.next(Duration::from_secs(1)) {
            Err(error) => break error,
            Ok(followed) => assert_eq!(followed, None),
        }
    };
    assert!(matches!(error, FollowError::Client(_)), "{error}");
    service.stop().unwrap();
}

#[test]
fn a_feed_without_an_endpoint_with_keys_is_refused() {
    let mut config = toy::config(Data::Memory);
    config.feed = Some(FREE_PORT.to_owned());
    match Service::start(config) {
        Err(error @ StartError::FeedAlone) => assert!(error.to_string().contains("--curve")),
        other => panic!("{:?}", other.map(|_| ())),
    }
}
