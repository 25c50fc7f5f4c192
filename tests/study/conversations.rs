//! What the protocol *conversation* counts, on our own transcripts and on those that ship.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use apprentice::learning::Recipe;
use apprentice_study::conversation::{Class, ConversationReport, Counts, conversation};
use apprentice_study::people::People;
use apprentice_study::report::{Setting, Teachers};
use apprentice_study::scenes::Staging;
use apprentice_testkit::paths::root;
use serde_json::Value;
use tempfile::TempDir;

/// A directory with transcripts `one.txt`, `two.txt`, … beside the kitchen of most transcripts.
fn directory(transcripts: &[&str]) -> TempDir {
    let directory = TempDir::new().unwrap();
    let kitchen = directory.path().join("kitchen.toml");
    fs::copy(root().join("tests/transcripts/kitchen.toml"), kitchen).unwrap();
    for (name, text) in ["one", "two", "three"].iter().zip(transcripts) {
        fs::write(directory.path().join(format!("{name}.txt")), text).unwrap();
    }
    directory
}

fn measured(recipe: &str, directory: &Path) -> ConversationReport {
    let recipe = Recipe::parse(Recipe::builtin(recipe).unwrap()).unwrap();
    let setting = Setting {
        recipe: &recipe,
        seeds: &[],
        limit: None,
        people: People::All,
        threads: 2,
        progress: &(),
        lessons: 1,
        teachers: Teachers::One,
        staging: Staging::Plain,
        failures: 0,
        cases: 1000,
    };
    conversation(&setting, directory).unwrap()
}

fn eval(directory: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_apprentice"));
    command.args(["eval", "--protocol", "conversation", "--recipe", "paper"]);
    command.arg(directory).args(arguments).output().unwrap()
}

fn adds_up(counts: &Counts) {
    let Counts { utterances, asked, spared, right, ahead, something_else, .. } = *counts;
    let Counts { misread, impossible, not_sure, rightly_left, wrongly_acted, .. } = *counts;
    assert_eq!(utterances, asked + spared, "{counts:?}");
    let nothing = rightly_left + wrongly_acted;
    let sum = right + something_else + misread + impossible + not_sure + nothing;
    assert_eq!(asked, sum, "{counts:?}");
    assert!(ahead <= right, "{counts:?}");
}

/// The paper's recipe carries out exactly what it understands, so each answer is known.
const EVERY_CLASS: [&str; 2] = [
    "\
scene kitchen.toml
task free
episode
> go to the mug and pick it up
~~ GOTO Mug
> wash the coffee mug
~~ nothing
> pick up the mug
~~ PICKUP Mug
> wash the coffee mug
~~ GOTO SinkBasin; PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug
> go to the sink
~~ nothing
> go to the dining table
~~ GOTO DiningTable
> put the mug on the dining table
~~ PUT Mug DiningTable
> pick up the mug
~~ GOTO DiningTable
done
teach \"wash the coffee mug\" := actions 3..7
learn
episode
> pick up the tomato
~~ PICKUP Tomato
> wash the tomato
~~ GOTO SinkBasin; PUT Tomato SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Tomato
> go to the dining table and put the tomato on the dining table
~~ GOTO DiningTable
~~ GOTO DiningTable; PUT Tomato DiningTable
done
",
    "\
scene kitchen.toml
task free
episode
> pick up the apple
~~ GOTO Apple
> go to the apple and pick up the apple
~~ PICKUP Apple
> put the apple on the counter
~~ PUT Apple CounterTop
done
",
];

#[test]
fn every_answer_gets_its_class() {
    let directory = directory(&EVERY_CLASS);
    let report = measured("paper", directory.path());
    let cases: Vec<(&str, usize, Class)> =
        report.cases.iter().map(|case| (case.file.as_str(), case.line, case.class)).collect();
    assert_eq!(
        cases,
        [
            ("one.txt", 10, Class::NotSure),
            ("one.txt", 12, Class::WronglyActed),
            ("one.txt", 18, Class::SomethingElse),
            ("two.txt", 4, Class::Misread),
            ("two.txt", 8, Class::Impossible),
        ],
        "{report}"
    );
    let expected = Counts {
        utterances: 14,
        asked: 13,
        spared: 1,
        right: 7,
        ahead: 1,
        something_else: 1,
        misread: 1,
        impossible: 1,
        not_sure: 1,
        rightly_left: 1,
        wrongly_acted: 1,
    };
    assert_eq!(report.total, expected, "{report}");
    report.transcripts.iter().for_each(|of| adds_up(&of.counts));
    assert_eq!(report.shares.requests, 11);
    assert!((report.shares.something_else - 2.0 / 13.0).abs() < 1e-12);
    assert!((report.shares.as_meant - 8.0 / 13.0).abs() < 1e-12);
}

