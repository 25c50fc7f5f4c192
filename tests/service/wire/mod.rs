//! The wire as other programs read it. Every message of `schema/wire.md` is exactly what the code
//! writes.
//!
//! `UPDATE_SCHEMA=1 cargo test --test service wire::` writes the examples again. Read the
//! difference.

mod requests;
mod responses;

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use apprentice::client::FeedMessage;
use apprentice::client::wire::{
    COMMANDS, ORDERS, QUERIES, Request, decode_request, decode_response, encode_request,
    encode_response,
};
use apprentice::ids::{Digest, PublicKey, RequestId, Seq, StreamKey, TenantId, UserId};
use apprentice::tenancy::Quotas;
use apprentice_testkit::value::Value;

use requests::requests;
use responses::{published, responses};

/// The request id of every example.
pub fn id() -> RequestId {
    RequestId(std::array::from_fn(|index| index as u8))
}

fn seq(number: u64) -> Seq {
    Seq::new(number).unwrap()
}

fn mind() -> Digest {
    Digest([0xab; 32])
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

/// Every message of the page: its name there, and its bytes.
pub fn messages() -> Vec<(&'static str, Vec<u8>)> {
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
            "the example {name:?} is stale: UPDATE_SCHEMA=1 writes it again"
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
