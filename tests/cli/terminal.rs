//! The binary as a user starts it: lines on standard input, answers on standard output, an exit
//! code.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Output, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::Duration;

const WASH_TASK: &str = "clean Mug CounterTop";

/// What was run, and how it ended.
struct Ran {
    code: Option<i32>,
    out: String,
    err: String,
}

impl Ran {
    fn of(output: Output) -> Ran {
        let text = |bytes| String::from_utf8(bytes).expect("the program prints UTF-8");
        Ran { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }

    /// Each answer is one line.
    fn lines(&self) -> Vec<&str> {
        self.out.lines().collect()
    }

    #[track_caller]
    fn ended(self, code: i32) -> Ran {
        assert_eq!(self.code, Some(code), "out:\n{}\nerr:\n{}", self.out, self.err);
        self
    }

    /// Code 2 and exactly one sentence on standard error that has all `parts`.
    #[track_caller]
    fn refused(self, parts: &[&str]) {
        let ran = self.ended(2);
        let said: Vec<&str> =
            ran.err.lines().filter(|line| !line.contains("everything is kept in")).collect();
        assert_eq!(said.len(), 1, "{}", ran.err);
        assert!(said[0].starts_with("apprentice: "), "{}", said[0]);
        for part in parts {
            assert!(said[0].contains(part), "{part:?} is missing in {}", said[0]);
        }
        assert_eq!(ran.out, "");
    }
}

fn command<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_apprentice"));
    command.args(arguments).env_remove("APPRENTICE_LOG");
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Runs to the end with `input` on standard input.
fn run_bytes<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>, input: &[u8]) -> Ran {
    let mut child = command(arguments).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    // A program that ends early closes its input. The test does not fail for this.
    let writer = thread::spawn(move || stdin.write_all(&input).ok());
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    Ran::of(output)
}

fn run<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>, input: &str) -> Ran {
    run_bytes(arguments, input.as_bytes())
}

/// A conversation about `tasks` in `data`, with seed 7.
fn talk(data: &Path, tasks: &[&str], input: &str) -> Ran {
    run(conversation(data, tasks), input)
}

fn conversation(data: &Path, tasks: &[&str]) -> Vec<String> {
    let mut arguments = vec!["--data".to_owned(), data.display().to_string()];
    arguments.extend(["--seed".to_owned(), "7".to_owned()]);
    for task in tasks {
        arguments.extend(["--task".to_owned(), (*task).to_owned()]);
    }
    arguments
}

/// A running conversation. The test writes it line by line and kills the program without warning.
struct Live {
    child: Child,
    stdin: ChildStdin,
    lines: Receiver<String>,
}

/// How long an answer may take before the test gives up.
const PATIENCE: Duration = Duration::from_secs(60);

impl Live {
    fn start(arguments: &[String]) -> Live {
        let mut child = command(arguments).spawn().unwrap();
        let stdin = child.stdin.take().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = mpsc::channel();
        thread::spawn(move || {
            stdout.lines().map_while(Result::ok).try_for_each(|l| sender.send(l))
        });
        Live { child, stdin, lines }
    }

    #[track_caller]
    fn heard(&mut self) -> String {
        self.lines.recv_timeout(PATIENCE).expect("the program says something")
    }

    /// Says something and waits for the one line of the answer.
    #[track_caller]
    fn say(&mut self, line: &str) -> String {
        writeln!(self.stdin, "{line}").unwrap();
        self.stdin.flush().unwrap();
        self.heard()
    }

    /// SIGKILL: the process cannot do anything before it ends.
    fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    (folder, data)
}

/// The washing that is taught. The robot holds the mug at the beginning and at the end.
const WASHING: &str = "go to the sink\nput the mug in the sink\nturn on the faucet\n\
     turn off the faucet\npick up the mug\n";

