//! The wire as other programs read it. Every message of `schema/wire.md` is exactly what the code
//! writes, and everything else is refused with one sentence.
//!
//! `UPDATE_SCHEMA=1 cargo test --test service wire::` writes the examples again. Read the
//! difference.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use apprentice::client::wire::{
    COMMANDS, ORDERS, QUERIES, Request, decode_request, decode_response, encode_request,
    encode_response,
};
use apprentice::client::{
    ActionView, ArchiveAsk, Ask, Busy, Command, DoorAsk, ErasedView, ErrorCode, Failed,
    FeedMessage, FeedView, Frame, HeadView, Heads, Hello, KeyView, KnownExemplar, OnClash, Order,
    Ordered, PersonAsk, Phase, PlainRecords, PlainView, Query, Quota, QuotaExceeded, Rejected,
    RejectionCode, Reply, Response, SealedRecords, SealedView, Status, Teachable, TenantAsk,
    TenantVerb, TenantView, Told, Waited,
};
use apprentice::events::{Ending, PersonErased, Report};
use apprentice::ids::{
    Digest, PublicKey, RequestId, Seq, Signature, StreamKey, TenantId, Timestamp, UserId,
};
use apprentice::language::{
    Accounted, Answer, Discarded, Evidence, Exemplar, LiftedUtterance, Mood, Near, Outcome, Symbol,
    Use,
};
use apprentice::limits::{FRAME_BYTES_MAX, UTTERANCE_BYTES_MAX};
use apprentice::tenancy::{Quotas, Role};
use apprentice::world::{Stage, Thing, View};
use apprentice_testkit::value::Value;

fn id() -> RequestId {
    RequestId(std::array::from_fn(|index| index as u8))
}

fn seq(number: u64) -> Seq {
    Seq::new(number).unwrap()
}

fn mind() -> Digest {
    Digest([0xab; 32])
}

fn reply(first: u64, told: Vec<Told>) -> Response {
    Response::Reply(Reply { first: seq(first), last: seq(first + told.len() as u64 - 1), told })
}

fn requests() -> Vec<(&'static str, Ask)> {
    let task = "clean Mug CounterTop".to_owned();
    let command = |command: Command| Ask::from(command);
    let teach = |actions, on_clash| command(Command::Teach { explains: seq(3), actions, on_clash });
    let start = |stage| command(Command::StartEpisode { stage });
    vec![
        ("start_episode", start(Stage::Task { task: task.clone(), seed: 7 })),
        ("start_episode drawn", start(Stage::Seed { seed: 7 })),
        ("start_episode scene", start(Stage::Scene { scene: "room = \"kitchen\"\n".into(), task })),
        ("say", command(Command::Say { utterance: "wash the coffee mug".into() })),
        ("done", command(Command::Done)),
        ("teach", teach(vec![2, 3, 4], OnClash::Ask)),
        ("teach nothing", teach(vec![], OnClash::Ask)),
        ("teach replace", teach(vec![2, 3, 4], OnClash::Replace)),
        ("finish_teaching", command(Command::FinishTeaching)),
        ("forget", command(Command::Forget { lesson: seq(9) })),
        ("close", command(Command::Close { reason: "the study is over".into() })),
        ("status", Ask::Person(PersonAsk::Query(Query::Status))),
        ("look", Ask::Person(PersonAsk::Query(Query::Look))),
        ("known", Ask::Person(PersonAsk::Query(Query::Known))),
        ("wait", Ask::Person(PersonAsk::Wait { seconds: 20 })),
        ("hello", Ask::Door(DoorAsk::Hello)),
        ("feed", Ask::Door(DoorAsk::Feed)),
        ("heads", Ask::Archive(ArchiveAsk::Heads { after: Some(STREAM), limit: 1000 })),
        ("records", Ask::Archive(ArchiveAsk::Sealed { stream: STREAM, from: seq(40), limit: 100 })),
        (
            "plain_records",
            Ask::Archive(ArchiveAsk::Plain { stream: STREAM, from: seq(40), limit: 100 }),
        ),
        ("list", order(None, TenantVerb::List)),
        ("add", give(Order::Add)),
        (
            "admit",
            give(Order::Admit {
                key: key(1),
                role: Role::Gateway,
                label: "robot in room 7".into(),
            }),
        ),
        ("retire", give(Order::Retire { key: key(1), overlap_seconds: 0 })),
        ("rotate", give(Order::Rotate { old: key(1), new: key(2), overlap_seconds: 604_800 })),
        ("disable", give(Order::Disable { reason: "the study is over".into() })),
        ("enable", give(Order::Enable)),
        ("set_quotas", give(Order::SetQuotas(quotas()))),
        ("erase", order(Some(lab()), TenantVerb::Erase { user: UserId::new("grace").unwrap() })),
    ]
}

