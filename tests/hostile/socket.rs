//! The endpoint, through a real socket.

use std::time::{Duration, Instant};

use apprentice::client::wire::{Request, decode_response, encode_request};
use apprentice::client::{Ask, Client, Command, PersonAsk, Response, ServiceAsk, fresh_id};
use apprentice::ids::{RequestId, UserId};
use apprentice::limits::FRAME_BYTES_MAX;
use apprentice::service::{Data, Service};
use apprentice::world::Stage;

use crate::mutate::mutate;
use crate::targets;
use apprentice_testkit::dice::Dice;
use apprentice_testkit::toy;

/// Messages that are sent before the test waits for the answers to all of them.
const WINDOW: usize = 50;
/// Memory that the service may take for all messages, beyond that at its start.
const MEMORY_MAX: u64 = 256 * 1024 * 1024;

#[derive(Debug, Default)]
struct Counts {
    mutated: usize,
    nested: usize,
    random: usize,
    frames: usize,
    long: usize,
    cut_off: usize,
    errors: usize,
    replies: usize,
    busy: usize,
}

struct Peer<'s> {
    service: &'s Service,
    socket: zmq::Socket,
}

impl Peer<'_> {
    fn new(service: &Service) -> Peer<'_> {
        let socket = zmq::Context::new().socket(zmq::DEALER).unwrap();
        socket.set_linger(0).unwrap();
        socket.connect(service.endpoint().unwrap()).unwrap();
        Peer { service, socket }
    }

    fn send(&self, frames: &[Vec<u8>]) {
        self.socket.send_multipart(frames, 0).unwrap();
    }

    /// Sends `hello`, and reads every answer up to the one to it.
    fn settle(&self, counts: &mut Counts) {
        let id = fresh_id();
        let user = UserId::new("mallory").unwrap();
        self.send(&[encode_request(&Request { id, user, ask: Ask::Service(ServiceAsk::Hello) })]);
        loop {
            let ready = self.socket.poll(zmq::POLLIN, 60_000).unwrap();
            assert_eq!(ready, 1, "no answer within a minute; {:?}", self.service.counts());
            let frames = self.socket.recv_multipart(0).unwrap();
            assert_eq!(frames.len(), 1);
            let (found, response) = decode_response(&frames[0]).unwrap();
            match response {
                Response::Hello(_) if found == id => return,
                Response::Error(_) | Response::Rejected(_) => counts.errors += 1,
                Response::Busy(_) | Response::QuotaExceeded(_) => counts.busy += 1,
                _ => counts.replies += 1,
            }
        }
    }
}

fn high_water() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() * 1024
}

pub fn run(messages: usize, seed: u64) {
    let mut config = toy::config(Data::Memory);
    config.domain = std::sync::Arc::new(toy::Bells::sturdy());
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    let service = Service::start(config).unwrap();
    let before = high_water();
    let (mut dice, mut counts) = (Dice::new(seed), Counts::default());
    let corpus = targets::requests();
    let mut peer = Peer::new(&service);
    let mut sent = 0;
    for message in 0..messages {
        match dice.below(100) {
            // The server disconnects. What else was on its way is lost with the connection.
            0 if counts.cut_off < 20 => {
                peer.settle(&mut counts);
                sent += 1;
                let huge = Peer::new(&service);
                huge.send(&[vec![b'x'; 2 * FRAME_BYTES_MAX + 1 + dice.below(FRAME_BYTES_MAX)]]);
                counts.cut_off += 1;
                // Each comes from a new address, as after a new connection.
                peer = Peer::new(&service);
                continue;
            }
            0..4 => {
                let mut long = encode_request(&Request {
                    id: RequestId([1; 16]),
                    user: UserId::new("mallory").unwrap(),
                    ask: Ask::Person(PersonAsk::Command(Command::Say {
                        utterance: "x".repeat(FRAME_BYTES_MAX),
                    })),
                });
                long.resize(FRAME_BYTES_MAX + dice.below(FRAME_BYTES_MAX), b'x');
                peer.send(&[long]);
                counts.long += 1;
            }
            4..14 => {
                let count = [0, 2, 3, 4, 5, 17, 1_000][dice.below(7)];
                let frame = |dice: &mut Dice| match dice.below(3) {
                    0 => Vec::new(),
                    1 => mutate(dice, &corpus),
                    _ => corpus[dice.below(corpus.len())].clone(),
                };
                let mut frames: Vec<Vec<u8>> = vec![Vec::new()];
                frames.extend((0..count).map(|_| frame(&mut dice)));
                peer.send(&frames);
                counts.frames += 1;
            }
            14..24 => {
                let bytes = (0..dice.below(4_000)).map(|_| dice.below(256) as u8).collect();
                peer.send(&[bytes]);
                counts.random += 1;
            }
            24..34 => {
                let nest: &[u8] =
                    [&b"\x91"[..], b"\x81\xa1v", b"\xdd\x00\x00\x00\x01"][dice.below(3)];
                let mut bytes = corpus[dice.below(corpus.len())].clone();
                let place = dice.below(bytes.len() + 1);
                let nested = nest.repeat(1 + dice.below(50_000));
                bytes.splice(place..place, nested);
                bytes.truncate(FRAME_BYTES_MAX);
                peer.send(&[bytes]);
                counts.nested += 1;
            }
            _ => {
                peer.send(&[mutate(&mut dice, &corpus)]);
                counts.mutated += 1;
            }
        }
        if message % WINDOW == WINDOW - 1 {
            peer.settle(&mut counts);
            sent += 1;
        }
    }
    peer.settle(&mut counts);
    sent += 1;
    // Every message was answered, or dropped and counted. A message that woke a user may be
    // answered after the last question to the endpoint.
    let whole = messages - counts.cut_off + sent;
    let end = Instant::now() + Duration::from_secs(60);
    let seen = loop {
        let seen = service.counts();
        if (seen.answered + seen.undelivered + seen.dropped) as usize == whole {
            break seen;
        }
        assert!(Instant::now() < end, "of {whole} messages: {counts:?}; the door: {seen:?}");
        std::thread::sleep(Duration::from_millis(5));
    };
    println!("{counts:?}; the door: {seen:?}");
    assert_eq!(seen.received as usize, whole);
    for (kind, count) in [
        ("mutated", counts.mutated),
        ("nested", counts.nested),
        ("random", counts.random),
        ("of many frames", counts.frames),
        ("too long", counts.long),
        ("cut off", counts.cut_off),
        ("answered with an error", counts.errors),
        ("dropped", seen.dropped as usize),
    ] {
        assert!(count > 0 || messages < 10_000, "no message was {kind}");
    }
    // And it still serves.
    let grace =
        Client::connect(service.endpoint().unwrap(), UserId::new("grace").unwrap()).unwrap();
    let grace = grace.with_patience(Duration::from_secs(30));
    grace.start(Stage::Task { task: "Brass Glass".to_owned(), seed: 1 }).unwrap();
    grace.say("ring the brass bell").unwrap();
    assert_eq!(service.failed(), None);
    let grown = high_water().saturating_sub(before);
    println!("memory: {} MB more at most", grown / 1024 / 1024);
    assert!(grown < MEMORY_MAX, "{grown} bytes");
    service.stop().unwrap();
}
