//! Recorded steps and reasons, as the robot says them to a person. The records keep the words of
//! the world, because an audit compares them; only what is shown is different.

use super::facts::facts;
use super::refusal::preposition;
use crate::language::Step;

/// A step as a person asks for it: `PUT Mug SinkBasin` → `put the mug in the sink`.
pub fn request(step: &Step) -> String {
    let the = |place: usize| step.args.get(place).map_or_else(String::new, |arg| the(arg.as_str()));
    let place = step.args.get(1).and_then(|name| facts().kind(name.as_str()));
    match step.operator.as_str() {
        "GOTO" => format!("go to {}", the(0)),
        "PICKUP" if is_pronoun(&the(0)) => format!("pick {} up", the(0)),
        "PICKUP" => format!("pick up {}", the(0)),
        "PUT" => format!("put {} {} {}", the(0), place.map_or("on", preposition), the(1)),
        "OPEN" => format!("open {}", the(0)),
        "CLOSE" => format!("close {}", the(0)),
        "TOGGLE" => format!("toggle {}", the(0)),
        _ => format!("do {step}"),
    }
}

/// An argument with its article. An argument that is not a kind is a word that the person used; it
/// stays as it is.
fn the(arg: &str) -> String {
    match (facts().kind(arg), arg) {
        (Some(kind), _) => format!("the {}", kind.said()),
        (None, "<held>") => "what I hold".to_owned(),
        (None, word) if is_pronoun(word) => word.to_owned(),
        (None, other) => format!("the {other}"),
    }
}

fn is_pronoun(word: &str) -> bool {
    matches!(word, "it" | "them")
}

/// Phrases of recorded reasons, and what the robot says instead. The longer ones come first.
const FIRST_PERSON: [(&str, &str); 8] = [
    ("nothing is left to do: ", ""),
    ("the robot's hand is full: it holds ", "I already hold "),
    ("put that down first", "put it down first"),
    ("the robot already holds ", "I already hold "),
    ("the robot does not hold ", "I don't hold "),
    ("the robot holds ", "I hold "),
    (": it holds ", "; I hold "),
    (": its hand is empty", "; my hand is empty"),
];

/// The recorded reason why a step cannot be done, in the first person, as sentences without the
/// last full stop: `the robot already holds the Mug` → `I already hold it`.
pub fn reason(step: &Step, reason: &str) -> String {
    let unnamed = reason.strip_prefix("nothing was named before that ");
    if let Some((word, _)) = unnamed.and_then(|rest| rest.split_once(" could mean")) {
        return format!("I don't know what {word} means here. Name the thing");
    }
    let mut told = match reason.strip_prefix("which ").and_then(|which| which.split_once(": ")) {
        Some((_, why)) => why.to_owned(),
        None => reason.trim_end_matches('.').to_owned(),
    };
    for (recorded, said) in FIRST_PERSON {
        told = told.replace(recorded, said);
    }
    let words: Vec<String> = told.split(' ').map(in_lower_case).collect();
    told = words.join(" ");
    if let [only] = &step.args[..] {
        told = it_for(&the(only.as_str()), &told);
    }
    let mut sentences = told.split("; ");
    let mut text = sentences.next().unwrap_or_default().to_owned();
    for sentence in sentences {
        let mut letters = sentence.chars();
        text.push_str(". ");
        text.extend(letters.next().iter().flat_map(|first| first.to_uppercase()));
        text.push_str(letters.as_str());
    }
    text
}

/// `(CounterTop` → `(counter top`; other words stay.
fn in_lower_case(word: &str) -> String {
    let name = word.trim_matches(|c: char| !c.is_ascii_alphanumeric());
    match facts().kind(name) {
        Some(kind) => word.replacen(name, kind.said(), 1),
        None => word.to_owned(),
    }
}

/// Says "it" for the thing in a reason, because the request has named it. A thing with a number
/// keeps its name, because the number says which one it is.
fn it_for(thing: &str, told: &str) -> String {
    let Some((before, after)) = told.split_once(thing) else { return told.to_owned() };
    let goes_on = after.trim_start().starts_with(|c: char| c.is_ascii_digit());
    let ends = after.is_empty() || after.starts_with([' ', ';', ',']);
    match ends && !goes_on {
        true => format!("{before}it{after}"),
        false => told.to_owned(),
    }
}