#[test]
fn a_person_teaches_and_is_understood_in_the_next_task() {
    let (_folder, data) = folder();
    let input = format!(
        "go to the mug and pick it up\nwash the coffee mug\n{WASHING}\
         go to the counter and put the mug on the counter\n3-7\n\
         go to the tomato and pick it up\nwash the tomato\n\
         go to the counter and put the tomato on the counter\n"
    );
    let ran = talk(&data, &[WASH_TASK, "clean Tomato CounterTop"], &input).ended(0);
    let lines = ran.lines();
    assert!(lines[0].starts_with("Goal: wash a mug and put it on the counter"), "{}", ran.out);
    assert!(lines[1].starts_with("1  "), "{}", ran.out);
    assert!(lines[2].starts_with("I don't understand \"wash the coffee mug\"."), "{}", ran.out);
    let taught = lines.iter().position(|line| line.starts_with("You said \"wash the coffee mug\""));
    let taught = taught.unwrap_or_else(|| panic!("no question:\n{}", ran.out));
    assert!(lines[taught].contains("3  "), "the numbered actions are shown: {}", lines[taught]);
    assert!(lines[taught + 1].contains("means GOTO SinkBasin; PUT Mug SinkBasin"), "{}", ran.out);
    assert_eq!(lines[taught + 2], "Learned. I now know 45 examples.");
    assert!(lines[taught + 3].starts_with("Goal: wash a tomato"), "{}", ran.out);
    let washed = lines[taught + 5];
    assert!(washed.contains("3  ") && washed.contains("7  "), "five actions at once: {washed}");
    assert!(lines.last().unwrap().starts_with("Done! The goal is reached"), "{}", ran.out);
}

#[test]
fn a_killed_conversation_goes_on_with_the_same_mind() {
    let (_folder, data) = folder();
    let arguments = conversation(&data, &[WASH_TASK, "clean Tomato CounterTop"]);
    let mind = |status: &str| {
        let (_, mind) = status.rsplit_once("mind ").unwrap_or_else(|| panic!("{status}"));
        mind.to_owned()
    };

    // In the middle of the first task.
    let mut first = Live::start(&arguments);
    assert!(first.heard().starts_with("Goal: wash a mug"));
    assert!(first.say("go to the mug and pick it up").starts_with("1  "));
    assert!(first.say("wash the coffee mug").starts_with("I don't understand"));
    first.kill();

    // It continues where it was, is killed while it is taught, …
    let mut second = Live::start(&arguments);
    assert!(second.heard().starts_with("Goal: wash a mug"));
    for line in WASHING.lines() {
        let heard = second.say(line);
        assert!(heard.starts_with(char::is_numeric), "{line}: {heard}");
    }
    assert!(second.say("go to the counter and put the mug on the counter").starts_with("8  "));
    assert!(second.heard().starts_with("Done!"));
    assert!(second.heard().starts_with("You said \"wash the coffee mug\""));
    second.kill();

    // … asks again, learns, …
    let mut third = Live::start(&arguments);
    assert!(third.heard().starts_with("You said \"wash the coffee mug\""));
    assert!(third.say("3-7").starts_with("Understood:"));
    assert_eq!(third.heard(), "Learned. I now know 45 examples.");
    assert!(third.heard().starts_with("Goal: "));
    let mut line = third.say(":status");
    while !line.contains("mind ") {
        line = third.heard();
    }
    let learned = mind(&line);
    third.kill();

    // … and still knows the lesson, with the same mind, bit for bit.
    let ran = talk(&data, &[], ":status\n:known\n").ended(0);
    let line = ran.lines().into_iter().find(|line| line.contains("mind ")).unwrap();
    assert_eq!(mind(line), learned);
    assert!(ran.out.contains("You taught me 1 request:"), "{}", ran.out);
    assert!(ran.out.contains("\"wash the <obj>\" = GOTO SinkBasin"), "{}", ran.out);
}

