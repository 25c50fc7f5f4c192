use super::{Household, Scene, Task, run};
use crate::language::{Step, Symbol};
use crate::world::{Pointing, Stage, Words, World};

/// The robot stands at the table. Mug 1 and Mug 3 are dirty, Potato 1 is cold, Drawer 2 is closed.
const KITCHEN: &str = r#"
room = "kitchen"
stands_at = "DiningTable"
thing = [
    { type = "DiningTable", at = [210, 240] },
    { type = "CounterTop", at = [120, 40] },
    { type = "CounterTop", at = [385, 40] },
    { type = "Cabinet", at = [200, 300] },
    { type = "Fridge", at = [40, 40] },
    { type = "Drawer", at = [120, 60], states = ["open"] },
    { type = "Drawer", at = [10, 10] },
    { type = "Drawer", at = [120, 80], states = ["open"] },
    { type = "DeskLamp", at = [300, 240] },
    { type = "DeskLamp", on = "DiningTable", states = ["on"] },
    { type = "FloorLamp", at = [10, 240] },
    { type = "Mug", on = "CounterTop 1", states = ["dirty"] },
    { type = "Mug", in = "Cabinet" },
    { type = "Mug", on = "CounterTop 2", states = ["dirty"] },
    { type = "Bowl", on = "DiningTable" },
    { type = "Bowl", on = "CounterTop 1" },
    { type = "Apple", in = "Bowl 1" },
    { type = "Apple", on = "CounterTop 1" },
    { type = "Potato", in = "Fridge" },
    { type = "Potato", on = "CounterTop 1" },
    { type = "Plate", on = "DiningTable" },
    { type = "Fork", on = "DiningTable", states = ["dirty"] },
    { type = "Fork", on = "CounterTop 1", states = ["dirty"] },
]
"#;

fn stage(scene: &str) -> (Household, Scene, Task) {
    let household = Household::new();
    let stage = Stage::Scene { scene: scene.to_owned(), task: "free".to_owned() };
    let (scene, task) = household.stage(&stage).unwrap();
    (household, scene, task)
}

/// Reads parts between commas: `number 2`, `last`, `on CounterTop|Fridge`, `here`, `other`,
/// `same`, `after Mug 1` (handled; the newest first), and any other part as a word before the name.
fn pointing(text: &str) -> Pointing {
    let mut pointing = Pointing::default();
    for part in text.split(", ") {
        match part.split_once(' ') {
            Some(("number", number)) => pointing.number = Some(number.parse().unwrap()),
            Some(("on", kinds)) => {
                pointing.place = Some(kinds.split('|').map(Symbol::new).collect())
            }
            Some(("after", name)) => pointing.handled.push(name.to_owned()),
            _ if part == "last" => pointing.last_of_all = true,
            _ if part == "here" => pointing.here = true,
            _ if part == "other" => pointing.other = true,
            _ if part == "same" => pointing.same = true,
            _ => pointing.words.push(part.to_owned()),
        }
    }
    pointing
}

/// The name that is chosen, `-` for none, or the refusal.
fn choose(scene: &Scene, kind: &str, text: &str) -> String {
    match Household::new().choose(scene, &Symbol::new(kind), &pointing(text)) {
        Ok(name) => name.unwrap_or_else(|| "-".to_owned()),
        Err(reason) => reason,
    }
}

fn check(scene: &Scene, cases: &[(&str, &str, &str)]) {
    for (kind, text, expected) in cases {
        assert_eq!(choose(scene, kind, text), *expected, "{kind}: {text}");
    }
}

