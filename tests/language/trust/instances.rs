//! Two or three things of a type. Words of number, order, state and place choose one of them. If
//! the words fit none, the request is declined.
//!
//! The bindings of the answer name the things, so the tests check these.

use super::talk::{Report, Setting, Talk, bound, line};

/// The last step acts on the things of `expected`, and all steps before it only lead to it.
fn chooses(talk: &Talk, report: &mut Report, text: &str, expected: &str) {
    let answer = talk.asks(text);
    let found = bound(&answer);
    let right = found.as_ref().is_some_and(|steps| match steps.split_last() {
        Some((last, before)) => last == expected && before.iter().all(|step| leads_there(step)),
        None => false,
    });
    report.check(right, || {
        let found = found.map_or(String::new(), |steps| format!(", that is {}", steps.join("; ")));
        format!("{}{found}", line(text, expected, &answer))
    });
}

fn leads_there(step: &str) -> bool {
    step.starts_with("GOTO ") || step.starts_with("OPEN ")
}

fn all(talk: &Talk, what: &str, cases: &[(&str, &str)]) {
    let mut report = Report::new(what);
    for (text, expected) in cases {
        chooses(talk, &mut report, text, expected);
    }
    report.finish();
}

#[test]
fn a_number_chooses() {
    let talk = Talk::new(&Setting::pairs());
    all(
        &talk,
        "numbers",
        &[
            ("pick up mug 1", "PICKUP Mug 1"),
            ("pick up mug 2", "PICKUP Mug 2"),
            ("pick up the mug 2", "PICKUP Mug 2"),
            ("take mug number 2", "PICKUP Mug 2"),
            ("grab apple 2", "PICKUP Apple 2"),
            ("grab apple 3", "PICKUP Apple 3"),
            ("could you please take apple 3?", "PICKUP Apple 3"),
            ("pick up Spoon 2", "PICKUP Spoon 2"),
            ("take fork 2 from the table", "PICKUP Fork 2"),
            ("pick up plate 2", "PICKUP Plate 2"),
            ("get egg 2 out of the fridge", "PICKUP Egg 2"),
            ("go to cabinet 2", "GOTO Cabinet 2"),
            ("go to drawer 2", "GOTO Drawer 2"),
            ("walk over to cabinet 3", "GOTO Cabinet 3"),
            ("open cabinet 1", "OPEN Cabinet 1"),
            ("open cabinet 3", "OPEN Cabinet 3"),
            ("open drawer 2", "OPEN Drawer 2"),
            ("open drawer number two", "OPEN Drawer 2"),
            ("close cabinet 2", "CLOSE Cabinet 2"),
            ("PICK UP MUG 2", "PICKUP Mug 2"),
        ],
    );
    let talk = Talk::new(&Setting::lounge());
    all(
        &talk,
        "numbers in the lounge",
        &[
            ("turn on floor lamp 1", "TOGGLE FloorLamp 1"),
            ("turn off floor lamp 2", "TOGGLE FloorLamp 2"),
            ("switch on desk lamp 2", "TOGGLE DeskLamp 2"),
            ("pick up pillow 2", "PICKUP Pillow 2"),
            ("take book 2", "PICKUP Book 2"),
            ("grab remote control 2", "PICKUP RemoteControl 2"),
            ("open drawer 1", "OPEN Drawer 1"),
        ],
    );
}

#[test]
fn an_ordinal_chooses() {
    let talk = Talk::new(&Setting::pairs());
    all(
        &talk,
        "ordinals",
        &[
            ("pick up the first mug", "PICKUP Mug 1"),
            ("pick up the second mug", "PICKUP Mug 2"),
            ("take the third apple", "PICKUP Apple 3"),
            ("grab the second apple", "PICKUP Apple 2"),
            ("pick up the 2nd spoon", "PICKUP Spoon 2"),
            ("open the first cabinet", "OPEN Cabinet 1"),
            ("open the third cabinet", "OPEN Cabinet 3"),
            ("open the second drawer", "OPEN Drawer 2"),
            ("go to the second cabinet", "GOTO Cabinet 2"),
            ("close the second cabinet", "CLOSE Cabinet 2"),
            ("pick up the second plate", "PICKUP Plate 2"),
        ],
    );
}

