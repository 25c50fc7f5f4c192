//! Whether an utterance is a request for something to be done now. Questions, statements,
//! prohibitions, and requests for another time are never carried out.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::frames::Framed;
use crate::language::{Mood, WordLists, is_mark};

/// The words that mark a mood. Data of a recipe, in lower case; entries may have several words.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Moods {
    /// At the beginning: the utterance is a question: "what", "tell me".
    pub asking: BTreeSet<String>,
    /// At the beginning, the utterance is a question; after a noun, it is a statement: "is", "did".
    pub auxiliaries: BTreeSet<String>,
    /// Auxiliaries only before a pronoun: "do you", "have you".
    pub auxiliaries_or_verbs: BTreeSet<String>,
    /// At the beginning: the utterance is a statement: "i", "somebody".
    pub subjects: BTreeSet<String>,
    /// Past forms of verbs that do not end in -ed.
    pub past: BTreeSet<String>,
    /// Anywhere: the utterance is a statement about the past.
    pub told: BTreeSet<String>,
    /// Begin a part of a sentence whose auxiliaries do not count: "that".
    pub relative: BTreeSet<String>,
    /// Anywhere: something is not to be done.
    pub forbidding: BTreeSet<String>,
    /// Before a verb in -ing: something is not to be done: "stop".
    pub ending: BTreeSet<String>,
    /// Anywhere: the request has a condition.
    pub conditions: BTreeSet<String>,
    /// Anywhere: the request is for another time.
    pub times: BTreeSet<String>,
    /// Anywhere: an amount that no single step can satisfy: "all", "or", "except".
    pub amounts: BTreeSet<String>,
    /// Phrases with such a word that do not count: "all the way".
    pub idioms: BTreeSet<String>,
    /// At the end of an utterance of several clauses: the order is that of the words. "When you are
    /// done", "afterwards".
    pub afterwards: BTreeSet<String>,
    /// At the beginning: the order is not that of the words. "Before".
    pub order_first: BTreeSet<String>,
    /// After the first word: the order is not that of the words. "After".
    pub order_later: BTreeSet<String>,
}

/// Words of a duration, such as "a few seconds".
const DURATION_WORDS: usize = 3;

impl Moods {
    /// The mood; none for a request for something to be done now.
    ///
    /// - `text`: as said, for its question mark.
    pub(super) fn of(&self, text: &str, framed: &Framed, lists: &WordLists) -> Option<Mood> {
        let tokens: Vec<&str> = framed.tokens.iter().map(String::as_str).collect();
        let first = tokens.iter().position(|token| !is_mark(token))?;
        let tokens = &tokens[first..];
        let found = |phrases: &BTreeSet<String>| anywhere(phrases, tokens);
        let ended = tokens.windows(2).find(|two| {
            self.ending.contains(two[0]) && two[1].ends_with("ing") && lists.base(two[1]) != two[1]
        });
        if let Some(word) = found(&self.forbidding).or(ended.map(|two| two.join(" "))) {
            return Some(Mood::Forbidden { word });
        }
        if let Some(word) = self.asks(text, framed, tokens) {
            return Some(Mood::Asked { word });
        }
        if let Some(word) = self.tells(tokens, lists) {
            return Some(Mood::Told { word });
        }
        if let Some(word) = found(&self.conditions) {
            return Some(Mood::Conditional { word });
        }
        if let Some(word) = found(&self.times) {
            return Some(Mood::Later { word });
        }
        let lasts = |at: usize| {
            tokens[at + 1..].iter().take(DURATION_WORDS).any(|next| lists.lasting.contains(*next))
        };
        let reordered = tokens.iter().enumerate().find(|(at, token)| match at {
            0 => self.order_first.contains(**token),
            // "After a few seconds" is how long, which a parser judges.
            _ => self.order_later.contains(**token) && !lasts(*at),
        });
        reordered.map(|(_, word)| Mood::Reordered { word: (*word).to_owned() })
    }

