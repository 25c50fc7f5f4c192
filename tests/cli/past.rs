//! `replay` and `audit` as a user starts them: what they print, and their exit codes. They do not
//! change the directory.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use apprentice::events::Event;
use apprentice::ids::{Digest, TenantId, UserId};
use apprentice::learning::Recipe;
use apprentice::replay::{Minds, rebuild};
use apprentice::store;
use apprentice::world::household::Household;
use apprentice_testkit::diary::Diary;
use apprentice_testkit::ran::run;
use apprentice_testkit::released::released;

/// Runs the program. It must end with code 0 and print nothing on standard error.
#[track_caller]
fn fine(arguments: &[&str]) -> String {
    let ran = run(arguments, "");
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""), "{arguments:?}\n{}", ran.out);
    ran.out
}

/// Every file below `dir` with the digest of its bytes.
fn contents(dir: &Path) -> BTreeMap<PathBuf, Digest> {
    let mut files = BTreeMap::new();
    let mut waiting = vec![dir.to_owned()];
    while let Some(path) = waiting.pop() {
        match path.is_dir() {
            true => waiting.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path())),
            false => {
                files.insert(path.clone(), Digest::of(&fs::read(&path).unwrap()));
            }
        }
    }
    files
}

/// A directory in which ada taught one lesson, used it, took it back and continued.
fn taught() -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data").display().to_string();
    let talk = |task: &str, input: &str| {
        let ran = run(&["--data", &data, "--user", "ada", "--seed", "3", "--task", task], input);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        ran.out
    };
    let free = "free kitchen";
    let out = talk(free, "boogie\ngo to the fridge\nopen the fridge\ndone\n1-2\n");
    assert!(out.contains("Learned. I now know 45 examples."), "{out}");
    let out = talk(free, "go to the mug\nboogie\ndone\n:known\n");
    let lesson = out.split('#').nth(1).unwrap().split_whitespace().next().unwrap().to_owned();
    talk(free, &format!("do the dishes\ndone\nskip\n:forget {lesson}\ndone\n"));
    talk(free, "boogie\ngo to the sink\ndone\nnone\n");
    (folder, data)
}

#[test]
fn a_history_is_replayed_at_any_record_audited_and_left_alone() {
    let (_folder, data) = taught();
    let before = contents(Path::new(&data));
    let log = fine(&["log", "show", "--data", &data, "--user", "ada", "--json"]);
    let head = log.lines().count();
    let kinds: Vec<&str> =
        log.lines().map(|line| line.split("\"kind\":\"").nth(1).unwrap()).collect();
    let forgotten = kinds.iter().position(|kind| kind.starts_with("LessonForgotten"));
    let at_forgotten = forgotten.expect("a lesson was forgotten") + 1;

    // At the end, at the lesson's forgetting and before it.
    let replay = |more: &[&str]| {
        let known = ["replay", "--data", &data, "--user", "ada"];
        fine(&known.iter().chain(more).copied().collect::<Vec<_>>())
    };
    let readable = replay(&[]);
    for part in [&*format!("after record {head} of {head}"), "mind ", "state ", "44 examples"] {
        assert!(readable.contains(part), "{part:?} is missing in\n{readable}");
    }
    let json = |at: usize| -> serde_json::Value {
        serde_json::from_str(&replay(&["--json", "--at", &at.to_string()])).unwrap()
    };
    let (first, taught, last) = (json(1), json(at_forgotten - 1), json(head));
    assert_eq!(first["mind_digest"], last["mind_digest"], "as if it had never been taught");
    assert_ne!(first["mind_digest"], taught["mind_digest"]);
    assert_eq!(taught["state"]["lessons"].as_array().unwrap().len(), 1);
    assert_eq!(last["head"], head);
    assert_ne!(first["state_digest"], last["state_digest"]);
    let text = replay(&["--json"]);
    assert_eq!(text, replay(&["--json"]), "equal stores print equal bytes");
    for time in ["last_at", "requests", &data] {
        assert!(!text.contains(time), "{time} in\n{text}");
    }

    // The transcript can be played, with the same answers.
    let transcript = replay(&["--transcript"]);
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(transcript.as_bytes()).unwrap();
    let checked = fine(&["transcript", "check", &file.path().display().to_string()]);
    assert_eq!(checked, "", "{transcript}");
    assert!(transcript.contains("forget \"boogie\""), "{transcript}");
    assert!(transcript.contains("teach \"boogie\" := nothing"), "{transcript}");
    // And a wrong answer in it is found.
    fs::write(file.path(), transcript.replacen("= GOTO Fridge", "= GOTO Mug", 1)).unwrap();
    assert_eq!(run(&["transcript", "check", &file.path().display().to_string()], "").code, Some(1));

    let report = fine(&["audit", "--data", &data, "--repropose", "--retrain"]);
    for part in [&*format!("{head} records"), "retrained 4 minds with lessons", "no differences"] {
        assert!(report.contains(part), "{part:?} is missing in\n{report}");
    }
    let report = fine(&["audit", "--data", &data, "--tenant", "local", "--json"]);
    let value: serde_json::Value = serde_json::from_str(&report).unwrap();
    let streams = value["streams"].as_array().unwrap();
    let hers: Vec<_> = streams.iter().filter(|stream| stream["user"] == "ada").collect();
    assert_eq!((hers.len(), &hers[0]["counts"]["records"]), (1, &head.into()));
    assert_eq!(hers[0]["state_digest"], last["state_digest"], "one fold, two commands");
    assert_eq!(contents(Path::new(&data)), before, "nothing changed on disk");
}