#[test]
fn a_state_chooses() {
    let talk = Talk::new(&Setting::pairs());
    all(
        &talk,
        "states",
        &[
            ("pick up the dirty mug", "PICKUP Mug 1"),
            ("pick up the clean mug", "PICKUP Mug 2"),
            ("take the mug that is clean", "PICKUP Mug 2"),
            ("pick up the clean apple", "PICKUP Apple 2"),
            ("pick up the dirty apple", "PICKUP Apple 1"),
            ("grab the dirty plate", "PICKUP Plate 2"),
            ("grab the clean plate", "PICKUP Plate 1"),
            ("take the hot potato", "PICKUP Potato 2"),
            ("take the potato that is hot", "PICKUP Potato 2"),
            ("get the cold egg", "PICKUP Egg 2"),
            ("pick up the cold apple", "PICKUP Apple 3"),
            ("close the open cabinet", "CLOSE Cabinet 2"),
            ("go to the open cabinet", "GOTO Cabinet 2"),
        ],
    );
    let talk = Talk::new(&Setting::lounge());
    all(
        &talk,
        "switches",
        &[
            ("turn off the floor lamp", "TOGGLE FloorLamp 2"),
            ("turn off the floor lamp that is on", "TOGGLE FloorLamp 2"),
            ("turn on the floor lamp", "TOGGLE FloorLamp 1"),
            ("turn off the lamp", "TOGGLE FloorLamp 2"),
        ],
    );
}

#[test]
fn a_place_chooses() {
    let talk = Talk::new(&Setting::pairs());
    all(
        &talk,
        "places",
        &[
            ("pick up the mug on the dining table", "PICKUP Mug 2"),
            ("pick up the mug on the table", "PICKUP Mug 2"),
            ("pick up the mug from the table", "PICKUP Mug 2"),
            ("take the mug off the dining table", "PICKUP Mug 2"),
            ("take the mug that is on the dining table", "PICKUP Mug 2"),
            ("could you get the mug from the table please", "PICKUP Mug 2"),
            ("pick up the mug on the counter", "PICKUP Mug 1"),
            ("grab the spoon from the dining table", "PICKUP Spoon 2"),
            ("pick up the spoon that lies on the table", "PICKUP Spoon 2"),
            ("pick up the apple in the fridge", "PICKUP Apple 3"),
            ("take the apple out of the fridge", "PICKUP Apple 3"),
            ("get the apple from inside the fridge", "PICKUP Apple 3"),
            ("remove the egg from the fridge", "PICKUP Egg 2"),
            ("take the egg from the counter", "PICKUP Egg 1"),
            ("grab the plate that is in the sink", "PICKUP Plate 2"),
            ("take the plate out of the sink", "PICKUP Plate 2"),
            ("take the bowl out of the cabinet", "PICKUP Bowl 2"),
            ("pick up the fork on the dining table", "PICKUP Fork 2"),
            ("grab the potato on the table", "PICKUP Potato 2"),
        ],
    );
    let talk = Talk::new(&Setting::lounge());
    all(
        &talk,
        "places in the lounge",
        &[
            ("switch on the lamp on the dresser", "TOGGLE DeskLamp 2"),
            ("turn on the desk lamp on the side table", "TOGGLE DeskLamp 1"),
            ("take the book from the shelf", "PICKUP Book 2"),
            ("pick up the book on the coffee table", "PICKUP Book 1"),
            ("grab the pillow from the armchair", "PICKUP Pillow 2"),
            ("pick up the remote control on the coffee table", "PICKUP RemoteControl 2"),
            ("take the remote off the sofa", "PICKUP RemoteControl 1"),
        ],
    );
}

#[test]
fn words_choose_the_place_of_a_put() {
    let talk = Talk::new(&Setting::pairs().holding("Tomato"));
    all(
        &talk,
        "places of a put",
        &[
            ("put the tomato on plate 2", "PUT Tomato > Plate 2"),
            ("put the tomato on plate 1", "PUT Tomato > Plate 1"),
            ("put it on the clean plate", "PUT Tomato > Plate 1"),
            ("put it on the dirty plate", "PUT Tomato > Plate 2"),
            ("put it on the plate in the sink", "PUT Tomato > Plate 2"),
            ("place the tomato on the second plate", "PUT Tomato > Plate 2"),
            ("put the tomato in bowl 1", "PUT Tomato > Bowl 1"),
            ("put the tomato in the bowl on the counter", "PUT Tomato > Bowl 1"),
        ],
    );
    let talk = Talk::new(&Setting::pairs().holding("Bowl 1"));
    all(
        &talk,
        "doors of a put",
        &[
            ("put the bowl in cabinet 2", "PUT Bowl 1 > Cabinet 2"),
            ("put the bowl in cabinet 3", "PUT Bowl 1 > Cabinet 3"),
            ("put it in the third cabinet", "PUT Bowl 1 > Cabinet 3"),
            ("put it in the open cabinet", "PUT Bowl 1 > Cabinet 2"),
            ("put the bowl in cabinet 1", "PUT Bowl 1 > Cabinet 1"),
        ],
    );
}

