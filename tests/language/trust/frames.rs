//! Polite words, names and small words around a request do not change what it means.

use super::talk::{Report, Setting, Talk, Taught, WASH_MUG, acted, done, line, shown};

/// `{bare}` is the request, `{going}` is its form after "mind".
const FRAMES: &[&str] = &[
    "can you {bare}",
    "can you {bare}?",
    "can you please {bare}?",
    "can you {bare} for me?",
    "could you {bare}?",
    "could you please {bare}",
    "could you please {bare} for me?",
    "could you kindly {bare}?",
    "could you maybe {bare}?",
    "would you {bare}?",
    "would you please {bare}?",
    "would you kindly {bare}",
    "will you {bare}?",
    "will you please {bare}",
    "would you mind {going}?",
    "do you mind {going}?",
    "would you be so kind as to {bare}?",
    "please be so kind as to {bare}",
    "be so good as to {bare}",
    "be a dear and {bare}",
    "do me a favor and {bare}",
    "do me a favour, {bare}",
    "please {bare}",
    "kindly {bare}",
    "please, {bare}",
    "{bare} please",
    "{bare}, please",
    "please could you {bare}",
    "please can you {bare}?",
    "i want you to {bare}",
    "i would like you to {bare}",
    "i'd like you to {bare}",
    "id like you to {bare}",
    "i need you to {bare}",
    "i would love for you to {bare}",
    "i'd appreciate it if you could {bare}",
    "it would be great if you could {bare}",
    "it would be nice if you would {bare}",
    "i was wondering if you could {bare}",
    "may i ask you to {bare}?",
    "can i ask you to {bare}",
    "could i get you to {bare}?",
    "robot, {bare}",
    "robot {bare}",
    "hey robot, {bare}",
    "hey robot {bare}",
    "hey, {bare}",
    "hi robot, please {bare}",
    "hello, {bare}",
    "hello robot, could you {bare}?",
    "dear robot, {bare}",
    "excuse me, {bare}",
    "excuse me, could you {bare}?",
    "good morning, please {bare}",
    "{bare}, robot",
    "{bare}, my friend",
    "ok, {bare}",
    "okay {bare}",
    "ok robot, now {bare}",
    "alright, {bare}",
    "all right, {bare}",
    "right, {bare}",
    "well, {bare}",
    "so, {bare}",
    "so now {bare}",
    "great, now {bare}",
    "good. now {bare}",
    "thanks, now {bare}",
    "perfect, {bare}",
    "um, {bare}",
    "uh {bare}",
    "hmm, {bare}",
    "oh, {bare}",
    "now {bare}",
    "now please {bare}",
    "next, {bare}",
    "next {bare}",
    "then {bare}",
    "and now {bare}",
    "and then {bare}",
    "after that, {bare}",
    "first, {bare}",
    "finally, {bare}",
    "just {bare}",
    "simply {bare}",
    "go and {bare}",
    "go ahead and {bare}",
    "try to {bare}",
    "please try to {bare}",
    "let's {bare}",
    "let us {bare}",
    "you can {bare}",
    "you should {bare}",
    "you should now {bare}",
    "you need to {bare}",
    "you have to {bare}",
    "your task is to {bare}",
    "your next step is to {bare}",
    "your job is to {bare}",
    "what i want you to do is {bare}",
    "be sure to {bare}",
    "make sure to {bare}",
    "{bare} now",
    "{bare} right now",
    "{bare} right away",
    "{bare} at once",
    "{bare} for me",
    "{bare} for me please",
    "{bare}, thanks",
    "{bare}, thank you",
    "{bare} thank you very much",
    "{bare} if you don't mind",
    "{bare}, if you please",
    "{bare}, will you?",
    "{bare}, would you?",
    "{bare}, ok?",
    "{bare} quickly",
    "{bare}!!!",
    "PLEASE {bare}!",
    "Could You {bare}",
];

/// Requests with their form after "mind".
const PRIMITIVES: &[(&str, &str)] = &[
    ("pick up the mug", "picking up the mug"),
    ("open the fridge", "opening the fridge"),
    ("go to the dining table", "going to the dining table"),
    ("turn on the faucet", "turning on the faucet"),
    ("take the apple from the table", "taking the apple from the table"),
];

const LESSON: &[(&str, &str)] =
    &[("wash the tomato", "washing the tomato"), ("wash the mug", "washing the mug")];

fn framed(frame: &str, (bare, going): (&str, &str)) -> String {
    frame.replace("{bare}", bare).replace("{going}", going)
}

fn each_frame_changes_nothing(talk: &Talk, what: &str, requests: &[(&str, &str)]) {
    let mut report = Report::new(what);
    for request in requests {
        let bare = shown(&talk.asks(request.0));
        assert!(acted(&talk.asks(request.0)), "{:?} by itself: {bare}", request.0);
        for frame in FRAMES {
            let text = framed(frame, *request);
            let answer = talk.asks(&text);
            report.check(shown(&answer) == bare, || line(&text, &bare, &answer));
        }
    }
    report.finish();
}

