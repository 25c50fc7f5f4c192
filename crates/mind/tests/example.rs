//! The example does what its page says.

#[path = "../examples/teach.rs"]
#[allow(dead_code, unreachable_pub, reason = "the example is a program of its own")]
mod teach;

use apprentice_core::language::Outcome;

#[test]
fn one_example_is_enough_and_a_question_is_no_request() {
    let outcomes = teach::outcomes().unwrap();
    let Outcome::Understood { program, .. } = &outcomes[0] else { panic!("{outcomes:?}") };
    assert!(program.to_string().contains("PUT Tomato SinkBasin; TOGGLE Faucet"), "{program}");
    assert_eq!(outcomes[1..], [Outcome::NotSure, Outcome::NotSure]);
}
