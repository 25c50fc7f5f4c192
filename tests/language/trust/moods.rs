//! Forbidden, asked, told, on a condition, or for later: nothing is carried out.

use super::talk::{Setting, Talk, WASH_MUG};

/// A request in the forms that the sentences need.
struct Job {
    /// `wash the potato`
    bare: &'static str,
    /// `washing the potato`
    going: &'static str,
    /// `washed the potato`, in the past tense
    past: &'static str,
    /// `washed the potato`, after "have"
    perfect: &'static str,
    /// `the potato`
    thing: &'static str,
    /// `washed`, after "was"
    passive: &'static str,
}

const LESSON: [Job; 2] = [
    Job {
        bare: "wash the potato",
        going: "washing the potato",
        past: "washed the potato",
        perfect: "washed the potato",
        thing: "the potato",
        passive: "washed",
    },
    Job {
        bare: "wash the mug",
        going: "washing the mug",
        past: "washed the mug",
        perfect: "washed the mug",
        thing: "the mug",
        passive: "washed",
    },
];

const PRIMITIVES: [Job; 6] = [
    Job {
        bare: "open the fridge",
        going: "opening the fridge",
        past: "opened the fridge",
        perfect: "opened the fridge",
        thing: "the fridge",
        passive: "opened",
    },
    Job {
        bare: "pick up the apple",
        going: "picking up the apple",
        past: "picked up the apple",
        perfect: "picked up the apple",
        thing: "the apple",
        passive: "picked up",
    },
    Job {
        bare: "turn on the faucet",
        going: "turning on the faucet",
        past: "turned on the faucet",
        perfect: "turned on the faucet",
        thing: "the faucet",
        passive: "turned on",
    },
    Job {
        bare: "go to the sink",
        going: "going to the sink",
        past: "went to the sink",
        perfect: "gone to the sink",
        thing: "the sink",
        passive: "visited",
    },
    Job {
        bare: "take the spatula",
        going: "taking the spatula",
        past: "took the spatula",
        perfect: "taken the spatula",
        thing: "the spatula",
        passive: "taken",
    },
    Job {
        bare: "grab the knife from the counter top",
        going: "grabbing the knife from the counter top",
        past: "grabbed the knife from the counter top",
        perfect: "grabbed the knife from the counter top",
        thing: "the knife",
        passive: "grabbed",
    },
];

const FORBIDDEN: &[&str] = &[
    "do not {bare}",
    "don't {bare}",
    "dont {bare}",
    "don\u{2019}t {bare}",
    "DO NOT {bare}",
    "please do not {bare}",
    "please don't {bare}, robot",
    "robot, do not {bare}",
    "never {bare}",
    "never ever {bare} again",
    "do not ever {bare}",
    "don't you dare {bare}",
    "you must not {bare}",
    "you mustn't {bare}",
    "you should not {bare}",
    "you shouldn't {bare} now",
    "you may not {bare}",
    "you cannot {bare}",
    "you need not {bare}",
    "you don't have to {bare}",
    "you'd better not {bare}",
    "better not {bare}",
    "there's no need to {bare}",
    "there is no need for you to {bare}",
    "no need to {bare}",
    "stop {going}",
    "please stop {going}",
    "quit {going}",
    "avoid {going}",
    "refrain from {going}",
    "no {going} please",
    "try not to {bare}",
    "be careful not to {bare}",
    "remember not to {bare}",
    "i told you not to {bare}",
    "i asked you not to {bare}",
    "i want you not to {bare}",
    "i don't want you to {bare}",
    "i do not want you to {bare}",
    "i would rather you did not {bare}",
    "i'd prefer it if you didn't {bare}",
    "let's not {bare}",
    "could you please not {bare}",
    "would you mind not {going}",
    "under no circumstances {bare}",
    "whatever you do, do not {bare}",
    "nobody is to {bare}",
    "you are not allowed to {bare}",
    "it is not a good idea to {bare}",
    "forget it, do not {bare}",
    "make sure that you do not {bare}",
    "make sure {thing} is not {passive}",
    "{thing} must not be {passive}",
    "anything but {going}",
    "do everything except {bare}",
];

