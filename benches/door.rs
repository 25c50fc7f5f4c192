//! How fast a durable answer comes through the socket. `cargo bench --bench door`
//!
//! The real household, a data directory on the disk of `target/`, and the recipe `default` or
//! another one: `cargo bench --bench door -- default-1`.

use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use apprentice::client::Client;
use apprentice::ids::UserId;
use apprentice::learning::Recipe;
use apprentice::service::{Config, Data, Service};
use apprentice::world::Stage;
use apprentice::world::household::Household;

/// Utterances of one episode, below `limits::EPISODE_UTTERANCES_MAX`.
const UTTERANCES: usize = 300;
const PEOPLE: usize = 16;

fn start(directory: &Path, awake_max: usize) -> Service {
    let data = Data::Directory(directory.to_owned());
    let mut config = Config::new(Arc::new(Household::new()), data);
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    config.awake_max = awake_max;
    if let Some(name) = std::env::args().skip(1).find(|argument| !argument.starts_with("--")) {
        let recipe = Recipe::builtin(&name).unwrap_or_else(|| panic!("no recipe is called {name}"));
        config.recipe_text = recipe.to_owned();
    }
    Service::start(config).expect("the service starts")
}

fn connect(service: &Service, name: &str) -> Client {
    let user = UserId::new(name).expect("a good name");
    Client::connect(service.endpoint().expect("it listens"), user).expect("it connects")
}

fn begin(client: &Client) {
    let stage = Stage::Task { task: "clean Mug CoffeeMachine".to_owned(), seed: 1 };
    client.start(stage).expect("an episode starts");
}

/// Says the same requests again and again; the robot goes to and fro.
fn talk(client: &Client, count: usize) -> Vec<Duration> {
    (0..count)
        .map(|index| {
            let place = if index % 2 == 0 { "mug" } else { "fridge" };
            let start = Instant::now();
            client.say(&format!("go to the {place}")).expect("an answer");
            start.elapsed()
        })
        .collect()
}

fn percentiles(what: &str, mut times: Vec<Duration>) {
    times.sort();
    let at = |percent: usize| times[(times.len() - 1) * percent / 100].as_secs_f64() * 1e3;
    println!(
        "{what}: p50 {:.2} ms, p90 {:.2} ms, p99 {:.2} ms ({} samples)",
        at(50),
        at(90),
        at(99),
        times.len()
    );
}

fn main() {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("door");
    let _ = std::fs::remove_dir_all(&directory);

    let launch = Instant::now();
    let service = start(&directory, 1_000);
    println!("start, base mind trained: {:.2} s", launch.elapsed().as_secs_f64());

    let one = connect(&service, "one");
    begin(&one);
    percentiles("durable answer, one person", talk(&one, UTTERANCES));
    let asked: Vec<Duration> = (0..UTTERANCES)
        .map(|_| {
            let start = Instant::now();
            one.status().expect("a status");
            start.elapsed()
        })
        .collect();
    percentiles("status, one person", asked);

    let people: Vec<Client> =
        (0..PEOPLE).map(|number| connect(&service, &format!("person {number}"))).collect();
    people.iter().for_each(begin);
    let all = Instant::now();
    let threads: Vec<_> =
        people.into_iter().map(|client| thread::spawn(move || talk(&client, UTTERANCES))).collect();
    let times: Vec<Duration> =
        threads.into_iter().flat_map(|thread| thread.join().expect("it talks")).collect();
    let per_second = times.len() as f64 / all.elapsed().as_secs_f64();
    println!("{PEOPLE} people: {per_second:.0} durable answers/s");
    percentiles("durable answer, one of many people", times);
    service.stop().expect("it stops");

    // Two people, and only one may be awake: each request wakes a user with about 300 utterances.
    let service = start(&directory, 1);
    let pair = [connect(&service, "person 0"), connect(&service, "person 1")];
    let woken: Vec<Duration> = (0..100)
        .map(|index| {
            let start = Instant::now();
            pair[index % 2].status().expect("a status");
            start.elapsed()
        })
        .collect();
    percentiles("waking a sleeper and answering", woken);
    service.stop().expect("it stops");
}