#[test]
fn a_frame_around_a_primitive_changes_nothing() {
    let talk = Talk::new(&Setting::kitchen());
    each_frame_changes_nothing(&talk, "frames around primitives", PRIMITIVES);
}

#[test]
fn a_frame_around_a_lesson_changes_nothing() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    each_frame_changes_nothing(&talk, "frames around a lesson", LESSON);
    each_frame_changes_nothing(&talk, "frames around primitives, beside a lesson", PRIMITIVES);
}

/// A PUT has two things that a frame could hide.
#[test]
fn a_frame_around_what_is_held_changes_nothing() {
    let talk = Talk::new(&Setting::kitchen().holding("Bread"));
    let requests = [
        ("put the bread on the counter", "putting the bread on the counter"),
        ("put it in the fridge", "putting it in the fridge"),
        ("place the bread on the plate", "placing the bread on the plate"),
    ];
    each_frame_changes_nothing(&talk, "frames around a put", &requests[..2]);
    // Bread cannot go on a plate: a frame must not make another request of it.
    let said: Vec<String> = FRAMES.iter().map(|frame| framed(frame, requests[2])).collect();
    talk.declines("frames around what cannot be", &said);
}

/// A frame that looks like a request does not make a request of other words.
#[test]
fn a_frame_does_not_make_sense_of_nonsense() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    let nonsense = ["juggle the mug", "the mug", "fridge", "sing", "polish the plate"];
    let said: Vec<String> = FRAMES
        .iter()
        .filter(|frame| !frame.contains("{going}"))
        .flat_map(|frame| nonsense.iter().map(|bare| frame.replace("{bare}", bare)))
        .collect();
    talk.declines("frames around nonsense", &said);
}

/// Each polite lesson, and other requests in the same polite words.
const POLITE_LESSONS: &[(Taught<'_>, &str)] = &[
    (
        ("could you please pick up the mug for me?", "GOTO Mug; PICKUP Mug"),
        "could you please {bare} for me?",
    ),
    (("robot, would you kindly take the mug?", "PICKUP Mug"), "robot, would you kindly {bare}?"),
    (("i would like you to grab the mug now", "PICKUP Mug"), "i would like you to {bare} now"),
    (
        ("now put the mug in the sink", "PICKUP Mug; GOTO SinkBasin; PUT Mug SinkBasin"),
        "now {bare}",
    ),
    (("ok then, next step: open the fridge", "GOTO Fridge; OPEN Fridge"), "ok then, next {bare}"),
    (
        ("please go ahead and freshen the potato", "PICKUP Potato; GOTO SinkBasin"),
        "please go ahead and {bare}",
    ),
];

#[test]
fn a_polite_lesson_does_not_catch_other_polite_requests() {
    // Words that the lessons above do not contain.
    let known = [
        "open the cabinet",
        "open the drawer",
        "go to the microwave",
        "turn on the faucet",
        "go to the table",
    ];
    let unknown = ["polish the plate", "juggle the apple", "sing a song", "sort the kitchen"];
    let plain = Talk::new(&Setting::kitchen());
    let mut report = Report::new("other requests after a polite lesson");
    for (lesson, frame) in POLITE_LESSONS {
        let talk = Talk::taught(&Setting::kitchen(), &[*lesson]);
        for bare in known {
            let text = frame.replace("{bare}", bare);
            let (expected, answer) = (shown(&plain.asks(bare)), talk.asks(&text));
            report.check(shown(&answer) == expected, || line(&text, &expected, &answer));
        }
        for bare in unknown {
            let text = frame.replace("{bare}", bare);
            let answer = talk.asks(&text);
            report.check(!acted(&answer), || line(&text, "nothing", &answer));
        }
    }
    report.finish();
}

#[test]
fn a_polite_lesson_is_due_without_its_frame() {
    let lesson = [("could you please freshen the mug for me?", WASH_MUG.1)];
    let talk = Talk::taught(&Setting::kitchen(), &lesson);
    let exact = shown(&talk.asks("could you please freshen the tomato for me?"));
    let mut report = Report::new("a polite lesson in other words");
    for text in [
        "freshen the tomato",
        "freshen the tomato please",
        "please freshen the tomato",
        "can you freshen the tomato?",
        "robot, freshen the tomato",
        "now freshen the tomato for me",
        "i want you to freshen the tomato",
        "hey, would you freshen the tomato?",
    ] {
        let answer = talk.asks(text);
        report.check(done(&answer).is_some() && shown(&answer) == exact, || {
            line(text, &exact, &answer)
        });
    }
    report.finish();
}