const STREAM: StreamKey = StreamKey([7; 16]);

fn lab() -> TenantId {
    TenantId::new("lab-a").unwrap()
}

fn key(number: u8) -> PublicKey {
    PublicKey([number; 32])
}

fn quotas() -> Quotas {
    Quotas { awake_users: Some(50), utterances_per_second: Some(20), ..Quotas::default() }
}

fn order(tenant: Option<TenantId>, verb: TenantVerb) -> Ask {
    Ask::Order(TenantAsk { tenant, verb })
}

fn give(this: Order) -> Ask {
    order(Some(lab()), TenantVerb::Give(this))
}

fn evidence() -> Evidence {
    Evidence {
        lifted: vec![LiftedUtterance::parse("go to the <obj>")],
        nearest: vec![Near {
            exemplar: LiftedUtterance::parse("go to the <obj>"),
            program: "GOTO <obj:1>".parse().unwrap(),
            distance: 0.0,
            number: 1,
        }],
        threshold: 0.375,
        discarded: vec![Discarded {
            program: "PICKUP Mug".parse().unwrap(),
            reason: "the mug is not within reach".into(),
        }],
        reranked: 0,
        ..Evidence::default()
    }
}

fn answered(outcome: Outcome) -> Response {
    told("go to the mug", outcome, evidence(), Vec::new())
}

fn told(
    utterance: &str,
    outcome: Outcome,
    evidence: Evidence,
    chosen: Vec<Vec<Option<String>>>,
) -> Response {
    let (utterance, mentioned) = (utterance.to_owned(), Some(Symbol::new("Mug")));
    let answer = Answer { outcome, evidence, mentioned, chosen };
    reply(3, vec![Told::Answered { seq: seq(3), utterance, answer, actions_before: 0 }])
}

fn chosen() -> Response {
    let mug = "Mug 2".to_owned();
    let program = "PICKUP Mug".parse().unwrap();
    let outcome = Outcome::Understood { program, bindings: vec![vec![mug.clone()]] };
    let words = [
        ("please", Use::Frame),
        ("pick", Use::Verb),
        ("up", Use::Verb),
        ("2", Use::Attribute),
        ("mug", Use::Thing),
    ];
    let accounted = |(word, used): (&str, Use)| Accounted { word: word.to_owned(), used };
    let evidence = Evidence {
        lifted: vec![LiftedUtterance::parse("pick up <obj>")],
        threshold: 0.375,
        accounting: words.map(accounted).to_vec(),
        ..Evidence::default()
    };
    told("please pick up mug 2", outcome, evidence, vec![vec![Some(mug)]])
}

fn asked() -> Response {
    let evidence = Evidence {
        lifted: vec![LiftedUtterance::parse("did you wash the <obj>")],
        threshold: 0.375,
        mood: Some(Mood::Asked { word: "did".to_owned() }),
        ..Evidence::default()
    };
    told("did you wash the mug?", Outcome::NotSure, evidence, Vec::new())
}

