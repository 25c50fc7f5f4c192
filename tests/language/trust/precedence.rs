//! A request that is understood and cannot be done is impossible. No far lesson and no other kind
//! of thing takes its place.

use super::talk::{Report, Setting, Talk, acted, line, reason};

/// Lessons whose words are near to many requests, and whose programs can always run.
const FAR: &[(&str, &str)] = &[
    ("turn the tap on and off", "GOTO Faucet; TOGGLE Faucet; TOGGLE Faucet"),
    ("open and shut the drawer", "GOTO Drawer; OPEN Drawer; CLOSE Drawer"),
    ("grab something for me", "GOTO CounterTop; PICKUP Knife"),
    (
        "put that away",
        "GOTO CounterTop; PICKUP Spatula; GOTO Drawer; OPEN Drawer; PUT Spatula Drawer",
    ),
];

/// What is off, open and on, and what the robot holds, at the start.
fn half_done() -> Setting {
    let setting = Setting::kitchen().with("Fridge", "open").with("Toaster", "on");
    setting.with("Microwave", "on")
}

#[test]
fn a_seed_that_the_world_forbids_stays_impossible() {
    let cases: &[(&str, &str)] = &[
        ("turn off the faucet", "off"),
        ("turn the faucet off", "off"),
        ("switch off the faucet", "off"),
        ("turn off the coffee machine", "off"),
        ("turn the coffee machine off", "off"),
        ("switch off the coffee machine", "off"),
        ("please turn off the coffee machine", "off"),
        ("turn on the toaster", "on"),
        ("turn the toaster on", "on"),
        ("switch on the toaster", "on"),
        ("turn on the microwave", "on"),
        ("open the fridge", "open"),
        ("open up the fridge", "open"),
        ("could you open the fridge?", "open"),
        ("open the door of the fridge", "open"),
        ("close the drawer", "closed"),
        ("shut the drawer", "closed"),
        ("close the door of the cabinet", "closed"),
        ("close the microwave", "closed"),
        ("open the microwave", "running"),
        ("open the apple", "cannot be opened"),
        ("turn on the bread", "cannot be turned"),
        ("pick up the fridge", "cannot be picked up"),
        ("pick up the counter", "cannot be picked up"),
    ];
    // The same with no lessons and with near lessons.
    Talk::new(&half_done()).is_impossible("forbidden by the world", cases);
    let talk = Talk::taught_in(&Setting::kitchen(), FAR, &half_done());
    talk.is_impossible("forbidden by the world, after far lessons", cases);
}

#[test]
fn a_full_hand_is_no_reason_for_another_program() {
    let setting = half_done().holding("Bread");
    let talk = Talk::taught_in(&Setting::kitchen(), FAR, &setting);
    talk.is_impossible(
        "the hand is full",
        &[
            ("pick up the bread", "holds"),
            ("pick up the mug", "hand"),
            ("grab the knife", "hand"),
            ("take the apple from the table", "hand"),
            ("get the egg out of the fridge", "hand"),
            ("put the bread in the sink", "does not go"),
            ("put the bread on the plate", "does not go"),
            ("put the bread in the toaster", "nothing can be put"),
            ("put the mug on the table", "hold"),
        ],
    );
}

/// A kitchen of three things, for things that are here and things that are not.
fn with_only(kind: &str) -> Setting {
    Setting::read(&format!(
        "room = \"kitchen\"\nstands_at = \"CounterTop\"\n\
         [[thing]]\ntype = \"CounterTop\"\nat = [100, 100]\n\
         [[thing]]\ntype = \"Fridge\"\nat = [300, 100]\n\
         [[thing]]\ntype = \"{kind}\"\non = \"CounterTop\"\n"
    ))
}