#[test]
fn here_is_where_the_robot_stands() {
    let counter = Talk::new(&Setting::pairs());
    let table = Talk::new(&Setting::pairs().standing_at("DiningTable"));
    let mut report = Report::new("here");
    for (talk, text, expected) in [
        (&counter, "pick up the mug here", "PICKUP Mug 1"),
        (&counter, "take the spoon that is here", "PICKUP Spoon 1"),
        (&table, "pick up the mug here", "PICKUP Mug 2"),
        (&table, "grab the fork here", "PICKUP Fork 2"),
        (&table, "take the potato that is here", "PICKUP Potato 2"),
        (&table, "pick up this spoon", "PICKUP Spoon 2"),
    ] {
        chooses(talk, &mut report, text, expected);
    }
    report.finish();
    counter.declines("not here", &["pick up the apple here", "take the apple that is here"]);
    table.declines("not here", &["pick up the egg here", "grab the plate that is here"]);
}

#[test]
fn what_was_handled_last_chooses_the_same_and_the_other() {
    let handled: &[&str] = &["pick up the spoon", "put the spoon on the counter"];
    let far: &[&str] = &["pick up mug 2", "put it on the table", "go to the counter"];
    let door: &[&str] = &["open drawer 1", "go to the counter"];
    let closed: &[&str] = &["open cabinet 3", "close cabinet 3", "go to the counter"];
    let sofa: &[&str] = &["pick up the pillow", "put the pillow on the sofa"];
    let (pairs, lounge) = (Setting::pairs(), Setting::lounge());
    let cases: &[(&Setting, &[&str], &str, &str)] = &[
        (&pairs, handled, "pick up the other spoon", "PICKUP Spoon 2"),
        (&pairs, handled, "pick up another spoon", "PICKUP Spoon 2"),
        (&pairs, handled, "now take the other spoon", "PICKUP Spoon 2"),
        (&pairs, handled, "get another spoon please", "PICKUP Spoon 2"),
        (&pairs, handled, "pick up the same spoon", "PICKUP Spoon 1"),
        (&pairs, handled, "pick up the same spoon again", "PICKUP Spoon 1"),
        (&pairs, far, "pick up the other mug", "PICKUP Mug 1"),
        (&pairs, far, "take another mug", "PICKUP Mug 1"),
        (&pairs, far, "pick up the same mug", "PICKUP Mug 2"),
        (&pairs, far, "grab the same mug again", "PICKUP Mug 2"),
        (&pairs, door, "open the other drawer", "OPEN Drawer 2"),
        (&pairs, door, "open another drawer", "OPEN Drawer 2"),
        (&pairs, door, "close the same drawer", "CLOSE Drawer 1"),
        (&pairs, closed, "open the same cabinet", "OPEN Cabinet 3"),
        (&lounge, sofa, "pick up the other pillow", "PICKUP Pillow 2"),
        (&lounge, sofa, "take another pillow", "PICKUP Pillow 2"),
        (&lounge, sofa, "pick up the same pillow", "PICKUP Pillow 1"),
        (&lounge, &["turn on floor lamp 1"], "turn off the other floor lamp", "TOGGLE FloorLamp 2"),
    ];
    let mut report = Report::new("same and other");
    for (setting, before, text, expected) in cases {
        chooses(&Talk::new(setting).after(before), &mut report, text, expected);
    }
    report.finish();
}

/// "Close it" and "turn it off" mean a door or a switch, whatever the robot holds.
#[test]
fn it_means_what_the_verb_can_be_done_to() {
    let held: &[&str] = &["pick up the egg"];
    let cases: &[(&[&str], &str, &str)] = &[
        (&["open the fridge", "pick up the tomato"], "close it", "CLOSE Fridge"),
        (&["open the fridge", "pick up the tomato"], "shut it", "CLOSE Fridge"),
        (&["pick up the egg", "go to the microwave"], "open it", "OPEN Microwave"),
        (&["pick up the egg", "go to the fridge"], "open it", "OPEN Fridge"),
        (&["pick up the egg", "turn on the faucet"], "turn it off", "TOGGLE Faucet"),
        (&["pick up the egg", "turn on the faucet"], "turn it off again", "TOGGLE Faucet"),
        (&["pick up the egg", "turn on the microwave"], "switch it off", "TOGGLE Microwave"),
        (&["pick up egg 1", "open cabinet 3"], "close it", "CLOSE Cabinet 3"),
        (&["pick up egg 1", "open drawer 2"], "close it again", "CLOSE Drawer 2"),
        (held, "put it on the dining table", "PUT Egg 1 > DiningTable"),
    ];
    let mut report = Report::new("it");
    for (before, text, expected) in cases {
        chooses(&Talk::new(&Setting::pairs()).after(before), &mut report, text, expected);
    }
    report.finish();
}