#[test]
fn numbers_count_as_the_view_does() {
    let (_, scene, _) = stage(KITCHEN);
    check(
        &scene,
        &[
            ("Mug", "number 1", "Mug 1"),
            ("Mug", "number 3", "Mug 3"),
            ("Mug", "last", "Mug 3"),
            ("Mug", "number 4", "there is no Mug 4 here"),
            ("Mug", "number 0", "there is no Mug 0 here"),
            ("Mug", "number 4294967295", "there is no Mug 4294967295 here"),
            ("Plate", "number 1", "Plate"),
            ("Plate", "last", "Plate"),
            ("Plate", "number 2", "there is only one Plate here"),
            ("Plate", "number 0", "there is no Plate 0 here"),
            ("Knife", "number 1", "there is no Knife here"),
            ("Mug", "number 2, dirty", "the Mug 2 is not dirty"),
            ("Mug", "number 3, dirty", "Mug 3"),
            ("Mug", "number 1, on DiningTable", "the Mug 1 is not on the DiningTable"),
            ("Apple", "last, on DiningTable", "Apple 1"),
        ],
    );
}

#[test]
fn states_choose_what_is_so() {
    let (_, scene, _) = stage(KITCHEN);
    check(
        &scene,
        &[
            ("Mug", "dirty", "Mug 1"),
            ("Mug", "unwashed", "Mug 1"),
            ("Mug", "clean", "Mug 2"),
            ("Mug", "red, clean, big", "Mug 2"),
            ("Bowl", "dirty", "no Bowl here is dirty"),
            ("Fork", "clean", "no Fork here is clean"),
            ("Potato", "cold", "Potato 1"),
            // Nothing is hot: of what is not cold, nothing is known.
            ("Potato", "hot", "Potato 2"),
            ("Mug", "cold", "-"),
            ("Plate", "warm", "-"),
            ("Drawer", "closed", "Drawer 2"),
            ("Drawer", "shut", "Drawer 2"),
            ("Drawer", "open", "Drawer 3"),
            ("Fridge", "open", "no Fridge here is open"),
            ("DeskLamp", "on", "DeskLamp 2"),
            ("DeskLamp", "off", "DeskLamp 1"),
            ("FloorLamp", "lit", "no FloorLamp here is lit"),
            ("Bowl", "full", "Bowl 1"),
            ("Bowl", "empty", "Bowl 2"),
            ("Plate", "full", "no Plate here is full"),
            ("Plate", "empty", "Plate"),
            // A table has no door, a fork no switch, and a fork holds nothing.
            ("DiningTable", "open", "-"),
            ("Fork", "on", "-"),
            ("Fork", "full", "-"),
            ("Mug", "dirty, full", "no Mug that is dirty is full"),
            ("Mug", "clean, dirty", "the Mug 2 is not dirty"),
        ],
    );
}

#[test]
fn words_that_leave_out_nothing_leave_the_choice_to_the_step() {
    let (_, scene, _) = stage(KITCHEN);
    check(
        &scene,
        &[
            ("Fork", "dirty", "-"),
            ("Bowl", "clean", "-"),
            ("Mug", "red", "-"),
            ("Mug", "", "-"),
            ("Mug", "the, of, 2, Dirty", "-"),
            ("Tomato", "red", "-"),
            ("Nonsense", "", "-"),
        ],
    );
    let many = ["empty, dirty, red"; 10_000].join(", ");
    check(&scene, &[("Bowl", "empty, clean, clean", "Bowl 2"), ("Mug", &many, "Mug 1")]);
    let long = "x".repeat(10_000);
    assert!(choose(&scene, &long, "dirty").len() < 100);
    assert!(choose(&scene, "Mug", &format!("on {long}")).len() < 100);
    assert_eq!(Household::new().choose(&scene, &"Mug".into(), &Pointing::default()), Ok(None));
    let nowhere = Pointing { place: Some(Vec::new()), ..Pointing::default() };
    assert_eq!(Household::new().choose(&scene, &"Mug".into(), &nowhere), Ok(None));
}

