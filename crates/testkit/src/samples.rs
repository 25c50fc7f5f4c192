//! At least one sample event of every kind, and the meaning of each field.

use std::collections::BTreeMap;

use apprentice::events::{
    DecompositionDeclined, DecompositionTaught, Ending, EpisodeEnded, EpisodeStarted, Event,
    Interpreted, KeyAdmitted, KeyRetired, LessonForgotten, MarkedWrong, Overlap, PersonErased,
    Quotas, QuotasSet, Report, RetrainCompleted, RetrainFailed, RetrainScheduled, Role,
    SegmentClosed, SessionClosed, SessionOpened, TenantDisabled, TenantEnabled, TenantOpened,
};
use apprentice::ids::{Digest, PublicKey, Seq, Signature, StreamKey, Timestamp, UserId};
use apprentice::language::{
    Accounted, Answer, AnswerOption, Answerer, Discarded, Document, Evidence, LiftedUtterance,
    Mood, Near, Outcome, Program, Question, Symbol, Use, Utterance,
};
use serde_json::json;

/// Name of the golden files, and the event. The first sample of a kind has the name of the kind.
pub fn samples() -> Vec<(&'static str, Event)> {
    vec![
        ("session_opened", Event::SessionOpened(session_opened())),
        ("episode_started", Event::EpisodeStarted(episode_started(Some(7), Some(10)))),
        ("episode_started_from_file", Event::EpisodeStarted(episode_started(None, None))),
        ("interpreted", Event::Interpreted(interpreted(understood()))),
        ("interpreted_impossible", Event::Interpreted(interpreted(impossible()))),
        ("interpreted_not_sure", Event::Interpreted(interpreted(Outcome::NotSure))),
        ("interpreted_by_the_baseline", Event::Interpreted(by_the_baseline())),
        ("interpreted_chosen", Event::Interpreted(chosen())),
        ("interpreted_forbidden", Event::Interpreted(forbidden())),
        ("interpreted_left_over", Event::Interpreted(left_over())),
        ("interpreted_asked", Event::Interpreted(asked())),
        ("interpreted_told", Event::Interpreted(told())),
        ("interpreted_option", Event::Interpreted(option())),
        ("episode_ended", Event::EpisodeEnded(episode_ended(Ending::Achieved))),
        ("episode_ended_abandoned", Event::EpisodeEnded(episode_ended(Ending::Abandoned))),
        ("decomposition_taught", Event::DecompositionTaught(taught())),
        ("decomposition_declined", Event::DecompositionDeclined(declined())),
        ("lesson_forgotten", Event::LessonForgotten(forgotten())),
        ("retrain_scheduled", Event::RetrainScheduled(scheduled())),
        ("retrain_completed", Event::RetrainCompleted(completed())),
        ("retrain_failed", Event::RetrainFailed(failed())),
        ("session_closed", Event::SessionClosed(closed())),
        ("marked_wrong", Event::MarkedWrong(marked_wrong(Some("that was wrong")))),
        ("marked_wrong_by_command", Event::MarkedWrong(marked_wrong(None))),
        ("tenant_opened", TenantOpened {}.into()),
        ("key_admitted", key_admitted().into()),
        ("key_retired", key_retired().into()),
        ("tenant_disabled", TenantDisabled { reason: "the study is over".to_owned() }.into()),
        ("tenant_enabled", TenantEnabled {}.into()),
        ("quotas_set", QuotasSet { quotas: quotas() }.into()),
        ("person_erased", person_erased().into()),
        ("segment_closed", segment_closed().into()),
    ]
}

/// Fields whose content belongs to the domain.
pub const DOCUMENTS: [&str; 2] = ["episode_started.scene", "episode_started.task"];

