//! A hundred recorded sentences go through the whole system: TCP, the person's actor, the parser,
//! the log, and back. Prints the share that was understood. Needs the shared data folder; without
//! it the test is skipped with a message.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::sync::Arc;

use apprentice::client::{Client, Told};
use apprentice::ids::UserId;
use apprentice::language::{Outcome, Step};
use apprentice::service::{Config, Data, Service};
use apprentice::world::Stage;
use apprentice::world::household::Household;
use serde::Deserialize;

/// For each of PICKUP, PUT and TOGGLE; a hundred in all.
const SENTENCES: [(&str, usize); 3] = [("PICKUP", 40), ("PUT", 40), ("TOGGLE", 20)];

#[derive(Deserialize)]
struct Row {
    u: String,
    prims: Option<Vec<String>>,
    suspect: Option<bool>,
}

/// Sentences that mean one primitive alone, from every seventh line.
fn sentences(path: &Path) -> Vec<(String, Step)> {
    let file = std::fs::File::open(path).unwrap();
    let mut wanted: BTreeMap<&str, usize> = SENTENCES.into();
    let mut found = Vec::new();
    for line in BufReader::new(flate2::read::GzDecoder::new(file)).lines().step_by(7) {
        let row: Row = serde_json::from_str(&line.unwrap()).unwrap();
        let Some([only]) = row.prims.as_deref() else { continue };
        let step: Step = only.parse().unwrap();
        let Some(left) = wanted.get_mut(step.operator.as_str()) else { continue };
        if *left > 0 && row.suspect != Some(true) {
            *left -= 1;
            found.push((row.u, step));
        }
    }
    found
}

/// A scene file in which the step can run: the thing is on a table or in the hand, and the robot is
/// next to it.
fn scene(step: &Step, sentence: &str) -> String {
    let entry = |kind: &str, more: &str| format!("[[thing]]\ntype = \"{kind}\"\n{more}\n");
    let name = |index: usize| step.args[index].as_str();
    let (head, things) = match step.operator.as_str() {
        "PICKUP" => (
            "stands_at = \"DiningTable\"".to_owned(),
            entry("DiningTable", "") + &entry(name(0), "on = \"DiningTable\""),
        ),
        "PUT" => (
            format!("stands_at = \"{}\"\nholds = \"{}\"", name(1), name(0)),
            entry(name(1), "") + &entry(name(0), ""),
        ),
        _ => {
            let on = if sentence.contains("off") { "states = [\"on\"]" } else { "" };
            (format!("stands_at = \"{}\"", name(0)), entry(name(0), on))
        }
    };
    format!("room = \"kitchen\"\n{head}\n{things}")
}

#[test]
fn a_hundred_recorded_sentences_go_through_the_real_socket() {
    let data = apprentice_testkit::paths::root().join("../shared/data");
    let path = data.join("alfred_utterances.jsonl.gz");
    if !path.exists() {
        println!("skipped: there are no recorded sentences at {}", path.display());
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let store = Data::Directory(folder.path().join("data"));
    let mut config = Config::new(Arc::new(Household::new()), store);
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    let service = Service::start(config).unwrap();
    let endpoint = service.endpoint().unwrap().to_owned();

    let sentences = sentences(&path);
    assert_eq!(sentences.len(), 100);
    let mut counts: BTreeMap<&str, u32> = BTreeMap::new();
    for (number, (sentence, step)) in sentences.iter().enumerate() {
        let user = UserId::new(&format!("person {number}")).unwrap();
        let robot = Client::connect(&endpoint, user).unwrap();
        let scene = scene(step, sentence);
        if let Err(error) = robot.start(Stage::Scene { scene: scene.clone(), task: "free".into() })
        {
            panic!("{step}: {error}\n{scene}");
        }
        let reply = robot.say(sentence).unwrap();
        let Some(Told::Answered { answer, .. }) = reply.told.first() else { panic!("{reply:?}") };
        let verdict = match &answer.outcome {
            Outcome::Understood { program, .. } => {
                let acts = |s: &&Step| !["GOTO", "OPEN", "CLOSE"].contains(&s.operator.as_str());
                let done: Vec<&Step> = program.steps.iter().filter(acts).collect();
                if done == [step] { "understood" } else { "misunderstood" }
            }
            Outcome::Impossible { .. } => "impossible",
            Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => "not sure",
        };
        *counts.entry(verdict).or_default() += 1;
    }
    service.stop().unwrap();
    println!("of 100 recorded sentences through the socket: {counts:?}");
    let of = |verdict| counts.get(verdict).copied().unwrap_or(0);
    assert!(of("understood") >= 95, "{counts:?}");
    assert!(of("misunderstood") <= 2, "{counts:?}");
}