    /// The words that ask for more, less or other than one step can say, if there are any.
    ///
    /// What only describes a landmark does not count: "between the TWO vases".
    pub(super) fn amounts(&self, tokens: &[String], lists: &WordLists) -> Vec<String> {
        let tokens: Vec<&str> = tokens.iter().map(String::as_str).collect();
        let aside = |at: usize| {
            let mut before = tokens[..at].iter().rev();
            let before =
                before.find(|word| !lists.determiners.contains(**word) && **word != "other");
            before.is_some_and(|word| {
                // "Mug number two".
                if *word == "number" {
                    return true;
                }
                lists.stop.contains(*word)
                    && !lists.onto.contains(*word)
                    && !lists.inside.contains(*word)
                    && !lists.cuts.contains(*word)
                    && !lists.verb_particles.contains(*word)
            })
        };
        let from = |at: usize| {
            let phrase = phrase_from(&self.amounts, &tokens[at..])?;
            // "For a few seconds" and "wait a bit" are how long, which a parser judges.
            let long = |word: Option<&&str>| word.is_some_and(|word| lists.lasting.contains(*word));
            let before = at.checked_sub(1).and_then(|before| tokens.get(before));
            let idiom = long(tokens.get(at + 1))
                || long(before)
                || phrase_from(&self.idioms, &tokens[at..]).is_some();
            (!idiom && !aside(at)).then(|| phrase.clone())
        };
        let mut found: Vec<String> = Vec::new();
        for phrase in (0..tokens.len()).filter_map(from) {
            if !found.contains(&phrase) {
                found.push(phrase);
            }
        }
        found
    }

    /// Takes away why something is asked for, where it is said last and behind a mark: "close the
    /// fridge, it is still open". What forbids or limits the request stays.
    pub(super) fn strip_reason(&self, framed: &mut Framed) {
        let tokens: Vec<&str> = framed.tokens.iter().map(String::as_str).collect();
        let Some(mark) = tokens.iter().rposition(|token| is_mark(token)) else { return };
        let [first, rest @ ..] = &tokens[mark + 1..] else { return };
        let contracted = first.split_once('\'').is_some_and(|(word, verb)| {
            self.subjects.contains(word) && matches!(verb, "s" | "re" | "m" | "ve")
        });
        let told = contracted
            || (self.subjects.contains(*first)
                && rest.first().is_some_and(|word| self.auxiliaries.contains(*word)));
        let says = [&self.forbidding, &self.conditions, &self.times, &self.amounts];
        if mark == 0 || !told || says.iter().any(|list| anywhere(list, &tokens[mark..]).is_some()) {
            return;
        }
        framed.frames.push(tokens[mark + 1..].join(" "));
        framed.tokens.truncate(mark);
    }

    /// Takes away that the last of several clauses is to be done last: "wash the mug and put it
    /// back when you are done". Said of a single request it is a condition, and stays.
    pub(super) fn strip_order(&self, framed: &mut Framed, lists: &WordLists) {
        let marks = framed.tokens.iter().rev().take_while(|token| is_mark(token)).count();
        let end = framed.tokens.len() - marks;
        let tokens: Vec<&str> = framed.tokens[..end].iter().map(String::as_str).collect();
        let last = (1..end).find(|&at| {
            phrase_from(&self.afterwards, &tokens[at..])
                .is_some_and(|phrase| phrase.split(' ').count() == end - at)
        });
        let Some(at) = last else { return };
        let is_verb = |word: &&&str| {
            lists.verbs.contains(&lists.base(word)) || lists.noun_verbs.contains(**word)
        };
        // "Pick up the clean mug when you are done" is one clause, for all its verbs.
        let cuts =
            |word: &&str| is_mark(word) || lists.cuts.contains(*word) || lists.base(word) != **word;
        let clauses = &tokens[..at];
        if clauses.iter().filter(is_verb).count() < 2 || !clauses.iter().any(cuts) {
            return;
        }
        framed.frames.push(tokens[at..].join(" "));
        framed.tokens.truncate(at);
    }

