//! Other words for what the seeds say, and typing errors in them. They are replaced before anything
//! is lifted, so that a lesson and a later request have the same words.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::names::one_slip_apart;
use crate::language::{WordLists, is_mark};

/// Other words for what seeds say ("grasp" for "pick up"), at the beginning of a clause. A phrase
/// with an ellipsis has its second part at the end of the clause: "shut … off".
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Verbs(BTreeMap<String, String>);

/// Words in which one wrong letter is corrected at the beginning of a clause.
const SLIP_LETTERS_MIN: usize = 4;

impl Verbs {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// - `known`: whether a word is in ordinary use, and so not an error.
    pub(super) fn rewrite(
        &self,
        tokens: Vec<String>,
        lists: &WordLists,
        known: &dyn Fn(&str) -> bool,
    ) -> Vec<String> {
        let mut out = Vec::with_capacity(tokens.len());
        let mut rest = tokens;
        loop {
            let begins = |token: &String| is_mark(token) || lists.cuts.contains(token);
            let skipped =
                rest.iter().take_while(|token| begins(token) || lists.joints.contains(*token));
            let skipped = skipped.count();
            out.extend(rest.drain(..skipped));
            if rest.is_empty() {
                return out;
            }
            let end = rest.iter().position(begins).unwrap_or(rest.len());
            let clause = rest.drain(..end.max(1)).collect();
            out.extend(self.rewrite_clause(mend_verb(clause, lists, known)));
        }
    }

    fn rewrite_clause(&self, clause: Vec<String>) -> Vec<String> {
        let mut best: Option<(usize, Vec<String>)> = None;
        let first = clause[0].as_str();
        let beginning = self.0.range(first.to_owned()..);
        for (said, meant) in beginning.take_while(|(said, _)| said.starts_with(first)) {
            let Some((count, words)) = replaced(&clause, said, meant) else { continue };
            if best.as_ref().is_none_or(|(known, _)| count > *known) {
                best = Some((count, words));
            }
        }
        best.map_or(clause, |(_, words)| words)
    }
}

/// The clause with `meant` in the place of `said`, and how many words were replaced.
fn replaced(clause: &[String], said: &str, meant: &str) -> Option<(usize, Vec<String>)> {
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let (head, tail) = said.split_once('…').unwrap_or((said, ""));
    let (head, tail) = (words(head), words(tail));
    let rest = clause.strip_prefix(head.as_slice())?;
    let (new_head, new_tail) = meant.split_once('…').unwrap_or((meant, ""));
    let mut out = words(new_head);
    if tail.is_empty() {
        out.extend(rest.iter().cloned());
        return Some((head.len(), out));
    }
    let between = rest.strip_suffix(tail.as_slice()).filter(|between| !between.is_empty())?;
    out.extend(between.iter().cloned());
    out.extend(words(new_tail));
    Some((head.len() + tail.len(), out))
}

/// "Opne the fridge": a first word that is in no table and differs by one letter from exactly one
/// common verb.
fn mend_verb(
    mut clause: Vec<String>,
    lists: &WordLists,
    known: &dyn Fn(&str) -> bool,
) -> Vec<String> {
    let word = clause[0].as_str();
    let listed = lists.verbs.contains(word) || lists.noun_verbs.contains(word);
    if clause.len() < 2 || word.len() < SLIP_LETTERS_MIN || listed || known(word) {
        return clause;
    }
    let common = lists.common_verbs.iter().filter(|verb| one_slip_apart(word, verb));
    if let [verb] = common.collect::<Vec<_>>()[..] {
        clause[0] = verb.clone();
    }
    clause
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::tokens;

    fn lists() -> WordLists {
        let set = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect();
        WordLists {
            verbs: set(&["open", "close", "pick", "shut"]),
            cuts: set(&["and", "then"]),
            joints: set(&["and", "then"]),
            common_verbs: set(&["open", "close", "pick"]),
            ..WordLists::default()
        }
    }

    #[test]
    fn other_words_for_a_verb_are_read_where_a_clause_begins() {
        let entries =
            [("grasp", "pick up"), ("shut off", "turn off"), ("shut … off", "turn … off")];
        let verbs = Verbs(entries.map(|(a, b)| (a.to_owned(), b.to_owned())).into());
        let known = |word: &str| !["opne", "clsoe"].contains(&word);
        for (said, read) in [
            ("grasp the mug and shut off the lamp", "pick up the mug and turn off the lamp"),
            ("shut the lamp off", "turn the lamp off"),
            ("shut the fridge", "shut the fridge"),
            ("open the grasp", "open the grasp"),
            ("opne the fridge then clsoe it", "open the fridge then close it"),
        ] {
            assert_eq!(verbs.rewrite(tokens(said), &lists(), &known).join(" "), read, "{said}");
        }
    }
}
