//! Take, bring, carry, move, return, deliver: the robot never arrives without the thing.

use apprentice::world::Thing;

use super::talk::{Report, Setting, Talk, acted, line, shown};

const VERBS: [&str; 6] = ["take", "bring", "carry", "move", "return", "deliver"];

/// A thing: how it is said, its name, and places where it is not yet (how they are said, and their
/// names).
type Load = (&'static str, &'static str, [(&'static str, &'static str); 3]);

const LOADS: [Load; 6] = [
    ("mug", "Mug", [("sink", "SinkBasin"), ("fridge", "Fridge"), ("table", "DiningTable")]),
    ("spatula", "Spatula", [("sink", "SinkBasin"), ("drawer", "Drawer"), ("table", "DiningTable")]),
    ("apple", "Apple", [("sink", "SinkBasin"), ("fridge", "Fridge"), ("counter", "CounterTop")]),
    ("plate", "Plate", [("sink", "SinkBasin"), ("cabinet", "Cabinet"), ("counter", "CounterTop")]),
    ("egg", "Egg", [("sink", "SinkBasin"), ("table", "DiningTable"), ("counter", "CounterTop")]),
    ("bowl", "Bowl", [("sink", "SinkBasin"), ("table", "DiningTable"), ("microwave", "Microwave")]),
];

const WORDINGS: [&str; 4] = [
    "{verb} the {thing} to the {place}",
    "{verb} the {thing} over to the {place}",
    "could you {verb} the {thing} to the {place}?",
    "please {verb} the {thing} back to the {place}",
];

fn thing(talk: &Talk, kind: &str) -> Thing {
    let things = talk.sees().things.into_iter();
    let mut of_kind = things.filter(|thing| thing.name == kind);
    of_kind.next().unwrap_or_else(|| panic!("there is no {kind}"))
}

fn held(talk: &Talk, kind: &str) -> bool {
    thing(talk, kind).states.iter().any(|state| state == "held")
}

fn lies_at(talk: &Talk, kind: &str, place: &str) -> bool {
    thing(talk, kind).place.as_deref() == Some(place)
}

fn stands_at(talk: &Talk, place: &str) -> bool {
    thing(talk, place).states.iter().any(|state| state == "here")
}

/// The thing was carried: it is at the place, or in the hand there if the verb keeps it.
fn came_along(talk: &Talk, verb: &str, kind: &str, place: &str) -> bool {
    let in_hand = matches!(verb, "take" | "carry") && held(talk, kind) && stands_at(talk, place);
    lies_at(talk, kind, place) || in_hand
}

fn where_it_is(talk: &Talk, kind: &str) -> String {
    let thing = thing(talk, kind);
    let place = thing.place.unwrap_or_else(|| "the hand or the floor".to_owned());
    format!("then {kind} is at {place}")
}

fn said(wording: &str, verb: &str, thing: &str, place: &str) -> String {
    wording.replace("{verb}", verb).replace("{thing}", thing).replace("{place}", place)
}

#[test]
fn the_robot_never_arrives_without_the_thing() {
    let talk = Talk::new(&Setting::kitchen());
    let mut report = Report::new("carried from elsewhere");
    for (name, kind, places) in LOADS {
        for (place_name, place) in places {
            for verb in VERBS {
                for wording in WORDINGS {
                    let text = said(wording, verb, name, place_name);
                    let mut after = talk.clone();
                    let answer = after.says(&text);
                    let right = !acted(&answer) || came_along(&after, verb, kind, place);
                    report.check(right, || {
                        let expected = format!("nothing, or {kind} at {place}");
                        let then = where_it_is(&after, kind);
                        format!("{}; {then}", line(&text, &expected, &answer))
                    });
                }
            }
        }
    }
    report.finish();
}

#[test]
fn what_is_in_the_hand_is_brought() {
    let mut report = Report::new("carried from the hand");
    for (name, kind, places) in LOADS {
        let talk = Talk::new(&Setting::kitchen().holding(kind));
        for (place_name, place) in places {
            for verb in VERBS {
                for wording in WORDINGS {
                    for object in [format!("the {name}"), "it".to_owned()] {
                        let wording = wording.replace("the {thing}", "{thing}");
                        let text = said(&wording, verb, &object, place_name);
                        let mut after = talk.clone();
                        let answer = after.says(&text);
                        let right = acted(&answer) && came_along(&after, verb, kind, place);
                        report.check(right, || {
                            let then = where_it_is(&after, kind);
                            format!(
                                "{}; {then}",
                                line(&text, &format!("{kind} at {place}"), &answer)
                            )
                        });
                    }
                }
            }
        }
    }
    report.finish();
}