fn status() -> Status {
    Status {
        phase: Phase::Teaching,
        seq: 7,
        episodes: 1,
        recipe: "default".into(),
        mind: mind(),
        exemplars: 44,
        lessons: 0,
        goal: Some("put a clean mug on the counter top".into()),
        progress: vec![("a mug is clean".into(), true), ("it is on the counter top".into(), false)],
        utterances: 4,
        actions: vec![ActionView {
            number: 1,
            step: "GOTO Mug".into(),
            sentence: "goes to the mug".into(),
        }],
        to_teach: vec![Teachable {
            seq: seq(3),
            utterance: "wash the coffee mug".into(),
            actions_before: 0,
            not_sure: true,
            guessed: false,
        }],
    }
}

fn report() -> Report {
    let figures = BTreeMap::from([("recall".to_owned(), 1.0)]);
    Report { exemplars: 45, threshold: 0.375, figures }
}

fn sealed() -> SealedView {
    let frame = Frame(b"APR1...".to_vec());
    SealedView { stream: STREAM, seq: seq(41), digest: mind(), frame }
}

fn plain() -> PlainView {
    PlainView {
        stream: STREAM,
        seq: seq(41),
        at: Timestamp(1_790_000_000_000_000),
        prev: Digest([0xcd; 32]),
        digest: mind(),
        kind: "SessionClosed".into(),
        event: serde_json::json!({"reason": "the study is over"}),
    }
}

/// Messages of the feed, without their topics.
fn published() -> Vec<(&'static str, FeedMessage)> {
    let message = |number, sealed, plain| FeedMessage {
        v: 1,
        start: RequestId([5; 16]),
        number,
        sealed,
        plain,
    };
    vec![
        ("feed sealed", message(17, Some(sealed()), None)),
        ("feed plain", message(17, None, Some(plain()))),
        ("feed beat", message(17, None, None)),
    ]
}

