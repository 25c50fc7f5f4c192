//! The service with a fault plan, run by a supervisor as an operator would run it, and stopped in
//! order.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{self, Child, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread;
use std::time::Duration;

use apprentice::client::{Client, ClientError, Command, ErrorCode, fresh_id};
use apprentice::events::EventKind;
use apprentice::ids::{Seq, TenantId, UserId};
use apprentice::session::{self};
use apprentice::store::{self, FaultPlan};
use apprentice::world::Stage;

const PEOPLE: [&str; 3] = ["ada", "grace", "edsger"];
const SAYINGS: usize = 40;
/// Each process ends after about thirty appends.
const PLAN: &str = "\
seed = 3
refused = 40
held_answers = 60
held_appends = 60
release_every_ms = 20
crashes_after = 15
crashes_before = 15
";

fn serve(data: &Path, endpoint: &str, plan: Option<&Path>) -> Child {
    let mut command = process::Command::new(env!("CARGO_BIN_EXE_apprentice"));
    command.args(["serve", "--log-filter", "off", "--zmq", endpoint]);
    command.arg("--data").arg(data);
    if let Some(plan) = plan {
        command.arg("--fault-plan").arg(plan);
    }
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits until the service says that it serves.
fn ready(service: &mut Child) {
    let mut line = String::new();
    BufReader::new(service.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
    assert!(line.starts_with("serving at "), "{line:?}");
}

/// Asks with one request id until there is an answer, even if the process dies meanwhile.
fn insist(client: &Client, command: &Command) {
    let id = fresh_id();
    for _ in 0..400 {
        match client.command_again(id, command.clone()) {
            Ok(_) => return,
            Err(ClientError::Failed { code: ErrorCode::Unavailable, .. }) => {
                thread::park_timeout(Duration::from_millis(20));
            }
            Err(ClientError::NoAnswer { .. } | ClientError::Busy { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
    panic!("{command:?} got no answer");
}

#[test]
fn on_a_bad_day_everybody_is_answered_and_nothing_is_there_twice() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let endpoint = format!("ipc://{}", folder.path().join("socket").display());
    let plan = folder.path().join("plan.toml");
    std::fs::write(&plan, PLAN).unwrap();
    let (over, ends) = (AtomicBool::new(false), AtomicU32::new(0));
    thread::scope(|scope| {
        let supervisor = scope.spawn(|| {
            while !over.load(Ordering::SeqCst) {
                let mut service = serve(&data, &endpoint, Some(&plan));
                let mut err = BufReader::new(service.stderr.take().unwrap());
                let mut first = String::new();
                err.read_line(&mut first).unwrap();
                err.read_line(&mut first).unwrap();
                assert!(first.contains("FAULT DRILL"), "a drill is loud: {first}");
                loop {
                    if let Some(status) = service.try_wait().unwrap() {
                        assert_eq!(status.code(), Some(1), "a planned crash is no panic");
                        ends.fetch_add(1, Ordering::SeqCst);
                        break;
                    }
                    if over.load(Ordering::SeqCst) {
                        service.kill().unwrap();
                        service.wait().unwrap();
                        break;
                    }
                    thread::yield_now();
                    thread::park_timeout(Duration::from_millis(5));
                }
            }
        });
        let talks: Vec<_> = PEOPLE
            .map(|person| {
                let endpoint = &endpoint;
                scope.spawn(move || {
                    let client = Client::connect(endpoint, UserId::new(person).unwrap()).unwrap();
                    let client = client.with_patience(Duration::from_millis(500));
                    let stage = Stage::Task { task: "free kitchen".to_owned(), seed: 1 };
                    insist(&client, &Command::StartEpisode { stage });
                    for saying in 0..SAYINGS {
                        let utterance = format!("{person} says {saying}");
                        insist(&client, &Command::Say { utterance });
                    }
                })
            })
            .into_iter()
            .map(thread::ScopedJoinHandle::join)
            .collect();
        over.store(true, Ordering::SeqCst);
        supervisor.thread().unpark();
        talks.into_iter().for_each(|talk| talk.unwrap());
    });
    let ends = ends.into_inner();
    println!("{ends} planned crashes");
    assert!(ends > 0, "the plan let the process crash");
    let store = store::open(&data).unwrap();
    for person in PEOPLE {
        let stream = store.keys.stream_id(&TenantId::local(), &UserId::new(person).unwrap());
        let records = store.log.read(&stream.unwrap(), Seq::FIRST).unwrap();
        let records: Vec<_> = records.map(Result::unwrap).collect();
        let said: Vec<String> = records
            .iter()
            .filter(|record| record.event.kind() == EventKind::Interpreted)
            .map(|record| session::reply_of(std::slice::from_ref(record)))
            .map(|reply| match &reply.told[0] {
                session::Told::Answered { utterance, .. } => utterance.clone(),
                other => panic!("{other:?}"),
            })
            .collect();
        let wanted: Vec<String> = (0..SAYINGS).map(|n| format!("{person} says {n}")).collect();
        assert_eq!(said, wanted, "each utterance once, in order");
    }
}

#[test]
fn the_plan_that_ships_is_one() {
    let plan = apprentice_testkit::paths::root().join("deploy/drills/bad-day.toml");
    assert!(FaultPlan::read(&plan).unwrap().crashes_after > 0);
}

#[test]
fn a_plan_that_cannot_be_read_is_one_sentence_and_code_2() {
    let folder = tempfile::tempdir().unwrap();
    let plan = folder.path().join("plan.toml");
    std::fs::write(&plan, "refuses = 3\n").unwrap();
    let data = folder.path().join("data");
    let output = serve(&data, "tcp://127.0.0.1:0", Some(&plan)).wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{err}");
    assert!(err.contains("refuses") && !data.exists(), "{err}");
}

#[test]
fn a_signal_ends_the_service_in_order() {
    for signal in ["TERM", "INT"] {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("data");
        let endpoint = format!("ipc://{}", folder.path().join("socket").display());
        let mut service = serve(&data, &endpoint, None);
        ready(&mut service);
        let client = Client::connect(&endpoint, UserId::new("ada").unwrap()).unwrap();
        client.start(Stage::Task { task: "free kitchen".to_owned(), seed: 1 }).unwrap();
        let id = service.id().to_string();
        assert!(
            process::Command::new("kill").args(["-s", signal, &id]).status().unwrap().success()
        );
        assert_eq!(service.wait().unwrap().code(), Some(0), "{signal}");
        store::open(&data).unwrap();
    }
}