#[test]
fn the_things_that_were_meant_are_judged() {
    let scene = fs::read_to_string(root().join("tests/transcripts/kitchen.toml")).unwrap();
    let scene = scene + "\n[[thing]]\ntype = \"Mug\"\non = \"DiningTable\"\n";
    let said = "\
scene kitchen.toml
task free
episode
> go to the mug and pick it up
~~ GOTO Mug; PICKUP Mug on Mug 2
> put the mug on the dining table
~~ GOTO DiningTable; PUT Mug DiningTable on Mug 2
> pick up the mug
~~ PICKUP Mug on Mug 2
done
";
    let directory = directory(&[said]);
    fs::write(directory.path().join("kitchen.toml"), scene).unwrap();
    let report = measured("paper", directory.path());
    // The nearest mug is the other one. Seen from the table, it is the right one.
    assert_eq!(report.total.something_else, 1, "{report}");
    assert_eq!((report.cases[0].line, report.total.right), (4, 2), "{report}");
    assert!(report.cases[0].answered.ends_with("on Mug 1"), "{report}");
}

#[test]
fn the_shipped_conversations_are_measured() {
    let directory = root().join("crates/study/data/conversations/look");
    let report = measured("default", &directory);
    let (mut said, mut nothing) = (0, 0);
    for of in &report.transcripts {
        adds_up(&of.counts);
        let text = fs::read_to_string(directory.join(&of.name)).unwrap();
        said += text.lines().filter(|line| line.starts_with('>')).count();
        nothing += text.lines().filter(|line| *line == "~~ nothing").count();
    }
    adds_up(&report.total);
    assert_eq!(report.transcripts.len(), 10);
    assert_eq!(report.total.utterances, said);
    assert_eq!(report.total.rightly_left + report.total.wrongly_acted, nothing, "{report}");
    assert!(report.total.right > said / 8, "{report}");
    assert_eq!(report.cases.len(), {
        let Counts { right, rightly_left, asked, .. } = report.total;
        asked - right - rightly_left
    });
    println!("{report}");
}

#[test]
fn the_report_is_the_same_however_it_is_asked_for() {
    let directory = directory(&EVERY_CLASS);
    let output = eval(directory.path(), &["--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["protocol"], "conversation");
    assert_eq!(report["recipe"], "paper");
    assert_eq!((&report["total"]["asked"], &report["total"]["ahead"]), (&13.into(), &1.into()));
    assert_eq!(report["transcripts"][1]["name"], "two.txt");
    assert_eq!(report["transcripts"][1]["misread"], 1);
    let one_thread = eval(directory.path(), &["--json", "--threads", "1"]);
    assert_eq!(one_thread.stdout, output.stdout);
    let table = eval(directory.path(), &["--cases", "1"]);
    let table = String::from_utf8(table.stdout).unwrap();
    assert!(
        table.contains("| two.txt:4 | pick up the apple | GOTO Apple | impossible: "),
        "{table}"
    );
}

#[test]
fn what_cannot_be_measured_is_refused_with_its_place() {
    let story = |rest: &str| format!("scene kitchen.toml\ntask free\nepisode\n{rest}");
    let cases = [
        (
            "> open the counter\n~~ OPEN CounterTop\n",
            "line 5: OPEN CounterTop cannot be carried out",
        ),
        ("> take mug 3\n~~ PICKUP Mug on Mug 3\n", "line 5: PICKUP Mug on Mug 3 cannot be"),
        ("> go to the mug\n", "line 4: no ~~ line below says what this utterance meant"),
        ("> hi\n~~ nothing\n~~ GOTO Mug\n", "line 6: an utterance that meant nothing"),
        ("> hi\n~~ PICKUP Mug on Cup 2\n", "line 5, column 4: PICKUP Mug has no thing"),
        ("done\n> hi\n~~ nothing\n", "line 5: there is no episode here"),
        ("> hi\n~~ nothing\ndone\nteach \"hi\" := actions 1..2\n", "line 7: 0 actions were meant"),
        ("done\nteach \"hi\" := actions 1\n", "line 5: \"hi\" was not said"),
        ("done\nforget \"hi\"\n", "line 5: there is no lesson for \"hi\""),
    ];
    for (rest, reason) in cases {
        let directory = directory(&[&story(rest)]);
        let output = eval(directory.path(), &[]);
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{rest}: {errors}");
        assert!(errors.contains("one.txt: ") && errors.contains(reason), "{rest}: {errors}");
        assert!(output.stdout.is_empty());
    }
    let empty = eval(directory(&[]).path(), &[]);
    assert_eq!(empty.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&empty.stderr).contains("has no transcript"));
    let elsewhere = eval(Path::new("no/such/directory"), &[]);
    assert_eq!(elsewhere.status.code(), Some(2));
}
