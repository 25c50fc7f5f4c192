//! The bytes of every kind of record, as released. They can still be read, they still mean the
//! same, and today's encoder still writes them. `UPDATE_GOLDEN=1` writes the files again.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use apprentice::events::{Batch, Event, EventKind, Head, Header};
use apprentice::ids::{RequestId, StreamKey, Timestamp};
use apprentice::store::{DataKey, Draft, SeededEntropy, Walk};
use apprentice_testkit::samples::{DOCUMENTS, MEANINGS, samples};
use serde_json::Value;

const STREAM: StreamKey = StreamKey(*b"golden stream 01");

fn key() -> DataKey {
    DataKey::from_bytes(*b"a key that protects nothing.....")
}

fn schema() -> PathBuf {
    apprentice_testkit::paths::root().join("schema")
}

fn updating() -> bool {
    std::env::var_os("UPDATE_GOLDEN").is_some_and(|value| value == "1")
}

/// The first record of a stream. Everything that is otherwise random is fixed.
fn frame(event: Event) -> Vec<u8> {
    let request = RequestId(*b"golden request 1");
    let batch = Batch { request, at: Timestamp(1_700_000_000_000_000), events: vec![event] };
    let draft = Draft::encode(batch).unwrap();
    let mut sealed = draft.seal(&key(), &SeededEntropy::new(42), STREAM, Head::EMPTY);
    sealed.frames.remove(0)
}

fn open(frame: &[u8]) -> Event {
    Walk::after(STREAM, Head::EMPTY).open(&key(), frame).unwrap().event
}

fn body(event: &Event) -> Value {
    let json = match event {
        Event::SessionOpened(body) => serde_json::to_value(body),
        Event::EpisodeStarted(body) => serde_json::to_value(body),
        Event::Interpreted(body) => serde_json::to_value(body),
        Event::EpisodeEnded(body) => serde_json::to_value(body),
        Event::DecompositionTaught(body) => serde_json::to_value(body),
        Event::DecompositionDeclined(body) => serde_json::to_value(body),
        Event::LessonForgotten(body) => serde_json::to_value(body),
        Event::RetrainScheduled(body) => serde_json::to_value(body),
        Event::RetrainCompleted(body) => serde_json::to_value(body),
        Event::RetrainFailed(body) => serde_json::to_value(body),
        Event::SessionClosed(body) => serde_json::to_value(body),
        Event::MarkedWrong(body) => serde_json::to_value(body),
        Event::Tenant(body) => serde_json::to_value(body),
    };
    json.unwrap()
}

fn text(event: &Event) -> String {
    format!("{}\n", serde_json::to_string_pretty(&body(event)).unwrap())
}

/// `SessionOpened` → `session_opened`.
fn snake(kind: EventKind) -> String {
    let mut name = String::new();
    for c in format!("{kind:?}").chars() {
        if c.is_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.extend(c.to_lowercase());
    }
    name
}

/// Compares a committed file with its expected content, or writes it.
fn check_file(path: &Path, expected: &[u8]) {
    if updating() {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, expected).unwrap();
        return;
    }
    let name = path.display();
    let found = fs::read(path).unwrap_or_else(|error| {
        panic!("{name}: {error}; a new kind or version is added with UPDATE_GOLDEN=1")
    });
    assert!(
        found == expected,
        "{name} is not what today's code writes; released bytes never change: give the event a \
         new version, or, if this one was never released, run with UPDATE_GOLDEN=1"
    );
}

#[test]
fn todays_encoder_writes_the_golden_bytes() {
    for (name, event) in samples() {
        let version = event.kind().version();
        let file = schema().join("golden").join(format!("{name}.v{version}.rec"));
        check_file(&file.with_extension("json"), text(&event).as_bytes());
        check_file(&file, &frame(event));
    }
}