    /// Whether a single word says anything of a mood.
    pub(super) fn has(&self, word: &str) -> bool {
        [&self.asking, &self.told, &self.forbidding, &self.conditions, &self.times, &self.amounts]
            .iter()
            .any(|list| list.contains(word))
    }

    fn asks(&self, text: &str, framed: &Framed, tokens: &[&str]) -> Option<String> {
        if let Some(phrase) = phrase_from(&self.asking, tokens) {
            return Some(phrase.clone());
        }
        let (first, second) = (tokens[0], tokens.get(1));
        let subject = second.is_some_and(|word| self.subjects.contains(*word));
        if self.auxiliaries.contains(first)
            || (self.auxiliaries_or_verbs.contains(first) && subject)
        {
            return Some(first.to_owned());
        }
        // "Open the fridge, will you?" is a polite request. Without the courtesy, a question mark
        // makes it a question.
        let polite = !framed.frames.is_empty();
        (text.contains('?') && !polite).then(|| "?".to_owned())
    }

    fn tells(&self, tokens: &[&str], lists: &WordLists) -> Option<String> {
        let first = tokens[0];
        let contracted =
            first.split_once('\'').is_some_and(|(word, _)| self.subjects.contains(word));
        if self.subjects.contains(first) || contracted {
            return Some(first.to_owned());
        }
        if let Some(word) = anywhere(&self.told, tokens) {
            return Some(word);
        }
        let is_past = |word: &str| {
            self.past.contains(word) || (word.ends_with("ed") && is_past_of(word, lists))
        };
        let is_verb = |word: &str| lists.verbs.contains(word) || lists.noun_verbs.contains(word);
        if is_past(first) && !is_verb(first) {
            return Some(first.to_owned());
        }
        let gerund = first.ends_with("ing") && lists.base(first) != first;
        if is_verb(first) {
            return None;
        }
        for (at, token) in tokens.iter().enumerate() {
            // What follows a mark, or describes a thing, is another part of the sentence.
            if self.relative.contains(*token) || (is_mark(token) && !gerund) {
                return None;
            }
            let determined = at > 0 && lists.determiners.contains(tokens[at - 1]);
            // A request does not begin with an article.
            let named_first = lists.determiners.contains(first);
            if at > 0 && is_verb(token) && !gerund && !determined && !is_past(token) && !named_first
            {
                return None;
            }
            let named_first = named_first || at == 1;
            let auxiliary = self.auxiliaries.contains(*token);
            if at > 0 && (auxiliary || (named_first && !gerund && !determined && is_past(token))) {
                return Some((*token).to_owned());
            }
        }
        None
    }
}

/// "Washed", "placed", "dropped": of a verb that is known.
fn is_past_of(word: &str, lists: &WordLists) -> bool {
    let Some(stem) = word.strip_suffix("ed") else { return false };
    let doubled = stem.char_indices().last().map_or("", |(end, _)| &stem[..end]);
    [stem.to_owned(), format!("{stem}e"), doubled.to_owned()]
        .iter()
        .any(|form| lists.verbs.contains(form) || lists.noun_verbs.contains(form))
}

/// The longest phrase that the tokens begin with.
fn phrase_from<'p>(phrases: &'p BTreeSet<String>, tokens: &[&str]) -> Option<&'p String> {
    let first = *tokens.first()?;
    let beginning = phrases.range(first.to_owned()..).take_while(|p| p.starts_with(first));
    beginning.filter(|phrase| begins_with(tokens, phrase)).max_by_key(|phrase| phrase.len())
}

fn begins_with(tokens: &[&str], phrase: &str) -> bool {
    let mut tokens = tokens.iter();
    phrase.split(' ').all(|word| tokens.next() == Some(&word))
}

/// The first phrase that stands anywhere in the tokens.
fn anywhere(phrases: &BTreeSet<String>, tokens: &[&str]) -> Option<String> {
    (0..tokens.len()).find_map(|at| phrase_from(phrases, &tokens[at..])).cloned()
}