/// A name, the type that it means, and a type that it was sometimes used for. Only the second type
/// is here.
const SELDOM: &[(&str, &str, &str)] = &[
    ("bowl", "Bowl", "Cup"),
    ("bowl", "Bowl", "Plate"),
    ("bowl", "Bowl", "Pot"),
    ("bowl", "Bowl", "Vase"),
    ("bowl", "Bowl", "Pan"),
    ("box", "Box", "TissueBox"),
    ("candle", "Candle", "SoapBottle"),
    ("cup", "Cup", "Bowl"),
    ("kettle", "Kettle", "Pot"),
    ("kettle", "Kettle", "WateringCan"),
    ("pan", "Pan", "Plate"),
    ("pan", "Pan", "Bowl"),
    ("pencil", "Pencil", "Pen"),
    ("plate", "Plate", "Pan"),
    ("plate", "Plate", "Bowl"),
    ("pot", "Pot", "WateringCan"),
    ("pot", "Pot", "Bowl"),
    ("pot", "Pot", "Vase"),
    ("potato", "Potato", "Egg"),
    ("spatula", "Spatula", "Ladle"),
    ("spray bottle", "SprayBottle", "SoapBottle"),
];

#[test]
fn a_kind_is_not_replaced_by_another() {
    let mut report = Report::new("another kind alone is here");
    for (name, kind, alone) in SELDOM {
        let talk = Talk::new(&with_only(alone));
        for verb in ["pick up the", "take the", "please grab the", "go to the"] {
            let text = format!("{verb} {name}");
            let answer = talk.asks(&text);
            let here = format!("beside a {alone} alone, {text}");
            report.check(!acted(&answer), || line(&here, &format!("no {kind}"), &answer));
        }
        // The first wording gets an answer with the reason.
        let answer = talk.asks(&format!("pick up the {name}"));
        let named = reason(&answer).is_some_and(|reason| {
            let reason = reason.replace(' ', "");
            reason.contains(&format!("no{}", kind.to_lowercase()))
        });
        report.check(named, || {
            line(&format!("pick up the {name}"), &format!("! no {kind}"), &answer)
        });
    }
    report.finish();
}

#[test]
fn what_is_not_here_is_said_not_to_be_here() {
    let talk = Talk::taught(&Setting::kitchen(), FAR);
    talk.is_impossible(
        "not here",
        &[
            ("pick up the pan", "no pan"),
            ("grab the pan", "no pan"),
            ("could you take the pan?", "no pan"),
            ("pick up the pot", "no pot"),
            ("pick up the spoon", "no spoon"),
            ("take the candle", "no candle"),
            ("pick up the book", "no book"),
            ("take the newspaper", "no newspaper"),
            ("go to the sofa", "no sofa"),
            ("go to the bed", "no bed"),
            ("open the safe", "no safe"),
            ("open the laptop", "no laptop"),
            ("close the safe", "no safe"),
            ("turn on the television", "no television"),
            ("turn on the floor lamp", "no floor"),
            ("turn off the television", "no television"),
            ("pick up the pillow from the counter", "no pillow"),
            ("take the vase out of the cabinet", "no vase"),
            ("go to the dresser", "no dresser"),
            ("pick up the remote control", "no remote"),
        ],
    );
    let talk = Talk::taught_in(&Setting::kitchen(), FAR, &Setting::kitchen().holding("Mug"));
    talk.is_impossible(
        "no such place here",
        &[
            ("put the mug on the sofa", "no sofa"),
            ("set the mug down on the dresser", "no dresser"),
            ("put it in the box", "no box"),
            ("place the mug on the coffee table", "no coffee"),
            ("put the mug in the safe", "no safe"),
        ],
    );
}

/// "Open the cabinet" a second time does not open the drawer, which is sometimes called a cabinet.
#[test]
fn what_is_done_already_does_not_slide_to_another_kind() {
    let setting = Setting::kitchen().with("Cabinet", "open");
    let closed = Talk::new(&setting);
    closed.is_impossible(
        "done already",
        &[
            ("open the cabinet", "open"),
            ("open up the cabinet", "open"),
            ("please open the cabinet", "open"),
            ("open the cabinet again", "open"),
            ("open the cupboard", "open"),
        ],
    );
    let other = Talk::new(&Setting::kitchen().with("Drawer", "open").with("Fridge", "open"));
    other.is_impossible(
        "only another is open",
        &[
            ("close the cabinet", "closed"),
            ("shut the cabinet", "closed"),
            ("close the microwave", "closed"),
            ("open the drawer", "open"),
            ("open the fridge", "open"),
        ],
    );
}

