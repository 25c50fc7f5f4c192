//! Questions are answered from the scene and from the lessons.

use super::{KITCHEN, Talk, check};

#[test]
fn where_things_are_is_told() {
    let mut talk = Talk::new(KITCHEN, "place Mug SinkBasin");
    check(
        &mut talk,
        &[
            ("where is the mug?", "i The mug is on the counter top."),
            ("where's the mug", "i The mug is on the counter top."),
            ("Where is the coffee mug?", "i The mug is on the counter top."),
            ("can you tell me where the mug is?", "i The mug is on the counter top."),
            ("please tell me where the mug is", "i The mug is on the counter top."),
            ("do you know where the apple is?", "i The apple is on the dining table."),
            ("where can I find an apple?", "i The apple is on the dining table."),
            ("where did you see the apple?", "i The apple is on the dining table."),
            ("where are the apples?", "i The apple is on the dining table."),
            ("is there an apple?", "i Yes. The apple is on the dining table."),
            ("are there any apples here?", "i Yes. The apple is on the dining table."),
            ("do you see the apple?", "i Yes. The apple is on the dining table."),
            ("is the apple on the table?", "i Yes, the apple is on the dining table."),
            ("is the apple in the fridge?", "i No. The apple is on the dining table."),
            ("how many apples are there?", "i There is one. The apple is on the dining table."),
            ("what do you know about the apple?", "i The apple is on the dining table."),
            ("where is the sofa?", "i There is no sofa here."),
            ("is there a sofa here?", "i No, there is no sofa here."),
            ("how many sofas are there?", "i There is no sofa here."),
            ("where is the zork?", "i I don't know \"zork\"."),
            ("is the zork open?", "i I don't know \"zork\"."),
            ("where are you?", "i I stand at the counter top."),
        ],
    );
    assert_eq!(talk.actions(), 0, "a question moved something");
    assert!(talk.to_teach().is_empty(), "a question is not there to be taught");
}

#[test]
fn what_is_in_a_thing_and_how_it_is_are_told() {
    let mut talk = Talk::new(KITCHEN, "place Mug SinkBasin");
    check(
        &mut talk,
        &[
            ("what is in the fridge?", "i The lettuce and the egg are in the fridge."),
            ("what's inside the fridge", "i The lettuce and the egg are in the fridge."),
            ("is there anything in the fridge?", "i The lettuce and the egg are in the fridge."),
            ("what is in the microwave?", "i Nothing is in the microwave."),
            (
                "what do you see on the dining table?",
                "i The apple, the potato, the cup and the plate are on the dining table.",
            ),
            ("is the fridge open?", "i No, the fridge is not open."),
            ("is the fridge closed?", "i Yes, the fridge is closed."),
            ("is the microwave on?", "i No, the microwave is not on."),
            ("is the microwave off", "i Yes, the microwave is off."),
            ("is the mug clean?", "i No, the mug is not clean."),
            ("is the mug dirty?", "i Yes, the mug is dirty."),
            ("what are you holding?", "i My hand is empty."),
            ("what do you have in your hand?", "i My hand is empty."),
            ("are you holding the mug?", "i No. My hand is empty."),
            ("pick up the mug", "PICKUP Mug"),
            ("what do you hold?", "i I hold the mug."),
            ("are you holding the mug?", "i Yes. I hold the mug."),
            ("do you have the apple?", "i No. I hold the mug."),
            ("where is the mug?", "i I hold the mug."),
            ("what is on the counter top?", "i The tomato and the knife are on the counter top."),
            ("what is the task?", "i The task is: put a mug in the sink."),
            ("what should I do?", "i The task is: put a mug in the sink."),
        ],
    );
    assert_eq!(talk.actions(), 1);
}

#[test]
fn the_robot_tells_what_it_can_what_it_learned_and_why() {
    let mut talk = Talk::new(KITCHEN, "place Mug SinkBasin");
    assert!(talk.say("what can you do?").starts_with("i I understand \"go to something\","));
    assert_eq!(talk.say("why did you do that?"), "i I have done nothing in this task yet.");
    assert_eq!(talk.say("what did I teach you?"), "i You taught me nothing yet.");
    assert_eq!(talk.say("grab and hold the mug tightly"), "?");
    talk.say("pick up the mug");
    let why = talk.say("why?");
    assert!(why.contains("\"pick up the mug\"") && why.contains("\"pick up something\""), "{why}");
    talk.0.done();
    talk.0.teach(&[1]);
    talk.0.learn();
    talk.0.start("place Apple CounterTop");
    let taught = talk.say("what did I teach you?");
    assert_eq!(taught, "i You taught me \"grab and hold the mug tightly\".");
}

#[test]
fn no_act_follows_from_a_question_and_requests_stay_requests() {
    let mut talk = Talk::new(KITCHEN, "place Mug SinkBasin");
    for question in [
        "could you have put the mug in the sink?",
        "did you open the fridge?",
        "why is the fridge closed?",
        "what if you open the fridge?",
        "is the mug in the sink or on the table?",
        "how do I open the fridge?",
        "which mug is dirty?",
        "who opened the fridge?",
        "when will you close the fridge?",
        "what about the mug?",
    ] {
        let found = talk.say(question);
        assert!(found.starts_with("i ") || found == "?", "{question:?}: {found}");
    }
    assert_eq!(talk.actions(), 0);
    assert_eq!(talk.say("could you open the fridge?"), "GOTO Fridge; OPEN Fridge");
    assert_eq!(talk.say("will you close the fridge please"), "CLOSE Fridge");
}

#[test]
fn recipes_without_a_conversation_answer_no_question() {
    let mut talk = Talk::with("default-2", KITCHEN, "place Mug SinkBasin");
    for said in ["where is the mug?", "yes", "no", "that was wrong"] {
        assert_eq!(talk.say(said), "?", "{said}");
    }
}