#[test]
fn a_place_chooses_what_is_in_or_on_it() {
    let (_, scene, _) = stage(KITCHEN);
    check(
        &scene,
        &[
            ("Mug", "on Cabinet", "Mug 2"),
            ("Mug", "on CounterTop", "Mug 1"),
            ("Mug", "on DiningTable", "there is no Mug on the DiningTable"),
            ("Mug", "on Fridge", "there is no Mug in the Fridge"),
            ("Mug", "on SideTable|DiningTable", "there is no Mug on the DiningTable"),
            ("Mug", "on SideTable|Cabinet", "Mug 2"),
            // Of a place that is not here nothing is known.
            ("Mug", "on SideTable", "-"),
            ("Mug", "on Nonsense", "-"),
            // The apple is in a bowl on the table.
            ("Apple", "on DiningTable", "Apple 1"),
            ("Apple", "on Bowl", "Apple 1"),
            ("Apple", "on CounterTop", "Apple 2"),
            ("Mug", "on CounterTop, clean", "no Mug that is on the CounterTop is clean"),
            // Of one thing alone, people say where it is as they see it.
            ("Plate", "on CounterTop", "-"),
            ("Plate", "on DiningTable", "-"),
            // Where a lamp stands that stands on nothing, the scene does not know.
            ("DeskLamp", "on DiningTable", "DeskLamp 2"),
            ("DeskLamp", "on CounterTop", "DeskLamp 1"),
            ("FloorLamp", "on DiningTable", "-"),
            ("FloorLamp", "on SideTable", "-"),
            ("Drawer", "on CounterTop", "-"),
            ("Bowl", "here", "Bowl 1"),
            ("Apple", "here", "Apple 1"),
            ("Mug", "here", "there is no Mug in reach"),
        ],
    );
}

#[test]
fn what_is_right_on_a_place_comes_before_what_is_in_something_there() {
    let with_plate = KITCHEN.replace(
        r#"{ type = "Potato", in"#,
        r#"{ type = "Apple", on = "DiningTable" }, { type = "Potato", in"#,
    );
    let (_, scene, _) = stage(&with_plate);
    check(&scene, &[("Apple", "on DiningTable", "Apple 3"), ("Apple", "on Bowl", "Apple 1")]);
}

#[test]
fn what_was_handled_is_the_same_and_not_the_other() {
    let (household, mut scene, task) = stage(KITCHEN);
    check(
        &scene,
        &[
            ("Mug", "same", "which Mug: no Mug was handled before"),
            ("Mug", "other", "which other Mug: no Mug was handled before"),
            ("Mug", "other, after Plate", "which other Mug: no Mug was handled before"),
            ("Mug", "other, after Mug", "which other Mug: no Mug was handled before"),
            ("Mug", "other, after Mug 9", "which other Mug: no Mug was handled before"),
            ("Plate", "other", "there is only one Plate here"),
            ("Plate", "other, after Plate", "there is no other Plate here"),
            ("Mug", "same, after Plate, after Mug 2, after Mug 1", "Mug 2"),
            ("Mug", "same, number 1, after Mug 2", "the same Mug is the Mug 2, not the Mug 1"),
            ("Fork", "other, after Fork 2", "Fork 1"),
            ("Fork", "other, after Fork 1, after Fork 2", "Fork 2"),
            ("Mug", "other, after Mug 1, after Mug 3", "Mug 2"),
            ("Mug", "other, dirty, after Mug 1", "Mug 3"),
            ("Mug", "other, clean, after Mug 2", "no other Mug here is clean"),
            ("Mug", "other, same, after Mug 2", "there is no other Mug here"),
        ],
    );
    run(&household, &mut scene, &task, "PICKUP Fork").unwrap();
    check(&scene, &[("Fork", "other", "Fork 2"), ("Fork", "same", "Fork 1")]);
}

#[test]
fn state_words_are_known_and_others_are_not() {
    let household = Household::new();
    for word in ["dirty", "clean", "chilled", "shut", "lit", "empty"] {
        assert!(household.is_instance_word(word), "{word}");
    }
    for word in ["", "red", "cooked", "sliced", "other", "Dirty", "dirty mug"] {
        assert!(!household.is_instance_word(word), "{word}");
    }
}

