//! Every verb × every name × every trick × every role.

use apprentice::client::wire::{COMMANDS, INTERNAL_COMMANDS, ORDERS, QUERIES};
use apprentice::ids::RequestId;
use serde::Serialize;
use serde_json::{Value, json};

use super::labs::Lab;

/// One message, and whether it can be answered.
pub struct Attempt {
    /// The attacker's key that sends it.
    pub key: &'static str,
    pub trick: &'static str,
    pub verb: String,
    /// None when the message has no id that could be read.
    pub id: Option<RequestId>,
    pub frames: Vec<Vec<u8>>,
}

impl std::fmt::Debug for Attempt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} as {} by {}", self.verb, self.key, self.trick)
    }
}

impl Attempt {
    pub fn is_answered(&self) -> bool {
        self.id.is_some()
    }
}

/// A request as another program writes it, with any fields.
#[derive(Serialize)]
struct Raw<'a> {
    v: u64,
    id: RequestId,
    user: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<&'a Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    query: Option<&'a Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    order: Option<&'a Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tenant: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    role: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stream: Option<&'a str>,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Command,
    Query,
    Order,
}

/// Verbs with arguments that would change or show something if they reached their goal.
fn verbs(victim: &Lab) -> Vec<(Kind, String, Value)> {
    let arguments = |verb: &str| match verb {
        "start_episode" => json!({"stage": {"task": {"task": "place Mug SinkBasin", "seed": 3}}}),
        "say" => json!({"utterance": "go to the fridge"}),
        "teach" => json!({"explains": 3, "actions": [1], "on_clash": "replace"}),
        "forget" => json!({"lesson": 7}),
        "close" => json!({"reason": "over"}),
        "open" => json!({"user": "ada", "recipe_text": "", "mind": "00".repeat(32)}),
        "finish_retrain" => json!({"recipe": "00".repeat(32), "outcome": {"Err": "no"}}),
        "wait" => json!({"seconds": 0}),
        "heads" => json!({"after": null, "limit": 1000}),
        "records" | "plain_records" => {
            json!({"stream": victim.person().to_hex(), "from": 1, "limit": 100})
        }
        "admit" => json!({"key": "11".repeat(32), "role": "operator", "label": "mine"}),
        "retire" => json!({"key": victim.public("gateway").to_hex(), "overlap_seconds": 0}),
        "rotate" => json!({
            "old": victim.public("gateway").to_hex(), "new": "12".repeat(32), "overlap_seconds": 0
        }),
        "disable" => json!({"reason": "hostile"}),
        "set_quotas" => json!({"awake_users": 1}),
        "erase" => json!({"user": "ada"}),
        _ => Value::Null,
    };
    let value = |verb: &str| match arguments(verb) {
        Value::Null => json!(verb),
        arguments => json!({ verb: arguments }),
    };
    let mut all = Vec::new();
    for verb in COMMANDS.iter().chain(&INTERNAL_COMMANDS) {
        all.push((Kind::Command, (*verb).to_owned(), value(verb)));
    }
    for verb in QUERIES {
        all.push((Kind::Query, verb.to_owned(), value(verb)));
    }
    for verb in ORDERS {
        all.push((Kind::Order, verb.to_owned(), value(verb)));
    }
    all
}

/// Names that could lead to a person of the other lab.
fn names(victim: &Lab) -> Vec<(&'static str, String)> {
    let (lab, ada) = (&victim.name, victim.known);
    vec![
        ("the same name", ada.to_owned()),
        ("another person", "eve".to_owned()),
        ("lab and name", format!("{lab}/{ada}")),
        ("lab and name", format!("{lab}:{ada}")),
        ("a path", format!("../{lab}/{ada}")),
        ("a path", format!("../../keys/users/{lab}/{ada}.key")),
        ("a path", "/etc/passwd".to_owned()),
        ("a path", format!("users\\{lab}\\{ada}")),
        ("NUL", format!("{ada}\0")),
        ("NUL", format!("{lab}\0{ada}")),
        ("NUL", format!("\0{ada}")),
        ("a homoglyph", ada.replace('a', "\u{430}")),
        ("a homoglyph", format!("{ada}\u{200b}")),
        ("a homoglyph", "\u{ff41}da".to_owned()),
        ("a homoglyph", format!("\u{202e}{ada}")),
        ("a stream", victim.stream_text()),
        ("a stream", "00".repeat(16)),
        ("a wildcard", "*".to_owned()),
        ("a wildcard", "%".to_owned()),
        ("a format", "{lab}%s%n".to_owned()),
        ("nothing", String::new()),
        ("a long name", ada.repeat(200)),
    ]
}

/// What is put into the message, or around it, besides the name.
const TRICKS: [&str; 8] = [
    "no trick",
    "a tenant in the request",
    "a role in the request",
    "a stream in the request",
    "the host's tenant in the request",
    "a replayed id",
    "an empty frame first",
    "a frame too many",
];

pub fn attempts(attacker: &Lab, victim: &Lab) -> Vec<Attempt> {
    let mut all = Vec::new();
    let (verbs, names) = (verbs(victim), names(victim));
    let keys: Vec<&'static str> = attacker.keys().map(|(name, _)| name).collect();
    let mut count: u64 = 0;
    let mut replayed: Option<Vec<Vec<u8>>> = None;
    for (kind, verb, value) in &verbs {
        for (about, name) in &names {
            for trick in TRICKS {
                // Each combination comes from one role in turn, and the plain ones from all roles.
                let every = trick == "no trick" || trick.starts_with("a tenant");
                let turn = count as usize % keys.len();
                for key in keys.iter().enumerate().filter(|(at, _)| every || *at == turn) {
                    count += 1;
                    let mut id = [0x5a; 16];
                    id[8..].copy_from_slice(&count.to_be_bytes());
                    let mut id = RequestId(id);
                    if trick == "a replayed id" {
                        id = victim.said;
                    }
                    let raw = Raw {
                        v: 1,
                        id,
                        user: name,
                        command: (*kind == Kind::Command).then_some(value),
                        query: (*kind == Kind::Query).then_some(value),
                        order: (*kind == Kind::Order).then_some(value),
                        tenant: match trick {
                            "a tenant in the request" => Some(&victim.name),
                            "the host's tenant in the request" => Some("local"),
                            _ => None,
                        },
                        role: trick.contains("role").then_some("operator"),
                        stream: trick.contains("stream").then_some("0000"),
                    };
                    let frame = rmp_serde::to_vec_named(&raw).unwrap();
                    let frames = match trick {
                        "an empty frame first" => vec![Vec::new(), frame.clone()],
                        "a frame too many" => vec![frame.clone(), victim.name.clone().into_bytes()],
                        _ => vec![frame.clone()],
                    };
                    let id = (trick != "a frame too many").then_some(id);
                    let verb = format!("{verb} ({about})");
                    all.push(Attempt { key: key.1, trick, verb, id, frames });
                    replayed.get_or_insert_with(|| vec![frame]);
                }
            }
        }
    }
    // A copy of a whole frame from every key: the first request.
    for key in keys {
        let mut id = [0x5a; 16];
        id[8..].copy_from_slice(&1u64.to_be_bytes());
        all.push(Attempt {
            key,
            trick: "a replayed frame",
            verb: "the first request".to_owned(),
            id: Some(RequestId(id)),
            frames: replayed.clone().expect("there was a first one"),
        });
    }
    all
}