fn responses() -> Vec<(&'static str, Response)> {
    let utterance = || "wash the coffee mug".to_owned();
    let program = || "GOTO Mug; PICKUP Mug".parse().unwrap();
    let bindings = vec![vec!["Mug".to_owned()], vec!["Mug".to_owned()]];
    let learned = || Told::Learned { mind: mind(), report: report() };
    let idle =
        Status { phase: Phase::Idle, exemplars: 45, lessons: 1, to_teach: vec![], ..status() };
    vec![
        ("opened", reply(1, vec![Told::Opened { recipe: "default".into(), mind: mind() }])),
        (
            "episode_started",
            reply(
                2,
                vec![Told::EpisodeStarted {
                    goal: "put a clean mug on the counter top".into(),
                    fewest: Some(8),
                }],
            ),
        ),
        ("understood", answered(Outcome::Understood { program: program(), bindings })),
        (
            "impossible",
            answered(Outcome::Impossible {
                program: program(),
                step: 1,
                reason: "the mug is in the cabinet, which is closed".into(),
            }),
        ),
        ("not_sure", answered(Outcome::NotSure)),
        ("chosen", chosen()),
        ("asked", asked()),
        (
            "episode_ended",
            reply(
                7,
                vec![Told::EpisodeEnded {
                    ending: Ending::Achieved,
                    utterances: 4,
                    actions: 8,
                    to_teach: vec![seq(3)],
                }],
            ),
        ),
        (
            "taught",
            reply(
                8,
                vec![Told::Taught {
                    lesson: seq(8),
                    explains: seq(3),
                    utterance: utterance(),
                    program: program(),
                    first: 1,
                    last: 2,
                }],
            ),
        ),
        ("declined", reply(8, vec![Told::Declined { explains: seq(3), utterance: utterance() }])),
        (
            "forgotten",
            reply(
                12,
                vec![
                    Told::Forgotten { lesson: seq(8), utterance: utterance() },
                    Told::Learning { lessons: 0 },
                ],
            ),
        ),
        ("learning", reply(9, vec![Told::Learning { lessons: 1 }])),
        ("closed", reply(14, vec![Told::Closed { reason: "the study is over".into() }])),
        ("waited", Response::Waited(Waited { status: idle.clone(), told: vec![learned()] })),
        (
            "waited in vain",
            Response::Waited(Waited {
                status: idle,
                told: vec![Told::LearningFailed { reason: "seed 12 lost its program".into() }],
            }),
        ),
        ("status answer", Response::Status(status())),
        (
            "look answer",
            Response::Look(View {
                summary: vec!["You are in a kitchen.".into()],
                things: vec![Thing {
                    name: "Mug 2".into(),
                    kind: Symbol::new("Mug"),
                    place: Some("CounterTop".into()),
                    at: (120, -40),
                    states: vec!["dirty".into()],
                }],
            }),
        ),
        (
            "known answer",
            Response::Known(vec![KnownExemplar {
                exemplar: Exemplar {
                    utterance: LiftedUtterance::parse("wash the <obj>"),
                    program: "GOTO <obj:1>; PICKUP <obj:1>".parse().unwrap(),
                },
                lesson: Some(seq(8)),
            }]),
        ),
        (
            "hello answer",
            Response::Hello(Hello {
                service: "apprentice".into(),
                version: "0.2.0".into(),
                domain: "household".into(),
                recipe: "default".into(),
            }),
        ),
        (
            "feed answer",
            Response::Feed(FeedView {
                start: RequestId([5; 16]),
                sealed: Some("tcp://192.0.2.7:7200".into()),
                plain: None,
            }),
        ),
        (
            "heads answer",
            Response::Heads(Heads {
                heads: vec![HeadView { stream: STREAM, seq: seq(41), digest: mind() }],
                more: false,
            }),
        ),
        (
            "records answer",
            Response::Records(SealedRecords { records: vec![sealed()], more: true }),
        ),
        (
            "plain_records answer",
            Response::PlainRecords(PlainRecords {
                erased: false,
                records: vec![plain()],
                more: false,
            }),
        ),
        ("ordered", Response::Ordered(Ordered { tenant: lab(), recorded: 1 })),
        (
            "tenants answer",
            Response::Tenants(vec![TenantView {
                tenant: lab(),
                disabled: None,
                quotas: quotas(),
                keys: vec![KeyView {
                    key: key(1),
                    role: Role::Gateway,
                    label: "robot in room 7".into(),
                    admitted_at: Timestamp(1_790_000_000_000_000),
                    valid_until: Some(Timestamp(1_790_604_800_000_000)),
                    retired: false,
                }],
            }]),
        ),
        (
            "erased",
            Response::Erased(ErasedView {
                tenant: lab(),
                erased: PersonErased {
                    stream: StreamKey([7; 16]),
                    last: seq(41),
                    head: mind(),
                    signature: Signature([9; 64]),
                },
            }),
        ),
        (
            "denied",
            Response::Error(Failed {
                code: ErrorCode::Denied,
                message: "this needs a key with the role gateway; yours is auditor".into(),
            }),
        ),
        (
            "rejected",
            Response::Rejected(Rejected {
                code: RejectionCode::StillLearning,
                message: "still learning from the last lessons; try again in a moment".into(),
            }),
        ),
        (
            "busy",
            Response::Busy(Busy {
                message: "you have too many requests waiting; send it again in a moment".into(),
                retry_after_ms: 100,
            }),
        ),
        (
            "quota exceeded",
            Response::QuotaExceeded(QuotaExceeded {
                quota: Quota::Utterances,
                used: 20,
                limit: 10,
                retry_after_ms: Some(100),
                message: "this tenant may say 10 utterances a second".into(),
            }),
        ),
        (
            "log full",
            Response::QuotaExceeded(QuotaExceeded {
                quota: Quota::SealedBytes,
                used: 1_000_200,
                limit: 1_000_000,
                retry_after_ms: None,
                message: "this tenant has 1000200 bytes in the log, of 1000000 that it may have; \
                          the operator can allow more"
                    .into(),
            }),
        ),
        (
            "error",
            Response::Error(Failed {
                code: ErrorCode::UnsupportedVersion,
                message: "wire version 2 is not spoken here; this service speaks 1".into(),
            }),
        ),
    ]
}

