//! What a lesson answers and what it does not: the words decide the last place, another state is
//! another request, and nothing is done twice because it was said twice.

use super::talk::{Report, Setting, Talk, Taught, WASH_MUG, acted, done, line, without_walks};

const WASH_AWAY: Taught<'_> = (
    "wash the tomato and put it on the table",
    "GOTO Tomato; PICKUP Tomato; GOTO SinkBasin; PUT Tomato SinkBasin; TOGGLE Faucet; \
     TOGGLE Faucet; PICKUP Tomato; GOTO DiningTable; PUT Tomato DiningTable",
);

const COOL_AWAY: Taught<'_> = (
    "put a cold tomato on the table",
    "GOTO Tomato; PICKUP Tomato; GOTO Fridge; OPEN Fridge; PUT Tomato Fridge; CLOSE Fridge; \
     OPEN Fridge; PICKUP Tomato; CLOSE Fridge; GOTO DiningTable; PUT Tomato DiningTable",
);

const INTO_THE_FRIDGE: Taught<'_> = (
    "wash the tomato and put it in the fridge",
    "GOTO Tomato; PICKUP Tomato; GOTO SinkBasin; PUT Tomato SinkBasin; TOGGLE Faucet; \
     TOGGLE Faucet; PICKUP Tomato; GOTO Fridge; OPEN Fridge; PUT Tomato Fridge; CLOSE Fridge",
);

fn taught(lesson: Taught<'_>) -> Talk {
    Talk::taught(&Setting::kitchen(), &[lesson])
}

fn washed(thing: &str, place: &str) -> String {
    let end = match place {
        "Fridge" | "Microwave" => format!("OPEN {place}; PUT {thing} {place}; CLOSE {place}"),
        _ => format!("PUT {thing} {place}"),
    };
    format!(
        "PICKUP {thing}; PUT {thing} SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP {thing}; {end}"
    )
}

/// A lesson for the table works for the fridge, whose door the robot opens and shuts; and the
/// reverse.
#[test]
fn a_lesson_ends_where_the_words_put_it() {
    let places = [
        ("in the fridge", "Fridge"),
        ("in the microwave", "Microwave"),
        ("on the counter", "CounterTop"),
        ("on the table", "DiningTable"),
    ];
    for lesson in [WASH_AWAY, INTO_THE_FRIDGE] {
        let talk = taught(lesson);
        let mut report = Report::new(lesson.0);
        for (thing, kind) in [("potato", "Potato"), ("apple", "Apple"), ("tomato", "Tomato")] {
            for (said, place) in places {
                for text in [
                    format!("wash the {thing} and put it {said}"),
                    format!("rinse the {thing} in the sink and put it {said}"),
                ] {
                    let answer = talk.asks(&text);
                    let expected = washed(kind, place);
                    let right = done(&answer).map(without_walks);
                    // Not understood is no harm: the words named another place.
                    let right = right.is_none_or(|found| found == expected);
                    report.check(right, || line(&text, &expected, &answer));
                }
            }
        }
        report.finish();
        let text = "wash the potato and put it on the counter";
        let answer = talk.asks(text);
        let found = done(&answer).map(without_walks);
        let expected = washed("Potato", "CounterTop");
        assert_eq!(found.as_deref(), Some(expected.as_str()), "after {:?}: {text}", lesson.0);
    }
}

#[test]
fn a_lesson_for_one_state_is_not_for_another() {
    let cold = taught(COOL_AWAY);
    let mut other = Vec::new();
    for state in ["hot", "warm", "heated", "cooked", "washed", "rinsed", "clean", "cleaned"] {
        for rest in ["potato on the table", "apple on the counter", "tomato on the table"] {
            other.push(format!("put a {state} {rest}"));
        }
    }
    cold.declines("a lesson about a cold thing", &other);
    assert!(acted(&cold.asks("put a chilled potato on the table")), "the same state");
    let washed = taught(WASH_AWAY);
    let other = [
        "cool the potato and put it on the table",
        "chill the apple and put it on the table",
        "heat the potato and put it on the table",
        "warm the apple and put it on the table",
        "cook the egg and put it on the table",
        "put a hot potato on the table",
        "put a chilled apple on the table",
    ];
    washed.declines("a lesson about washing", &other);
}

