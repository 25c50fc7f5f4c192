//! Messages that are not as `schema/wire.md` describes them. Each is refused with one sentence, and no
//! bytes make the decoders panic.

use apprentice::client::wire::{decode_request, decode_response};
use apprentice::client::{Ask, Command, ErrorCode, PersonAsk};
use apprentice::limits::{FRAME_BYTES_MAX, UTTERANCE_BYTES_MAX};
use apprentice_testkit::value::Value;

use super::wire::{id, messages};

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
fn unknown_fields_are_ignored() {
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
fn unknown_verbs_are_refused_by_name() {
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
fn commands_from_inside_the_service_are_refused_on_the_wire() {
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
fn orders_from_inside_the_service_are_unknown_on_the_wire() {
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
        assert!(!answerable, "it cannot be answered: {bytes:?}");
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