#[test]
fn what_no_instance_is_like_is_declined() {
    let talk = Talk::new(&Setting::pairs());
    talk.declines(
        "no such instance",
        &[
            "pick up mug 5",
            "pick up mug 3",
            "pick up mug 0",
            "take apple 12",
            "take spoon number 9",
            "open cabinet 4",
            "open drawer 3",
            "go to cabinet 7",
            "pick up the third mug",
            "grab the fourth apple",
            "open the fifth drawer",
            "go to the tenth cabinet",
            "pick up the clean fork",
            "take the fork that is clean",
            "pick up the dirty spoon",
            "close the open drawer",
            "go to the open drawer",
            "open the other fridge",
            "open another fridge",
            "go to the other sink",
            "go to the second fridge",
            "open fridge 2",
            "take the other tomato",
            "pick up tomato 2",
            "pick up the mug in the fridge",
            "take the mug from inside the cabinet",
            "take the mug out of the microwave",
            "pick up the egg on the dining table",
            "take the apple from the counter",
            "grab the apple that is on the counter",
            "grab the plate in the microwave",
            "take the spoon out of the drawer",
            "pick up the bowl on the dining table",
            "take the potato out of the fridge",
            "take out the fork in the sink",
        ],
    );
}

/// Nothing was handled yet, so "the other" chooses nothing. The robot declines and does not guess.
#[test]
fn the_other_of_nothing_is_declined() {
    let talk = Talk::new(&Setting::pairs());
    talk.declines(
        "the other of nothing",
        &[
            "pick up the other fork",
            "take the other mug",
            "open the other drawer",
            "grab the other spoon please",
            "go to the other cabinet",
            "pick up the same plate again",
        ],
    );
    let talk = Talk::new(&Setting::pairs().holding("Tomato"));
    talk.declines(
        "no such place of a put",
        &[
            "put the tomato on plate 3",
            "put the tomato in bowl 4",
            "put it on the plate in the fridge",
            "put it in the bowl on the dining table",
            "put it in the other fridge",
            "put the tomato in fridge 2",
            "put tomato 2 in the fridge",
        ],
    );
}

/// A question is refused because it is a question, so that the person learns this.
#[test]
fn a_decline_names_what_did_not_fit() {
    let talk = Talk::new(&Setting::pairs());
    let mut report = Report::new("declines with a reason");
    for (text, part) in [
        ("pick up mug 5", "mug"),
        ("pick up the clean fork", "fork"),
        ("open the second fridge", "fridge"),
        ("take the mug out of the microwave", "mug"),
    ] {
        let answer = talk.asks(text);
        let named = super::talk::reason(&answer).is_none_or(|reason| reason.contains(part));
        report.check(named && bound(&answer).is_none(), || line(text, part, &answer));
    }
    report.finish();
}

/// Later steps act on the thing that the words chose, not on the nearest.
#[test]
fn a_program_keeps_to_the_chosen_thing() {
    let talk = Talk::taught(&Setting::pairs(), &[super::talk::WASH_MUG]);
    let mut report = Report::new("lessons on a chosen thing");
    for (text, thing) in [
        ("wash mug 2", "Mug 2"),
        ("wash the second mug", "Mug 2"),
        ("wash the clean mug", "Mug 2"),
        ("wash the mug on the dining table", "Mug 2"),
        ("wash apple 2", "Apple 2"),
        ("wash the third apple", "Apple 3"),
        ("wash the apple in the fridge", "Apple 3"),
        ("wash the hot potato", "Potato 2"),
        ("wash fork 2", "Fork 2"),
        ("wash the spoon from the table", "Spoon 2"),
    ] {
        let answer = talk.asks(text);
        let kind = thing.split(' ').next().unwrap_or(thing);
        let steps = bound(&answer).unwrap_or_default();
        let of_kind = |step: &&String| {
            let acts = step.starts_with("PICKUP ") || step.starts_with("PUT ");
            acts && step.contains(&format!(" {kind}"))
        };
        let touched: Vec<&String> = steps.iter().filter(of_kind).collect();
        let right = !touched.is_empty() && touched.iter().all(|step| step.contains(thing));
        report.check(right, || format!("{}: {}", line(text, thing, &answer), steps.join("; ")));
    }
    report.finish();
}
