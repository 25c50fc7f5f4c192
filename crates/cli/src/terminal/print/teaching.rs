//! What is asked while a person teaches, and what they are told afterwards.

use apprentice::client::{ActionView, Teachable};
use apprentice::plain::count;

use super::answer::action;

/// The question about one utterance, with the actions that it may stand for.
pub fn teaching_question(said: &Teachable, actions: &[ActionView]) -> Vec<String> {
    let why = match (said.not_sure, said.guessed) {
        (true, _) => "I did not understand it",
        (false, true) => "I guessed what it means",
        (false, false) => "I understood it, but it could not be done",
    };
    let after = after(said, actions);
    let mut lines = vec![format!("You said \"{}\" and {why}.", said.utterance)];
    match (after.first(), after.last()) {
        (Some(first), Some(last)) => {
            lines.push("What I did after that:".to_owned());
            lines.extend(after.iter().map(|done| action(done)));
            lines.push(format!(
                "Which of these actions did you mean by \"{}\"? Type the first and the last, such as \
                 {}-{}. Or type all, none or skip (help explains them).",
                said.utterance, first.number, last.number
            ));
        }
        _ => lines.push("I did nothing after that. Type none or skip.".to_owned()),
    }
    lines
}

/// The actions that came after an utterance.
pub fn after<'a>(said: &Teachable, actions: &'a [ActionView]) -> Vec<&'a ActionView> {
    actions.iter().filter(|action| action.number > said.actions_before).collect()
}

/// What a person is told when training is over.
pub fn learned(examples: u32) -> String {
    format!("Learned. I now know {}.", count(examples, "example"))
}

#[cfg(test)]
mod tests {
    use apprentice::ids::Seq;

    use super::super::samples::done;
    use super::*;

    #[test]
    fn a_teaching_question_shows_only_what_came_after() {
        let said = Teachable {
            seq: Seq::FIRST,
            utterance: "wash it".into(),
            actions_before: 1,
            not_sure: true,
            guessed: false,
        };
        let lines = teaching_question(&said, &[done(1, "a"), done(2, "b"), done(3, "c")]);
        assert_eq!(lines[2..4], ["  2  b", "  3  c"]);
        assert!(lines[4].contains("such as 2-3."), "{lines:?}");
        let nothing = teaching_question(&said, &[done(1, "a")]);
        assert!(nothing[1].contains("Type none or skip"), "{nothing:?}");
    }

    #[test]
    fn what_was_learned_is_counted() {
        assert_eq!(learned(45), "Learned. I now know 45 examples.");
    }
}