#[test]
fn a_wrong_answer_to_a_question_is_asked_again_and_a_clash_is_settled() {
    let (_folder, data) = folder();
    let input = "\
tidy up the mug\ngo to the mug\npick up the mug\ngo to the counter\nput the mug on the counter\n\
tidy up the mug\ngo to the sink\ndone\n\
the second one\n9-12\n4-2\n1-4\n5\nmaybe\nreplace\n";
    let ran = talk(&data, &["free kitchen"], input).ended(0);
    let questions = ran.lines().iter().filter(|line| line.starts_with("You said")).count();
    assert_eq!(questions, 5, "three bad answers, and two utterances:\n{}", ran.out);
    for part in ["is not a list of actions", "this episode has 5 actions", "comes after the last"] {
        assert!(ran.out.contains(part), "{part:?} is missing in\n{}", ran.out);
    }
    assert_eq!(ran.out.matches("already means").count(), 2, "{}", ran.out);
    assert!(ran.out.contains("Forgotten: what \"tidy up the mug\" meant before."), "{}", ran.out);
    assert!(ran.out.contains("\"tidy up the mug\" means GOTO SinkBasin."), "{}", ran.out);
    assert!(ran.out.contains("Learned. I now know 45 examples."), "{}", ran.out);
}

#[test]
fn teaching_takes_one_move_and_may_be_left_out() {
    let (_folder, data) = folder();
    let input = "boogie\ntidy up\ngo to the fridge\ndone\nteach \"tidy up\" 1\nnone\n\
                 boogie\ndone\nskip\n";
    let ran = talk(&data, &["free kitchen", "free kitchen"], input).ended(0);
    assert!(ran.out.contains("\"tidy up\" means GOTO Fridge."), "{}", ran.out);
    assert!(ran.out.contains("none of these actions means \"boogie\""), "{}", ran.out);
    assert_eq!(ran.out.matches("Learned. I now know 45 examples.").count(), 2, "{}", ran.out);
}

#[test]
fn why_and_look_and_forget_answer() {
    let (_folder, data) = folder();
    let input = ":why\nboogie with the mug\n:why\n:look\n:help\n:dance\ngo to the fridge\ndone\n1\n\
                 :known\n:forget 99\n:forget 5\n";
    let ran = talk(&data, &["free kitchen"], input).ended(0);
    for part in [
        "There is no answer to explain yet",
        "I read it as \"boogie with the <obj>\"",
        "too far",
        "Fridge",
        ":forget N",
        "There is no command :dance",
        "There is no lesson #99",
    ] {
        assert!(ran.out.contains(part), "{part:?} is missing in\n{}", ran.out);
    }
}

#[test]
fn a_forgotten_lesson_is_gone_when_the_task_is_over() {
    let (_folder, data) = folder();
    let taught = talk(&data, &["free kitchen"], "boogie\ngo to the fridge\ndone\n1\n").ended(0);
    assert!(taught.out.contains("Learned. I now know 45 examples."), "{}", taught.out);
    let known = talk(&data, &["free kitchen"], ":known\n").ended(0);
    let lesson = known.lines().into_iter().find_map(|line| line.trim().strip_prefix('#')).unwrap();
    let number = lesson.split_whitespace().next().unwrap();
    let ran = talk(&data, &[], &format!(":forget {number}\ndone\nboogie\n")).ended(0);
    assert!(ran.out.contains("when this task is over"), "{}", ran.out);
    assert!(ran.out.contains(&format!("Forgotten: #{number}, \"boogie\".")), "{}", ran.out);
    assert!(ran.out.contains("Learned. I now know 44 examples."), "{}", ran.out);
    assert!(ran.lines().last().unwrap().starts_with("I don't understand"), "{}", ran.out);
}

#[test]
fn whatever_is_typed_gets_one_line_and_the_conversation_goes_on() {
    let (_folder, data) = folder();
    let enormous = "a".repeat(300_000);
    let wordy = "go ".repeat(10_000);
    let mut input = format!("\n{enormous}\n{wordy}\n").into_bytes();
    input.extend_from_slice(b"\xff\xfe\x00\n\x00\x01\n");
    input.extend_from_slice("🤖\n<b>dance</b> 💃\ngo to the fridge".as_bytes());
    let ran = run_bytes(conversation(&data, &["free kitchen"]), &input).ended(0);
    let lines = ran.lines();
    assert_eq!(lines.len(), 9, "{}", ran.out);
    let parts = [
        "Goal:",
        "That is empty",
        "300000 bytes. The limit is",
        "29999 bytes; the limit is",
        "not UTF-8 text: byte 0xff at position 1",
        "U+0000",
        "no words in that",
        "I don't understand",
        "1  ",
    ];
    for (line, part) in lines.iter().zip(parts) {
        assert!(line.contains(part), "{part:?} is missing in {line:?}");
    }
}

