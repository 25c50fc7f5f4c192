//! A wrong act is named: the same words are not taken for it again, and it can be taught.

use apprentice::client::{Command, OnClash, Phase, RejectionCode};

use super::{KITCHEN, Talk};

fn talk() -> Talk {
    Talk::new(KITCHEN, "place Mug SinkBasin")
}

#[test]
fn many_words_say_that_it_was_wrong() {
    for words in [
        "wrong",
        "that was wrong",
        "That was wrong!",
        "that's wrong",
        "no, that was wrong",
        "no",
        "No.",
        "nope",
        "that's not what I meant",
        "that is not what I meant.",
        "no, that's not what I meant",
        "that wasn't what I meant",
        "not what I meant",
        "I didn't mean that",
        "I did not mean that",
        "that's not right",
        "you did it wrong",
        "you got it wrong",
        "you misunderstood me",
        "incorrect",
        "bad robot",
    ] {
        let mut talk = talk();
        talk.say("go to the table");
        assert_eq!(talk.say(words), "marked", "{words}");
        assert_eq!(talk.to_teach(), Vec::<String>::new(), "taught when the task is over");
        assert_eq!(talk.say("go to the table"), "?", "{words}: it was done again");
        assert_eq!(talk.say("go to the fridge"), "GOTO Fridge", "{words}: other words are free");
        assert_eq!(talk.0.session.status().utterances, 4, "{words}: it counts as one utterance");
    }
}

#[test]
fn what_was_done_wrongly_is_taught_with_what_then_did_it() {
    let mut talk = talk();
    assert_eq!(talk.say("tidy the mug"), "?");
    assert_eq!(talk.say("pick up the mug"), "PICKUP Mug");
    talk.0.done();
    talk.0.teach(&[1]);
    talk.0.learn();

    talk.start(KITCHEN, "place Apple CounterTop");
    assert_eq!(talk.say("tidy the apple"), "GOTO Apple; PICKUP Apple");
    assert_eq!(talk.say("that was wrong"), "marked");
    assert_eq!(talk.say("put it in the fridge"), "GOTO Fridge; OPEN Fridge; PUT Apple Fridge");
    talk.0.done();
    assert_eq!(talk.to_teach(), ["tidy the apple"]);
    let explains = talk.0.session.status().to_teach[0].seq;
    let teach = |actions: Vec<u32>, on_clash| Command::Teach { explains, actions, on_clash };
    let clash = talk.0.give(&teach(vec![2, 3, 4, 5], OnClash::Ask)).unwrap_err();
    assert_eq!(clash.code(), RejectionCode::Clash);
    talk.0.accept(&teach(vec![2, 3, 4, 5], OnClash::Replace));
    talk.0.learn();

    talk.start(KITCHEN, "place Potato CounterTop");
    let learned = talk.say("tidy the potato");
    assert!(learned.ends_with("PUT Potato Fridge"), "the new lesson outranks: {learned}");
}

#[test]
fn the_command_works_with_every_recipe_until_the_next_task() {
    for recipe in ["default-1", "default-2", "paper"] {
        let mut talk = Talk::with(recipe, KITCHEN, "place Mug SinkBasin");
        let refused = talk.0.give(&Command::MarkWrong).unwrap_err();
        assert_eq!(refused.code(), RejectionCode::NothingToMark, "{recipe}");
        assert!(talk.say("go to the fridge").starts_with("GOTO Fridge"), "{recipe}");
        talk.0.accept(&Command::MarkWrong);
        let again = talk.0.give(&Command::MarkWrong).unwrap_err();
        assert_eq!(again.code(), RejectionCode::NothingToMark, "{recipe}: {again}");
        talk.0.done();
        assert_eq!(talk.0.session.phase(), Phase::Teaching, "{recipe}");
    }
}

#[test]
fn between_tasks_it_reopens_teaching() {
    let mut talk = talk();
    assert_eq!(talk.say("go to the table"), "GOTO DiningTable");
    talk.0.done();
    assert_eq!(talk.0.session.phase(), Phase::Idle);
    talk.0.accept(&Command::MarkWrong);
    assert_eq!(talk.0.session.phase(), Phase::Teaching);
    let explains = talk.0.session.status().to_teach[0].seq;
    let (actions, on_clash) = (Vec::new(), OnClash::Ask);
    talk.0.accept(&Command::Teach { explains, actions, on_clash });
    talk.0.learn();
    talk.0.start("place Apple CounterTop");
    let refused = talk.0.give(&Command::MarkWrong).unwrap_err();
    assert_eq!(refused.code(), RejectionCode::NothingToMark, "it is another task");
}

#[test]
fn words_about_nothing_are_one_plain_sentence() {
    let mut talk = talk();
    assert_eq!(talk.say("that was wrong"), "i I have done nothing in this task yet.");
    assert_eq!(talk.say("yes"), "i I did not ask anything.");
    assert_eq!(talk.say("never mind"), "?", "it takes nothing back");
    assert_eq!(talk.say("go to the table"), "GOTO DiningTable");
    assert_eq!(talk.say("wrong"), "marked");
    let twice = talk.say("wrong");
    assert_eq!(twice, "i What I did for \"go to the table\" is marked as wrong.");
}

#[test]
fn the_act_that_reached_the_goal_can_be_called_wrong() {
    let mut talk = talk();
    talk.say("pick up the mug");
    talk.say("put it in the sink");
    assert_eq!(talk.0.session.phase(), Phase::Idle, "the goal is reached");
    talk.0.accept(&Command::MarkWrong);
    assert_eq!(talk.to_teach(), ["put it in the sink"]);
}