#[test]
fn equal_stores_print_equal_bytes_wherever_they_are() {
    let (_folder, data) = taught();
    let other = tempfile::tempdir().unwrap();
    let copy = other.path().join("elsewhere");
    let status = Command::new("cp").arg("-a").arg(&data).arg(&copy).status().unwrap();
    assert!(status.success());
    let copy = copy.display().to_string();
    for more in [&["audit", "--repropose", "--retrain"][..], &["audit", "--json"]] {
        let printed = [&data, &copy].map(|dir| fine(&[more, &["--data", dir]].concat()));
        assert_eq!(printed[0], printed[1]);
    }
    let replay = ["replay", "--user", "ada"];
    let printed = [&data, &copy].map(|dir| fine(&[&replay[..], &["--data", dir]].concat()));
    assert_eq!(printed[0], printed[1]);
}

#[test]
fn a_doctored_directory_is_named_by_its_first_difference_and_code_1() {
    let folder = tempfile::tempdir().unwrap();
    let domain = Arc::new(Household::new());
    let recipe = Recipe::builtin("default").unwrap();
    let mut diary = Diary::new(&domain, &store::open_memory(), "ada", recipe);
    diary.start("free kitchen");
    diary.say("boogie");
    diary.say("go to the fridge");
    diary.done();
    diary.teach(&[1]);
    diary.learn();
    let data = folder.path().join("data");
    let wrong = Digest::of(b"another mind");
    let mut at = 0;
    let doctored = diary.doctored(store::open(&data).unwrap(), |seq, event| {
        if let Event::RetrainCompleted(event) = event {
            at = seq.get();
            event.mind = wrong;
        }
    });
    drop(doctored);
    let data = data.display().to_string();
    assert!(fine(&["audit", "--data", &data]).contains("no differences"), "the fold asks no mind");
    let ran = run(&["audit", "--data", &data, "--retrain"], "");
    let named = format!(
        "differs at record {at}: mind: recorded {wrong}, recomputed {}",
        diary.session.state().mind.unwrap()
    );
    assert_eq!((ran.code, ran.err.as_str()), (Some(1), ""));
    assert!(ran.out.contains(&named), "{named}\nis missing in\n{}", ran.out);
    assert!(ran.out.contains("differences in 1 stream"), "{}", ran.out);
    // Replay cannot make that mind either, and says which one it makes.
    let ran = run(&["replay", "--data", &data, "--user", "ada"], "");
    assert_eq!((ran.code, ran.out.as_str()), (Some(1), ""));
    assert!(ran.err.contains(&wrong.to_string()), "{}", ran.err);
}

/// Code 2, nothing on standard output, one sentence with these parts, and no change on the disk.
#[track_caller]
fn refused(dir: &Path, arguments: &[&str], parts: &[&str]) {
    let before = contents(dir);
    let ran = run(arguments, "");
    assert_eq!((ran.code, ran.out.as_str()), (Some(2), ""), "{arguments:?}: {}", ran.err);
    assert_eq!(ran.err.lines().count(), 1, "{}", ran.err);
    assert!(ran.err.starts_with("apprentice: "), "{}", ran.err);
    for part in parts {
        assert!(ran.err.contains(part), "{part:?} is missing in {}", ran.err);
    }
    assert_eq!(contents(dir), before, "something changed on disk");
}

