//! Several requests in one utterance: all are done in the order of the words, or none.

use apprentice::language::{Program, Step};

use super::talk::{Report, Setting, Talk, WASH_MUG, done, line};

const WASH_POTATO: &str =
    "PICKUP Potato; PUT Potato SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Potato";

/// The expected steps are in the program in this order. All other steps only lead to them.
fn is_whole(program: &Program, expected: &str) -> bool {
    let expected: Program = expected.parse().unwrap();
    let mut wanted = expected.steps.iter().peekable();
    let mut rest: Vec<&Step> = Vec::new();
    for step in &program.steps {
        if wanted.peek() == Some(&step) {
            wanted.next();
        } else {
            rest.push(step);
        }
    }
    wanted.peek().is_none() && rest.iter().all(|step| step.operator.as_str() == "GOTO")
}

fn whole(talk: &Talk, what: &str, cases: &[(&str, &str)], or_nothing: bool) {
    let mut report = Report::new(what);
    for (text, expected) in cases {
        let answer = talk.asks(text);
        let right = match done(&answer) {
            Some(program) => is_whole(program, expected),
            None => or_nothing,
        };
        let or = if or_nothing { " or nothing" } else { "" };
        report.check(right, || line(text, &format!("{expected}{or}"), &answer));
    }
    report.finish();
}

fn all_or_none(talk: &Talk, what: &str, cases: &[(&str, &str)]) {
    whole(talk, what, cases, true);
}

fn all_done(talk: &Talk, what: &str, cases: &[(&str, &str)]) {
    whole(talk, what, cases, false);
}

#[test]
fn two_objects_of_one_verb_are_two_steps() {
    all_done(
        &Talk::new(&Setting::kitchen()),
        "two objects",
        &[
            ("open the fridge and the cabinet", "OPEN Fridge; OPEN Cabinet"),
            ("open the drawer and the fridge", "OPEN Drawer; OPEN Fridge"),
            ("open the microwave and the drawer", "OPEN Microwave; OPEN Drawer"),
            ("please open the fridge and the drawer", "OPEN Fridge; OPEN Drawer"),
            (
                "open the cabinet, the drawer and the fridge",
                "OPEN Cabinet; OPEN Drawer; OPEN Fridge",
            ),
            ("open cabinet, drawer, and microwave", "OPEN Cabinet; OPEN Drawer; OPEN Microwave"),
            ("turn on the toaster and the coffee machine", "TOGGLE Toaster; TOGGLE CoffeeMachine"),
            ("turn on the faucet and the toaster", "TOGGLE Faucet; TOGGLE Toaster"),
            ("switch on the toaster and the faucet", "TOGGLE Toaster; TOGGLE Faucet"),
            ("go to the fridge and the sink", "GOTO Fridge; GOTO SinkBasin"),
            ("go to the table and the microwave", "GOTO DiningTable; GOTO Microwave"),
            ("walk to the sink and the table", "GOTO SinkBasin; GOTO DiningTable"),
        ],
    );
    let open = Setting::kitchen().with("Fridge", "open").with("Drawer", "open");
    let open = open.with("Cabinet", "open");
    all_done(
        &Talk::new(&open),
        "two doors",
        &[
            ("close the fridge and the drawer", "CLOSE Fridge; CLOSE Drawer"),
            ("shut the cabinet and the fridge", "CLOSE Cabinet; CLOSE Fridge"),
            (
                "close the fridge, the cabinet and the drawer",
                "CLOSE Fridge; CLOSE Cabinet; CLOSE Drawer",
            ),
        ],
    );
    let on = Setting::kitchen().with("Toaster", "on").with("Faucet", "on");
    all_done(
        &Talk::new(&on),
        "two switches",
        &[
            ("turn off the faucet and the toaster", "TOGGLE Faucet; TOGGLE Toaster"),
            ("switch off the toaster and the faucet", "TOGGLE Toaster; TOGGLE Faucet"),
        ],
    );
}

