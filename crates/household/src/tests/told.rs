use super::super::told;
use super::{kitchen, run};
use crate::language::Program;

/// What a person is told when the last step of a program is refused in the example kitchen.
#[track_caller]
fn refused(program: &str) -> String {
    let (household, mut scene, task) = kitchen("free");
    let reason = run(&household, &mut scene, &task, program).unwrap_err();
    let program: Program = program.parse().unwrap();
    let step = program.steps.last().unwrap();
    format!("I can't {}: {}.", told::request(step), told::reason(step, &reason))
}

#[test]
fn a_refused_step_is_told_in_the_first_person_and_in_plain_words() {
    // The kitchen has several mugs and one fridge.
    for (program, told) in [
        ("GOTO Fridge; OPEN Fridge; OPEN Fridge", "I can't open the fridge: it is already open."),
        ("OPEN Fridge", "I can't open the fridge: it is out of reach. Go there first."),
        (
            "GOTO Fridge; PUT Mug Fridge",
            "I can't put the mug in the fridge: I don't hold a mug. My hand is empty.",
        ),
        ("GOTO Mug; PICKUP Mug; PICKUP Mug", "I can't pick up the mug: I already hold the mug 1."),
    ] {
        assert_eq!(refused(program), told);
    }
}

#[test]
fn recorded_phrases_are_told_in_the_first_person() {
    let told = |step: &str, reason: &str| {
        let program: Program = step.parse().unwrap();
        told::reason(&program.steps[0], reason)
    };
    for (step, reason, said) in [
        ("PICKUP Mug", "the robot already holds the Mug", "I already hold it"),
        ("PICKUP Mug", "the robot already holds the Mug 2", "I already hold the mug 2"),
        (
            "PICKUP Apple",
            "the robot's hand is full: it holds the Mug; put that down first",
            "I already hold the mug. Put it down first",
        ),
        (
            "PUT Mug SinkBasin",
            "the robot does not hold a Mug: its hand is empty",
            "I don't hold a mug. My hand is empty",
        ),
        (
            "PICKUP Mug",
            "the Mug is out of reach (it is on the CounterTop 2); go there first",
            "it is out of reach (it is on the counter top 2). Go there first",
        ),
        (
            "PUT Mug Fridge",
            "the Fridge is closed; open it first",
            "the fridge is closed. Open it first",
        ),
        ("PICKUP Mug", "which Mug: no Mug was handled before", "no mug was handled before"),
        (
            "PICKUP it",
            "nothing was named before that \"it\" could mean, and the robot holds nothing",
            "I don't know what \"it\" means here. Name the thing",
        ),
        (
            "PUT Mug CounterTop",
            "nothing is left to do: the Mug is at the CounterTop",
            "the mug is at the counter top",
        ),
        ("PICKUP unicorn", "there is no unicorn here", "there is no unicorn here"),
    ] {
        assert_eq!(told(step, reason), said);
    }
}

#[test]
fn a_request_shows_the_words_that_no_thing_was_found_for() {
    let request = |step: &str| told::request(&step.parse::<Program>().unwrap().steps[0]);
    assert_eq!(request("PUT Mug SinkBasin"), "put the mug in the sink");
    assert_eq!(request("PICKUP unicorn"), "pick up the unicorn");
    assert_eq!(request("PICKUP it"), "pick it up");
}
