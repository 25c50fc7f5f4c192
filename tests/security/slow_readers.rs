//! Clients that do not read cannot fill the memory: connections that ask and read no answer,
//! subscribers that ask for everything, and any number of connections. The test uses real sockets
//! and the real program, and measures its memory from outside.

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command as Process, Stdio};
use std::time::{Duration, Instant};

use apprentice::client::wire::{Request, decode_response, encode_request};
use apprentice::client::{
    ArchiveAsk, Ask, Client, CurveKey, Follower, Identity, Order, PersonAsk, Query, Response,
    ServiceAsk, fresh_id, read_public,
};
use apprentice::ids::{PublicKey, Seq, StreamKey};
use apprentice::limits::{KEY_CONNECTIONS_MAX, TOPICS_MAX};
use apprentice::service::{Data, Service};
use apprentice::tenancy::Role;
use apprentice::world::Stage;
use apprentice_testkit::lab::{self, FREE_PORT, tenant, user};

/// How long a test may take, hung or not.
const BOUND: Duration = Duration::from_secs(60);
/// What the service says when it drops answers that are not read.
const DROPS: &str = "a tenant's connections do not read";
/// How long the hostile clients continue.
const FLOOD: Duration = Duration::from_secs(5);
/// Megabytes by which the process may grow in this time.
const GROWTH_MAX: f64 = 64.0;

/// The program, serving from a directory of its own.
struct Served {
    child: Child,
    open: String,
    locked: String,
    server: PublicKey,
    said: PathBuf,
    _dir: tempfile::TempDir,
}

impl Served {
    fn start() -> Served {
        let dir = tempfile::tempdir().unwrap();
        let said = dir.path().join("said");
        let mut process = Process::new(env!("CARGO_BIN_EXE_apprentice"));
        process.args(["serve", "--zmq", FREE_PORT, "--curve", FREE_PORT]);
        process.args(["--feed", FREE_PORT, "--data"]).arg(dir.path().join("lab"));
        process.env_remove("APPRENTICE_LOG").stdout(Stdio::piped());
        let mut child = process.stderr(File::create(&said).unwrap()).spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut after = |words: &str| loop {
            let line = lines.next().expect("the program says where it serves").unwrap();
            if let Some(rest) = line.strip_prefix(words) {
                return rest.to_owned();
            }
        };
        let (open, locked) = (after("serving at "), after("serving with keys at "));
        let server = read_public(&after("server key ")).unwrap();
        Served { child, open, locked, server, said, _dir: dir }
    }

    /// A key of a lab. It is made if it does not exist.
    fn admit(&self, name: &str, role: Role) -> CurveKey {
        let (host, key) =
            (Client::connect(&self.open, user("host")).unwrap(), CurveKey::new().unwrap());
        let admit = Order::Admit { key: *key.public(), role, label: String::new() };
        for order in [Order::Add, admit] {
            host.order(Some(tenant(name)), order).unwrap();
        }
        key
    }

    fn identity(&self, key: &CurveKey) -> Identity {
        Identity { key: key.clone(), server: self.server }
    }

    fn connect(&self, key: &CurveKey, name: &str) -> Client {
        Client::connect_as(&self.locked, user(name), self.identity(key)).unwrap()
    }