/// If the robot holds another thing, that thing is in the way. It is not what is carried.
#[test]
fn another_thing_in_the_hand_is_not_carried_instead() {
    let talk = Talk::new(&Setting::kitchen().holding("Knife"));
    let mut report = Report::new("another thing in the hand");
    for (name, kind, places) in LOADS {
        for (place_name, place) in places {
            for verb in VERBS {
                let text = said(WORDINGS[0], verb, name, place_name);
                let mut after = talk.clone();
                let answer = after.says(&text);
                let right = !acted(&answer) || came_along(&after, verb, kind, place);
                report.check(right, || line(&text, "nothing", &answer));
            }
        }
    }
    report.finish();
}

/// For fetching there is no goal, or the person is the goal. The thing is in the hand at the end,
/// or nothing is done.
#[test]
fn fetching_ends_with_the_thing_in_the_hand() {
    let talk = Talk::new(&Setting::kitchen());
    let mut report = Report::new("fetched");
    let moulds = [
        "go get the {}",
        "go and get the {}",
        "go fetch the {}",
        "go and fetch the {} for me",
        "go over and grab the {}",
        "fetch the {}",
        "fetch me the {}",
        "bring me the {}",
        "bring the {} here",
        "hand me the {}",
        "get me the {} please",
        "come back with the {}",
        "go look for the {} and bring it",
    ];
    for (name, kind, _) in LOADS {
        for mould in moulds {
            let text = mould.replace("{}", name);
            let mut after = talk.clone();
            let answer = after.says(&text);
            report.check(!acted(&answer) || held(&after, kind), || {
                line(&text, &format!("nothing, or {kind} in the hand"), &answer)
            });
        }
    }
    report.finish();
}

/// Later words of the sentence count too.
#[test]
fn what_follows_the_carrying_is_not_dropped() {
    let talk = Talk::new(&Setting::kitchen());
    let mut report = Report::new("carried and put down");
    for (name, kind, places) in LOADS {
        for (place_name, place) in places {
            for (verb, rest) in [
                ("take", "and put it down"),
                ("carry", "and leave it there"),
                ("take", "and put it in there"),
                ("bring", "and set it down"),
            ] {
                let text = format!("{verb} the {name} to the {place_name} {rest}");
                let mut after = talk.clone();
                let answer = after.says(&text);
                report.check(!acted(&answer) || lies_at(&after, kind, place), || {
                    line(&text, &format!("nothing, or {kind} at {place}"), &answer)
                });
            }
        }
    }
    report.finish();
}

/// With a purpose, a state or a second thing that no primitive can reach, the robot does not walk
/// and does no part.
#[test]
fn carrying_for_more_than_the_walk_is_not_done_in_part() {
    let talk = Talk::new(&Setting::kitchen());
    talk.declines(
        "more than carrying",
        &[
            "take the apple to the sink to wash it",
            "bring the apple to the sink for washing",
            "carry the tomato to the microwave to heat it up",
            "take the mug to the sink and rinse it",
            "bring the egg to the counter and crack it",
            "take a chilled apple to the counter",
            "bring a washed tomato to the counter",
            "carry a hot potato to the table",
            "deliver a clean fork to the table",
            "bring the mug and the knife to the table",
            "take both the apple and the tomato to the sink",
            "move two apples to the counter",
            "bring all the plates to the sink",
            "take the apple with the plate to the counter",
            "return everything to the fridge",
            "take the mug to the sink or to the table",
            "bring the apple to the kitchen of the neighbour",
            "deliver the bread to my friend",
            "take the mug to the hammer",
            "bring the banana to the sink",
        ],
    );
}

/// One lesson is enough for what is declined.
#[test]
fn carrying_that_is_declined_can_be_taught() {
    let lesson =
        [("deliver the mug to the table", "PICKUP Mug; GOTO DiningTable; PUT Mug DiningTable")];
    let talk = Talk::taught(&Setting::kitchen(), &lesson);
    let mut report = Report::new("taught to deliver");
    for (text, kind, place) in [
        ("deliver the mug to the table", "Mug", "DiningTable"),
        ("deliver the spatula to the table", "Spatula", "DiningTable"),
        ("deliver the knife to the table", "Knife", "DiningTable"),
        ("please deliver the potato to the table", "Potato", "DiningTable"),
    ] {
        let mut after = talk.clone();
        let answer = after.says(text);
        report.check(lies_at(&after, kind, place), || {
            format!("{text:?}: expected {kind} at {place}, found {}", shown(&answer))
        });
    }
    report.finish();
}