const ASKED: &[&str] = &[
    "did you {bare}",
    "did you {bare}?",
    "did somebody {bare} already?",
    "didn't you {bare}?",
    "do you {bare} every day?",
    "do you know how to {bare}?",
    "do you want to {bare}?",
    "does anybody {bare} here?",
    "have you {perfect}?",
    "have you ever {perfect}",
    "haven't you {perfect} yet?",
    "has somebody {perfect}?",
    "why did you {bare}?",
    "why do you {bare}",
    "why don't you ever {bare}?",
    "when did you {bare}?",
    "when will you {bare}?",
    "how do i {bare}?",
    "how long does it take to {bare}?",
    "how often do you {bare}",
    "who {past}?",
    "who told you to {bare}?",
    "what happens when you {bare}?",
    "are you {going}?",
    "are you going to {bare}?",
    "were you {going}?",
    "was {thing} {passive}?",
    "is {thing} {passive}",
    "has {thing} been {passive} today?",
    "should i {bare}?",
    "should we {bare} or not",
    "may i {bare}?",
    "must i {bare} myself?",
    "is it dangerous to {bare}?",
    "is it true that you never {bare}?",
    "can you tell me whether you {past}?",
    "do you remember that i told you to {bare}?",
    "DID YOU {bare}",
];

const TOLD: &[&str] = &[
    "i {past}",
    "i already {past}",
    "i have {perfect}",
    "i will {bare} myself",
    "i'll {bare} myself",
    "i am going to {bare}",
    "i'm {going}",
    "i was {going} when you came",
    "i forgot to {bare}",
    "i like {going}",
    "i hate to {bare}",
    "i was told to {bare}",
    "you {past}",
    "you just {past}",
    "you have already {perfect}",
    "you are {going}",
    "you were supposed to {bare} yesterday",
    "you forgot to {bare}",
    "you seem to {bare} all the time",
    "she {past} yesterday",
    "my brother used to {bare}",
    "they {bare} every day",
    "somebody {past}",
    "{thing} was {passive}",
    "{thing} has been {passive} already",
    "{thing} is being {passive}",
    "{thing} will be {passive} by somebody else",
    "it takes a minute to {bare}",
    "it is fun to {bare}",
    "{going} is boring",
    "he said that he {past}",
    "thank you for {going}",
    "nice that you {past}",
    "imagine {going}",
    "pretend to {bare}",
    "the other robot will {bare}",
];

const CONDITIONAL: &[&str] = &[
    "if i ask you again, {bare}",
    "if somebody knocks {bare}",
    "{bare} if the doorbell rings",
    "{bare} if and only if i say so",
    "{bare} only if it is needed",
    "if it rains then {bare}",
    "unless i say otherwise, {bare}",
    "{bare} unless i am home",
    "unless it is late {bare}",
    "when the bell rings, {bare}",
    "{bare} when i come home",
    "when i clap my hands {bare}",
    "whenever it rains, {bare}",
    "{bare} whenever guests are here",
    "once i am back, {bare}",
    "{bare} once i am back",
    "as soon as i leave, {bare}",
    "{bare} as soon as i call you",
    "{bare} until i say stop",
    "until i come back, {bare}",
    "wait until it is dark and {bare}",
    "in case of fire, {bare}",
    "{bare} in case i forget",
    "should it get cold, {bare}",
    "provided that nobody minds, {bare}",
    "suppose you {past}",
    "what if you {past}",
    "you could {bare} if you had two hands",
];

const LATER: &[&str] = &[
    "{bare} tomorrow",
    "tomorrow, {bare}",
    "tomorrow {bare} please",
    "{bare} later",
    "later on, {bare}",
    "{bare} later today",
    "{bare} in five minutes",
    "in five minutes, {bare}",
    "{bare} in half an hour",
    "in an hour {bare}",
    "{bare} tonight",
    "{bare} this evening",
    "{bare} next week",
    "{bare} on monday",
    "{bare} at noon",
    "at seven o'clock {bare}",
    "{bare} every morning",
    "every day at six {bare}",
    "{bare} after lunch",
    "remind me to {bare}",
    "wait ten minutes, then {bare}",
    "{bare} some other day",
    "{bare}, but not now",
    "not now, but {bare} soon",
];

fn sentences(jobs: &[Job], moulds: &[&str]) -> Vec<String> {
    let filled = |job: &Job, mould: &str| {
        mould
            .replace("{bare}", job.bare)
            .replace("{going}", job.going)
            .replace("{past}", job.past)
            .replace("{perfect}", job.perfect)
            .replace("{thing}", job.thing)
            .replace("{passive}", job.passive)
    };
    jobs.iter().flat_map(|job| moulds.iter().map(|mould| filled(job, mould))).collect()
}