    /// Megabytes that the process uses.
    fn memory_mb(&self) -> f64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
        let kb: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
        kb / 1024.0
    }

    /// True while the flood continues: for its time, and on a busy machine until something was
    /// dropped.
    fn is_flooded_since(&self, start: Instant) -> bool {
        let flooded = start.elapsed();
        flooded < FLOOD || (flooded < BOUND && !self.said().contains(DROPS))
    }

    fn said(&self) -> String {
        fs::read_to_string(&self.said).unwrap()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A socket that asks, and reads almost none of the answers.
fn deaf(context: &zmq::Context, endpoint: &str, identity: Option<&Identity>) -> zmq::Socket {
    let socket = context.socket(zmq::DEALER).unwrap();
    socket.set_linger(0).unwrap();
    socket.set_rcvhwm(1).unwrap();
    socket.set_rcvbuf(4096).unwrap();
    identity.iter().for_each(|identity| identity.put_on(&socket).unwrap());
    socket.connect(endpoint).unwrap();
    socket
}

fn request(name: &str, ask: Ask) -> Vec<u8> {
    encode_request(&Request { id: fresh_id(), user: user(name), ask })
}

/// A kitchen with the largest number of things that a scene may have.
fn large_stage() -> Stage {
    let thing = |name: &str| format!("[[thing]]\ntype = \"{name}\"\non = \"CounterTop\"\n");
    let things: String = (0..390).map(|n| thing(["Mug", "Apple", "Tomato"][n % 3])).collect();
    let room =
        "room = \"kitchen\"\n[[thing]]\ntype = \"CounterTop\"\n[[thing]]\ntype = \"SinkBasin\"\n";
    let scene = format!("{room}{things}");
    Stage::Scene { scene, task: "place Mug SinkBasin".to_owned() }
}

/// Enough records for the largest answer to `records`.
///
/// - returns: the stream of the records.
fn record_much(client: &Client, reader: &Client) -> StreamKey {
    loop {
        client.start(large_stage()).unwrap();
        client.done().unwrap();
        let heads = reader.heads().unwrap();
        let longest = heads.iter().max_by_key(|head| head.seq).unwrap().stream;
        if reader.records(longest, Seq::FIRST).unwrap().more {
            return longest;
        }
    }
}

/// Milliseconds of the slowest of a hundred queries of a quiet lab.
fn p99_ms(client: &Client, asked: usize) -> f64 {
    let mut times: Vec<Duration> = (0..asked)
        .map(|_| {
            let start = Instant::now();
            client.status().unwrap();
            start.elapsed()
        })
        .collect();
    times.sort_unstable();
    times[asked * 99 / 100].as_secs_f64() * 1_000.0
}

#[test]
fn eight_connections_that_take_no_answer_cost_bounded_memory_and_nobody_elses_time() {
    let served = Served::start();
    let [gateway, auditor] = [Role::Gateway, Role::Auditor].map(|role| served.admit("loud", role));
    let quiet = served.connect(&served.admit("quiet", Role::Gateway), "ada");
    let (bob, reader) = (served.connect(&gateway, "bob"), served.connect(&auditor, "reader"));
    let stream = record_much(&bob, &reader);
    let alone_ms = p99_ms(&quiet, 200);

    let context = zmq::Context::new();
    let identity = served.identity(&auditor);
    let deaf: Vec<_> = (0..8).map(|_| deaf(&context, &served.locked, Some(&identity))).collect();
    let (before, mut most, mut times) = (served.memory_mb(), 0f64, Vec::new());
    let start = Instant::now();
    while served.is_flooded_since(start) {
        for socket in &deaf {
            for _ in 0..20 {
                let ask = ArchiveAsk::Sealed { stream, from: Seq::FIRST, limit: 256 };
                // A full queue is just as good: they must not run out of requests.
                let _ = socket.send(request("reader", Ask::Archive(ask)), zmq::DONTWAIT);
            }
        }
        times.push(p99_ms(&quiet, 100));
        most = most.max(served.memory_mb() - before);
    }
    times.sort_by(f64::total_cmp);
    let beside_ms = times[times.len() / 2];
    println!(
        "grew by {most:.0} MB in {FLOOD:?}; another lab's p99 {alone_ms:.2} ms alone, {beside_ms:.2} ms beside"
    );
    assert!(most <= GROWTH_MAX, "the process grew by {most:.0} MB");
    assert!(served.said().contains(DROPS), "drops are told of");
    // Clients of the same lab that read are answered, while the others still do not read.
    assert!(bob.status().unwrap().seq > 0);
    drop(deaf);
    // The space that was reserved for them is free again.
    assert!(reader.records(stream, Seq::FIRST).unwrap().more);
}

#[test]
fn an_endpoint_without_keys_is_bounded_in_the_same_way() {
    let served = Served::start();
    let ada = Client::connect(&served.open, user("ada")).unwrap();
    ada.start(large_stage()).unwrap();
    let context = zmq::Context::new();
    let deaf: Vec<_> = (0..8).map(|_| deaf(&context, &served.open, None)).collect();
    let (before, mut most) = (served.memory_mb(), 0f64);
    let start = Instant::now();
    while served.is_flooded_since(start) {
        for socket in &deaf {
            for query in [Query::Known, Query::Look] {
                let _ = socket
                    .send(request("ada", Ask::Person(PersonAsk::Query(query))), zmq::DONTWAIT);
            }
        }
        ada.hello().unwrap();
        most = most.max(served.memory_mb() - before);
    }
    println!("grew by {most:.0} MB in {FLOOD:?}");
    assert!(most <= GROWTH_MAX, "the process grew by {most:.0} MB");
    assert!(served.said().contains(DROPS), "drops are told of");
}

#[test]
fn a_subscriber_that_asks_for_everything_is_cut_off_and_the_others_follow_on() {
    let served = Served::start();
    let [gateway, good, bad] =
        [Role::Gateway, Role::Auditor, Role::Auditor].map(|role| served.admit("lab", role));
    let ada = served.connect(&gateway, "ada");
    let mut follower = Follower::sealed(served.connect(&good, "good"), Default::default());
    ada.start(large_stage()).unwrap();
    let client = served.connect(&bad, "bad");
    let end = Instant::now() + BOUND;
    let feed = loop {
        match client.feed().unwrap().sealed {
            Some(endpoint) => break endpoint,
            None => assert!(Instant::now() < end, "no feed within {BOUND:?}"),
        }
    };
    let hostile = zmq::Context::new().socket(zmq::XSUB).unwrap();
    hostile.set_linger(0).unwrap();
    hostile.set_sndhwm(0).unwrap();
    served.identity(&bad).put_on(&hostile).unwrap();
    hostile.connect(&feed).unwrap();
    let (before, mut most, mut asked) = (served.memory_mb(), 0f64, 0u64);
    let start = Instant::now();
    while start.elapsed() < FLOOD {
        for _ in 0..500 {
            asked += 1;
            let topic = [&[1], &asked.to_le_bytes()[..], &[7; 200]].concat();
            hostile.send(topic, zmq::DONTWAIT).unwrap();
        }
        most = most.max(served.memory_mb() - before);
        std::thread::yield_now();
    }
    println!("{asked} topics; grew by {most:.0} MB in {FLOOD:?}");
    assert!(asked as usize > 10 * TOPICS_MAX);
    assert!(most <= GROWTH_MAX, "the process grew by {most:.0} MB");
    assert!(served.said().contains("subscribed to too many topics"), "it is told of");
    // The others miss nothing.
    let last = ada.done().unwrap().last;
    let end = Instant::now() + BOUND;
    while !follower.positions().values().any(|position| position.seq >= last) {
        assert!(Instant::now() < end, "not everything within {BOUND:?}");
        follower.next(Duration::from_millis(200)).unwrap();
    }
}

/// A service of bells, and a gateway's key of a lab.
fn bells() -> (Service, CurveKey) {
    let service = Service::start(lab::config(Data::Memory)).unwrap();
    let key = lab::admit(&service, "lab", Role::Gateway);
    (service, key)
}

#[test]
fn a_key_has_so_many_connections_and_an_ended_one_makes_room() {
    let (service, key) = bells();
    let (context, identity) = (zmq::Context::new(), lab::identity(&service, &key));
    let connect = || {
        let socket = context.socket(zmq::DEALER).unwrap();
        socket.set_linger(0).unwrap();
        identity.put_on(&socket).unwrap();
        socket.connect(&service.curve_endpoints()[0]).unwrap();
        socket.send(request("ada", Ask::Service(ServiceAsk::Hello)), 0).unwrap();
        socket
    };
    let is_answered = |socket: &zmq::Socket, patience: Duration| {
        let answered = socket.poll(zmq::POLLIN, patience.as_millis() as i64).unwrap() == 1;
        if answered {
            let (_, response) = decode_response(&socket.recv_bytes(0).unwrap()).unwrap();
            assert!(matches!(response, Response::Hello(_)), "{response:?}");
        }
        answered
    };
    let mut sockets: Vec<_> = (0..KEY_CONNECTIONS_MAX).map(|_| connect()).collect();
    assert!(sockets.iter().all(|socket| is_answered(socket, BOUND)));
    let one_more = connect();
    let end = Instant::now() + BOUND;
    while service.counts().handshakes_crowded == 0 {
        assert!(Instant::now() < end, "it is counted");
        std::thread::yield_now();
    }
    assert!(!is_answered(&one_more, Duration::ZERO));
    // ZeroMQ tries again by itself.
    sockets.truncate(KEY_CONNECTIONS_MAX - 1);
    assert!(is_answered(&one_more, BOUND), "there is room again");
    for socket in &sockets {
        socket.send(request("ada", Ask::Service(ServiceAsk::Hello)), 0).unwrap();
        assert!(is_answered(socket, BOUND), "nobody else was cut off");
    }
}
