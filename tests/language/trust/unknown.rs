//! An unknown thing is named as unknown, and no known thing near it takes its place. If words that
//! change a request were not used, no part of it is done.

use super::talk::{Report, Setting, Talk, WASH_MUG, acted, line};

/// Things for which the household has no name.
const UNKNOWN: [&str; 14] = [
    "banana", "hammer", "guitar", "carrot", "umbrella", "whistle", "stapler", "violin", "wrench",
    "trumpet", "lantern", "helmet", "balloon", "broom",
];

/// Each with a known thing that may be in the same place.
const PLACES: [&str; 10] = [
    "next to the mug",
    "beside the potato",
    "near the fridge",
    "by the sink",
    "behind the knife",
    "in front of the microwave",
    "under the cabinet",
    "on the dining table",
    "from the counter",
    "to the left of the apple",
];

const VERBS: [&str; 3] = ["pick up the", "grab the", "go to the"];

#[test]
fn a_known_thing_beside_an_unknown_one_is_not_taken() {
    let talk = Talk::new(&Setting::kitchen());
    let mut report = Report::new("unknown beside known");
    for verb in VERBS {
        for thing in UNKNOWN {
            for place in PLACES {
                let text = format!("{verb} {thing} {place}");
                let answer = talk.asks(&text);
                report.check(!acted(&answer), || line(&text, "nothing", &answer));
            }
        }
    }
    report.finish_with(14 * 10 * 3 / 100);
}

#[test]
fn a_lesson_does_not_take_a_known_thing_beside_an_unknown_one() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    let mut report = Report::new("unknown beside known, with a lesson");
    for thing in UNKNOWN {
        for place in PLACES {
            let text = format!("wash the {thing} {place}");
            let answer = talk.asks(&text);
            report.check(!acted(&answer), || line(&text, "nothing", &answer));
        }
    }
    report.finish_with(14 * 10 / 100);
}

#[test]
fn an_unknown_place_is_no_place() {
    let talk = Talk::new(&Setting::kitchen().holding("Mug"));
    let moulds = [
        "put the mug in the {}",
        "put the mug on the {}",
        "place the mug on the {}",
        "put it in the {}",
        "put the mug on the {} next to the sink",
        "put the mug in the {} by the fridge",
        "set the mug down on the {}",
        "drop the mug into the {}",
    ];
    let said: Vec<String> =
        UNKNOWN.iter().flat_map(|thing| moulds.map(|mould| mould.replace("{}", thing))).collect();
    talk.declines("unknown places", &said);
}

#[test]
fn an_unknown_name_alone_is_not_understood() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    let moulds = [
        "{}",
        "the {}",
        "pick up the {}",
        "take the {} please",
        "open the {}",
        "turn on the {}",
        "walk to the {}",
        "wash the {}",
        "put the {} in the fridge",
    ];
    let said: Vec<String> =
        UNKNOWN.iter().flat_map(|thing| moulds.map(|mould| mould.replace("{}", thing))).collect();
    talk.declines("unknown names", &said);
}

/// The known word only says what the unknown thing is for, or of.
#[test]
fn a_known_word_in_an_unknown_name_is_not_the_thing() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    talk.declines(
        "unknown compounds",
        &[
            "pick up the apple pie",
            "grab the apple peeler",
            "take the tomato ketchup",
            "pick up the tomato stew",
            "get the potato peeler",
            "pick up the potato masher",
            "take the bread basket lid",
            "pick up the bread crumb",
            "grab the egg timer",
            "pick up the egg beater",
            "take the plate warmer",
            "pick up the mug handle",
            "grab the mug warmer",
            "take the knife sharpener",
            "pick up the knife block",
            "open the fridge magnet",
            "pick up the fridge magnet",
            "go to the fridge repairman",
            "take the microwave manual",
            "open the cabinet hinge",
            "pick up the drawer knob",
            "go to the counter clerk",
            "turn on the faucet filter",
            "turn on the toaster timer",
            "wash the potato skin",
            "wash the tomato stain",
            "wash the mug handle",
            "wash the apple tree",
        ],
    );
}

#[test]
fn an_unknown_thing_in_one_of_two_clauses_stops_both() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    let said: Vec<String> = UNKNOWN
        .iter()
        .flat_map(|thing| {
            [
                format!("open the fridge and pick up the {thing}"),
                format!("go to the {thing} and open the fridge"),
                format!("pick up the mug and put it on the {thing}"),
                format!("wash the potato and open the {thing}"),
                format!("pick up the mug and the {thing}"),
                format!("open the fridge with the {thing}"),
            ]
        })
        .collect();
    talk.declines("an unknown thing in one clause", &said);
}

/// A program names single things, so for a set it could only do a part.
#[test]
fn sets_are_not_done_in_part() {
    let talk = Talk::new(&Setting::pairs());
    talk.declines(
        "sets",
        &[
            "open all drawers",
            "open all the drawers",
            "open all of the cabinets",
            "open every drawer",
            "open each cabinet",
            "open both drawers",
            "open both of the drawers",
            "close every door",
            "close all doors",
            "pick up all the apples",
            "pick up all apples",
            "take every spoon",
            "grab both forks",
            "take both mugs",
            "pick up the apples, all of them",
            "pick up everything",
            "take everything from the counter",
            "open everything",
            "open the drawers one by one",
            "go to all the cabinets",
            "go everywhere",
            "open the cabinets, each of them",
            "pick up several apples",
            "pick up a few apples",
            "grab some more spoons and forks",
        ],
    );
}