/// Carries out steps on chosen instances, written `PICKUP Mug @ Mug 2`; what was bound, or the
/// refusal and what would have to come first.
fn act(steps: &str) -> String {
    let (household, mut scene, task) = stage(KITCHEN);
    let mut said = String::new();
    for text in steps.split("; ") {
        let (step, on) = text.split_once(" @ ").unwrap_or((text, "-"));
        let step: Step = step.parse().unwrap();
        let on: Vec<Option<String>> =
            on.split(" + ").map(|name| (name != "-").then(|| name.to_owned())).collect();
        let before = scene.clone();
        match household.step_on(&mut scene, &task, &step, &on) {
            Ok(bound) => said = bound.join(" + "),
            Err(refusal) => {
                assert_eq!(scene, before, "a refused step changes nothing");
                let first =
                    refusal.first.map(|first| format!(" [{first} @ {:?}]", refusal.first_on));
                return refusal.reason + &first.unwrap_or_default();
            }
        }
    }
    said
}

#[test]
fn a_step_binds_the_chosen_instance_or_says_why_not() {
    for (steps, expected) in [
        ("GOTO Mug @ Mug 3; PICKUP Mug @ Mug 3", "Mug 3"),
        ("GOTO CounterTop @ CounterTop 2; PICKUP Mug", "Mug 3"),
        (
            "PICKUP Mug @ Mug 3",
            "the Mug 3 is out of reach (it is on the CounterTop 2); go there first \
             [GOTO Mug @ [Some(\"Mug 3\")]]",
        ),
        (
            "GOTO Mug @ Mug 2; PICKUP Mug @ Mug 2",
            "the Mug 2 is in the Cabinet, which is closed; open it first \
             [OPEN Cabinet @ [Some(\"Cabinet\")]]",
        ),
        // A free argument leaves the first step free.
        (
            "GOTO Fridge; PICKUP Fork",
            "the Fork 2 is out of reach (it is on the CounterTop 1); go there first \
             [GOTO Fork @ []]",
        ),
        ("GOTO Drawer @ Drawer 1; OPEN Drawer @ Drawer 1", "the Drawer 1 is already open"),
        ("GOTO Drawer @ Drawer 2; OPEN Drawer @ Drawer 2; CLOSE Drawer @ Drawer 2", "Drawer 2"),
        ("GOTO DeskLamp @ DeskLamp 1; TOGGLE DeskLamp @ DeskLamp 1", "DeskLamp 1"),
        ("PICKUP Fork; PICKUP Fork @ Fork 1", "the robot already holds the Fork 1"),
        (
            "PICKUP Fork; PICKUP Fork @ Fork 2",
            "the robot's hand is full: it holds the Fork 1; put that down first",
        ),
        (
            "PICKUP Fork; PUT Fork DiningTable @ Fork 2",
            "the robot does not hold the Fork 2: it holds the Fork 1",
        ),
        ("PUT Fork DiningTable @ Fork 2", "the robot does not hold the Fork 2: its hand is empty"),
        ("PICKUP Fork; PUT Fork DiningTable @ Fork 1 + DiningTable", "Fork 1 + DiningTable"),
        (
            "PICKUP Fork; PUT Fork CounterTop @ - + CounterTop 2",
            "the CounterTop 2 is out of reach; go there first \
             [GOTO CounterTop @ [Some(\"CounterTop 2\")]]",
        ),
        (
            "PICKUP Fork; GOTO CounterTop @ CounterTop 2; PUT Fork CounterTop @ - + CounterTop 2",
            "Fork 1 + CounterTop 2",
        ),
        ("GOTO Mug @ Mug 4", "there is nothing called \"Mug 4\" here"),
        ("GOTO Mug @ Mug", "there is nothing called \"Mug\" here"),
        ("GOTO Plate @ Plate 1", "there is nothing called \"Plate 1\" here"),
        ("GOTO Mug @ Mug 0", "there is nothing called \"Mug 0\" here"),
        ("GOTO Mug @ Mug 01", "there is nothing called \"Mug 01\" here"),
        (
            "GOTO Mug @ Mug 99999999999999999999",
            "there is nothing called \"Mug 99999999999999999999\" here",
        ),
        ("GOTO Mug @ ", "there is nothing called \"\" here"),
        ("GOTO Mug @ Plate", "the Plate is not a Mug"),
        ("PICKUP Plate @ Plate + Mug 9", "Plate"),
    ] {
        assert_eq!(act(steps), expected, "{steps}");
    }
}