#[test]
fn every_golden_record_opens_and_means_what_it_meant() {
    if updating() {
        // The other test is writing the files at this moment.
        return;
    }
    let (mut kinds, mut versions) = (BTreeMap::new(), BTreeSet::new());
    for entry in fs::read_dir(schema().join("golden")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "rec") {
            let bytes = fs::read(&path).unwrap();
            let (header, _, _) = Header::unframe(&bytes).unwrap();
            *kinds.entry(header.kind).or_insert(0) += 1;
            // `.json` always says what was written. If today's form is different, `.upcast.json`
            // says what it means.
            let event = open(&bytes);
            let meaning = match header.version == event.kind().version() {
                true => path.with_extension("json"),
                false => path.with_extension("upcast.json"),
            };
            let meant = fs::read_to_string(meaning).unwrap();
            let written = fs::read_to_string(path.with_extension("json")).unwrap();
            let [written, means]: [Value; 2] =
                [&written, &meant].map(|text| serde_json::from_str(text).unwrap());
            for (field, value) in written.as_object().unwrap() {
                assert_eq!(means.get(field), Some(value), "{} {field}", path.display());
            }
            assert_eq!(text(&event), meant, "{}", path.display());
            versions.insert((header.kind, header.version));
        }
    }
    let expected: Vec<u16> = EventKind::ALL.iter().map(|&kind| kind as u16).collect();
    assert_eq!(kinds.into_keys().collect::<Vec<_>>(), expected, "every kind has golden bytes");
    for kind in EventKind::ALL {
        for version in 1..=kind.version() {
            let (number, frozen) = (kind as u16, version < kind.version());
            assert!(versions.contains(&(number, version)), "{kind:?} version {version} is lost");
            let museum = apprentice_migrations::records::FROZEN.contains(&(number, version));
            assert_eq!(museum, frozen, "{kind:?} version {version} in the museum");
        }
    }
}

#[test]
fn the_samples_are_read_back_as_the_same_events() {
    for (name, event) in samples() {
        assert_eq!(open(&frame(event.clone())), event, "{name}");
    }
}

/// Paths of the fields in a value, with the kind of each value.
fn fields(path: &str, value: &Value, found: &mut BTreeMap<String, Vec<&'static str>>) {
    let kind = match value {
        _ if DOCUMENTS.contains(&path) => "document",
        Value::Object(object) if path.ends_with(".figures") => {
            assert!(object.values().all(Value::is_number), "{path} holds numbers by name");
            "map of numbers"
        }
        Value::Object(object) => {
            for (name, inner) in object {
                fields(&format!("{path}.{name}"), inner, found);
            }
            return;
        }
        Value::Array(items) => {
            for item in items {
                fields(&format!("{path}[]"), item, found);
            }
            return;
        }
        Value::String(text) if text.len() == 64 && text.bytes().all(|b| b.is_ascii_hexdigit()) => {
            "digest (32 bytes)"
        }
        Value::String(_) => "text",
        Value::Number(number) if number.is_f64() => "float",
        Value::Number(_) => "integer",
        Value::Bool(_) => "boolean",
        Value::Null => "null",
    };
    let kinds = found.entry(path.to_owned()).or_default();
    if !kinds.contains(&kind) {
        kinds.push(kind);
    }
}

/// The catalogue of `schema/events.md`.
fn catalogue() -> String {
    let mut out = String::new();
    let mut described: BTreeSet<&str> = MEANINGS.iter().map(|(path, _)| *path).collect();
    for kind in EventKind::ALL {
        let (name, number, version) = (snake(kind), kind as u16, kind.version());
        let mut found = BTreeMap::new();
        for (_, event) in samples().iter().filter(|(_, event)| event.kind() == kind) {
            fields(&name, &body(event), &mut found);
        }
        writeln!(out, "### {number} · `{name}` · version {version}\n").unwrap();
        writeln!(out, "| field | value | meaning |\n|---|---|---|").unwrap();
        for (path, kinds) in found {
            let meaning = MEANINGS.iter().find(|(known, _)| *known == path);
            described.remove(path.as_str());
            let (_, meaning) = meaning.unwrap_or_else(|| panic!("{path} has no meaning yet"));
            let field = path.strip_prefix(&format!("{name}.")).unwrap();
            writeln!(out, "| `{field}` | {} | {meaning} |", kinds.join(" or ")).unwrap();
        }
        writeln!(out).unwrap();
    }
    assert!(described.is_empty(), "no sample has the fields {described:?}");
    out
}

#[test]
fn the_catalogue_in_the_schema_is_up_to_date() {
    let path = schema().join("events.md");
    let page = fs::read_to_string(&path).unwrap();
    let (begin, end) = ("<!-- catalogue: generated -->\n", "<!-- end of catalogue -->");
    let (before, rest) = page.split_once(begin).unwrap();
    let (_, after) = rest.split_once(end).unwrap();
    check_file(&path, format!("{before}{begin}\n{}{end}{after}", catalogue()).as_bytes());
}