#[test]
fn the_seed_fixes_scenes_and_tasks() {
    let (_folder, data) = folder();
    let (_other_folder, other) = folder();
    let input = ":look\ndone\n:look\n";
    let (once, again) = (talk(&data, &[], input).ended(0), talk(&other, &[], input).ended(0));
    assert_eq!(once.out, again.out);
    assert!(once.out.contains("Goal: "), "{}", once.out);
}

#[test]
fn a_directory_that_cannot_be_used_is_one_sentence_and_code_2() {
    let (folder, data) = folder();
    let mut holder = Live::start(&conversation(&data, &["free kitchen"]));
    assert!(holder.heard().starts_with("Goal:"));
    talk(&data, &[], "").refused(&[&data.display().to_string(), "in use"]);
    holder.kill();
    talk(&data, &[], "").ended(0);

    // Not even root can make a directory below a file.
    let file = folder.path().join("file");
    std::fs::write(&file, "not a directory").unwrap();
    talk(&file.join("below"), &[], "").refused(&[&file.display().to_string()]);
    let strange = folder.path().join("strange");
    std::fs::create_dir(&strange).unwrap();
    std::fs::write(strange.join("holiday.jpg"), "x").unwrap();
    talk(&strange, &[], "").refused(&["holiday.jpg"]);
}

#[test]
fn bad_usage_is_one_sentence_and_code_2() {
    let (folder, data) = folder();
    talk(&data, &["dance Mug"], "").refused(&["dance", "known forms"]);
    let recipe = folder.path().join("recipe.toml");
    std::fs::write(&recipe, "name = \n").unwrap();
    let data = data.display().to_string();
    run(["--data", &data, "--recipe", recipe.to_str().unwrap()], "").refused(&["line 1"]);
    run(["--data", &data, "--recipe", "none-such"], "")
        .refused(&["none-such", "default-1, default-2, paper"]);
    run(["--data", &data, "--user", ""], "").refused(&["user must not be empty"]);
    run(["--data", &data, "--log-filter", "=%="], "").refused(&["--log-filter"]);
    run(["talk", "--connect", "carrier-pigeon"], "").refused(&["carrier-pigeon"]);
    let unknown = run(["--no-such-flag"], "").ended(2);
    assert!(unknown.err.contains("--no-such-flag"), "{}", unknown.err);
    let help = run(["--help"], "").ended(0);
    assert!(help.out.contains("Exit codes:"), "{}", help.out);
}

#[test]
fn several_people_talk_to_one_service_at_once() {
    let (_folder, data) = folder();
    let serve = ["serve", "--data", data.to_str().unwrap(), "--zmq", "tcp://127.0.0.1:0"];
    let serve: Vec<String> = serve.iter().map(|word| (*word).to_owned()).collect();
    let mut service = Live::start(&serve);
    let heard = service.heard();
    let endpoint =
        heard.strip_prefix("serving at ").unwrap_or_else(|| panic!("{heard}")).to_owned();
    let people: Vec<_> = ["ada", "bo", "cy"]
        .map(|user| {
            let endpoint = endpoint.clone();
            thread::spawn(move || {
                let arguments = ["talk", "--connect", &endpoint, "--user", user, "--task"];
                let arguments = arguments.into_iter().chain(["free kitchen", "--seed", "1"]);
                let input = format!("{user} dance\ngo to the fridge\ndone\n1\n{user} dance\n");
                (user, run(arguments, &input).ended(0))
            })
        })
        .into_iter()
        .map(|person| person.join().unwrap())
        .collect();
    for (user, ran) in people {
        assert!(ran.out.contains(&format!("\"{user} dance\" means GOTO Fridge.")), "{}", ran.out);
        assert!(ran.out.contains("Learned. I now know 45 examples."), "{}", ran.out);
    }
    service.kill();
    // If no service is there, the person gets a sentence.
    let alone = run(["talk", "--connect", &endpoint], "").ended(1);
    assert!(alone.err.contains("no answer from"), "{}", alone.err);
}