/// What each field means. A field without a line here fails the test.
pub const MEANINGS: &[(&str, &str)] = &[
    ("session_opened.user", "the person, as the tenant's gateway names them"),
    ("session_opened.domain", "the world they talk about"),
    ("session_opened.domain_version", "which rules of that world apply"),
    ("session_opened.recipe", "the recipe's name"),
    ("session_opened.recipe_text", "the recipe itself (TOML)"),
    ("session_opened.recipe_digest", "BLAKE3 of the recipe's settings"),
    ("session_opened.mind", "digest of the base mind they start with"),
    ("episode_started.scene", "the whole scene, a document of the domain"),
    ("episode_started.scene_digest", "BLAKE3 of the scene's compact JSON text with sorted keys"),
    ("episode_started.task", "the task, a document of the domain"),
    ("episode_started.goal", "the task as a sentence"),
    ("episode_started.seed", "seed of a drawn stage; null when a scene file was given"),
    ("episode_started.fewest", "the fewest primitives that achieve the task, if known"),
    ("interpreted.utterance", "what was typed"),
    ("interpreted.answer.outcome", "understood, impossible, not_sure, asked or told"),
    ("interpreted.answer.outcome.understood.program", "what was carried out"),
    ("interpreted.answer.outcome.understood.bindings[][]", "the things each step acted on"),
    ("interpreted.answer.outcome.impossible.program", "what was understood and not carried out"),
    ("interpreted.answer.outcome.impossible.step", "the step that fails, counted from 0"),
    ("interpreted.answer.outcome.impossible.reason", "why it fails"),
    (
        "interpreted.answer.chosen[][]",
        "per step and argument the thing that words chose; null or absent: the world chooses",
    ),
    (
        "interpreted.answer.evidence.accounting[].word",
        "a word or phrase; absent if the recipe does not account for words",
    ),
    (
        "interpreted.answer.evidence.accounting[].as",
        "its use: frame, verb, thing, attribute, landmark, harmless or nothing",
    ),
    (
        "interpreted.answer.evidence.mood.forbidden.word",
        "the word that forbids; likewise asked, told, conditional, later, reordered; absent: a request",
    ),
    ("interpreted.answer.outcome.asked.question.text", "the question to the person"),
    ("interpreted.answer.outcome.asked.question.options[].label", "an answer that it offers"),
    ("interpreted.answer.outcome.asked.question.options[].program", "what that answer leads to"),
    (
        "interpreted.answer.outcome.asked.question.options[].bindings[][]",
        "per step the things that it acts on",
    ),
    (
        "interpreted.answer.outcome.asked.question.options[].mentioned",
        "the type that the program is about, for a later \"it\"",
    ),
    ("interpreted.answer.outcome.told.text", "what the robot said"),
    ("interpreted.answer.evidence.replies_to", "the record with the question that this answers"),
    ("interpreted.answer.evidence.lifted[]", "the utterance as the parser saw it, by clause"),
    ("interpreted.answer.evidence.nearest[].exemplar", "a near exemplar, nearest first"),
    ("interpreted.answer.evidence.nearest[].program", "what it stands for"),
    ("interpreted.answer.evidence.nearest[].distance", "its distance, no unit"),
    ("interpreted.answer.evidence.nearest[].number", "its number among the mind's exemplars"),
    ("interpreted.answer.evidence.threshold", "the distance up to which an exemplar counts"),
    ("interpreted.answer.evidence.discarded[].program", "a candidate that was dropped"),
    ("interpreted.answer.evidence.discarded[].reason", "why it was dropped"),
    ("interpreted.answer.evidence.reranked", "candidates the reranker chose from; 0: not asked"),
    (
        "interpreted.answer.evidence.answered_by[]",
        "which part of the parser answered each clause: grammar or seq2seq; absent if it has no parts",
    ),
    ("interpreted.answer.mentioned", "the type of the last mention, for a later \"it\""),
    ("interpreted.actions_before", "primitives carried out in the episode before"),
    ("interpreted.scene_after", "digest of the scene afterwards"),
    ("interpreted.mind", "digest of the mind that answered"),
    ("episode_ended.ending", "achieved or abandoned"),
    ("episode_ended.utterances", "utterances of the episode"),
    ("episode_ended.actions", "primitives carried out"),
    ("episode_ended.to_teach[]", "the interpreted events that may be taught now"),
    ("decomposition_taught.explains", "the interpreted event that is explained"),
    ("decomposition_taught.utterance", "its utterance"),
    ("decomposition_taught.program", "what it stands for"),
    ("decomposition_taught.first", "first action of the run, counted from 1 in the episode"),
    ("decomposition_taught.last", "last action of the run, included"),
    ("decomposition_declined.explains", "the interpreted event that nothing explained"),
    ("decomposition_declined.utterance", "its utterance"),
    ("lesson_forgotten.lesson", "the decomposition_taught event that is taken back"),
    ("lesson_forgotten.utterance", "its utterance"),
    ("retrain_scheduled.recipe", "digest of the recipe to train by"),
    ("retrain_scheduled.lessons[]", "the live lessons, in order"),
    ("retrain_completed.recipe", "digest of the recipe"),
    ("retrain_completed.mind", "digest of the new mind"),
    ("retrain_completed.report.exemplars", "seeds and live lessons"),
    ("retrain_completed.report.threshold", "the calibrated threshold"),
    ("retrain_completed.report.figures", "other figures of this kind of parser, by name"),
    ("retrain_completed.code", "digest of the code that trained; null when version 1 did not say"),
    ("retrain_failed.recipe", "digest of the recipe"),
    ("retrain_failed.reason", "why; the previous mind stays"),
    ("marked_wrong.act", "the record of the act that was not meant"),
    ("marked_wrong.utterance", "the words that said so; absent when it was a command"),
    ("session_closed.reason", "why the person withdrew"),
    ("key_admitted.key", "the public half of a CURVE key"),
    ("key_admitted.role", "gateway, operator or auditor"),
    ("key_admitted.label", "for people: whose machine it is on"),
    ("key_retired.key", "a key that was admitted before"),
    (
        "key_retired.overlap_seconds",
        "seconds that the key still works after that reading; at most 30 days",
    ),
    (
        "key_retired.wall",
        "the reading of the wall clock, in µs since 1970; a held record time is no reading",
    ),
    ("tenant_disabled.reason", "why the tenant is shut out"),
    (
        "quotas_set.quotas.awake_users",
        "people awake at the same time; null: only the machine's limit",
    ),
    ("quotas_set.quotas.in_flight", "requests accepted and not yet answered"),
    ("quotas_set.quotas.utterances_per_second", "utterances a second, in the long run"),
    ("quotas_set.quotas.burst", "utterances at once after a silence"),
    ("quotas_set.quotas.sealed_bytes", "the total of sealed bytes in the log"),
    ("quotas_set.quotas.trainings_waiting", "trainings waiting"),
    ("person_erased.stream", "the stream of the person whose key was destroyed"),
    ("person_erased.last", "the last record of that stream"),
    ("person_erased.head", "its digest"),
    ("person_erased.signature", "Ed25519 by the tenant's key over the statement of the erasure"),
    ("segment_closed.stream", "the stream that the segment belongs to"),
    ("segment_closed.first", "its first record"),
    ("segment_closed.last", "its last record, included"),
    ("segment_closed.root", "RFC 6962 tree over the digests of these records"),
    ("segment_closed.head", "the digest of the last of them"),
];