/// The same sentence patterns after a lesson, and for the requests that everybody can make at the
/// start.
fn nothing_is_done(what: &str, moulds: &[&str]) {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    talk.declines(&format!("{what}, with a lesson"), &sentences(&LESSON, moulds));
    talk.declines(&format!("{what}, primitives"), &sentences(&PRIMITIVES, moulds));
    // Before the first lesson it must be just as safe.
    let talk = Talk::new(&Setting::kitchen());
    talk.declines(&format!("{what}, nothing taught"), &sentences(&PRIMITIVES, moulds));
}

#[test]
fn the_bare_requests_of_these_tests_are_understood() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    talk.acts(
        "bare requests",
        &[
            (
                "wash the potato",
                "PICKUP Potato; PUT Potato SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Potato",
            ),
            (
                "wash the mug",
                "PICKUP Mug; PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug",
            ),
            ("open the fridge", "OPEN Fridge"),
            ("pick up the apple", "PICKUP Apple"),
            ("turn on the faucet", "TOGGLE Faucet"),
            ("take the spatula", "PICKUP Spatula"),
            ("grab the knife from the counter top", "PICKUP Knife"),
        ],
    );
    talk.does("bare requests", &[("go to the sink", "GOTO SinkBasin")]);
}

#[test]
fn what_is_forbidden_is_not_done() {
    nothing_is_done("forbidden", FORBIDDEN);
}

#[test]
fn what_is_asked_about_is_not_done() {
    nothing_is_done("asked", ASKED);
}

#[test]
fn what_is_told_is_not_done() {
    nothing_is_done("told", TOLD);
}

#[test]
fn what_has_a_condition_is_not_done() {
    nothing_is_done("conditional", CONDITIONAL);
}

/// A long instruction that waits at its beginning is not answered by a lesson, however near it is.
#[test]
fn a_long_request_that_waits_from_its_beginning_is_not_done() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    let said = [
        "if the potato is dirty, pick it up, wash it and put it on the counter",
        "when i come home, pick up the potato, wash it and put it on the table",
        "once the bell rings, take the potato, wash it, and put it down",
        "unless i call, pick up the potato, wash the potato and put the potato on the counter",
        "wash the potato when i say so, put it on the counter and open the fridge",
        "wash the potato when i say so, turn off the faucet and pick it up",
        "wash the potato if it is dirty, turn on the faucet, and pick it up",
        "put the potato in the sink when i say so, wash it and pick it up",
    ];
    talk.declines("waiting from the beginning", &said.map(str::to_owned));
}

#[test]
fn what_is_for_later_is_not_done() {
    nothing_is_done("later", LATER);
}

/// The same sentences without "not" at the front and without a mark at the end, as people type in a
/// hurry.
#[test]
fn moods_are_seen_in_capitals_and_without_marks() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    talk.declines(
        "in haste",
        &[
            "DONT WASH THE POTATO",
            "NEVER WASH THE POTATO!!!",
            "Do Not Wash The Potato.",
            "no dont wash the potato",
            "no! not the potato, do not wash it",
            "wash the potato NOT",
            "wash the potato? no",
            "wash the potato, no, do not",
            "wash not the potato",
            "not wash the potato",
            "HAVE YOU WASHED THE POTATO",
            "u washed the potato",
            "you didnt wash the potato",
            "didnt i say dont wash the potato",
            "the potato isnt washed",
            "why was the potato washed",
            "plz dont open the fridge",
            "DO NOT OPEN THE FRIDGE",
            "open the fridge - not",
            "open the fridge? never",
            "youd better not open the fridge",
            "theres no need to open the fridge",
            "no opening the fridge",
            "wouldnt it be bad to open the fridge",
            "i said dont pick up the apple",
            "dont u pick up the apple",
        ],
    );
}

/// These are no questions about the kitchen either. They are not understood.
#[test]
fn a_mood_is_no_impossible_request() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    talk.is_unsure(
        "moods",
        &[
            "do not wash the potato",
            "don't open the fridge",
            "never pick up the apple",
            "did you wash the potato?",
            "have you opened the fridge?",
            "why did you go to the sink?",
            "is the fridge open?",
            "is the apple on the table?",
            "where is the mug?",
            "what is in the fridge?",
            "which of the doors is open?",
            "i washed the potato",
            "the fridge was opened",
            "you picked up the apple",
            "the apple is on the table",
            "wash the potato tomorrow",
            "open the fridge in five minutes",
            "open the fridge if it is closed and you like it",
            "pick up the apple when i say so",
            "go to the sink once i am back",
        ],
    );
}