fn messages() -> Vec<(&'static str, Vec<u8>)> {
    let user = UserId::new("ada").unwrap();
    let request =
        |(name, ask)| (name, encode_request(&Request { id: id(), user: user.clone(), ask }));
    let response = |(name, response)| (name, encode_response(id(), response));
    let published = |(name, message): (_, FeedMessage)| (name, message.encode());
    let (requests, responses) = (requests().into_iter(), responses().into_iter());
    let both = requests.map(request).chain(responses.map(response));
    both.chain(self::published().into_iter().map(published)).collect()
}

fn page() -> PathBuf {
    apprentice_testkit::paths::root().join("schema/wire.md")
}

/// The page's examples: the name in `<!-- example: NAME -->`, and the fenced text that follows.
fn examples(page: &str) -> Vec<(String, String)> {
    let mut parts = page.split("<!-- example: ");
    parts.next();
    parts
        .map(|part| {
            let (name, rest) = part.split_once(" -->").expect("the comment is closed");
            let (_, rest) = rest.split_once("```json\n").expect("a json fence follows");
            let (text, _) = rest.split_once("```").expect("the fence is closed");
            (name.to_owned(), text.trim().to_owned())
        })
        .collect()
}

#[test]
fn every_message_is_on_the_page_as_the_code_writes_it() {
    let written: BTreeMap<String, String> = messages()
        .iter()
        .map(|(name, bytes)| ((*name).to_owned(), Value::from_wire(bytes).notation()))
        .collect();
    let mut text = fs::read_to_string(page()).unwrap();
    if std::env::var_os("UPDATE_SCHEMA").is_some() {
        for (name, _) in examples(&text) {
            let marker = format!("<!-- example: {name} -->");
            let (before, after) = text.split_once(&marker).unwrap();
            let (_, after) = after.split_once("```json\n").unwrap();
            let (_, after) = after.split_once("```").unwrap();
            let body = written.get(&name).unwrap_or_else(|| panic!("no message is named {name:?}"));
            text = format!("{before}{marker}\n```json\n{body}\n```{after}");
        }
        fs::write(page(), &text).unwrap();
    }
    let found = examples(&text);
    for (name, example) in &found {
        let wanted = written.get(name).unwrap_or_else(|| panic!("no message is named {name:?}"));
        assert_eq!(
            example, wanted,
            "the example {name:?} is stale: UPDATE_SCHEMA=1 writes it anew"
        );
    }
    let names: Vec<&String> = found.iter().map(|(name, _)| name).collect();
    for name in written.keys() {
        assert_eq!(names.iter().filter(|n| **n == name).count(), 1, "{name:?} is on the page once");
    }
}

#[test]
fn every_example_is_understood_and_written_back_alike() {
    let examples: BTreeMap<String, String> =
        examples(&fs::read_to_string(page()).unwrap()).into_iter().collect();
    for (name, ask) in requests() {
        let read = decode_request(&Value::from_notation(&examples[name]).to_wire())
            .unwrap_or_else(|refused| panic!("{name}: {refused:?}"));
        assert_eq!(read, Request { id: id(), user: UserId::new("ada").unwrap(), ask }, "{name}");
    }
    for (name, response) in responses() {
        let read = decode_response(&Value::from_notation(&examples[name]).to_wire())
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(read, (id(), response), "{name}");
    }
    for (name, message) in published() {
        let read = FeedMessage::decode(&Value::from_notation(&examples[name]).to_wire());
        assert_eq!(read, Ok(message), "{name}");
    }
}

#[test]
fn every_verb_has_an_example() {
    let names: Vec<&str> = requests().iter().map(|(name, _)| *name).collect();
    for verb in COMMANDS.iter().chain(&QUERIES).chain(&ORDERS) {
        assert!(names.contains(verb), "{verb}");
    }
}