/// The robot has one hand, and an open door cannot be opened. Then neither request is done.
#[test]
fn two_objects_of_which_one_cannot_be_are_none() {
    let half = Setting::kitchen().with("Fridge", "open").with("Toaster", "on");
    Talk::new(&half).declines(
        "one of two cannot be",
        &[
            "pick up the mug and the knife",
            "pick up the mug, the knife and the potato",
            "take the apple and the tomato",
            "grab the spatula and the knife",
            "get the plate and the bread from the table",
            "open the drawer and the fridge",
            "open the fridge and the cabinet",
            "close the fridge and the drawer",
            "close the cabinet and the fridge",
            "turn on the faucet and the toaster",
            "turn off the toaster and the faucet",
            "open the drawer and the piano",
            "open the drawer and the apple",
            "turn on the faucet and the bread",
            "go to the sink and the banana",
        ],
    );
}

#[test]
fn each_clause_is_read_in_the_state_that_the_one_before_leaves() {
    all_done(
        &Talk::taught(&Setting::kitchen(), &[WASH_MUG]),
        "clauses in order",
        &[
            ("go to the fridge and open it", "GOTO Fridge; OPEN Fridge"),
            ("open the fridge and close it", "OPEN Fridge; CLOSE Fridge"),
            ("open the fridge, then take the egg", "OPEN Fridge; PICKUP Egg"),
            ("pick up the mug and put it in the sink", "PICKUP Mug; PUT Mug SinkBasin"),
            ("pick up the mug and then open the fridge", "PICKUP Mug; OPEN Fridge"),
            (
                "pick up the mug, put it in the sink and go to the table",
                "PICKUP Mug; PUT Mug SinkBasin; GOTO DiningTable",
            ),
            (
                "open the drawer. take the fork. close the drawer.",
                "OPEN Drawer; PICKUP Fork; CLOSE Drawer",
            ),
            (
                "take the apple, open the fridge and put the apple in the fridge",
                "PICKUP Apple; OPEN Fridge; PUT Apple Fridge",
            ),
            (
                "could you open the fridge and then go to the sink please?",
                "OPEN Fridge; GOTO SinkBasin",
            ),
        ],
    );
}

/// Using one thing twice is a means to something that was not said, so it is declined.
#[test]
fn turning_on_and_off_at_once_is_both_or_neither() {
    all_or_none(
        &Talk::new(&Setting::kitchen()),
        "on and off",
        &[
            ("turn on the faucet and turn it off", "TOGGLE Faucet; TOGGLE Faucet"),
            ("turn on the faucet, then turn off the faucet", "TOGGLE Faucet; TOGGLE Faucet"),
        ],
    );
}

#[test]
fn a_lesson_and_something_else_are_both_done_or_neither() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    let with = |more: &str| format!("{WASH_POTATO}; {more}");
    let cases = [
        ("wash the potato and open the fridge", with("OPEN Fridge")),
        ("wash the potato and then go to the table", with("GOTO DiningTable")),
        ("wash the potato and put it on the dining table", with("PUT Potato DiningTable")),
        ("wash the potato, then put it on the counter", with("PUT Potato CounterTop")),
        ("please wash the potato and turn on the toaster", with("TOGGLE Toaster")),
        ("open the fridge and wash the potato", format!("OPEN Fridge; {WASH_POTATO}")),
        ("open the drawer, then wash the potato", format!("OPEN Drawer; {WASH_POTATO}")),
        ("turn on the toaster and wash the potato", format!("TOGGLE Toaster; {WASH_POTATO}")),
        ("go to the table and wash the potato", format!("GOTO DiningTable; {WASH_POTATO}")),
        (
            "wash the potato, put it on the table and open the fridge",
            with("PUT Potato DiningTable; OPEN Fridge"),
        ),
        (
            "open the drawer and wash the potato and open the cabinet",
            format!("OPEN Drawer; {WASH_POTATO}; OPEN Cabinet"),
        ),
    ];
    let cases: Vec<(&str, &str)> = cases.iter().map(|(text, all)| (*text, all.as_str())).collect();
    all_or_none(&talk, "a lesson and more", &cases);
    // The robot holds the potato after the washing, so these cannot follow.
    talk.declines(
        "a lesson and what the hand forbids",
        &[
            "wash the potato and the mug",
            "wash the potato and the tomato",
            "wash the potato and wash the mug",
            "wash the potato and then the plate",
            "wash the potato and pick up the knife",
            "wash the mug, the plate and the fork",
            "pick up the knife and wash the potato",
            "wash the potato and juggle",
            "wash the potato and polish it",
            "polish the potato and wash it",
            "wash the potato and open the piano",
            "sing and wash the potato",
        ],
    );
}