#[test]
fn what_cannot_be_read_is_refused_in_one_sentence_and_left_alone() {
    let (folder, data) = taught();
    let dir = folder.path();
    let empty = dir.join("empty");
    fs::create_dir(&empty).unwrap();
    let foreign = dir.join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("thesis.tex"), "...").unwrap();
    let text = |path: PathBuf| path.display().to_string();
    let (empty, absent) = (text(empty), text(dir.join("absent")));
    let (file, foreign) = (text(foreign.join("thesis.tex")), text(foreign));
    for verb in [&["replay", "--user", "ada"][..], &["audit"]] {
        let with = |data: &str, parts: &[&str]| {
            refused(dir, &[verb, &["--data", data]].concat(), parts);
        };
        with(&absent, &[&absent, "it does not exist", "name the right one"]);
        with(&empty, &[&empty, "is empty", "name the right one"]);
        with(&foreign, &[&foreign, "other files"]);
        with(&file, &[&file, "it is a file"]);
        let tenant = [verb, &["--data", &data, "--tenant", "lab"]].concat();
        refused(dir, &tenant, &["lab", "its tenants are local", "name one"]);
        let held = store::open(Path::new(&data)).unwrap();
        with(&data, &[&data, "in use by another process", "stop that one"]);
        drop(held);
    }
    let replay = |more: &[&str], parts: &[&str]| {
        refused(dir, &[&["replay", "--data", &data][..], more].concat(), parts);
    };
    replay(&["--user", "eve"], &["eve", "local", "name a user"]);
    replay(&["--user", "ada", "--at", "999"], &["ada", "no record 999", "records 1 to", "--at"]);
    replay(&["--user", "ada", "--at", "0"], &["no record 0", "records 1 to"]);
    replay(&["--user", ""], &["user"]);
    let ran = run(&["replay", "--data", &data], "");
    assert_eq!(ran.code, Some(2), "a user must be named");
}

#[test]
fn records_that_were_acknowledged_and_are_lost_are_told_with_the_directory_that_lost_them() {
    let (folder, data) = taught();
    // An older copy of the log with the newer heads, as after restoring half a backup.
    let old = folder.path().join("old");
    let older = Diary::new(
        &Arc::new(Household::new()),
        &store::open(&old).unwrap(),
        "ada",
        Recipe::builtin("default").unwrap(),
    );
    drop(older);
    fs::remove_dir_all(Path::new(&data).join("log")).unwrap();
    let copied = Command::new("cp")
        .arg("-a")
        .arg(old.join("log"))
        .arg(Path::new(&data).join("log"))
        .status()
        .unwrap();
    assert!(copied.success());
    let ran = run(&["audit", "--data", &data], "");
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains(&data) && ran.err.contains("lost"), "{}", ran.err);
}

/// `golden/shut-out-0.2/data.tar.gz` was made by a 0.2 before its release. Ada began an episode
/// with her own scene, in which the goal was already true, and said "hello". That ended the
/// episode. "hello" was not among the utterances to teach, and no fold accepted the record.
#[test]
fn a_person_that_an_ending_of_0_2_shut_out_comes_back() {
    let folder = released("shut-out-0.2", "data");
    let data = folder.path().display().to_string();
    let before = contents(Path::new(&data));
    let report = fine(&["audit", "--data", &data, "--repropose", "--retrain"]);
    for part in ["(1 of them utterances): 1 differ", "no differences"] {
        assert!(report.contains(part), "{part:?} is missing in\n{report}");
    }
    let replay = ["replay", "--data", &data, "--user", "ada"];
    let json: serde_json::Value =
        serde_json::from_str(&fine(&[&replay[..], &["--json"]].concat())).unwrap();
    assert_eq!((&json["head"], &json["state"]["phase"]), (&4.into(), &"teaching".into()));
    assert_eq!(json["state"]["episode"]["unexplained"][0]["utterance"], "hello");
    fine(&[&replay[..], &["--transcript"]].concat());
    assert_eq!(contents(Path::new(&data)), before, "nothing changed on disk");

    // "hello" counts as not explained, and ada can continue.
    let ran = run(&["--data", &data, "--user", "ada"], "none\n");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.contains("hello"), "{}", ran.out);
    let task = ["--data", &data, "--user", "ada", "--seed", "3", "--task", "free kitchen"];
    let ran = run(&task, "go to the fridge\ndone\n");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let log = fine(&["log", "show", "--data", &data, "--user", "ada"]);
    for kind in ["DecompositionDeclined", "RetrainCompleted"] {
        assert!(log.contains(kind), "{kind} is missing in\n{log}");
    }
    assert_eq!(log.matches("EpisodeEnded").count(), 2, "{log}");
    fine(&["audit", "--data", &data, "--repropose", "--retrain"]);
}

#[test]
fn an_ending_that_leaves_out_anything_else_is_still_a_difference() {
    let domain = Arc::new(Household::new());
    let recipe = Recipe::builtin("tiny").unwrap();
    let mut diary = Diary::new(&domain, &store::open_memory(), "ada", recipe);
    diary.start("free kitchen");
    diary.say("flibbertigibbet");
    diary.done();
    let left_out = diary.doctored(store::open_memory(), |_, event| {
        if let Event::EpisodeEnded(ended) = event {
            ended.to_teach.clear();
        }
    });
    // `done` cannot reach a goal: no version left out the utterance before it.
    let stream = left_out.keys.stream_id(&TenantId::local(), &UserId::new("ada").unwrap()).unwrap();
    let error = rebuild(&domain, &left_out, &stream, &Minds::default()).err().unwrap();
    assert!(error.to_string().contains("utterances to teach"), "{error}");
}