fn seq(number: u64) -> Seq {
    Seq::new(number).unwrap()
}

fn utterance(text: &str) -> Utterance {
    Utterance::new(text).unwrap()
}

fn program(text: &str) -> Program {
    text.parse().unwrap()
}

fn session_opened() -> SessionOpened {
    SessionOpened {
        user: UserId::new("ada").unwrap(),
        domain: "household".to_owned(),
        domain_version: 1,
        recipe: "paper".to_owned(),
        recipe_text: "name = \"paper\"\n".to_owned(),
        recipe_digest: Digest::of(b"paper"),
        mind: Digest::of(b"base mind"),
    }
}

fn episode_started(seed: Option<u64>, fewest: Option<u32>) -> EpisodeStarted {
    let scene = Document::of(&json!({"objects": [{"type": "Apple", "hot": false, "x": -3}]}));
    EpisodeStarted {
        scene_digest: scene.digest(),
        scene,
        task: Document::of(&json!({"kind": "cool_and_place", "object": "Apple"})),
        goal: "cool the apple and put it on the table".to_owned(),
        seed,
        fewest,
    }
}

fn understood() -> Outcome {
    Outcome::Understood {
        program: program("GOTO Apple; PICKUP Apple"),
        bindings: vec![vec!["Apple#1".to_owned()], vec!["Apple#1".to_owned()]],
    }
}

fn impossible() -> Outcome {
    Outcome::Impossible {
        program: program("GOTO Table; PICKUP Table"),
        step: 1,
        reason: "the Table cannot be picked up".to_owned(),
    }
}