/// One lesson answers several clauses once, or they are not understood.
#[test]
fn what_is_said_twice_is_not_done_twice() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    let mut report = Report::new("once at most");
    for thing in ["potato", "apple", "tomato", "plate", "knife"] {
        for text in [
            format!("put the {thing} in the sink, wash it"),
            format!("wash the {thing} and rinse it"),
            format!("clean the {thing}, then wash it in the sink"),
            format!("wash the {thing}, wash the {thing}"),
        ] {
            let answer = talk.asks(&text);
            let times = done(&answer).map_or(0, |program| {
                program.steps.iter().filter(|step| step.to_string() == "TOGGLE Faucet").count()
            });
            report.check(times <= 2, || line(&text, "one washing at most", &answer));
        }
    }
    report.finish();
}

/// "When you are done" changes nothing in the last of several clauses. In a single request it is a
/// condition.
#[test]
fn the_last_clause_may_be_said_to_be_last() {
    let ends = [
        "when you are done",
        "when you're done",
        "when done",
        "afterwards",
        "when you're finished",
        "once you are done",
        "when you have finished",
    ];
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    let mut two = Vec::new();
    for end in ends {
        for (text, bare) in [
            ("open the fridge and close it", "OPEN Fridge; CLOSE Fridge"),
            ("open the drawer, then open the cabinet", "OPEN Drawer; OPEN Cabinet"),
            ("pick up the mug and open the fridge", "PICKUP Mug; OPEN Fridge"),
        ] {
            two.push((format!("{text} {end}"), bare));
        }
    }
    talk.acts("two clauses", &two);
    let one = |text: &str| ends.iter().map(|end| format!("{text} {end}")).collect::<Vec<_>>();
    for request in
        ["wash the potato", "open the fridge", "pick up the clean mug", "turn on the tap"]
    {
        talk.declines("a single request is for another time then", &one(request));
    }
}

#[test]
fn a_word_that_may_open_a_frame_is_also_a_verb() {
    let chill = (
        "cool the tomato",
        "GOTO Tomato; PICKUP Tomato; GOTO Fridge; OPEN Fridge; PUT Tomato Fridge; CLOSE Fridge; \
         OPEN Fridge; PICKUP Tomato; CLOSE Fridge",
    );
    let talk = Talk::taught(&Setting::kitchen(), &[chill]);
    for (thing, kind) in [("potato", "Potato"), ("apple", "Apple"), ("bread", "Bread")] {
        let chilled = format!(
            "PICKUP {kind}; OPEN Fridge; PUT {kind} Fridge; CLOSE Fridge; OPEN Fridge; \
             PICKUP {kind}; CLOSE Fridge"
        );
        let verb = ["cool the", "please cool the", "cool, cool the", "ok cool the"];
        let said = verb.map(|words| (format!("{words} {thing}"), chilled.as_str()));
        talk.acts("cool as a verb", &said);
        let taken = format!("PICKUP {kind}");
        let frame = ["cool, pick up the", "cool pick up the", "ok, cool, pick up the"];
        let said = frame.map(|words| (format!("{words} {thing}"), taken.as_str()));
        talk.acts("cool as a frame", &said);
    }
}

