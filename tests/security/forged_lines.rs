//! Nobody can forge a line. Characters that hide text, end lines or control a terminal are refused
//! on input. If older versions recorded them, every command that reads them shows them escaped.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::process::Command as Process;
use std::sync::Arc;

use apprentice::client::wire::{Request, decode_response, encode_request};
use apprentice::client::{
    Ask, Client, ClientError, Command, ErrorCode, Order, PersonAsk, Phase, RejectionCode, Response,
    fresh_id,
};
use apprentice::events::{Batch, Event, Head, KeyAdmitted, TenantDisabled, TenantOpened};
use apprentice::ids::{PublicKey, RequestId, StreamId, TenantId, Timestamp, UserId};
use apprentice::learning::Recipe;
use apprentice::limits::{LABEL_BYTES_MAX, UTTERANCE_BYTES_MAX};
use apprentice::plain;
use apprentice::service::{Data, Service};
use apprentice::store::{self, Store};
use apprentice::tenancy::Role;
use apprentice::world::Stage;
use apprentice::world::household::Household;
use apprentice_testkit::diary::Diary;
use apprentice_testkit::python::python;
use apprentice_testkit::ran::run;
use apprentice_testkit::toy::config;

/// One character of each kind that older versions allowed in names and utterances, and those that
/// they refused.
const HOSTILE: [char; 16] = [
    '\0',
    '\n',
    '\r',
    '\u{1b}',
    '\u{7f}',
    '\u{85}',
    '\u{9b}',
    '\u{61c}',
    '\u{200b}',
    '\u{200f}',
    '\u{2028}',
    '\u{2029}',
    '\u{202e}',
    '\u{2066}',
    '\u{feff}',
    '\u{e0041}',
];

fn user(name: &str) -> UserId {
    UserId::new(name).unwrap()
}

fn tenant(name: &str) -> TenantId {
    TenantId::new(name).unwrap()
}

/// A service of bells that listens on a free port.
fn bells() -> Service {
    let mut config = config(Data::Memory);
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    Service::start(config).unwrap()
}

fn connect(service: &Service, name: &str) -> Client {
    Client::connect(service.endpoint().unwrap(), user(name)).unwrap()
}

