//! Every kind of answer, and the messages of the feed.

use std::collections::BTreeMap;

use apprentice::client::{
    ActionView, Busy, ErasedView, ErrorCode, Failed, FeedMessage, FeedView, Frame, HeadView, Heads,
    Hello, KeyView, KnownExemplar, Ordered, Phase, PlainRecords, PlainView, Quota, QuotaExceeded,
    Rejected, RejectionCode, Reply, Response, SealedRecords, SealedView, Status, Teachable,
    TenantView, Told, Waited,
};
use apprentice::events::{Ending, PersonErased, Report};
use apprentice::ids::{Digest, RequestId, Signature, StreamKey, Timestamp};
use apprentice::language::{
    Accounted, Answer, AnswerOption, Discarded, Evidence, Exemplar, LiftedUtterance, Mood, Near,
    Outcome, Question, Symbol, Use,
};
use apprentice::tenancy::Role;
use apprentice::world::{Thing, View};

use super::{STREAM, key, lab, mind, quotas, seq};

pub fn responses() -> Vec<(&'static str, Response)> {
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
        ("asked which", asked_which()),
        ("told", told_where()),
        ("marked_wrong", reply(5, vec![marked()])),
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

/// Messages of the feed, without their topics.
pub fn published() -> Vec<(&'static str, FeedMessage)> {
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

fn reply(first: u64, told: Vec<Told>) -> Response {
    Response::Reply(Reply { first: seq(first), last: seq(first + told.len() as u64 - 1), told })
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

fn asked_which() -> Response {
    let option = |label: &str, kind: &str| AnswerOption {
        label: label.to_owned(),
        program: format!("GOTO {kind}").parse().unwrap(),
        bindings: vec![vec![kind.to_owned()]],
        chosen: Vec::new(),
        mentioned: Some(Symbol::new(kind)),
    };
    let text = "Which table: the dining table or the side table?".to_owned();
    let options =
        vec![option("the dining table", "DiningTable"), option("the side table", "SideTable")];
    let outcome = Outcome::Asked { question: Question { text, options } };
    told("go to the table", outcome, Evidence::default(), Vec::new())
}

fn told_where() -> Response {
    let text = "The mug is in the sink basin.".to_owned();
    told("where is the mug?", Outcome::Told { text }, Evidence::default(), Vec::new())
}

fn marked() -> Told {
    Told::MarkedWrong { act: seq(4), utterance: "that was wrong".to_owned() }
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