#[test]
fn exceptions_and_opposites_are_not_passed_over() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    talk.declines(
        "exceptions",
        &[
            "open everything but the fridge",
            "open everything except for the drawer",
            "open anything except the cabinet",
            "open all doors apart from the fridge",
            "open something besides the fridge",
            "open something other than the drawer",
            "pick up anything but the mug",
            "pick up everything except the knife",
            "take all but the potato",
            "take something that is not the mug",
            "pick up no mug",
            "pick up none of the apples",
            "pick up neither the mug nor the potato",
            "grab nothing from the counter",
            "go anywhere except the sink",
            "go anywhere but to the fridge",
            "go somewhere other than the table",
            "go nowhere near the microwave",
            "open no drawer",
            "open the fridge without opening it",
            "pick up the mug without the knife",
            "wash everything but the potato",
            "wash all things except the mug",
            "wash anything other than the tomato",
            "wash no potato",
        ],
    );
}

#[test]
fn an_alternative_is_not_chosen_for_the_person() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    talk.declines(
        "alternatives",
        &[
            "open the fridge or the drawer",
            "open either the fridge or the cabinet",
            "either open the fridge or open the drawer",
            "pick up the mug or the knife",
            "pick up either the mug or the potato",
            "pick up the mug or else the knife",
            "take the mug, or the spatula",
            "go to the sink or to the table",
            "go to the sink or the fridge, you choose",
            "go to the fridge or wherever",
            "open or close the fridge",
            "turn the faucet on or off",
            "turn on the toaster or the coffee machine",
            "wash the potato or the tomato",
            "wash either the mug or the plate",
            "wash the potato or open the fridge",
            "pick up the mug, alternatively the knife",
            "open the fridge or not",
            "pick up the mug, the knife or the spatula",
            "go to the table or stay here",
        ],
    );
}

#[test]
fn an_amount_is_not_passed_over() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    talk.declines(
        "amounts",
        &[
            "pick up two apples",
            "pick up 2 apples",
            "pick up three mugs",
            "take two of the apples",
            "take a dozen eggs",
            "grab a couple of potatoes",
            "pick up ten knives",
            "take half of that apple",
            "pick up half the bread",
            "pick up a third of the tomato",
            "open the fridge half way",
            "open the fridge to 50 percent",
            "open the drawer by 20 %",
            "open the drawer a little",
            "open the fridge three times",
            "open the fridge twice",
            "turn the faucet on to 30 percent",
            "turn on the faucet for ten seconds",
            "turn the coffee machine up",
            "turn up the toaster",
            "turn down the toaster",
            "turn the faucet down a bit",
            "set the toaster to 5",
            "wash two mugs",
            "wash the potato twice",
            "wash half of the tomato",
            "wash the mug for an hour",
        ],
    );
}

#[test]
fn up_and_down_are_not_on_and_off() {
    let talk = Talk::new(&Setting::lounge());
    talk.declines(
        "up and down",
        &[
            "turn the lamp up",
            "turn up the lamp",
            "turn the lamp down",
            "turn down the lamp",
            "turn the lamp to half",
            "turn the lamp to 50 percent",
            "turn the lamp red",
            "turn the lamp blue",
            "turn the lamp upside down",
            "turn the lamp around",
            "turn the lamp over",
            "turn the television up",
            "turn down the television",
            "turn up the volume of the television",
            "turn the tv to channel five",
            "switch the television to the news",
            "turn the desk lamp up to 80 %",
            "turn the floor lamp lower",
            "turn the floor lamp to the left",
            "dim the lamp to 20 percent",
        ],
    );
}

#[test]
fn a_correction_is_not_passed_over() {
    let talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    talk.declines(
        "corrections",
        &[
            "go to the fridge, no, the table",
            "go to the fridge, i mean the table",
            "pick up the mug, sorry, the knife",
            "pick up the mug, no wait, the potato",
            "pick up the mug, or rather the spatula",
            "open the fridge, i meant the drawer",
            "open the fridge... no, the cabinet",
            "open the drawer, scratch that, the fridge",
            "turn on the toaster, correction, the coffee machine",
            "wash the potato, no, the tomato",
            "wash the mug, i mean the plate",
            "pick up the mug not the knife no the other way round",
            "go to the sink - forget it",
            "open the fridge never mind",
            "open the fridge, cancel that",
            "pick up the mug, just kidding",
            "wash the potato, oh no, leave it",
            "take the knife, actually do not",
            "open the drawer, hold on",
            "go to the table, stop",
        ],
    );
}

/// An unused word in the object.
#[test]
fn what_the_object_is_said_to_be_counts() {
    let talk = Talk::new(&Setting::kitchen());
    talk.declines(
        "parts and pictures",
        &[
            "pick up the picture of the apple",
            "pick up the shadow of the mug",
            "take the lid of the mug",
            "grab the crumbs of the bread",
            "pick up the recipe for the bread",
            "take the smell of the apple",
            "pick up the worm in the apple",
            "pick up the crumbs from the plate",
            "take the dust off the counter",
            "take the stain off the counter",
            "pick up the dirt under the fridge",
            "remove the sticker from the apple",
            "take the juice out of the fridge",
            "take the milk out of the fridge",
            "get the cheese from the fridge",
            "grab the butter that is on the table",
            "pick up the crumpled napkin on the table",
            "get the tea out of the cabinet",
            "take the batteries from the drawer",
            "pick up the receipt in the drawer",
        ],
    );
}