/// A request map with some fields replaced. A field that is None is left out.
fn request_with(fields: &[(&str, Option<Value>)]) -> Vec<u8> {
    let mut map = vec![
        ("v".to_owned(), Value::Unsigned(1)),
        ("id".to_owned(), Value::Bytes(id().0.to_vec())),
        ("user".to_owned(), Value::Text("ada".into())),
        ("command".to_owned(), Value::Text("done".into())),
    ];
    for (name, value) in fields {
        map.retain(|(key, _)| key != name);
        if let Some(value) = value {
            map.push(((*name).to_owned(), value.clone()));
        }
    }
    Value::Map(map).to_wire()
}

/// How a request is refused: if it can be answered, the code, and the sentence.
fn refusal(bytes: &[u8]) -> (bool, ErrorCode, String) {
    let refused = decode_request(bytes).expect_err("it is no request");
    assert!(refused.id.is_none_or(|found| found == id()));
    (refused.id.is_some(), refused.failed.code, refused.failed.message)
}

fn verb(name: &str, arguments: Value) -> Option<Value> {
    Some(Value::Map(vec![(name.to_owned(), arguments)]))
}

#[test]
fn fields_that_nobody_knows_are_ignored() {
    let plain = decode_request(&request_with(&[])).unwrap();
    let say = |more: Vec<(String, Value)>| {
        let said = ("utterance".to_owned(), Value::Text("go to the mug".into()));
        let arguments = Value::Map([vec![said], more].concat());
        decode_request(&request_with(&[("command", verb("say", arguments))])).unwrap()
    };
    let unknown = vec![("mood".to_owned(), Value::List(vec![Value::Nil, Value::Double(0.5)]))];
    assert_eq!(decode_request(&request_with(&[("mood", Some(Value::Bool(true)))])).unwrap(), plain);
    assert_eq!(say(unknown), say(vec![]));
}

#[test]
fn verbs_that_nobody_knows_are_refused_by_name() {
    for bytes in [
        request_with(&[("command", Some(Value::Text("dance".into())))]),
        request_with(&[("command", verb("dance", Value::Map(vec![])))]),
        request_with(&[("command", None), ("query", Some(Value::Text("dance".into())))]),
    ] {
        let (answerable, code, message) = refusal(&bytes);
        assert!(answerable, "{message}");
        assert_eq!(code, ErrorCode::UnknownVerb);
        assert!(message.contains("\"dance\""), "{message}");
    }
}

#[test]
fn commands_from_inside_the_service_are_refused_at_the_door() {
    for name in ["open", "finish_retrain"] {
        let bytes = request_with(&[("command", verb(name, Value::Map(vec![])))]);
        let (answerable, code, message) = refusal(&bytes);
        assert!(answerable, "{message}");
        assert_eq!(code, ErrorCode::InternalVerb);
        assert!(message.contains(name), "{message}");
    }
}

/// Records of erasures and of evidence come from the service itself. No message can order them,
/// even with the right spelling.
#[test]
fn orders_from_inside_the_service_are_none_at_the_door() {
    for name in ["open", "note_erasure", "close_segment"] {
        let bytes = request_with(&[("command", None), ("order", verb(name, Value::Map(vec![])))]);
        let (answerable, code, message) = refusal(&bytes);
        assert!(answerable, "{message}");
        assert_eq!(code, ErrorCode::UnknownVerb);
        assert!(message.contains(name), "{message}");
    }
    let path = request_with(&[
        ("command", None),
        ("order", Some(Value::Text("list".into()))),
        ("tenant", Some(Value::Text("../lab-a".into()))),
    ]);
    let (answerable, code, message) = refusal(&path);
    assert!(answerable && code == ErrorCode::Malformed && message.contains("tenant"), "{message}");
}

#[test]
fn other_versions_are_refused_with_what_is_spoken() {
    let (answerable, code, message) = refusal(&request_with(&[("v", Some(Value::Unsigned(2)))]));
    assert!(answerable, "{message}");
    assert_eq!(code, ErrorCode::UnsupportedVersion);
    assert_eq!(message, "wire version 2 is not spoken here; this service speaks 1");
}

