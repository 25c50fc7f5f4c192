//! A person who spells out primitives may have a purpose that the words do not name. The robot
//! would then carry out the steps without understanding the request.

use crate::language::{Roles, Step, Symbol};

/// Whether something is taken twice, or put down and then taken, or gone to, again.
pub(super) fn undoes_itself(roles: &Roles, steps: &[Step]) -> bool {
    let mut moved: Vec<&Symbol> = Vec::new();
    let mut placed: Vec<&Symbol> = Vec::new();
    for step in steps {
        let Some(thing) = step.args.first() else { continue };
        let takes = roles.takes(&step.operator);
        let again = takes && moved.contains(&thing);
        if again || (roles.goes(&step.operator) && placed.contains(&thing)) {
            return true;
        }
        if takes || roles.puts(&step.operator) {
            moved.push(thing);
        }
        if roles.puts(&step.operator) {
            placed.push(thing);
        }
    }
    false
}

/// Why several primitives in one utterance have a purpose that was not named; none if they have
/// not.
///
/// Putting a thing somewhere and then turning something on, or working the same thing twice, is
/// done for its effect on the thing, and the steps alone may not complete it. Several steps of
/// which one is not possible were probably not meant as they were said.
///
/// - `clauses`: how many parts of the utterance gave the steps.
/// - `forbidden`: whether the world does not allow one of them.
pub(super) fn beyond_steps(
    roles: &Roles,
    steps: &[Step],
    clauses: usize,
    forbidden: bool,
) -> Option<&'static str> {
    let moves = |step: &Step| roles.goes(&step.operator);
    let handles = |step: &Step| !moves(step) && !roles.is_door(&step.operator);
    let works =
        |step: &Step| handles(step) && !roles.takes(&step.operator) && !roles.puts(&step.operator);
    let put = steps.iter().position(|step| roles.puts(&step.operator));
    let put_then_worked = put.is_some_and(|put| steps[put..].iter().any(works));
    let again = |place: usize, step: &Step| {
        steps[..place].iter().any(|before| before.args == step.args && works(before))
    };
    let worked_twice = steps.iter().enumerate().any(|(at, step)| works(step) && again(at, step));
    if put_then_worked || worked_twice {
        return Some("what all of that together is for is not known");
    }
    let acts = steps.iter().filter(|step| !moves(step)).count();
    let handled = steps.iter().filter(|step| handles(step)).count();
    let several = clauses > 1 && (handled > 1 || acts > 2);
    (forbidden && several).then_some("all of that together cannot be done as it was said")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::Program;

    fn roles() -> Roles {
        let [going, taking, putting] = ["GO", "TAKE", "PUT"].map(|name| Some(Symbol::new(name)));
        Roles { going, taking, putting, doors: vec!["OPEN".into(), "SHUT".into()] }
    }

    fn steps(text: &str) -> Vec<Step> {
        text.parse::<Program>().unwrap().steps
    }

    #[test]
    fn what_is_put_and_taken_again_was_put_for_something() {
        for text in
            ["PUT Knife Box; TAKE Knife", "TAKE Knife; TAKE Knife", "PUT Knife Box; GO Knife"]
        {
            assert!(undoes_itself(&roles(), &steps(text)), "{text}");
        }
        for text in ["TAKE Knife; PUT Knife Box", "PUT Knife Box; TAKE Fork", "GO Box; GO Box"] {
            assert!(!undoes_itself(&roles(), &steps(text)), "{text}");
        }
    }

    #[test]
    fn working_something_after_a_put_or_twice_is_for_something() {
        let beyond = |text: &str| beyond_steps(&roles(), &steps(text), 2, false);
        for text in
            ["PUT Knife Box; WORK Lamp", "WORK Lamp; WORK Lamp", "WORK Lamp; GO Box; WORK Lamp"]
        {
            assert!(beyond(text).is_some_and(|reason| reason.contains("for")), "{text}");
        }
        for text in [
            "WORK Lamp; PUT Knife Box",
            "TAKE Knife; WORK Lamp",
            "WORK Lamp; WORK Tap",
            "OPEN Box; PUT Knife Box; SHUT Box",
        ] {
            assert_eq!(beyond(text), None, "{text}");
        }
    }

    #[test]
    fn several_acts_that_cannot_be_done_as_said_are_not_understood() {
        let beyond = |text: &str, clauses| beyond_steps(&roles(), &steps(text), clauses, true);
        assert!(beyond("TAKE Knife; PUT Knife Box", 2).is_some());
        assert!(beyond("OPEN Box; PUT Knife Box; SHUT Box", 3).is_some());
        // One part, or one act: impossible is the honest answer.
        assert_eq!(beyond("TAKE Knife; PUT Knife Box", 1), None);
        assert_eq!(beyond("GO Box; TAKE Knife", 2), None);
    }
}
