//! Which option of a question an utterance takes.

use crate::language::{Question, tokens};

/// Words of a reply that say nothing of which option it is.
const EMPTY: [&str; 12] =
    ["the", "a", "an", "one", "that", "i", "meant", "mean", "please", "of", "them", "number"];
/// By place. "One" alone is a number; behind another word it is not.
const NUMBERS: [[&str; 3]; 6] = [
    ["1", "one", "first"],
    ["2", "two", "second"],
    ["3", "three", "third"],
    ["4", "four", "fourth"],
    ["5", "five", "fifth"],
    ["6", "six", "sixth"],
];

/// - `accepts`: whether the words are a yes.
/// - returns: the 0-based place of the option; none when the words take none of them, or fit several.
pub(super) fn chosen(question: &Question, words: &[&str], accepts: bool) -> Option<usize> {
    if accepts {
        return (question.options.len() == 1).then_some(0);
    }
    let telling: Vec<&str> = words.iter().filter(|word| !EMPTY.contains(word)).copied().collect();
    let number = match (&telling[..], words) {
        ([only], _) => NUMBERS.iter().position(|names| names.contains(only)),
        ([], [.., last]) => NUMBERS.iter().position(|names| names.contains(last)),
        _ => None,
    };
    if let Some(place) = number.filter(|place| *place < question.options.len()) {
        return Some(place);
    }
    if telling.is_empty() {
        return None;
    }
    let fits = |label: &str| {
        let label = tokens(label);
        telling.iter().all(|word| label.iter().any(|other| other == word))
    };
    let mut fitting = question.options.iter().enumerate().filter(|(_, it)| fits(&it.label));
    match (fitting.next(), fitting.next()) {
        (Some((place, _)), None) => Some(place),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::{AnswerOption, Program};

    fn question(labels: &[&str]) -> Question {
        let option = |label: &&str| AnswerOption {
            label: (*label).to_owned(),
            program: Program { steps: Vec::new() },
            bindings: Vec::new(),
            chosen: Vec::new(),
            mentioned: None,
        };
        Question { text: String::new(), options: labels.iter().map(option).collect() }
    }

    fn chosen_by(question: &Question, said: &str) -> Option<usize> {
        let words = tokens(said);
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        chosen(question, &words, said == "yes")
    }

    #[test]
    fn a_choice_is_taken_by_its_number_its_name_or_a_word_of_it() {
        let tables = question(&["the dining table", "the side table"]);
        for (said, place) in [
            ("the side table", Some(1)),
            ("side", Some(1)),
            ("the dining one", Some(0)),
            ("2", Some(1)),
            ("two", Some(1)),
            ("one", Some(0)),
            ("the first one", Some(0)),
            ("number two", Some(1)),
            ("i meant the side table please", Some(1)),
            // Both, none, or a request of its own.
            ("table", None),
            ("the table", None),
            ("yes", None),
            ("3", None),
            ("the coffee table", None),
            ("go to the side table", None),
            ("the", None),
        ] {
            assert_eq!(chosen_by(&tables, said), place, "{said}");
        }
    }

    #[test]
    fn yes_takes_the_only_choice() {
        assert_eq!(chosen_by(&question(&["the knife"]), "yes"), Some(0));
        assert_eq!(chosen_by(&question(&[]), "yes"), None);
    }
}
