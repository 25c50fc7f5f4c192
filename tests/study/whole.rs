//! Whole studies by the real program, through real sockets, killed and continued. Every table is
//! compared with the event log.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use apprentice::events::{Ending, Event, Record};
use apprentice::ids::{Seq, TenantId, UserId};
use apprentice::language::Outcome;
use apprentice::store;
use serde_json::{Value, json};
use tempfile::TempDir;

const BINARY: &str = env!("CARGO_BIN_EXE_apprentice");
const TABLES: [&str; 5] =
    ["utterances.csv", "episodes.csv", "summary.csv", "answered.csv", "study.toml"];
const SEEDS: usize = 44;

fn study(out: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(BINARY);
    command.args(["study", "run", "--out"]).arg(out).args(arguments);
    command
}

fn run(out: &Path, arguments: &[&str]) -> Output {
    study(out, arguments).output().unwrap()
}

fn run_well(out: &Path, arguments: &[&str]) -> Output {
    let output = run(out, arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

fn refused(out: &Path, arguments: &[&str], code: i32, expected: &[&str]) {
    let output = run(out, arguments);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
    for part in expected {
        assert!(errors.contains(part), "{part:?} is missing in: {errors}");
    }
    assert_eq!(errors.trim_end().lines().count(), 1, "{errors}");
}

/// Two users for each of two types, two episodes, two conditions.
const SMALL: [&str; 10] = [
    "--conditions",
    "tiny,default",
    "--users-per-type",
    "2",
    "--task-types",
    "cool,place",
    "--episodes",
    "2",
    "--seed",
    "3",
];

fn bytes(out: &Path) -> Vec<(&'static str, String)> {
    TABLES.map(|name| (name, fs::read_to_string(out.join(name)).unwrap())).to_vec()
}

/// A table as maps from column to value; fields with commas are quoted.
fn table(out: &Path, name: &str) -> Vec<BTreeMap<String, String>> {
    let text = fs::read_to_string(out.join(name)).unwrap();
    let mut lines = text.lines().map(|line| {
        let (mut fields, mut field, mut quoted) = (Vec::new(), String::new(), false);
        for c in line.chars() {
            match c {
                '"' => quoted = !quoted,
                ',' if !quoted => fields.push(std::mem::take(&mut field)),
                c => field.push(c),
            }
        }
        fields.push(field);
        fields
    });
    let head = lines.next().unwrap();
    let rows = lines.map(|fields| {
        assert_eq!(fields.len(), head.len(), "{name}: {fields:?}");
        head.iter().cloned().zip(fields).collect()
    });
    rows.collect()
}

fn records(out: &Path, condition: &str, user: &str) -> Vec<Record> {
    let copy = store::copy_private(&out.join("data").join(condition)).unwrap();
    let store = copy.open().unwrap();
    let user = UserId::new(user).unwrap();
    let stream = store.keys.stream_id(&TenantId::local(), &user).unwrap();
    store.log.read(&stream, Seq::FIRST).unwrap().collect::<Result<_, _>>().unwrap()
}

/// What the log alone says about one episode.
#[derive(Default, Clone)]
struct Counted {
    goal: String,
    fewest: u32,
    said: Vec<(u64, String, &'static str, usize, String)>,
    taught: BTreeSet<u64>,
    examples: usize,
    achieved: bool,
}

fn count(records: &[Record]) -> Vec<Counted> {
    let mut episodes: Vec<Counted> = Vec::new();
    let mut lessons = BTreeSet::new();
    for record in records {
        match &record.event {
            Event::EpisodeStarted(event) => episodes.push(Counted {
                goal: event.goal.clone(),
                fewest: event.fewest.unwrap_or(0),
                examples: SEEDS + lessons.len(),
                ..Counted::default()
            }),
            Event::Interpreted(event) => {
                let (outcome, done) = match &event.answer.outcome {
                    Outcome::Understood { program, .. } => ("understood", program.steps.len()),
                    Outcome::Impossible { .. } => ("impossible", 0),
                    Outcome::NotSure => ("not_sure", 0),
                    Outcome::Asked { .. } => ("asked", 0),
                    Outcome::Told { .. } => ("told", 0),
                };
                let program = match &event.answer.outcome {
                    Outcome::Understood { program, .. } => program.to_string(),
                    _ => String::new(),
                };
                let said = event.utterance.to_string();
                let episode = episodes.last_mut().unwrap();
                episode.said.push((record.seq.get(), said, outcome, done, program));
            }
            Event::EpisodeEnded(event) => {
                episodes.last_mut().unwrap().achieved = event.ending == Ending::Achieved;
            }
            Event::DecompositionTaught(event) => {
                lessons.insert((event.utterance.to_string(), event.program.to_string()));
                let episode = episodes.last_mut().unwrap();
                episode.taught.insert(event.explains.get());
                episode.examples = SEEDS + lessons.len();
            }
            _ => {}
        }
    }
    episodes
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} of {row:?}"))
}

fn close(row: &BTreeMap<String, String>, column: &str, expected: f64) {
    let found = number(row, column);
    assert!((found - expected).abs() <= 0.000_051, "{column} is {found}, not {expected}: {row:?}");
}

/// Compares every row of the first two tables with the log.
///
/// - `enough`: people with fewer episodes are summed separately.
fn check_against_the_log(out: &Path, enough: usize) {
    let utterances = table(out, "utterances.csv");
    let episodes = table(out, "episodes.csv");
    let mut seen = 0;
    let lives: BTreeSet<(String, String)> =
        episodes.iter().map(|row| (row["condition"].clone(), row["user"].clone())).collect();
    for (condition, user) in &lives {
        let of = |row: &&BTreeMap<String, String>| {
            row["condition"] == *condition && row["user"] == *user
        };
        let counted = count(&records(out, condition, user));
        assert_eq!(episodes.iter().filter(of).count(), counted.len(), "{condition} {user}");
        for (index, counted) in counted.iter().enumerate() {
            let in_it = |row: &&BTreeMap<String, String>| {
                of(row) && row["episode"] == (index + 1).to_string()
            };
            let rows: Vec<_> = utterances.iter().filter(in_it).collect();
            assert_eq!(rows.len(), counted.said.len());
            seen += rows.len();
            for (turn, (row, said)) in rows.iter().zip(&counted.said).enumerate() {
                let (seq, utterance, outcome, done, program) = said;
                assert_eq!(row["turn"], (turn + 1).to_string());
                assert_eq!(row["utterance"], *utterance);
                assert_eq!(row["outcome"], *outcome);
                assert_eq!(row["primitives"], done.to_string());
                assert_eq!(row["taught"] == "1", counted.taught.contains(seq), "{row:?}");
                assert_eq!(row["right"].is_empty(), *outcome != "understood", "{row:?}");
                assert_eq!(row["answered_by"].is_empty(), *outcome == "not_sure", "{row:?}");
                // An answer with exactly the meant program is right.
                if row["meant"] == *program {
                    assert_eq!(row["right"], "1", "{row:?}");
                }
            }
            let row = episodes.iter().find(in_it).unwrap();
            let outcome = |name: &str| counted.said.iter().filter(|said| said.2 == name).count();
            let wrong = rows.iter().filter(|row| row["right"] == "0").count();
            let primitives: usize = counted.said.iter().map(|said| said.3).sum();
            assert_eq!(row["goal"], counted.goal);
            for (column, expected) in [
                ("utterances", counted.said.len()),
                ("understood", outcome("understood")),
                ("not_sure", outcome("not_sure")),
                ("impossible", outcome("impossible")),
                ("wrong", wrong),
                ("primitives", primitives),
                ("examples_taught", counted.examples),
                ("finished", usize::from(counted.achieved)),
            ] {
                assert_eq!(row[column], expected.to_string(), "{column}: {row:?}");
            }
            if counted.fewest > 0 {
                assert_eq!(row["fewest_actions"], counted.fewest.to_string());
            }
            let said = counted.said.len() as f64;
            close(row, "normalised_length", said / number(row, "fewest_actions"));
            close(row, "complexity", primitives as f64 / said);
        }
    }
    assert_eq!(seen, utterances.len());
    check_sums(out, enough, &utterances, &episodes);
}

/// Compares the last two tables with the first two.
fn check_sums(
    out: &Path,
    enough: usize,
    utterances: &[BTreeMap<String, String>],
    episodes: &[BTreeMap<String, String>],
) {
    let summary = table(out, "summary.csv");
    let lived = |e: &BTreeMap<String, String>| {
        let same = |o: &&BTreeMap<String, String>| {
            o["condition"] == e["condition"] && o["user"] == e["user"]
        };
        episodes.iter().filter(same).count()
    };
    for row in &summary {
        let apart = row["task_type"] == "under_5_episodes";
        let of_type = |e: &&BTreeMap<String, String>| {
            e["condition"] == row["condition"]
                && e["episode"] == row["episode"]
                && (lived(e) < enough) == apart
                && (apart || row["task_type"] == "all" || e["task_type"] == row["task_type"])
        };
        let value = |e: &BTreeMap<String, String>| match row["measure"].as_str() {
            "wrong_rate" => Some(number(e, "wrong") / number(e, "utterances")),
            "not_sure_rate" => Some(number(e, "not_sure") / number(e, "utterances")),
            "complexity" => Some(number(e, "primitives") / number(e, "utterances")),
            "normalised_length" => Some(number(e, "utterances") / number(e, "fewest_actions")),
            "examples_taught" => Some(number(e, "examples_taught")),
            _ => None,
        };
        let values: Vec<f64> = episodes.iter().filter(of_type).filter_map(value).collect();
        if value(&episodes[0]).is_none() {
            continue;
        }
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
        assert_eq!(row["users"], values.len().to_string(), "{row:?}");
        close(row, "mean", mean);
        match values.len() {
            1 => assert_eq!(row["sd"], ""),
            n => close(row, "sd", (squares / (n - 1) as f64).sqrt()),
        }
    }
    for row in table(out, "answered.csv") {
        let parses = |same: bool| {
            let in_condition = utterances.iter().filter(|u| u["condition"] == row["condition"]);
            let by = in_condition.filter(|u| match same {
                true => u["answered_by"] == row["answered_by"],
                false => !u["answered_by"].is_empty(),
            });
            by.count()
        };
        assert_eq!(row["parses"], parses(true).to_string());
        close(&row, "share", parses(true) as f64 / parses(false) as f64);
    }
}

fn lines(folder: &Path) -> usize {
    let Ok(entries) = fs::read_dir(folder) else { return 0 };
    let count = |path: &Path| match path.is_dir() {
        true => lines(path),
        false => fs::read_to_string(path).map_or(0, |text| text.lines().count()),
    };
    entries.map(|entry| count(&entry.unwrap().path())).sum()
}

#[test]
fn a_study_is_the_same_whoever_works_at_it_and_however_often_it_is_killed() {
    let dir = TempDir::new().unwrap();
    let (one, three, killed) =
        (dir.path().join("one"), dir.path().join("three"), dir.path().join("killed"));
    let first = run_well(&one, &[&SMALL[..], &["--workers", "1", "--json"]].concat());
    let report: Value = serde_json::from_slice(&first.stdout).unwrap();
    assert_eq!(report["simulated"], true);
    assert_eq!(report["episodes"], 16);
    let errors = String::from_utf8(first.stderr).unwrap();
    assert!(errors.contains("16 episodes, 0 of them from an earlier run"), "{errors}");
    assert!(errors.contains("s of processor time"), "{errors}");
    check_against_the_log(&one, 0);
    let expected = bytes(&one);
    assert!(expected[4].1.contains("simulated = true"));

    run_well(&three, &[&SMALL[..], &["--workers", "3"]].concat());
    assert_eq!(bytes(&three), expected);

    let arguments = [&SMALL[..], &["--workers", "2"]].concat();
    for wanted in [1, 5, 11] {
        let mut command = study(&killed, &arguments);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let end = Instant::now() + Duration::from_secs(120);
        while lines(&killed.join("journal")) < wanted && child.try_wait().unwrap().is_none() {
            assert!(Instant::now() < end, "{wanted} episodes take too long");
            thread::sleep(Duration::from_millis(2));
        }
        let _ = child.kill();
        child.wait().unwrap();
    }
    assert!(lines(&killed.join("journal")) < 16, "it was never killed half-way");
    run_well(&killed, &arguments);
    assert_eq!(bytes(&killed), expected);
    // Once more: nothing is left to do.
    let again = run_well(&killed, &arguments);
    let errors = String::from_utf8(again.stderr).unwrap();
    assert!(errors.contains("16 episodes, 16 of them from an earlier run"), "{errors}");
    assert_eq!(bytes(&killed), expected);
}

#[test]
fn the_second_teacher_that_ships_is_chosen_by_name() {
    let dir = TempDir::new().unwrap();
    let small =
        ["--conditions", "grammar", "--users", "1", "--task-types", "place", "--episodes", "1"];
    let [first, second] = ["teacher", "teacher-2"].map(|name| {
        let out = dir.path().join(name);
        run_well(&out, &[&small[..], &["--teacher", name]].concat());
        assert!(fs::read_to_string(out.join("utterances.csv")).unwrap().lines().count() > 1);
        fs::read_to_string(out.join("study.toml")).unwrap()
    });
    assert_ne!(first, second, "study.toml names another teacher");
}

#[test]
fn a_study_that_makes_no_sense_is_refused_in_a_sentence() {
    let dir = TempDir::new().unwrap();
    let out = dir.path().join("study");
    let check = |arguments: &[&str], expected: &[&str]| {
        refused(&out, arguments, 2, expected);
        assert!(!out.exists(), "{arguments:?} left something behind");
    };
    check(&["--conditions", "papper"], &["papper", "default-1, default-2, paper, grammar"]);
    check(&["--conditions", "paper,paper"], &["paper twice"]);
    check(&["--task-types", "cool,bake"], &["\"bake\"", "look, place, nested, two, clean"]);
    check(&["--teacher", "no/such/file"], &["no/such/file cannot be used"]);
    check(&["--corpus", "no/such/file"], &["no/such/file cannot be read"]);

    let small =
        ["--conditions", "grammar", "--users", "1", "--task-types", "place", "--episodes", "1"];
    let other = dir.path().join("other");
    fs::create_dir(&other).unwrap();
    fs::write(other.join("notes"), "mine").unwrap();
    refused(&other, &small, 2, &["holds other files"]);
    run_well(&out, &small);
    let with = |more: &[&'static str]| [&small[..], more].concat();
    refused(&out, &with(&["--seed", "9"]), 2, &["seed = 1", "seed = 9", "another study"]);
    // A service that cannot work: the command says what is finished and how to continue.
    fs::remove_dir_all(out.join("journal")).unwrap();
    fs::remove_dir_all(out.join("data")).unwrap();
    fs::write(out.join("data"), "no directory").unwrap();
    refused(&out, &small, 2, &["0 of 1 episodes are finished", "run the same command again"]);
    fs::remove_file(out.join("data")).unwrap();
    let before = bytes(&out);
    run_well(&out, &small);
    assert_eq!(bytes(&out), before);
}

/// Our own sentences in the format of a corpus.
fn corpus_lines() -> Vec<String> {
    let row = |task: &str, step: usize, user: &str, act: &str, sentence: &str, prims: &[&str]| {
        json!({
            "id": format!("{task}/{step}"), "u": sentence, "act": act, "args": [],
            "prims": prims, "scene": 3, "user": user,
        })
    };
    let mut rows = Vec::new();
    // One person with six tasks, who always uses the same words, and one with two.
    for (user, things) in [
        ("ada", &["Mug", "Egg", "Apple", "Cup", "Tomato", "Potato"][..]),
        ("ben", &["Mug", "Egg"][..]),
    ] {
        for thing in things {
            let task = format!("t-{user}-{thing}/0");
            let name = thing.to_lowercase();
            let cool = [
                "OPEN Fridge".to_owned(),
                format!("PUT {thing} Fridge"),
                "CLOSE Fridge".to_owned(),
                "OPEN Fridge".to_owned(),
                format!("PICKUP {thing}"),
                "CLOSE Fridge".to_owned(),
            ];
            let cool: Vec<&str> = cool.iter().map(String::as_str).collect();
            let (pick, put) = (format!("PICKUP {thing}"), format!("PUT {thing} CounterTop"));
            let goto = format!("GOTO {thing}");
            let step =
                |step, act, said: &str, prims: &[&str]| row(&task, step, user, act, said, prims);
            let mut walk = step(0, "GotoLocation", "turn left and go straight", &[&goto]);
            walk["ego"] = json!(true);
            rows.push(walk);
            rows.push(step(1, "PickupObject", &format!("get hold of the {name}"), &[&pick]));
            rows.push(step(2, "GotoLocation", "go to the fridge", &["GOTO Fridge"]));
            rows.push(step(3, "CoolObject", &format!("let the {name} freeze a bit"), &cool));
            rows.push(step(4, "GotoLocation", "go to the counter", &["GOTO CounterTop"]));
            rows.push(step(5, "PutObject", &format!("put the {name} on the counter"), &[&put]));
        }
    }
    rows.iter().map(Value::to_string).collect()
}

#[test]
fn recorded_people_say_their_own_sentences_and_teach_them() {
    let dir = TempDir::new().unwrap();
    let corpus = dir.path().join("corpus.jsonl");
    let mut lines = corpus_lines();
    let torn = r#"{"id":"t-x/0/1","u":"take it","act":"PickupObject","prims":["PICKUP Mug"],"scene":3,"user":"ada"}"#;
    lines.push(torn.to_owned());
    let bad = [
        ("\"user\":\"ada\"", "\"user\":\"\"", "its user is empty"),
        ("PICKUP Mug", "PICKUP Unicorn", "Unicorn"),
        ("PICKUP Mug", "FRY Mug", "FRY is not an action"),
        ("PICKUP Mug", "PUT Mug", "PUT takes 2 things"),
    ];
    lines.extend(bad.map(|(from, to, _)| torn.replace(from, to)));
    fs::write(&corpus, lines.join("\n")).unwrap();
    let corpus = corpus.to_str().unwrap();
    let arguments = ["--conditions", "default,grammar", "--corpus", corpus, "--seed", "2"];
    let out = dir.path().join("study");
    refused(&out, &[&arguments[..], &["--strict"]].concat(), 2, &["line 50", "user is empty"]);
    let output = run_well(&out, &[&arguments[..], &["--json"]].concat());
    let errors = String::from_utf8(output.stderr).unwrap();
    for (line, (_, _, reason)) in (50..).zip(bad) {
        let told = errors.lines().find(|told| told.contains(&format!("line {line} ")));
        assert!(told.is_some_and(|told| told.contains(reason)), "{reason}: {errors}");
    }
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&report["simulated"], &report["bad_lines"]), (&json!(false), &json!(4)));
    assert_eq!((&report["people"], &report["episodes"]), (&json!(2), &json!(16)));
    check_against_the_log(&out, 5);

    let utterances = table(&out, "utterances.csv");
    let own = |row: &&BTreeMap<String, String>| row["utterance"].contains("freeze a bit");
    let of_ada = |row: &&BTreeMap<String, String>| {
        own(row) && row["condition"] == "default-2" && row["user"] == "ada"
    };
    let said: Vec<_> = utterances.iter().filter(of_ada).collect();
    assert_eq!(said.len(), 6);
    assert!(said[0]["outcome"] != "understood" && said[0]["taught"] == "1", "{:?}", said[0]);
    let right = said[1..].iter().filter(|row| row["right"] == "1").count();
    assert!(right >= 4, "what was taught once is understood of other things: {said:?}");
    // Sentences that only give directions ("go straight") are not said.
    assert!(utterances.iter().all(|row| !row["utterance"].contains("straight")));
    let episodes = table(&out, "episodes.csv");
    assert!(episodes.iter().all(|row| row["finished"] == "1"), "{episodes:?}");
    assert!(episodes.iter().all(|row| row["task_type"] == "cool"), "{episodes:?}");
    // People with few episodes are reported separately.
    let summary = table(&out, "summary.csv");
    let users = |task_type: &str| -> BTreeSet<String> {
        let rows = summary.iter().filter(|row| row["task_type"] == task_type);
        rows.map(|row| row["users"].clone()).collect()
    };
    assert_eq!(users("all"), BTreeSet::from(["1".to_owned()]));
    assert_eq!(users("under_5_episodes"), BTreeSet::from(["1".to_owned()]));
    let first = bytes(&out);
    let again = dir.path().join("again");
    run_well(&again, &[&arguments[..], &["--workers", "1"]].concat());
    assert_eq!(bytes(&again), first);
}