#[test]
fn a_sure_seed_is_not_a_lesson_with_the_same_verb() {
    let lessons = &[
        ("close up shop", "GOTO Fridge; OPEN Fridge; CLOSE Fridge"),
        ("turn everything on", "TOGGLE Toaster; TOGGLE CoffeeMachine"),
        ("pick up the slack", "PICKUP Knife"),
        ("go to town", "GOTO DiningTable"),
        ("take a break", "GOTO DiningTable; PICKUP Bread"),
        ("open up for me", "GOTO Cabinet; OPEN Cabinet"),
    ];
    let talk = Talk::taught(&Setting::kitchen(), lessons);
    talk.acts(
        "seeds beside lessons",
        &[
            ("open the drawer", "OPEN Drawer"),
            ("open up the fridge", "OPEN Fridge"),
            ("turn on the toaster", "TOGGLE Toaster"),
            ("turn on the faucet", "TOGGLE Faucet"),
            ("pick up the mug", "PICKUP Mug"),
            ("take the potato", "PICKUP Potato"),
            ("take the apple from the table", "PICKUP Apple"),
        ],
    );
    talk.is_impossible(
        "seeds beside lessons",
        &[
            ("close the fridge", "closed"),
            ("close up the drawer", "closed"),
            ("turn off the toaster", "off"),
            ("turn off the coffee machine", "off"),
            ("take the pan", "no pan"),
            ("pick up the safe", "no safe"),
            ("go to the sofa", "no sofa"),
        ],
    );
}

/// A name means its own type if a thing of that type is in the room.
#[test]
fn a_full_name_leads_to_its_own_type() {
    let kitchen = |things: [&str; 2]| {
        Setting::read(&format!(
            "room = \"kitchen\"\nstands_at = \"CounterTop\"\n\
             [[thing]]\ntype = \"CounterTop\"\nat = [100, 100]\n\
             [[thing]]\ntype = \"{}\"\non = \"CounterTop\"\n\
             [[thing]]\ntype = \"{}\"\non = \"CounterTop\"\n",
            things[0], things[1]
        ))
    };
    let mut report = Report::new("full names");
    for (name, own, other) in [
        ("salt shaker", "SaltShaker", "PepperShaker"),
        ("pepper shaker", "PepperShaker", "SaltShaker"),
        ("butter knife", "ButterKnife", "Knife"),
        ("pan", "Pan", "Plate"),
        ("pot", "Pot", "Pan"),
        ("pot", "Pot", "WateringCan"),
        ("bowl", "Bowl", "Cup"),
        ("plate", "Plate", "Pan"),
        ("cup", "Cup", "Mug"),
        ("mug", "Mug", "Cup"),
        ("spoon", "Spoon", "Ladle"),
        ("ladle", "Ladle", "Spoon"),
        ("spatula", "Spatula", "Ladle"),
        ("kettle", "Kettle", "Pot"),
        ("potato", "Potato", "Egg"),
        ("candle", "Candle", "SoapBottle"),
        ("vase", "Vase", "Glassbottle"),
        ("box", "Box", "TissueBox"),
        ("pencil", "Pencil", "Pen"),
        ("spray bottle", "SprayBottle", "SoapBottle"),
        ("soap bottle", "SoapBottle", "SprayBottle"),
        ("hand towel", "HandTowel", "Cloth"),
    ] {
        // Whichever is nearer, or earlier in the room.
        for things in [[own, other], [other, own]] {
            let talk = Talk::new(&kitchen(things));
            let (text, expected) = (format!("pick up the {name}"), format!("PICKUP {own}"));
            let answer = talk.asks(&text);
            let right = super::talk::shown(&answer).ends_with(&expected);
            report.check(right, || line(&format!("{text} beside a {other}"), &expected, &answer));
        }
    }
    report.finish();
}