#[test]
fn a_tap_is_opened_and_closed_by_turning_it() {
    let on = Setting::kitchen().with("Faucet", "on");
    let open: Vec<String> = ["the tap", "the faucet", "tap", "faucet"]
        .iter()
        .flat_map(|tap| [format!("open {tap}"), format!("please open {tap}")])
        .collect();
    let said: Vec<(&str, &str)> =
        open.iter().map(|text| (text.as_str(), "TOGGLE Faucet")).collect();
    Talk::new(&Setting::kitchen()).acts("a tap that is off", &said);
    Talk::new(&on).declines("a tap that is on", &open);
    let close: Vec<String> = open.iter().map(|text| text.replace("open", "close")).collect();
    let said: Vec<(&str, &str)> =
        close.iter().map(|text| (text.as_str(), "TOGGLE Faucet")).collect();
    Talk::new(&on).acts("a tap that is on", &said);
    Talk::new(&Setting::kitchen()).declines("a tap that is off", &close);
}

/// "Look at" goes to a thing. With a light it asks for more, which only a lesson can answer.
#[test]
fn looking_in_a_light_is_more_than_going_there() {
    let talk = Talk::new(&Setting::lounge());
    let mut said = Vec::new();
    for thing in ["the book", "the remote control", "the pillow"] {
        for light in [
            "in the light",
            "under the lamp",
            "by the lamp",
            "with the lamp",
            "in the lamp light",
            "under the light of the lamp",
            "by the light of the desk lamp",
            "in the floor lamp light",
        ] {
            said.push(format!("look at {thing} {light}"));
        }
    }
    talk.declines("looking in a light", &said);
    let mut beside = Report::new("beside a lamp");
    for text in
        ["look at the book", "look at the book next to the lamp", "go to the book by the lamp"]
    {
        let answer = talk.asks(text);
        beside.check(acted(&answer), || line(text, "a walk", &answer));
    }
    beside.finish();
}

/// A lesson about the fridge does not answer for another thing in the same place of the sentence.
#[test]
fn a_lesson_about_a_fixture_is_not_for_another_thing() {
    let peek = ("peek into the fridge", "GOTO Fridge; OPEN Fridge; CLOSE Fridge");
    let chill = (
        "put the tomato into the fridge for a moment",
        "GOTO Tomato; PICKUP Tomato; GOTO Fridge; OPEN Fridge; PUT Tomato Fridge; CLOSE Fridge; \
         OPEN Fridge; PICKUP Tomato; CLOSE Fridge",
    );
    let talk = Talk::taught(&Setting::kitchen(), &[peek, chill]);
    let mut report = Report::new("the fridge is not meant");
    for place in ["drawer", "cabinet", "microwave", "sink", "table", "counter", "toaster"] {
        for text in [
            format!("peek into the {place}"),
            format!("please peek into the {place}"),
            format!("peek in the {place}"),
            format!("put the potato into the {place} for a moment"),
        ] {
            let answer = talk.asks(&text);
            let fridge = done(&answer).is_some_and(|program| {
                program
                    .steps
                    .iter()
                    .any(|step| step.args.iter().any(|arg| arg.as_str() == "Fridge"))
            });
            report.check(!fridge, || line(&text, "nothing with the fridge", &answer));
        }
    }
    report.finish();
    assert!(acted(&talk.asks("please peek into the fridge")), "the same fixture");
}

/// A tool that the words name is asked for too. The lesson was done without a tool.
#[test]
fn a_lesson_is_not_done_without_the_tool_that_was_named() {
    let wash = (
        "wash the mug",
        "PICKUP Mug; GOTO SinkBasin; PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug",
    );
    let talk = Talk::taught(&Setting::kitchen(), &[wash]);
    let with: Vec<String> = ["banana", "fork", "zork", "hammer", "knife"]
        .into_iter()
        .flat_map(|tool| {
            [
                format!("wash the tomato with the {tool}"),
                format!("wash the tomato using a {tool}"),
                format!("please wash the potato with the {tool}"),
            ]
        })
        .collect();
    talk.is_unsure("nothing is washed without the tool", &with);
    assert!(acted(&talk.asks("wash the tomato")), "the lesson itself");
}