#[test]
fn each_fault_is_named() {
    let text = |text: &str| Some(Value::Text(text.into()));
    let not_utf8 = {
        // "ada" with its last letter replaced by a byte that is no UTF-8.
        let mut bytes = request_with(&[]);
        let place = bytes.windows(3).position(|w| w == b"ada").unwrap();
        bytes[place + 2] = 0xff;
        bytes
    };
    let trailing = [request_with(&[]), vec![0xc0]].concat();
    let two_verbs =
        Value::Map(vec![("done".to_owned(), Value::Nil), ("say".to_owned(), Value::Map(vec![]))]);
    let nested = (0..100).fold(Value::Nil, |inner, _| Value::List(vec![inner]));
    let huge = "x".repeat(FRAME_BYTES_MAX);
    for (bytes, wanted_code, words) in [
        (request_with(&[("v", None)]), ErrorCode::Malformed, "v cannot be read"),
        (request_with(&[("user", None)]), ErrorCode::Malformed, "user"),
        (request_with(&[("user", text(""))]), ErrorCode::Malformed, "must not be empty"),
        (request_with(&[("user", text("a\nb"))]), ErrorCode::Malformed, "may not contain"),
        (not_utf8, ErrorCode::Malformed, "user"),
        (request_with(&[("command", None)]), ErrorCode::Malformed, "neither"),
        (request_with(&[("query", text("status"))]), ErrorCode::Malformed, "both"),
        (request_with(&[("command", Some(Value::Unsigned(3)))]), ErrorCode::Malformed, "verb"),
        (request_with(&[("command", Some(two_verbs))]), ErrorCode::Malformed, "verb"),
        (request_with(&[("command", text("say"))]), ErrorCode::Malformed, "\"say\""),
        (
            request_with(&[("command", verb("say", Value::Map(vec![])))]),
            ErrorCode::Malformed,
            "utterance",
        ),
        (request_with(&[("mood", text(&huge))]), ErrorCode::TooLarge, "at most"),
    ] {
        let (answerable, code, message) = refusal(&bytes);
        assert!(answerable, "{message}");
        assert_eq!(code, wanted_code, "{message}");
        assert!(message.contains(words), "{message:?} says {words:?}");
    }
    for bytes in [
        vec![],
        b"GET / HTTP/1.1\r\n\r\n".to_vec(),
        trailing,
        request_with(&[("id", None)]),
        request_with(&[("id", Some(Value::Bytes(vec![1; 15])))]),
        request_with(&[("mood", Some(nested))]),
    ] {
        let (answerable, code, _) = refusal(&bytes);
        assert!(!answerable, "whom to answer is not known: {bytes:?}");
        assert_eq!(code, ErrorCode::Malformed);
    }
}

#[test]
fn a_long_utterance_reaches_the_session_which_says_what_is_wrong() {
    let long = "go ".repeat(UTTERANCE_BYTES_MAX);
    let said = Value::Map(vec![("utterance".to_owned(), Value::Text(long.clone()))]);
    let request = decode_request(&request_with(&[("command", verb("say", said))])).unwrap();
    assert_eq!(request.ask, Ask::Person(PersonAsk::Command(Command::Say { utterance: long })));
}

#[test]
fn no_bytes_make_the_decoders_panic() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    println!("seed {state:#x}");
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state as usize
    };
    let messages = messages();
    for _ in 0..20_000 {
        let mut bytes = messages[random() % messages.len()].1.clone();
        for _ in 0..1 + random() % 4 {
            let place = random() % bytes.len();
            match random() % 3 {
                0 => bytes[place] = random() as u8,
                1 => bytes.truncate(place.max(1)),
                _ => bytes.insert(place, random() as u8),
            }
        }
        let _ = decode_request(&bytes);
        let _ = decode_response(&bytes);
    }
}