fn interpreted(outcome: Outcome) -> Interpreted {
    Interpreted {
        utterance: utterance("Hol den Apfel, 🍎!"),
        answer: Answer {
            outcome,
            evidence: Evidence {
                lifted: vec![LiftedUtterance::parse("pick up <obj>")],
                nearest: vec![Near {
                    exemplar: LiftedUtterance::parse("take <obj> from <obj=fridge>"),
                    program: "GOTO <obj:2>; PICKUP <obj:1>".parse().unwrap(),
                    distance: 0.25,
                    number: 12,
                }],
                threshold: 0.5,
                discarded: vec![Discarded {
                    program: program("PICKUP Table"),
                    reason: "the Table cannot be picked up".to_owned(),
                }],
                reranked: 2,
                ..Evidence::default()
            },
            mentioned: Some(Symbol::new("Apple")),
            chosen: Vec::new(),
        },
        actions_before: 4,
        scene_after: Digest::of(b"scene after"),
        mind: Digest::of(b"mind"),
    }
}

fn by_the_baseline() -> Interpreted {
    let mut event = interpreted(understood());
    let clauses = ["go to <obj>", "grab <obj>"];
    event.answer.evidence = Evidence {
        lifted: clauses.map(LiftedUtterance::parse).to_vec(),
        threshold: 1.0,
        answered_by: vec![Answerer::Grammar, Answerer::Seq2seq],
        ..Evidence::default()
    };
    event
}

/// "Robot, put the second mug on the table": the words chose the mug, the world chose the table.
fn chosen() -> Interpreted {
    let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    let chosen =
        |names: &[Option<&str>]| names.iter().map(|name| name.map(str::to_owned)).collect();
    let mut event = interpreted(Outcome::Understood {
        program: program("PICKUP Mug; PUT Mug DiningTable"),
        bindings: vec![names(&["Mug 2"]), names(&["Mug 2", "DiningTable"])],
    });
    event.utterance = utterance("Robot, put the second mug on the table");
    event.answer.evidence = Evidence {
        lifted: vec![LiftedUtterance::parse("put the <obj> on the <obj>")],
        threshold: 0.5,
        accounting: accounting(&[
            ("robot", Use::Frame),
            ("put", Use::Verb),
            ("the", Use::Harmless),
            ("second", Use::Attribute),
            ("mug", Use::Thing),
            ("on", Use::Harmless),
            ("the", Use::Harmless),
            ("table", Use::Thing),
        ]),
        ..Evidence::default()
    };
    event.answer.mentioned = Some(Symbol::new("DiningTable"));
    event.answer.chosen = vec![chosen(&[Some("Mug 2")]), chosen(&[Some("Mug 2"), None])];
    event
}

fn forbidden() -> Interpreted {
    let mut event = interpreted(Outcome::NotSure);
    event.utterance = utterance("do not pick up the apple");
    event.answer.evidence = Evidence {
        lifted: vec![LiftedUtterance::parse("do not pick up the <obj>")],
        threshold: 0.5,
        mood: Some(Mood::Forbidden { word: "not".to_owned() }),
        ..Evidence::default()
    };
    event
}

fn left_over() -> Interpreted {
    let mut event = interpreted(Outcome::NotSure);
    event.utterance = utterance("pick up the banana next to the apple");
    event.answer.evidence = Evidence {
        lifted: vec![LiftedUtterance::parse("pick up the banana next to the <obj>")],
        threshold: 0.5,
        accounting: accounting(&[
            ("pick", Use::Verb),
            ("up", Use::Verb),
            ("the", Use::Harmless),
            ("banana", Use::Nothing),
            ("next", Use::Harmless),
            ("to", Use::Harmless),
            ("the", Use::Harmless),
            ("apple", Use::Landmark),
        ]),
        ..Evidence::default()
    };
    event
}

fn accounting(words: &[(&str, Use)]) -> Vec<Accounted> {
    let accounted = |&(word, used): &(&str, Use)| Accounted { word: word.to_owned(), used };
    words.iter().map(accounted).collect()
}

fn episode_ended(ending: Ending) -> EpisodeEnded {
    EpisodeEnded { ending, utterances: 9, actions: 14, to_teach: vec![seq(4), seq(6)] }
}

