//! The robot asks which of several things was meant, and takes the answer.

use super::{LIVING_ROOM, Talk, check};

const TABLE: &str = "~ Which table: the coffee table or the side table?";

fn talk() -> Talk {
    Talk::new(LIVING_ROOM, "place Book CoffeeTable")
}

#[test]
fn a_choice_is_taken_by_name_by_number_or_not_at_all() {
    for (reply, outcome) in [
        ("the side table", "GOTO SideTable"),
        ("side table", "GOTO SideTable"),
        ("the side one", "GOTO SideTable"),
        ("side", "GOTO SideTable"),
        ("I meant the side table", "GOTO SideTable"),
        ("the second one", "GOTO SideTable"),
        ("the second", "GOTO SideTable"),
        ("number two", "GOTO SideTable"),
        ("2", "GOTO SideTable"),
        ("two", "GOTO SideTable"),
        ("The coffee table, please.", "GOTO CoffeeTable"),
        ("coffee", "GOTO CoffeeTable"),
        ("the first one", "GOTO CoffeeTable"),
        ("1", "GOTO CoffeeTable"),
        ("one", "GOTO CoffeeTable"),
        ("no", "i All right. Do it in small steps, then teach me."),
        ("neither", "i All right. Do it in small steps, then teach me."),
        ("never mind", "i All right. Do it in small steps, then teach me."),
        // No answer: the question is closed, and this is what was said.
        ("go to the sofa", "GOTO Sofa"),
        ("where is the book?", "i The book is on the sofa."),
        ("yes", "i I did not ask anything."),
        ("3", "?"),
    ] {
        let mut talk = talk();
        assert_eq!(talk.say("go to the table"), TABLE, "{reply}");
        assert_eq!(talk.actions(), 0, "it asked, and moved");
        let found = talk.say(reply);
        // A yes to two choices is an answer to nothing.
        let expected = if reply == "yes" { "i I did not ask anything." } else { outcome };
        assert_eq!(found, expected, "{reply}");
        if outcome.starts_with("GOTO CoffeeTable") || outcome.starts_with("GOTO SideTable") {
            assert!(talk.to_teach().is_empty(), "{reply}: what was understood is not taught");
        }
    }
}

#[test]
fn a_question_lapses_and_what_was_used_is_meant_again() {
    let mut talk = talk();
    check(
        &mut talk,
        &[
            ("go to the table", TABLE),
            ("go to the sofa", "GOTO Sofa"),
            ("the side table", "?"),
            ("go to the table", TABLE),
            ("the side table", "GOTO SideTable"),
            ("go to the sofa", "GOTO Sofa"),
            ("go to the side table", "GOTO SideTable"),
            ("go to the coffee table", "GOTO CoffeeTable"),
        ],
    );
    talk.0.done();
    assert_eq!(talk.to_teach(), ["go to the table", "the side table"], "what nobody answered");
}

#[test]
fn nothing_is_asked_where_one_thing_fits() {
    let mut talk = Talk::new(super::KITCHEN, "place Mug SinkBasin");
    check(
        &mut talk,
        &[
            ("go to the table", "GOTO DiningTable"),
            ("go to the fridge", "GOTO Fridge"),
            ("open it", "OPEN Fridge"),
            ("pick up the mug", "GOTO Mug; PICKUP Mug"),
            ("put it in the fridge", "GOTO Fridge; PUT Mug Fridge"),
        ],
    );
}
