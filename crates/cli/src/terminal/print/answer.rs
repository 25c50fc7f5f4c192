//! The answer to an utterance: what was done, or why nothing was done.

use apprentice::client::ActionView;
use apprentice::language::{Answer, Evidence, Mood, Outcome, Program};
use apprentice::session::CALLED_WRONG;
use apprentice::world::household::told;

use super::words::{quoted, unique, without_stop};

/// Characters of an utterance that is quoted back. The person sees a longer one above the answer.
const QUOTED_CHARS_MAX: usize = 60;

/// An answer to an utterance: what was done, action by action, or why nothing was.
///
/// - `done`: the actions that this utterance led to.
pub fn answer(utterance: &str, answer: &Answer, done: &[ActionView]) -> Vec<String> {
    match &answer.outcome {
        Outcome::Understood { .. } => done.iter().map(action).collect(),
        Outcome::Impossible { program, step, reason } => vec![impossible(program, *step, reason)],
        Outcome::NotSure => vec![not_sure(utterance, &answer.evidence)],
        Outcome::Asked { question } => vec![question.text.clone()],
        Outcome::Told { text } => vec![text.clone()],
    }
}

/// `  3  picks up the mug from the counter top`
pub fn action(action: &ActionView) -> String {
    format!("{:>3}  {}", action.number, action.sentence)
}

fn impossible(program: &Program, step: u32, reason: &str) -> String {
    let Some(failing) = program.steps.get(step as usize) else {
        return format!("I can't do that: {}. Nothing changed.", without_stop(reason));
    };
    let (request, reason) = (told::request(failing), told::reason(failing, reason));
    match program.steps.len() {
        1 => format!("I can't {request}: {reason}. Nothing changed."),
        of => format!(
            "I can't {request} (step {} of {of}): {reason}. Nothing changed. I took it to mean: \
             {program}.",
            step + 1
        ),
    }
}

fn not_sure(utterance: &str, evidence: &Evidence) -> String {
    if let Some(mood) = &evidence.mood {
        return no_request(mood);
    }
    let left_over = unique(evidence.left_over());
    if let [words @ .., _] = &left_over[..] {
        let these = if words.is_empty() { "this word" } else { "these words" };
        let words = quoted(&left_over);
        return format!(
            "I don't know what to do with {words}. Nothing changed. Say it without {these}, or do it \
             in small steps, then teach me."
        );
    }
    let that = match utterance.chars().count() {
        0..=QUOTED_CHARS_MAX => format!("\"{utterance}\""),
        _ => "that".to_owned(),
    };
    if evidence.discarded.iter().any(|discarded| discarded.reason == CALLED_WRONG) {
        return format!(
            "You said that this was wrong, so I don't do it for {that} again in this task. Do it in \
             small steps, then teach me."
        );
    }
    match evidence.nearest.first() {
        // Close enough, and still no program: a slot of it had no mention to fill it.
        Some(near) if near.distance <= evidence.threshold => format!(
            "I don't understand all of {that}. The closest request I know is \"{}\". Name every thing \
             in it, or do it in small steps, then teach me. (:why shows more.)",
            near.exemplar
        ),
        Some(_) => format!(
            "I don't understand {that}. Do it in small steps, then teach me. (:why shows what came \
             closest.)"
        ),
        None => format!("I don't understand {that}. Do it in small steps, then teach me."),
    }
}

/// The utterance was no request. Says which word shows it, and what to do instead.
pub(super) fn no_request(mood: &Mood) -> String {
    match mood {
        Mood::Asked { word } => format!(
            "That sounds like a question (\"{word}\"). I can't answer questions. Nothing changed. \
             (:look shows where things are.)"
        ),
        Mood::Told { word } => format!(
            "That sounds like a statement (\"{word}\"). Nothing changed. Tell me what to do."
        ),
        Mood::Forbidden { word } => {
            format!("You told me not to do something (\"{word}\"). Nothing changed.")
        }
        Mood::Conditional { word } => format!(
            "I can't wait for something to happen (\"{word}\"). Nothing changed. Tell me when it is \
             time."
        ),
        Mood::Later { word } => format!(
            "I can only do things now (\"{word}\"). Nothing changed. Tell me when it is time."
        ),
        Mood::Reordered { word } => format!(
            "I do things in the order in which you say them (\"{word}\"). Nothing changed. Say first \
             what I must do first."
        ),
    }
}

#[cfg(test)]
mod tests {
    use apprentice::language::{Discarded, Use};

    use super::super::samples::{accounting, answered, done};
    use super::super::why;
    use super::*;

    #[test]
    fn what_was_done_is_numbered() {
        let program = "GOTO Mug; PICKUP Mug".parse().unwrap();
        let outcome = Outcome::Understood { program, bindings: vec![] };
        let done = [done(3, "goes to the mug"), done(12, "waits")];
        let lines = answer("go", &answered(outcome), &done);
        assert_eq!(lines, ["  3  goes to the mug", " 12  waits"]);
    }

