//! What one lab's flood costs another lab. `cargo bench --bench fairness`
//!
//! Two labs in one service, on the disk of `target/`. The quiet lab says 20 utterances a second.
//! The flood sends a hundred times as many, without waiting for answers. Short periods with and
//! without the flood follow one another, so that both are measured on the same machine. One run has
//! a quota for the flooding lab. The other has none: then only the turns between labs limit it.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use apprentice::client::wire::{Request, decode_response, encode_request};
use apprentice::client::{Ask, Client, Command, CurveKey, PersonAsk, Response, fresh_id};
use apprentice::service::{Config, Data, Service};
use apprentice::tenancy::{Order, Quotas, Role};
use apprentice::world::Stage;
use apprentice::world::household::Household;
use apprentice_testkit::lab::{self, FREE_PORT};

/// Utterances a second of the quiet lab.
const QUIET: u64 = 20;
const TIMES: u64 = 100;
/// People of the flooding lab.
const CROWD: usize = 64;
/// How many times a period without the flood and one with it are measured.
const ROUNDS: usize = 10;
const STRETCH: Duration = Duration::from_secs(3);
/// Utterances of one episode.
const EPISODE: usize = 200;

fn person(number: usize) -> String {
    format!("person {number}")
}

fn stage() -> Stage {
    Stage::Task { task: "clean Mug CoffeeMachine".to_owned(), seed: 1 }
}

fn saying(index: usize) -> String {
    format!("go to the {}", if index.is_multiple_of(2) { "mug" } else { "fridge" })
}

fn start(directory: &Path) -> Service {
    let data = Data::Directory(directory.to_owned());
    let mut config = Config::new(Arc::new(Household::new()), data);
    config.listen_curve = vec![FREE_PORT.to_owned()];
    Service::start(config).expect("the service starts")
}

/// Sends at its full rate while it is switched on, and does not wait for answers.
struct Flood {
    on: AtomicBool,
    over: AtomicBool,
    sent: AtomicUsize,
    /// Replies, refusals for a quota, other refusals.
    heard: [AtomicUsize; 3],
}

impl Flood {
    fn run(&self, service: &Service, key: &CurveKey) {
        let socket = lab::socket(service, key, zmq::DEALER);
        socket.set_sndhwm(100_000).expect("an option");
        socket.connect(&service.curve_endpoints()[0]).expect("it connects");
        let (mut index, mut start, mut due) = (0, Instant::now(), 0);
        while !self.over.load(Ordering::Relaxed) {
            if !self.on.load(Ordering::Relaxed) {
                (start, due) = (Instant::now(), 0);
            }
            let wanted = start.elapsed().as_micros() as u64 * QUIET * TIMES / 1_000_000;
            while due < wanted {
                due += 1;
                let (user, turn) = (lab::user(&person(index % CROWD)), index / CROWD % EPISODE);
                let command = match turn {
                    0 => Command::Done,
                    1 => Command::StartEpisode { stage: stage() },
                    turn => Command::Say { utterance: saying(turn) },
                };
                index += 1;
                let ask = Ask::Person(PersonAsk::Command(command));
                let bytes = encode_request(&Request { id: fresh_id(), user, ask });
                if socket.send(bytes, zmq::DONTWAIT).is_ok() {
                    self.sent.fetch_add(1, Ordering::Relaxed);
                }
            }
            while let Ok(bytes) = socket.recv_bytes(zmq::DONTWAIT) {
                let kind = match decode_response(&bytes) {
                    Ok((_, Response::Reply(_))) => 0,
                    Ok((_, Response::QuotaExceeded(_))) => 1,
                    _ => 2,
                };
                self.heard[kind].fetch_add(1, Ordering::Relaxed);
            }
            thread::sleep(Duration::from_millis(1));
        }
    }
}

/// The quiet lab's person speaks at an even pace for one period.
fn talk(client: &Client, said: &mut usize, times: &mut Vec<Duration>) {
    let start = Instant::now();
    for turn in 0.. {
        let due = Duration::from_micros(turn * 1_000_000 / QUIET);
        if due >= STRETCH {
            return;
        }
        thread::sleep(due.saturating_sub(start.elapsed()));
        if said.is_multiple_of(EPISODE) {
            if *said > 0 {
                client.done().expect("the episode ends");
            }
            client.start(stage()).expect("an episode starts");
        }
        let asked = Instant::now();
        client.say(&saying(*said)).expect("an answer");
        times.push(asked.elapsed());
        *said += 1;
    }
}

fn percentile(times: &mut [Duration], percent: usize) -> f64 {
    times.sort();
    times[(times.len() - 1) * percent / 100].as_secs_f64() * 1e3
}

fn measure(service: &Service, name: &str, quotas: Quotas) {
    let (quiet, flood) = (format!("quiet-{name}"), format!("flood-{name}"));
    let [quiet_key, flood_key, key] =
        [&quiet, &flood, &flood].map(|lab| lab::admit(service, lab, Role::Gateway));
    for number in 0..CROWD {
        let client = lab::connect(service, &flood_key, &person(number));
        client.start(stage()).expect("an episode starts");
    }
    lab::order(service, &flood, Order::SetQuotas(quotas));
    let state = Flood {
        on: AtomicBool::new(false),
        over: AtomicBool::new(false),
        sent: AtomicUsize::new(0),
        heard: Default::default(),
    };
    let client = lab::connect(service, &quiet_key, &person(0));
    let (mut said, mut alone, mut beside) = (0, Vec::new(), Vec::new());
    talk(&client, &mut said, &mut Vec::new());
    thread::scope(|scope| {
        scope.spawn(|| state.run(service, &key));
        for _ in 0..ROUNDS {
            talk(&client, &mut said, &mut alone);
            state.on.store(true, Ordering::Relaxed);
            talk(&client, &mut said, &mut beside);
            state.on.store(false, Ordering::Relaxed);
            // What the flood has left in queues belongs to its period.
            talk(&client, &mut said, &mut Vec::new());
        }
        state.over.store(true, Ordering::Relaxed);
    });
    let seconds = (ROUNDS as f64) * STRETCH.as_secs_f64();
    let count = |count: &AtomicUsize| count.load(Ordering::Relaxed) as f64 / seconds;
    let [replies, over, other] = state.heard.each_ref().map(count);
    println!(
        "{name}: the flood sends {:.0}/s, of which {replies:.0}/s are answered, {over:.0}/s are \
         over a quota, {other:.0}/s refused otherwise",
        count(&state.sent)
    );
    for percent in [50, 90, 99] {
        let (quiet, flooded) = (percentile(&mut alone, percent), percentile(&mut beside, percent));
        println!(
            "{name}: the quiet lab's p{percent} is {quiet:.2} ms alone and {flooded:.2} ms beside \
             the flood: {:.2} times ({} samples each)",
            flooded / quiet,
            alone.len()
        );
    }
}

fn main() {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fairness");
    let _ = std::fs::remove_dir_all(&directory);
    let service = start(&directory);
    let quotas = Quotas {
        utterances_per_second: Some(2 * QUIET as u32),
        burst: Some(2 * QUIET as u32),
        in_flight: Some(64),
        ..Quotas::default()
    };
    measure(&service, "with-quotas", quotas);
    measure(&service, "without-quotas", Quotas::default());
    service.stop().expect("it stops");
}
