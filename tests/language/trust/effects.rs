//! Lessons are replayed by effect: a step whose effect is there is skipped, the others are done. If
//! nothing is left to do, the robot says so.

use super::talk::{Report, Setting, Talk, Taught, WASH_MUG, acted, line, reason, shown};

const CHILL: Taught<'_> = (
    "chill the tomato",
    "GOTO Tomato; PICKUP Tomato; GOTO Fridge; OPEN Fridge; PUT Tomato Fridge; CLOSE Fridge; \
     OPEN Fridge; PICKUP Tomato",
);

const HEAT: Taught<'_> = (
    "heat the potato",
    "GOTO Potato; PICKUP Potato; GOTO Microwave; OPEN Microwave; PUT Potato Microwave; \
     CLOSE Microwave; TOGGLE Microwave; TOGGLE Microwave; OPEN Microwave; PICKUP Potato",
);

const STOW: Taught<'_> = (
    "stow the spatula",
    "GOTO Spatula; PICKUP Spatula; GOTO Drawer; OPEN Drawer; PUT Spatula Drawer; CLOSE Drawer",
);

const ALL: &[Taught<'_>] = &[WASH_MUG, CHILL, HEAT, STOW];

/// A talk in this setting, after lessons in the kitchen in its first state.
fn talk(setting: &Setting) -> Talk {
    Talk::taught_in(&Setting::kitchen(), ALL, setting)
}

/// What must be true of a thing: a state it has, `clean`, `off`, or `in` a place.
type Want<'a> = (&'a str, &'a str);

fn holds(talk: &Talk, (name, wanted): &Want<'_>) -> bool {
    let things = talk.sees().things;
    let thing = things.iter().find(|thing| thing.name == *name).unwrap_or_else(|| {
        panic!("there is no {name}");
    });
    let is = |state: &str| thing.states.iter().any(|found| found == state);
    match wanted.split_once(' ') {
        Some(("in", place)) => thing.place.as_deref() == Some(place),
        _ => match *wanted {
            "clean" => !is("dirty"),
            "off" => !is("on"),
            state => is(state),
        },
    }
}

/// Carried out, and afterwards all of this is true.
fn ends(talk: &Talk, report: &mut Report, text: &str, wants: &[Want<'_>]) {
    let mut after = talk.clone();
    let answer = after.says(text);
    let missing: Vec<&Want<'_>> = wants.iter().filter(|want| !holds(&after, want)).collect();
    report.check(acted(&answer) && missing.is_empty(), || {
        format!("{}; then not {missing:?}", line(text, &format!("{wants:?}"), &answer))
    });
}

#[test]
fn what_is_done_already_is_skipped() {
    let kitchen = Setting::kitchen;
    let at_fridge = || kitchen().standing_at("Fridge").with("Fridge", "open");
    let cases: &[(Setting, &str, &str)] = &[
        (
            kitchen(),
            "chill the apple",
            "PICKUP Apple; OPEN Fridge; PUT Apple Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Apple",
        ),
        (
            kitchen().with("Fridge", "open"),
            "chill the apple",
            "PICKUP Apple; PUT Apple Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Apple",
        ),
        (
            kitchen().holding("Apple"),
            "chill the apple",
            "OPEN Fridge; PUT Apple Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Apple",
        ),
        (
            kitchen().holding("Mug").with("Fridge", "open"),
            "chill the mug",
            "PUT Mug Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Mug",
        ),
        (
            at_fridge().holding("Plate"),
            "chill the plate",
            "PUT Plate Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Plate",
        ),
        (
            kitchen().holding("Tomato"),
            "chill the tomato",
            "OPEN Fridge; PUT Tomato Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Tomato",
        ),
        (
            kitchen().holding("Plate"),
            "wash the plate",
            "PUT Plate SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Plate",
        ),
        (
            kitchen().holding("Mug"),
            "wash the mug",
            "PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug",
        ),
        (
            kitchen().holding("Tomato").standing_at("SinkBasin"),
            "wash the tomato",
            "PUT Tomato SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Tomato",
        ),
        (
            kitchen().holding("Plate"),
            "wash it",
            "PUT Plate SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Plate",
        ),
        (
            kitchen().with("Microwave", "open"),
            "heat the apple",
            "PICKUP Apple; PUT Apple Microwave; CLOSE Microwave; TOGGLE Microwave; \
             TOGGLE Microwave; OPEN Microwave; PICKUP Apple",
        ),
        (
            kitchen().holding("Bread"),
            "heat the bread",
            "OPEN Microwave; PUT Bread Microwave; CLOSE Microwave; TOGGLE Microwave; \
             TOGGLE Microwave; OPEN Microwave; PICKUP Bread",
        ),
        (
            kitchen().holding("Potato").with("Microwave", "open"),
            "heat the potato",
            "PUT Potato Microwave; CLOSE Microwave; TOGGLE Microwave; TOGGLE Microwave; \
             OPEN Microwave; PICKUP Potato",
        ),
        (
            kitchen().with("Drawer", "open"),
            "stow the knife",
            "PICKUP Knife; PUT Knife Drawer; CLOSE Drawer",
        ),
        (
            kitchen().holding("Knife"),
            "stow the knife",
            "OPEN Drawer; PUT Knife Drawer; CLOSE Drawer",
        ),
        (
            kitchen().holding("Fork").with("Drawer", "open"),
            "stow the fork",
            "PUT Fork Drawer; CLOSE Drawer",
        ),
        (
            kitchen().holding("Spatula").with("Drawer", "open").standing_at("Drawer"),
            "stow the spatula",
            "PUT Spatula Drawer; CLOSE Drawer",
        ),
        (
            kitchen().with("Drawer", "open"),
            "stow the spatula",
            "PICKUP Spatula; PUT Spatula Drawer; CLOSE Drawer",
        ),
    ];
    let mut report = Report::new("half done");
    for (setting, text, program) in cases {
        for frame in ["{}", "please {}", "could you {}?", "{} now"] {
            let text = frame.replace("{}", text);
            let answer = talk(setting).asks(&text);
            let found = super::talk::done(&answer).map(super::talk::without_walks);
            report.check(found.as_deref() == Some(*program), || line(&text, program, &answer));
        }
    }
    report.finish();
}

/// If more than one program would be right, only the end counts.
#[test]
fn a_half_done_lesson_ends_as_a_whole_one() {
    let kitchen = Setting::kitchen;
    let cold = |thing: &'static str| vec![(thing, "held"), (thing, "cold")];
    let hot = |thing: &'static str| vec![(thing, "held"), (thing, "hot"), ("Microwave", "off")];
    let clean = |thing: &'static str| vec![(thing, "held"), (thing, "clean"), ("Faucet", "off")];
    let stowed = |thing: &'static str| vec![(thing, "in Drawer"), ("Drawer", "closed")];
    let cases: Vec<(Setting, &str, Vec<Want<'_>>)> = vec![
        (kitchen(), "chill the egg", cold("Egg")),
        (kitchen().with("Fridge", "open"), "chill the lettuce", cold("Lettuce")),
        (kitchen().placed("Apple", "Fridge"), "chill the apple", cold("Apple")),
        (kitchen().standing_at("Fridge"), "chill the apple", cold("Apple")),
        (kitchen().placed("Plate", "SinkBasin"), "wash the plate", clean("Plate")),
        (kitchen().placed("Mug", "SinkBasin"), "wash the mug", clean("Mug")),
        (kitchen().with("Faucet", "on"), "wash the potato", clean("Potato")),
        (kitchen().with("Faucet", "on").holding("Plate"), "wash the plate", clean("Plate")),
        (kitchen().standing_at("SinkBasin"), "wash the apple", clean("Apple")),
        (kitchen().placed("Apple", "Microwave"), "heat the apple", hot("Apple")),
        (
            kitchen().placed("Apple", "Microwave").with("Microwave", "open"),
            "heat the apple",
            hot("Apple"),
        ),
        (kitchen().standing_at("Microwave").holding("Apple"), "heat the apple", hot("Apple")),
        (kitchen().standing_at("Drawer"), "stow the knife", stowed("Knife")),
        (kitchen().with("Drawer", "open").holding("Knife"), "stow it", stowed("Knife")),
    ];
    let mut report = Report::new("half done, by how it ends");
    for (setting, text, wants) in &cases {
        ends(&talk(setting), &mut report, text, wants);
    }
    report.finish();
}

#[test]
fn a_lesson_works_a_second_time_in_one_episode() {
    let mut report = Report::new("a second time");
    let cases: &[(&[&str], &str, &[Want<'_>])] = &[
        (
            &["wash the potato", "put the potato on the counter"],
            "wash the tomato",
            &[("Tomato", "held"), ("Tomato", "clean")],
        ),
        (
            &["chill the apple", "put the apple on the counter"],
            "chill the tomato",
            &[("Tomato", "held"), ("Tomato", "cold")],
        ),
        (
            &["chill the apple", "put it on the table", "chill the tomato", "put it on the table"],
            "chill the potato",
            &[("Potato", "held"), ("Potato", "cold")],
        ),
        (
            &["heat the potato", "put the potato on the counter"],
            "heat the bread",
            &[("Bread", "held"), ("Bread", "hot")],
        ),
        (
            &["stow the spatula", "open the drawer"],
            "stow the knife",
            &[("Knife", "in Drawer"), ("Drawer", "closed")],
        ),
        (&["wash the tomato"], "chill the tomato", &[("Tomato", "held"), ("Tomato", "cold")]),
        (&["chill the apple"], "heat the apple", &[("Apple", "held"), ("Apple", "hot")]),
        (&["pick up the plate"], "wash the plate", &[("Plate", "held"), ("Plate", "clean")]),
    ];
    for (before, text, wants) in cases {
        ends(&talk(&Setting::kitchen()).after(before), &mut report, text, wants);
    }
    report.finish();
}

/// Nothing is left to do. An empty program would be a success without an action.
#[test]
fn nothing_left_to_do_is_said() {
    let lessons: &[Taught<'_>] = &[
        ("secure the fridge", "GOTO Fridge; CLOSE Fridge"),
        ("prepare the drawer", "GOTO Drawer; OPEN Drawer"),
        ("seize the mug", "GOTO Mug; PICKUP Mug"),
    ];
    // The fridge is open during the lesson.
    let taught = Setting::kitchen().with("Fridge", "open");
    let shut = || Setting::kitchen();
    let cases: &[(Setting, &[&str])] = &[
        (
            shut().standing_at("Fridge"),
            &["secure the fridge", "please secure the fridge", "secure the fridge now"],
        ),
        (
            shut().standing_at("Drawer").with("Drawer", "open"),
            &["prepare the drawer", "could you prepare the drawer?", "prepare the drawer please"],
        ),
        (
            shut().standing_at("Cabinet").with("Cabinet", "open"),
            &["prepare the cabinet", "please prepare the cabinet"],
        ),
        (shut().standing_at("Drawer"), &["secure the drawer", "robot, secure the drawer"]),
        (shut().holding("Mug"), &["seize the mug", "seize it", "seize the mug now"]),
        (shut().holding("Knife"), &["seize the knife", "please seize the knife"]),
    ];
    let mut report = Report::new("nothing left");
    for (setting, said) in cases {
        let talk = Talk::taught_in(&taught, lessons, setting);
        for text in *said {
            let mut after = talk.clone();
            let answer = after.says(text);
            let told = reason(&answer).is_none_or(|reason| !reason.trim().is_empty());
            report.check(!acted(&answer) && after.actions() == 0 && told, || {
                line(text, "a reason", &answer)
            });
        }
    }
    report.finish();
}

/// If the thing is already where the lesson puts it, it is not fetched and put back.
#[test]
fn a_lesson_without_a_name_leaves_its_own_thing_alone() {
    type Case<'t> = (Taught<'t>, fn() -> Setting);
    let lessons: &[Case<'_>] = &[
        (("tidy up a bit", "PICKUP Mug; GOTO SinkBasin; PUT Mug SinkBasin"), || {
            Setting::kitchen().placed("Mug", "SinkBasin")
        }),
        (("do the usual", STOW.1), || Setting::kitchen().placed("Spatula", "Drawer")),
        (("do the usual", STOW.1), || {
            Setting::kitchen().placed("Spatula", "Drawer").with("Drawer", "open")
        }),
        (
            (
                "set everything up",
                "GOTO Apple; PICKUP Apple; GOTO CounterTop; PUT Apple CounterTop",
            ),
            || Setting::kitchen().placed("Apple", "CounterTop"),
        ),
        (("clear this mess", "PICKUP Knife; GOTO DiningTable; PUT Knife DiningTable"), || {
            Setting::kitchen().placed("Knife", "DiningTable")
        }),
    ];
    let mut report = Report::new("a lesson without a name");
    for (lesson, setting) in lessons {
        let talk = Talk::taught_in(&Setting::kitchen(), &[*lesson], &setting());
        for frame in ["{}", "please {}", "{} again", "now {}"] {
            let text = frame.replace("{}", lesson.0);
            let answer = talk.asks(&text);
            report.check(!acted(&answer), || line(&text, "nothing", &answer));
        }
    }
    report.finish();
}

/// The exact words of a lesson are adapted in the same way as words near to them.
#[test]
fn near_and_exact_words_are_mended_alike() {
    let kitchen = Setting::kitchen;
    let settings: &[(Setting, &str)] = &[
        (kitchen().with("Drawer", "open"), "stow the spatula"),
        (kitchen().holding("Spatula"), "stow the spatula"),
        (kitchen().standing_at("Drawer"), "stow the spatula"),
        (kitchen().placed("Spatula", "DiningTable"), "stow the spatula"),
        (kitchen().with("Fridge", "open"), "chill the tomato"),
        (kitchen().holding("Tomato"), "chill the tomato"),
        (kitchen().placed("Tomato", "SinkBasin"), "chill the tomato"),
        (kitchen().placed("Mug", "Cabinet"), "wash the mug"),
        (kitchen().holding("Mug"), "wash the mug"),
        (kitchen().placed("Mug", "DiningTable"), "wash the mug"),
        (kitchen().with("Microwave", "open"), "heat the potato"),
        (kitchen().placed("Potato", "Fridge"), "heat the potato"),
    ];
    let mut report = Report::new("near and exact");
    for (setting, exact) in settings {
        let talk = talk(setting);
        let expected = shown(&talk.asks(exact));
        let right = acted(&talk.asks(exact));
        report.check(right, || line(exact, "a program", &talk.asks(exact)));
        for frame in ["please {}", "{} please", "now {}", "{}!", "can you {}?", "{} for me"] {
            let text = frame.replace("{}", exact);
            let answer = talk.asks(&text);
            report.check(shown(&answer) == expected, || line(&text, &expected, &answer));
        }
    }
    report.finish();
}

#[test]
fn a_lesson_that_cannot_apply_says_why() {
    talk(&Setting::kitchen()).is_impossible(
        "another kind of thing",
        &[
            ("wash the counter", "cannot be"),
            ("wash the dining table", "cannot be"),
            ("wash the fridge", "cannot be"),
            ("wash the microwave", "cannot be"),
            ("wash the cabinet", "cannot be"),
            ("wash the coffee machine", "cannot be"),
            ("please wash the counter", "cannot be"),
            ("chill the toaster", "cannot be"),
            ("chill the drawer", "cannot be"),
            ("chill the counter", "cannot be"),
            ("heat the coffee machine", "cannot be"),
            ("heat the table", "cannot be"),
            ("stow the fridge", "cannot be"),
            ("stow the microwave", "cannot be"),
            ("heat the spatula", "does not go"),
            ("stow the mug", "does not go"),
        ],
    );
}

#[test]
fn two_lessons_of_one_wording_are_chosen_by_kind() {
    let lessons: &[Taught<'_>] = &[
        ("freshen the potato", &WASH_MUG.1.replace("Mug", "Potato")),
        ("freshen the drawer", "GOTO Drawer; OPEN Drawer; CLOSE Drawer"),
    ];
    let talk = Talk::taught(&Setting::kitchen(), lessons);
    let wash = |thing: &str| {
        "PICKUP X; PUT X SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP X".replace('X', thing)
    };
    let (mug, apple, tomato, plate) = (wash("Mug"), wash("Apple"), wash("Tomato"), wash("Plate"));
    let potato = wash("Potato");
    talk.acts(
        "two lessons of one wording",
        &[
            ("freshen the potato", potato.as_str()),
            ("freshen the mug", mug.as_str()),
            ("freshen the apple", apple.as_str()),
            ("please freshen the tomato", tomato.as_str()),
            ("could you freshen the plate?", plate.as_str()),
            ("freshen the drawer", "OPEN Drawer; CLOSE Drawer"),
            ("freshen the cabinet", "OPEN Cabinet; CLOSE Cabinet"),
            ("freshen the fridge", "OPEN Fridge; CLOSE Fridge"),
            ("please freshen the microwave", "OPEN Microwave; CLOSE Microwave"),
        ],
    );
}