#[test]
fn transcripts_are_checked_with_a_diff_and_a_code() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let bare = file("bare.txt", "task free kitchen\nepisode\n> go to the fridge\ndone\n");
    let printed = run(["transcript", "run", &bare], "").ended(0);
    let good = file("good.txt", &printed.out);
    assert_eq!(run(["transcript", "check", &good], "").ended(0).out, "");

    let wrong = file("wrong.txt", &printed.out.replace("= GOTO Fridge", "= GOTO Sofa"));
    let differs = run(["transcript", "check", &good, &wrong], "").ended(1);
    for line in ["-= GOTO Sofa (action 1)", "+= GOTO Fridge (action 1)", " > go to the fridge"] {
        assert!(differs.out.lines().any(|found| found == line), "{line}:\n{}", differs.out);
    }
    assert_eq!(differs.err, "");

    let broken = file("broken.txt", "task free\nepisode\n> go\n= \n");
    run(["transcript", "check", &broken], "").refused(&["broken.txt: line 4, column 3"]);
    run(["transcript", "run", "none-such.txt"], "").refused(&["none-such.txt"]);
    let early = file("early.txt", "task free\nepisode\nteach \"x\" := nothing\n");
    run(["transcript", "check", &early], "").refused(&["line 3: \"x\" was not said"]);
}

#[test]
fn the_log_is_shown_for_people_and_for_programs() {
    let (_folder, data) = folder();
    let input = "dance\ngo to the fridge\ndone\n1\n";
    talk(&data, &["free kitchen"], input).ended(0);
    let show = ["log", "show", "--data", data.to_str().unwrap(), "--user", "you"];
    let people = run(show, "").ended(0);
    for part in [
        "SessionOpened",
        "> dance",
        "? not sure",
        "= GOTO Fridge",
        "abandoned: 2 utterances, 1 actions, 1 to teach",
        "actions 1..1: GOTO Fridge",
        "RetrainCompleted",
    ] {
        assert!(people.out.contains(part), "{part:?} is missing in\n{}", people.out);
    }
    let programs = run(show.into_iter().chain(["--json"]), "").ended(0);
    let records: Vec<serde_json::Value> =
        programs.lines().iter().map(|line| serde_json::from_str(line).unwrap()).collect();
    let numbers: Vec<u64> = records.iter().map(|record| record["seq"].as_u64().unwrap()).collect();
    assert_eq!(numbers, (1..=numbers.len() as u64).collect::<Vec<_>>());
    assert_eq!(records[0]["kind"], "SessionOpened");
    assert_eq!(records[2]["event"]["utterance"], "dance");
    // `:look` changes nothing.
    assert_eq!(run(show.into_iter().chain(["--json"]), "").ended(0).out, programs.out);

    run(["log", "show", "--data", data.to_str().unwrap(), "--user", "nobody"], "")
        .refused(&["no records of user \"nobody\""]);
    run(["log", "show", "--data", "none-such", "--user", "you"], "").refused(&["none-such"]);
}

#[test]
fn no_word_of_a_person_is_logged_at_info() {
    let (_folder, data) = folder();
    let mut arguments = conversation(&data, &["free kitchen"]);
    arguments.extend(["--log-filter", "info", "--log-format", "json"].map(str::to_owned));
    let ran = run(&arguments, "xylophone dance\ngo to the fridge\ndone\n1\n").ended(0);
    assert!(ran.out.contains("Learned. I now know 45 examples."), "{}", ran.out);
    assert!(!ran.err.contains("xylophone"), "{}", ran.err);
}