    #[test]
    fn not_sure_quotes_the_words_and_says_what_to_do_next() {
        let lines = answer("boogie", &answered(Outcome::NotSure), &[]);
        assert_eq!(
            lines,
            [
                "I don't understand \"boogie\". Do it in small steps, then teach me. (:why shows what \
              came closest.)"
            ]
        );
        let lines = answer(&"boogie ".repeat(20), &answered(Outcome::NotSure), &[]);
        assert!(lines[0].starts_with("I don't understand that. Do it"), "{lines:?}");
    }

    #[test]
    fn what_was_called_wrong_is_not_done_again_and_that_is_said() {
        let mut told = answered(Outcome::NotSure);
        let program = "GOTO Mug".parse().unwrap();
        told.evidence.discarded = vec![Discarded { program, reason: CALLED_WRONG.to_owned() }];
        let lines = answer("go to the mug", &told, &[]);
        assert!(lines[0].starts_with("You said that this was wrong, so I don't do it for \"go to"));
    }

    #[test]
    fn a_near_request_that_names_too_little_says_so() {
        let mut told = answered(Outcome::NotSure);
        told.evidence.nearest[0].distance = 0.2;
        let lines = answer("pick up", &told, &[]);
        assert_eq!(
            lines,
            ["I don't understand all of \"pick up\". The closest request I know is \"pick up the \
              <obj>\". Name every thing in it, or do it in small steps, then teach me. (:why shows \
              more.)"]
        );
    }

    #[test]
    fn what_is_no_request_is_told_by_the_word_that_says_so() {
        let word = |word: &str| word.to_owned();
        for (mood, sentence) in [
            (
                Mood::Asked { word: word("did") },
                "That sounds like a question (\"did\"). I can't answer questions. Nothing changed. \
                 (:look shows where things are.)",
            ),
            (
                Mood::Told { word: word("i") },
                "That sounds like a statement (\"i\"). Nothing changed. Tell me what to do.",
            ),
            (
                Mood::Forbidden { word: word("not") },
                "You told me not to do something (\"not\"). Nothing changed.",
            ),
            (
                Mood::Conditional { word: word("until") },
                "I can't wait for something to happen (\"until\"). Nothing changed. Tell me when it \
                 is time.",
            ),
            (
                Mood::Later { word: word("tomorrow") },
                "I can only do things now (\"tomorrow\"). Nothing changed. Tell me when it is time.",
            ),
            (
                Mood::Reordered { word: word("before") },
                "I do things in the order in which you say them (\"before\"). Nothing changed. Say \
                 first what I must do first.",
            ),
        ] {
            let mut told = answered(Outcome::NotSure);
            told.evidence.nearest.clear();
            told.evidence.mood = Some(mood);
            assert_eq!(answer("did you wash it?", &told, &[]), [sentence]);
            let lines = why("did you wash it?", &told);
            assert_eq!(lines.last().map(String::as_str), Some(sentence));
            assert!(!lines.join("\n").contains("nothing to compare"), "{lines:?}");
        }
    }

    #[test]
    fn words_that_were_used_for_nothing_are_named() {
        let mut told = answered(Outcome::NotSure);
        let mut sentence = |words: &[(&str, Use)]| {
            told.evidence.accounting = accounting(words);
            answer("get it", &told, &[]).remove(0)
        };
        let (banana, kiwi, fig) =
            (("banana", Use::Nothing), ("kiwi", Use::Nothing), ("fig", Use::Nothing));
        assert_eq!(
            sentence(&[("get", Use::Verb), banana, ("the", Use::Harmless), banana]),
            "I don't know what to do with \"banana\". Nothing changed. Say it without this word, or \
             do it in small steps, then teach me."
        );
        assert_eq!(
            sentence(&[banana, kiwi, fig]),
            "I don't know what to do with \"banana\", \"kiwi\" and \"fig\". Nothing changed. Say it \
             without these words, or do it in small steps, then teach me."
        );
        // Every word was used, so none is to blame.
        assert!(sentence(&[("get", Use::Verb)]).starts_with("I don't understand \"get it\"."));
    }

    #[test]
    fn an_impossible_request_names_the_step_the_reason_and_that_nothing_was_done() {
        let outcome = |program: &str, step| Outcome::Impossible {
            program: program.parse().unwrap(),
            step,
            reason: "the fridge is closed".into(),
        };
        let told = |program, step| answer("do", &answered(outcome(program, step)), &[]).remove(0);
        assert_eq!(
            told("GOTO Fridge; PUT Mug Fridge", 1),
            "I can't put the mug in the fridge (step 2 of 2): the fridge is closed. Nothing changed. \
             I took it to mean: GOTO Fridge; PUT Mug Fridge."
        );
        assert_eq!(
            told("PUT Mug Fridge", 0),
            "I can't put the mug in the fridge: the fridge is closed. Nothing changed."
        );
        assert_eq!(
            told("OPEN Fridge", 0),
            "I can't open the fridge: it is closed. Nothing changed."
        );
        assert_eq!(
            told("OPEN Fridge", 7),
            "I can't do that: the fridge is closed. Nothing changed."
        );
    }
}