#[test]
fn a_clause_that_is_not_understood_stops_all() {
    Talk::taught(&Setting::kitchen(), &[WASH_MUG]).declines(
        "one clause is not understood",
        &[
            "open the fridge and sing",
            "open the fridge and polish the apple",
            "open the fridge, dance, and close it",
            "sing and open the fridge",
            "pick up the mug and juggle it",
            "pick up the mug and smash it",
            "pick up the mug and give it to my aunt",
            "pick up the mug, polish it and put it in the sink",
            "go to the table and count the plates",
            "go to the table and wait",
            "turn on the faucet and fill the bowl",
            "turn on the toaster and smell the bread",
            "slice the bread and pick up the mug",
            "slice the bread, then go to the sink",
            "open the drawer and sort it",
            "take the egg and boil it",
            "take the knife and sharpen it, then put it on the table",
            "close your eyes and open the fridge",
            "count to ten and open the drawer",
            "open the fridge and tell me what you see",
        ],
    );
}

#[test]
fn an_impossible_clause_stops_all() {
    let open = Setting::kitchen().with("Fridge", "open");
    Talk::new(&open).declines(
        "one clause is impossible",
        &[
            "open the drawer and open the fridge",
            "pick up the mug and open the fridge",
            "go to the sink and open the fridge",
            "pick up the mug and pick up the knife",
            "take the mug, then take the knife",
            "pick up the fridge and go to the sink",
            "go to the sink and pick up the table",
            "close the fridge and close the fridge",
            "turn on the faucet and turn it on",
            "open the drawer, open the drawer",
            "go to the table and put the apple in the toaster",
            "pick up the mug and put the knife in the sink",
            "open the apple and go to the table",
            "pick up the pan and go to the sink",
        ],
    );
}

#[test]
fn order_words_are_kept() {
    let talk = Talk::new(&Setting::kitchen().with("Microwave", "open"));
    all_or_none(
        &talk,
        "order words",
        &[
            ("before you open the fridge, close the microwave", "CLOSE Microwave; OPEN Fridge"),
            ("close the microwave before you open the fridge", "CLOSE Microwave; OPEN Fridge"),
            ("before opening the drawer close the microwave", "CLOSE Microwave; OPEN Drawer"),
            ("close the microwave before opening the drawer", "CLOSE Microwave; OPEN Drawer"),
            ("open the fridge after you close the microwave", "CLOSE Microwave; OPEN Fridge"),
            ("open the drawer after closing the microwave", "CLOSE Microwave; OPEN Drawer"),
            ("after closing the microwave, open the drawer", "CLOSE Microwave; OPEN Drawer"),
            ("after you pick up the mug, open the fridge", "PICKUP Mug; OPEN Fridge"),
            ("open the fridge after picking up the mug", "PICKUP Mug; OPEN Fridge"),
            ("open the fridge after you picked up the mug", "PICKUP Mug; OPEN Fridge"),
            ("pick up the mug before you go to the sink", "PICKUP Mug; GOTO SinkBasin"),
            ("before you go to the sink, pick up the mug", "PICKUP Mug; GOTO SinkBasin"),
            ("before going to the sink pick up the mug", "PICKUP Mug; GOTO SinkBasin"),
            ("open the fridge but first pick up the mug", "PICKUP Mug; OPEN Fridge"),
            ("open the fridge, but pick up the mug first", "PICKUP Mug; OPEN Fridge"),
            ("first pick up the mug, then open the fridge", "PICKUP Mug; OPEN Fridge"),
            ("pick up the mug first and then open the fridge", "PICKUP Mug; OPEN Fridge"),
            ("go to the sink, after that open the drawer", "GOTO SinkBasin; OPEN Drawer"),
            ("go to the sink and afterwards open the drawer", "GOTO SinkBasin; OPEN Drawer"),
            ("open the drawer last, first open the cabinet", "OPEN Cabinet; OPEN Drawer"),
            ("open the drawer once you have opened the cabinet", "OPEN Cabinet; OPEN Drawer"),
            (
                "turn on the toaster, but before that turn on the faucet",
                "TOGGLE Faucet; TOGGLE Toaster",
            ),
            ("turn on the faucet, followed by the toaster", "TOGGLE Faucet; TOGGLE Toaster"),
            ("open the cabinet and finally the drawer", "OPEN Cabinet; OPEN Drawer"),
        ],
    );
}