/// The code and the sentence of a refusal. It must quote no raw character.
#[track_caller]
fn rejected<T: std::fmt::Debug>(answer: Result<T, ClientError>) -> (RejectionCode, String) {
    match answer.unwrap_err() {
        ClientError::Rejected { code, message } => {
            assert_eq!(plain::check(&message), Ok(()), "{message:?}");
            (code, message)
        }
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn failed<T: std::fmt::Debug>(answer: Result<T, ClientError>) -> (ErrorCode, String) {
    match answer.unwrap_err() {
        ClientError::Failed { code, message } => {
            assert_eq!(plain::check(&message), Ok(()), "{message:?}");
            (code, message)
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_free_text_of_the_wire_is_refused_with_its_character_and_nothing_is_recorded() {
    let service = bells();
    let ada = connect(&service, "ada");
    let scene = |scene: &str, task: &str| Stage::Scene { scene: scene.into(), task: task.into() };
    for c in HOSTILE {
        let (text, name) = (format!("a {c} b"), format!("U+{:04X}", u32::from(c)));
        let named = |(code, message): (RejectionCode, String)| {
            assert!(message.contains("character 3 is ") && message.contains(&name), "{message}");
            code
        };
        let task = Stage::Task { task: text.clone(), seed: 1 };
        assert_eq!(named(rejected(ada.start(task))), RejectionCode::BadStage);
        assert_eq!(named(rejected(ada.start(scene("", &text)))), RejectionCode::BadStage);
        if !matches!(c, '\n' | '\r') {
            assert_eq!(named(rejected(ada.start(scene(&text, "x")))), RejectionCode::BadStage);
        }
        assert_eq!(named(rejected(ada.close(&text))), RejectionCode::BadText);
        for order in [
            Order::Admit { key: PublicKey([7; 32]), role: Role::Auditor, label: text.clone() },
            Order::Disable { reason: text.clone() },
        ] {
            let (code, message) = failed(ada.order(Some(TenantId::local()), order));
            assert_eq!(code, ErrorCode::Refused);
            assert!(message.contains("character 3 is ") && message.contains(&name), "{message}");
        }
        // A name may not contain a control character at all.
        if let Ok(odd) = UserId::new(&text) {
            let odd = Client::connect(service.endpoint().unwrap(), odd).unwrap();
            let (code, message) = failed(odd.say("ring the brass bell"));
            assert_eq!(code, ErrorCode::Refused);
            assert!(message.contains(&name), "{message}");
        }
    }
    assert_eq!(ada.status().unwrap().episodes, 0);
    ada.start(Stage::Task { task: "Brass".to_owned(), seed: 1 }).unwrap();
    for c in HOSTILE {
        let (code, message) = rejected(ada.say(&format!("ring {c} bell")));
        assert_eq!(code, RejectionCode::BadUtterance);
        let named = format!("character 6 is U+{:04X}", u32::from(c));
        assert!(message.contains(&named), "{message}");
    }
    let status = ada.status().unwrap();
    assert_eq!((status.phase, status.utterances), (Phase::Interacting, 0));

    // The limits of free texts, exactly at the limit and just above it.
    let (code, message) = rejected(ada.close(&"y".repeat(UTTERANCE_BYTES_MAX + 1)));
    assert_eq!(code, RejectionCode::BadText);
    assert!(message.contains("2001 bytes; the limit is 2000"), "{message}");
    let reason = "z".repeat(LABEL_BYTES_MAX + 1);
    assert_eq!(failed(ada.order(None, Order::Disable { reason })).0, ErrorCode::Refused);
    ada.say("ring 👩\u{200d}🚀 the brass bell").unwrap();
    ada.close(&"y".repeat(UTTERANCE_BYTES_MAX)).unwrap();
    service.stop().unwrap();
}

#[test]
fn names_that_look_like_others_are_for_nobody_new() {
    let service = bells();
    for odd in [" ada", "ada ", "a\u{a0}da", "ada\u{feff}", "ad\u{200d}a"] {
        let (code, message) = failed(connect(&service, odd).say("ring the brass bell"));
        assert_eq!(code, ErrorCode::Refused, "{odd:?}");
        assert!(message.starts_with("a new person cannot have this name: "), "{message}");
    }
    let ada = connect(&service, "ada");
    for name in ["-", "--data", "-lab"] {
        let (code, message) = failed(ada.order(Some(tenant(name)), Order::Add));
        assert_eq!(code, ErrorCode::Refused);
        assert!(message.contains("may not begin with '-'"), "{message}");
    }
    let tenants = ada.tenants(None).unwrap();
    assert!(tenants.iter().all(|view| !view.tenant.as_str().starts_with('-')), "{tenants:?}");
    service.stop().unwrap();
}

#[test]
fn a_refusal_of_what_cannot_be_read_quotes_nothing_raw() {
    let service = bells();
    let socket = zmq::Context::new().socket(zmq::DEALER).unwrap();
    socket.set_linger(0).unwrap();
    socket.connect(service.endpoint().unwrap()).unwrap();
    let ask = Ask::Person(PersonAsk::Command(Command::Close { reason: "x".to_owned() }));
    let request = encode_request(&Request { id: fresh_id(), user: user("mallory"), ask });
    // The same message with a hostile character in a verb and in a field's name.
    let forged = |from: &[u8], to: &[u8]| {
        let at = request.windows(from.len()).position(|window| window == from).unwrap();
        [&request[..at], to, &request[at + from.len()..]].concat()
    };
    for (from, to) in [
        (&b"\xa5close"[..], "\u{1b}[2J\n".as_bytes()),
        (&b"\xa6reason"[..], "re\u{202e}".as_bytes()),
        (&b"\xa7mallory"[..], "m\u{9b}8m".as_bytes()),
    ] {
        let length = 0xa0 | u8::try_from(to.len()).unwrap();
        socket.send(forged(from, &[&[length], to].concat()), 0).unwrap();
        assert_eq!(socket.poll(zmq::POLLIN, 30_000).unwrap(), 1, "an answer within 30 s");
        let (_, response) = decode_response(&socket.recv_bytes(0).unwrap()).unwrap();
        let Response::Error(failed) = response else { panic!("{response:?}") };
        assert_eq!(plain::check(&failed.message), Ok(()), "{:?}", failed.message);
    }
    service.stop().unwrap();
}

/// Each begins like a line of ours.
const FORGED: [&str; 5] = [
    "     99  2026-11-29 10:00:00Z  Interpreted            > I hereby consent to everything",
    "the log only grew, from 1 segments to 31",
    "user victim",
    "no differences",
    "lab: DISABLED (\"forged\"); no quotas",
];
const NAME: &str = "mal\u{202e}\u{2028}no differences";
const SAID: &str = "boogie\u{202e}woogie\u{2028}user victim";

fn evil() -> String {
    format!("bye\n{}\r\u{1b}[8m\u{9b}2J\u{2066}\u{feff}\u{e0041}", FORGED.join("\n"))
}

/// A directory as an older version left it: every free text contains what that version allowed.
struct Old {
    _folder: tempfile::TempDir,
    data: String,
    dir: PathBuf,
}

fn old() -> Old {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().to_owned();
    let data = dir.join("data");
    let store = store::open(&data).unwrap();
    let (domain, recipe) = (Arc::new(Household::new()), Recipe::builtin("default").unwrap());
    for (name, closes) in [(NAME, true), ("pat\u{202e}", false)] {
        let mut diary = Diary::new(&domain, &store, name, recipe);
        let say = |diary: &mut Diary<Household>, words: &str| {
            let command = Command::Say { utterance: words.to_owned() };
            diary.give_as_of_old(&command).unwrap();
        };
        diary.start("free kitchen");
        say(&mut diary, SAID);
        say(&mut diary, "go\u{202e}to the fridge");
        say(&mut diary, "=HYPERLINK(\"x\")\u{feff} the mug");
        diary.done();
        diary.teach(&[1]);
        while let Some(said) = diary.session.status().to_teach.first().map(|said| said.seq) {
            let (actions, on_clash) = (Vec::new(), Default::default());
            diary.accept(&Command::Teach { explains: said, actions, on_clash });
        }
        diary.learn();
        diary.start("free kitchen");
        say(&mut diary, SAID);
        if closes {
            diary.give_as_of_old(&Command::Close { reason: evil() }).unwrap();
        }
    }
    tenant_of_old(&store);
    drop(store);
    Old { data: data.display().to_string(), dir, _folder: folder }
}

/// A lab with a name, label and reason that are refused today.
fn tenant_of_old(store: &Store) {
    let lab = tenant("--data");
    store.keys.make_tenant(&lab).unwrap();
    let key = PublicKey([9; 32]);
    let events: Vec<Event> = vec![
        TenantOpened {}.into(),
        KeyAdmitted { key, role: Role::Gateway, label: evil() }.into(),
        TenantDisabled { reason: evil() }.into(),
    ];
    let batch = Batch { request: RequestId([1; 16]), at: Timestamp(1_000), events };
    store.log.append(&StreamId::of_tenant(&lab), Head::EMPTY, batch).wait().unwrap();
}

/// The output contains no hidden character and no line that begins like a forged one. Lines that
/// the command itself writes may begin so: those in `own`.
#[track_caller]
fn honest(what: &str, text: &str, own: &[&str]) {
    assert_eq!(plain::check_lines(text), Ok(()), "{what}:\n{text:?}");
    assert!(!text.contains('\r'), "{what}:\n{text:?}");
    let begins = |line: &str| FORGED.iter().any(|forged| line.trim().starts_with(forged.trim()));
    for line in text.lines().filter(|line| begins(line)) {
        assert!(own.contains(&line), "{what}: {line:?} in\n{text}");
    }
}

#[test]
fn every_command_that_reads_an_old_log_shows_its_texts_escaped() {
    let Old { data, dir, _folder } = old();
    let path = |name: &str| dir.join(name).display().to_string();
    let (csv, ndjson) = (path("rerun.csv"), path("log.ndjson"));
    let of = |name| ["--data", &data, "--user", name];
    let mut shown = BTreeMap::new();
    for (code, own, arguments) in [
        (0, &[][..], [&["log", "show"][..], &of(NAME)].concat()),
        (0, &[], [&["log", "show", "--json"][..], &of(NAME)].concat()),
        (0, &[], [&["replay"][..], &of(NAME)].concat()),
        (0, &[], [&["replay", "--json"][..], &of(NAME)].concat()),
        (0, &[], [&["replay", "--transcript"][..], &of(NAME)].concat()),
        (2, &[], [&["replay", "--at", "999"][..], &of(NAME)].concat()),
        (2, &[], [&["log", "show"][..], &of("no\u{202e}body\u{2029}no differences")].concat()),
        (0, &["no differences"], vec!["audit", "--data", &data, "--repropose", "--retrain"]),
        (0, &[], vec!["audit", "--data", &data, "--json"]),
        (0, &[], vec!["tenant", "list", "--data", &data]),
        (
            0,
            &[],
            vec!["export", "--tenant", "local", "--data", &data, "--out", &ndjson, "--ndjson"],
        ),
        (0, &[], vec!["study", "rerun", "--data", &data, "--with", "tau=0.9", "--out", &csv]),
        (0, &[], vec!["study", "rerun", "--data", &data, "--with", "tau=0.9", "--json"]),
    ] {
        let ran = run(&arguments, "");
        assert_eq!(ran.code, Some(code), "{arguments:?}: {}\n{}", ran.out, ran.err);
        let what = arguments.join(" ");
        honest(&what, &ran.out, own);
        honest(&what, &ran.err, &[]);
        if code == 0 {
            shown.insert(arguments[..3].join(" "), ran.out);
        }
    }
    for file in [&csv, &ndjson] {
        honest(file, &fs::read_to_string(file).unwrap(), &[]);
    }
    // Escaped does not mean left out.
    let log = &shown["log show --data"];
    for part in
        ["bye\\u{a}     99  2026", "\\u{1b}[8m\\u{9b}2J", "boogie\\u{202e}woogie", "mal\\u{202e}"]
    {
        assert!(log.contains(part), "{part} is missing in\n{log}");
    }
    assert!(shown["tenant list --data"].contains("--data: DISABLED (\"bye\\n"));
    // The JSON is the same data.
    let lines = &shown["log show --json"];
    let last: serde_json::Value = serde_json::from_str(lines.lines().last().unwrap()).unwrap();
    assert_eq!(last["event"]["reason"], evil());
    // No cell of the table is a formula, and a spreadsheet shows the words.
    let table = fs::read_to_string(&csv).unwrap();
    assert!(table.contains(",\"'=HYPERLINK(\"\"x\"\")\\u{feff} the mug\","), "{table}");
}

#[test]
fn a_transcript_of_an_old_log_plays_as_itself() {
    let Old { data, dir, _folder } = old();
    for name in [NAME, "pat\u{202e}"] {
        let ran = run(&["replay", "--data", &data, "--user", name, "--transcript"], "");
        assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
        let file = dir.join("transcript.txt");
        fs::write(&file, &ran.out).unwrap();
        let checked = run(&["transcript", "check", &file.display().to_string()], "");
        let clean = (Some(0), "", "");
        assert_eq!((checked.code, &*checked.out, &*checked.err), clean, "{}", ran.out);
        assert!(ran.out.contains("\n> boogie\u{fffd}woogie\u{fffd}user victim\n"), "{}", ran.out);
        let remark =
            "with � in place of each special character: boogie\\u{202e}woogie\\u{2028}user";
        assert!(ran.out.contains(remark), "{}", ran.out);
    }
}

#[test]
fn a_transcript_with_a_hidden_character_is_refused_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("t.txt");
    fs::write(&file, "task free kitchen\nepisode\n> go\u{202e}to\n").unwrap();
    let ran = run(&["transcript", "check", &file.display().to_string()], "");
    assert_eq!(ran.code, Some(2));
    assert!(ran.err.contains("line 3, column 5: U+202E is not a plain character"), "{}", ran.err);
    honest("transcript check", &ran.err, &[]);
}

#[test]
fn a_person_recorded_with_an_odd_name_is_reached_and_sees_plain_lines() {
    let Old { data, .. } = &old();
    let typed = ":known\n:status\n:why\nboogie woogie\n:why\n:look\nx\u{202e}y\ndone\nskip\n";
    let ran = run(&["--data", data, "--user", "pat\u{202e}", "--seed", "3"], typed);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    honest("conversation", &ran.out, &[]);
    honest("conversation", &ran.err, &[]);
    assert!(ran.out.contains("character 2 is U+202E"), "{}", ran.out);
    assert!(ran.out.contains("You taught me 1 request"), "{}", ran.out);
    let ran = run(&["--data", data, "--user", NAME], "");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.contains("cannot be opened again"), "{}", ran.out);
    let ran = run(&["erase", "--data", data, "--user", NAME], "");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
}

#[test]
fn a_revealed_record_adds_no_line_to_what_both_readers_of_a_proof_say() {
    let Old { data, dir, _folder } = old();
    let [checkpoint, key, proof] =
        ["checkpoint", "key.pub", "mal.proof"].map(|name| dir.join(name).display().to_string());
    let fine = |arguments: &[&str]| {
        let ran = run(arguments, "");
        assert_eq!(ran.code, Some(0), "{arguments:?}: {}{}", ran.out, ran.err);
        ran.out
    };
    fine(&["checkpoint", "--data", &data, "--out", &checkpoint]);
    fs::write(&key, fine(&["checkpoint", "--data", &data, "--public-key"])).unwrap();
    let log = fine(&["log", "show", "--data", &data, "--user", NAME, "--json"]);
    let last = log.lines().count().to_string();
    fine(&["proof", "--data", &data, "--user", NAME, "--seq", &last, "--reveal", "--out", &proof]);
    let text = fine(&["verify", &proof, "--key", &key]);
    honest("verify", &text, &[]);
    assert_eq!(text.lines().count(), 4, "{text}");
    assert!(text.contains("bye\\u{a}"), "{text}");
    honest("verify --json", &fine(&["verify", &proof, "--key", &key, "--json"]), &[]);
    // The key of another log, with a name that controls a terminal. The refusal names it.
    let Some(python) = python("cryptography") else { return };
    let script = apprentice_testkit::paths::root().join("tools/verify.py");
    let second = |key: &str| {
        let mut command = Process::new(&python);
        let ran = command.arg(&script).args([&proof, "--key", key]).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (ran.status.code(), text(ran.stdout), text(ran.stderr))
    };
    let (code, out, err) = second(&key);
    assert_eq!((code, err.as_str(), out.lines().count()), (Some(0), "", 2));
    honest("verify.py", &out, &[]);
    let (code, out, err) = second(&forged_key(&fs::read_to_string(&key).unwrap()));
    assert_eq!((code, out.as_str()), (Some(1), ""), "{err}");
    assert!(err.contains("no signature by x\\u{1b}[8m\\u{a}"), "{err}");
    honest("verify.py", &err, &[]);
}

/// The same key under a name that none of our keys may have. For `tools/verify.py` it is valid.
fn forged_key(key: &str) -> String {
    use base64::Engine;
    use base64::engine::general_purpose::STANDARD;
    use sha2::Digest;
    let bytes = STANDARD.decode(key.trim().splitn(3, '+').nth(2).unwrap()).unwrap();
    let name = format!("x\u{1b}[8m\n{}", FORGED[1]);
    let hash = sha2::Sha256::digest([name.as_bytes(), b"\n", &bytes].concat());
    let tag = data_encoding::HEXLOWER.encode(&hash[..4]);
    format!("{name}+{tag}+{}", STANDARD.encode(bytes))
}
