use super::{kitchen, run};
use crate::world::{Show, World};

fn refusal(program: &str) -> String {
    let (household, mut scene, task) = kitchen("free");
    run(&household, &mut scene, &task, program).unwrap_err()
}

#[test]
fn every_refusal_names_the_thing_and_the_reason() {
    let hand = "the robot's hand is full: it holds the Apple; put that down first";
    for (program, reason) in [
        ("GOTO Potato", "there is no Potato here"),
        ("GOTO Tomatoe", "there is no kind of thing called \"Tomatoe\"; the nearest is Tomato"),
        (
            "JUMP Apple",
            "there is no primitive JUMP; known are GOTO, PICKUP, OPEN, CLOSE, TOGGLE, PUT",
        ),
        ("PUT Apple", "PUT takes 2 arguments, \"PUT Apple\" has 1"),
        ("PICKUP DiningTable", "a DiningTable cannot be picked up"),
        ("PICKUP Apple; PICKUP Knife", hand),
        ("PICKUP Apple; PICKUP Apple", "the robot already holds the Apple"),
        ("PICKUP Apple; GOTO Apple", "the robot already holds the Apple"),
        ("PICKUP Mug", "the Mug 1 is out of reach (it is on the CounterTop); go there first"),
        (
            "GOTO Tomato; PICKUP Tomato",
            "the Tomato is in the Fridge, which is closed; open it first",
        ),
        ("OPEN Fridge", "the Fridge is out of reach; go there first"),
        ("GOTO Fridge; CLOSE Fridge", "the Fridge is already closed"),
        ("GOTO Fridge; OPEN Fridge; OPEN Fridge", "the Fridge is already open"),
        ("OPEN DiningTable", "a DiningTable cannot be opened or closed"),
        ("TOGGLE Apple", "an Apple cannot be turned on or off"),
        ("PUT Apple DiningTable", "the robot does not hold an Apple: its hand is empty"),
        (
            "PICKUP Knife; PUT Apple DiningTable",
            "the robot does not hold an Apple: it holds the Knife",
        ),
        ("PICKUP Apple; GOTO Fridge; PUT Apple Fridge", "the Fridge is closed; open it first"),
        ("PICKUP Apple; PUT Apple Knife", "nothing can be put in or on a Knife"),
        (
            "PICKUP Knife; GOTO Mug; PUT Knife CoffeeMachine",
            "a Knife does not go on a CoffeeMachine",
        ),
        (
            "GOTO Microwave; OPEN Microwave; TOGGLE Microwave",
            "the Microwave does not start while it is open; close it first",
        ),
        (
            "GOTO Microwave; TOGGLE Microwave; OPEN Microwave",
            "the Microwave is running; turn it off first",
        ),
    ] {
        assert_eq!(refusal(program), reason, "{program}");
    }
}

#[test]
fn what_is_in_or_on_the_same_thing_is_in_reach() {
    let (household, mut scene, task) = kitchen("free");
    let bound = run(&household, &mut scene, &task, "GOTO Mug; PICKUP Mug; PUT Mug CoffeeMachine");
    assert_eq!(bound.unwrap(), ["Mug 1", "Mug 1", "Mug 1 + CoffeeMachine"]);
    let bound = run(&household, &mut scene, &task, "GOTO SinkBasin; TOGGLE Faucet");
    assert_eq!(bound.unwrap(), ["SinkBasin", "Faucet"]);
}

#[test]
fn running_water_cleans_what_is_in_the_sink() {
    let (household, mut scene, task) = kitchen("clean Apple CounterTop");
    let washed = |scene: &_| household.progress(scene, &task)[0].1;
    run(&household, &mut scene, &task, "PICKUP Apple; GOTO SinkBasin; PUT Apple SinkBasin")
        .unwrap();
    assert!(!washed(&scene));
    run(&household, &mut scene, &task, "TOGGLE Faucet").unwrap();
    assert!(washed(&scene));
    run(&household, &mut scene, &task, "TOGGLE Faucet; PICKUP Apple; GOTO CounterTop").unwrap();
    assert!(!household.achieved(&scene, &task));
    run(&household, &mut scene, &task, "PUT Apple CounterTop").unwrap();
    assert!(household.achieved(&scene, &task));
}

#[test]
fn a_plate_in_the_microwave_heats_with_what_is_on_it_and_the_fridge_cools_it_again() {
    let (household, mut scene, task) = kitchen("free");
    let program = "PICKUP Apple; PUT Apple Plate; PICKUP Plate; GOTO Microwave; OPEN Microwave; \
        PUT Plate Microwave; CLOSE Microwave; TOGGLE Microwave; TOGGLE Microwave; OPEN Microwave";
    run(&household, &mut scene, &task, program).unwrap();
    let states = |scene: &_, name: &str| {
        household.look(scene).things.into_iter().find(|thing| thing.name == name).unwrap().states
    };
    assert_eq!(states(&scene, "Apple"), ["dirty", "hot", "here"]);
    assert_eq!(states(&scene, "Plate"), ["hot", "here"]);
    let program = "PICKUP Plate; GOTO Fridge; OPEN Fridge; PUT Plate Fridge; CLOSE Fridge";
    run(&household, &mut scene, &task, program).unwrap();
    assert_eq!(states(&scene, "Apple"), ["dirty", "cold", "here"]);
}

#[test]
fn a_carried_bowl_takes_its_contents_along_and_never_goes_into_itself() {
    let (household, mut scene, task) = kitchen("free");
    run(&household, &mut scene, &task, "PICKUP Knife; PUT Knife Plate; PICKUP Plate").unwrap();
    run(&household, &mut scene, &task, "GOTO CounterTop; PUT Plate CounterTop").unwrap();
    let knife = household.look(&scene).things.into_iter().find(|t| t.name == "Knife").unwrap();
    let plate = household.look(&scene).things.into_iter().find(|t| t.name == "Plate").unwrap();
    assert_eq!((knife.place.as_deref(), knife.at), (Some("Plate"), plate.at));
    // The plate holds nothing that the hand does not hold: PUT binds only what is not the held.
    run(&household, &mut scene, &task, "PICKUP Mug").unwrap();
    let reason = run(&household, &mut scene, &task, "PUT Mug Mug").unwrap_err();
    assert_eq!(reason, "a Mug does not go in a Mug");
}

#[test]
fn a_pick_up_prefers_what_is_not_yet_at_its_goal() {
    let (household, mut scene, task) = kitchen("two Mug CoffeeMachine");
    let program = "GOTO Mug; PICKUP Mug; GOTO CoffeeMachine; PUT Mug CoffeeMachine; GOTO Mug; \
        OPEN Cabinet; PICKUP Mug; GOTO CoffeeMachine; PUT Mug CoffeeMachine";
    let bound = run(&household, &mut scene, &task, program).unwrap();
    assert_eq!(bound[4..7], ["Mug 2", "Cabinet", "Mug 2"]);
    assert!(household.achieved(&scene, &task));
}