fn taught() -> DecompositionTaught {
    DecompositionTaught {
        explains: seq(4),
        utterance: utterance("chill the apple"),
        program: program("OPEN Fridge; PUT Apple Fridge; CLOSE Fridge"),
        first: 3,
        last: 5,
    }
}

fn declined() -> DecompositionDeclined {
    DecompositionDeclined { explains: seq(6), utterance: utterance("sing a song") }
}

fn forgotten() -> LessonForgotten {
    LessonForgotten { lesson: seq(17), utterance: utterance("chill the apple") }
}

fn scheduled() -> RetrainScheduled {
    RetrainScheduled { recipe: Digest::of(b"paper"), lessons: vec![seq(17), seq(300)] }
}

fn completed() -> RetrainCompleted {
    let figures = BTreeMap::from([("precision".to_owned(), 0.9375), ("steps".to_owned(), 400.0)]);
    let report = Report { exemplars: 45, threshold: 0.42, figures };
    let code = Some(Digest::of(b"code"));
    RetrainCompleted { recipe: Digest::of(b"paper"), mind: Digest::of(b"mind"), report, code }
}

fn failed() -> RetrainFailed {
    RetrainFailed {
        recipe: Digest::of(b"paper"),
        reason: "the seed \"go to <obj>\" lost its own program".to_owned(),
    }
}

fn asked() -> Interpreted {
    let option = |label: &str, kind: &str| AnswerOption {
        label: label.to_owned(),
        program: format!("GOTO {kind}").parse().unwrap(),
        bindings: vec![vec![kind.to_owned()]],
        chosen: Vec::new(),
        mentioned: Some(Symbol::new(kind)),
    };
    let question = Question {
        text: "Which table: the dining table or the side table?".to_owned(),
        options: vec![
            option("the dining table", "DiningTable"),
            option("the side table", "SideTable"),
        ],
    };
    let mut event = interpreted(Outcome::Asked { question });
    event.utterance = utterance("go to the table");
    event.answer.mentioned = None;
    event.answer.evidence = Evidence {
        lifted: vec![LiftedUtterance::parse("go to the <obj>")],
        threshold: 0.5,
        ..Evidence::default()
    };
    event
}

fn told() -> Interpreted {
    let text = "The mug is in the sink basin.".to_owned();
    let mut event = interpreted(Outcome::Told { text });
    event.utterance = utterance("where is the mug?");
    event.answer.mentioned = None;
    event.answer.evidence = Evidence::default();
    event
}

fn option() -> Interpreted {
    let program = "GOTO SideTable".parse().unwrap();
    let bindings = vec![vec!["SideTable".to_owned()]];
    let mut event = interpreted(Outcome::Understood { program, bindings });
    event.utterance = utterance("the side table");
    event.answer.mentioned = Some(Symbol::new("SideTable"));
    event.answer.evidence = Evidence { replies_to: Some(seq(3)), ..Evidence::default() };
    event
}

fn marked_wrong(words: Option<&str>) -> MarkedWrong {
    MarkedWrong { act: seq(4), utterance: words.map(utterance) }
}

fn closed() -> SessionClosed {
    SessionClosed { reason: "the study is over".to_owned() }
}

fn key_admitted() -> KeyAdmitted {
    let label = "the robot lab's web door".to_owned();
    KeyAdmitted { key: PublicKey([1; 32]), role: Role::Gateway, label }
}

fn key_retired() -> KeyRetired {
    let wall = Timestamp(1_700_000_000_000_000);
    KeyRetired {
        key: PublicKey([1; 32]),
        overlap: Overlap::Read { wall, overlap_seconds: 604_800 },
    }
}

fn quotas() -> Quotas {
    Quotas {
        awake_users: Some(200),
        in_flight: Some(64),
        utterances_per_second: Some(50),
        burst: Some(100),
        sealed_bytes: Some(10_000_000_000),
        trainings_waiting: None,
    }
}

fn person_erased() -> PersonErased {
    PersonErased {
        stream: StreamKey([3; 16]),
        last: seq(40),
        head: Digest::of(b"record 40"),
        signature: Signature([9; 64]),
    }
}

fn segment_closed() -> SegmentClosed {
    SegmentClosed {
        stream: StreamKey([3; 16]),
        first: seq(1),
        last: seq(12),
        root: Digest::of(b"root"),
        head: Digest::of(b"record 12"),
    }
}