#[test]
fn more_words_between_do_not_drop_a_clause() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    all_or_none(
        &talk,
        "words between",
        &[
            ("open the fridge and also the drawer", "OPEN Fridge; OPEN Drawer"),
            ("open the fridge as well as the drawer", "OPEN Fridge; OPEN Drawer"),
            ("open the fridge plus the drawer", "OPEN Fridge; OPEN Drawer"),
            ("open the fridge, and then, if you please, the drawer", "OPEN Fridge; OPEN Drawer"),
            ("open the fridge, thanks, and the drawer", "OPEN Fridge; OPEN Drawer"),
            ("open the fridge & the drawer", "OPEN Fridge; OPEN Drawer"),
            ("open the fridge; open the drawer", "OPEN Fridge; OPEN Drawer"),
            ("open the fridge open the drawer", "OPEN Fridge; OPEN Drawer"),
            ("open both the fridge and the drawer", "OPEN Fridge; OPEN Drawer"),
            ("open the fridge. also pick up the mug", "OPEN Fridge; PICKUP Mug"),
            ("open the fridge while you go to the sink", "OPEN Fridge; GOTO SinkBasin"),
            ("pick up the mug while the fridge is being opened", "OPEN Fridge; PICKUP Mug"),
            ("not only open the fridge but also open the drawer", "OPEN Fridge; OPEN Drawer"),
            ("instead of opening the drawer, open the fridge", "OPEN Fridge"),
            ("open the fridge instead of the drawer", "OPEN Fridge"),
            ("open the fridge, not the drawer", "OPEN Fridge"),
            ("not the drawer, open the fridge", "OPEN Fridge"),
            ("pick up the mug instead of the knife", "PICKUP Mug"),
            ("pick up the mug, not the knife", "PICKUP Mug"),
            ("wash the potato instead of the mug", WASH_POTATO),
            ("wash the potato, not the mug", WASH_POTATO),
        ],
    );
}

/// Two things are put one after the other, with fetching if the recipe composes it; or neither is
/// put.
#[test]
fn two_things_of_one_put_are_two_errands() {
    let two = |one: &str, other: &str, place: &str| {
        format!("PICKUP {one}; PUT {one} {place}; PICKUP {other}; PUT {other} {place}")
    };
    let cases = [
        ("put the mug and the knife in the sink", two("Mug", "Knife", "SinkBasin")),
        ("put the potato and the spatula in the sink", two("Potato", "Spatula", "SinkBasin")),
        ("place the mug and the potato on the table", two("Mug", "Potato", "DiningTable")),
        ("take the mug and the knife to the table", two("Mug", "Knife", "DiningTable")),
        ("bring the apple and the bread to the counter", two("Apple", "Bread", "CounterTop")),
    ];
    let cases: Vec<(&str, &str)> = cases.iter().map(|(text, all)| (*text, all.as_str())).collect();
    all_or_none(&Talk::new(&Setting::kitchen()), "two things of one put", &cases);
}
