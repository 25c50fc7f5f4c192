//! Phrases around a request: addresses, courtesies, fillers. They are removed before anything is
//! lifted, so that a lesson and a later request have the same form.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::language::{WordLists, is_mark};

/// Phrases that ask for nothing by themselves. Data of a recipe, in lower case.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frames {
    /// At the beginning of an utterance: "could you please", "robot", "ok". Phrases of several
    /// words also at the beginning of a later clause.
    pub openers: BTreeSet<String>,
    /// At the beginning, before a verb in -ing: "would you mind".
    pub gerunds: BTreeSet<String>,
    /// At the end of an utterance: "for me", "thank you".
    pub closers: BTreeSet<String>,
    /// Anywhere: "please".
    pub fillers: BTreeSet<String>,
    /// Before another verb: "go and", "come".
    pub going: BTreeSet<String>,
    /// Words after which a phrase is not an opener: "next TO the sink".
    pub unless_before: BTreeSet<String>,
}

/// The words of an utterance without its frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Framed {
    /// Words and clause marks.
    pub tokens: Vec<String>,
    /// The removed phrases, in order.
    pub frames: Vec<String>,
}

impl Framed {
    /// Words without frames.
    pub(super) fn bare(tokens: Vec<String>) -> Framed {
        Framed { tokens, frames: Vec::new() }
    }
}

impl Frames {
    /// Removes the frames. At least one word stays.
    ///
    /// - `says`: whether a word says something that must not be taken for a name ("tomorrow, …").
    pub(super) fn strip(
        &self,
        tokens: Vec<String>,
        lists: Option<&WordLists>,
        says: &dyn Fn(&str) -> bool,
    ) -> Framed {
        let mut framed = Framed::bare(tokens);
        while self.open(&mut framed, lists, says) || self.close(&mut framed) {}
        self.strip_later_clauses(&mut framed, lists);
        framed
    }

    /// Removes one opener.
    fn open(
        &self,
        framed: &mut Framed,
        lists: Option<&WordLists>,
        says: &dyn Fn(&str) -> bool,
    ) -> bool {
        let marks = framed.tokens.iter().take_while(|token| is_mark(token)).count();
        framed.tokens.drain(..marks);
        self.open_at(0, framed, lists, 1) || self.address(framed, lists, says)
    }

    /// - `words_min`: of how many words an opener must be.
    fn open_at(
        &self,
        at: usize,
        framed: &mut Framed,
        lists: Option<&WordLists>,
        words_min: usize,
    ) -> bool {
        let tokens = &framed.tokens;
        let gerund = longest(&self.gerunds, &tokens[at..]);
        let opener = longest(&self.openers, &tokens[at..]);
        let going = longest(&self.going, &tokens[at..]).filter(|count| {
            let verb = tokens.get(at + count);
            verb.zip(lists).is_some_and(|(verb, lists)| {
                lists.verbs.contains(verb) && !self.is_excluded(tokens.get(at + count + 1))
            })
        });
        let usual = gerund.max(opener).filter(|count| {
            *count >= words_min
                && !self.is_excluded(tokens.get(at + count))
                && !is_request(&tokens[at..], *count, lists)
        });
        let Some(count) = usual.or(going) else { return false };
        if !tokens[at + count..].iter().any(|token| !is_mark(token)) {
            return false;
        }
        framed.frames.push(tokens[at..at + count].join(" "));
        framed.tokens.drain(at..at + count);
        if let (true, Some(lists)) = (gerund >= opener && gerund.is_some(), lists)
            && let Some(verb) = framed.tokens.get_mut(at)
        {
            *verb = lists.base(verb);
        }
        true
    }

    fn is_excluded(&self, next: Option<&String>) -> bool {
        next.is_some_and(|next| self.unless_before.contains(next))
    }

    /// "Alfred, open the fridge": one unknown word before a comma.
    fn address(
        &self,
        framed: &mut Framed,
        lists: Option<&WordLists>,
        says: &dyn Fn(&str) -> bool,
    ) -> bool {
        let [name, mark, rest @ ..] = framed.tokens.as_slice() else { return false };
        let Some(lists) = lists else { return false };
        let known = lists.verbs.contains(name)
            || lists.noun_verbs.contains(name)
            || lists.stop.contains(name)
            || lists.adverbs.contains(name)
            || lists.lasting.contains(name)
            || says(name);
        if mark != "," || known || !rest.iter().any(|token| !is_mark(token)) {
            return false;
        }
        // What follows is a request of its own, not the rest of a list.
        if !rest.first().is_some_and(|verb| lists.verbs.contains(verb)) {
            return false;
        }
        framed.frames.push(name.clone());
        framed.tokens.drain(..2);
        true
    }

    /// Takes one closer away.
    fn close(&self, framed: &mut Framed) -> bool {
        let tokens = &framed.tokens;
        let marks = tokens.iter().rev().take_while(|token| is_mark(token)).count();
        let end = tokens.len() - marks;
        let count =
            (1..end).rev().find(|&count| phrase_in(&self.closers, &tokens[end - count..end]));
        let Some(count) = count else { return false };
        framed.frames.push(tokens[end - count..end].join(" "));
        framed.tokens.truncate(end - count);
        while framed.tokens.last().is_some_and(|token| is_mark(token)) {
            framed.tokens.pop();
        }
        true
    }

    fn strip_later_clauses(&self, framed: &mut Framed, lists: Option<&WordLists>) {
        let mut at = 1;
        while at < framed.tokens.len() {
            let begins = |token: &String| {
                is_mark(token) || lists.is_some_and(|lists| lists.cuts.contains(token))
            };
            if begins(&framed.tokens[at - 1]) && self.open_at(at, framed, lists, 2) {
                continue;
            }
            if self.fillers.contains(&framed.tokens[at]) {
                framed.frames.push(framed.tokens.remove(at));
                continue;
            }
            at += 1;
        }
    }
}

/// "Cool the apple" asks for something, where "cool, open the fridge" and "cool open the fridge" do
/// not: whether the one word that may open a frame is the verb.
fn is_request(tokens: &[String], count: usize, lists: Option<&WordLists>) -> bool {
    let (Some(lists), [word]) = (lists, &tokens[..count]) else { return false };
    let is_verb = |word: &String| lists.verbs.contains(word) || lists.noun_verbs.contains(word);
    is_verb(word) && tokens.get(count).is_some_and(|next| !is_mark(next) && !is_verb(next))
}

/// How many tokens the longest phrase takes that `tokens` begin with.
fn longest(phrases: &BTreeSet<String>, tokens: &[String]) -> Option<usize> {
    (1..=tokens.len().min(PHRASE_WORDS_MAX)).rev().find(|&n| phrase_in(phrases, &tokens[..n]))
}

/// Words of the longest phrase that is looked for.
const PHRASE_WORDS_MAX: usize = 8;

fn phrase_in(phrases: &BTreeSet<String>, tokens: &[String]) -> bool {
    match tokens {
        [one] => phrases.contains(one),
        several if several.len() <= PHRASE_WORDS_MAX => phrases.contains(&several.join(" ")),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::tokens;

    fn set(words: &[&str]) -> BTreeSet<String> {
        words.iter().map(|word| (*word).to_owned()).collect()
    }

    fn lists() -> WordLists {
        WordLists {
            verbs: set(&["open", "pick", "get", "go", "close", "turn", "shut"]),
            noun_verbs: set(&["cool"]),
            cuts: set(&["and", "then"]),
            joints: set(&["and", "then"]),
            ..WordLists::default()
        }
    }

    fn stripped(text: &str) -> String {
        let frames = Frames {
            openers: set(&["please", "could you", "can you", "ok", "next", "robot", "cool"]),
            gerunds: set(&["would you mind"]),
            closers: set(&["please", "for me", "thank you"]),
            fillers: set(&["please"]),
            going: set(&["go", "go and"]),
            unless_before: set(&["to"]),
        };
        frames.strip(tokens(text), Some(&lists()), &|_| false).tokens.join(" ")
    }

    #[test]
    fn frames_are_taken_away_and_requests_stay() {
        for (said, bare) in [
            ("could you please open the fridge for me, please?", "open the fridge"),
            ("ok robot, open the fridge. thank you", "open the fridge"),
            ("alfred, open the fridge", "open the fridge"),
            ("would you mind opening the fridge", "open the fridge"),
            ("open the fridge and can you close it", "open the fridge and close it"),
            ("go and pick up the mug", "pick up the mug"),
            ("go get the mug", "get the mug"),
            ("go close to the sink", "go close to the sink"),
            ("next to the sink", "next to the sink"),
            ("next open the fridge", "open the fridge"),
            ("cool, open the fridge", "open the fridge"),
            ("cool open the fridge", "open the fridge"),
            ("cool the apple in the fridge", "cool the apple in the fridge"),
            ("please", "please"),
            ("the mug, please", "the mug"),
        ] {
            assert_eq!(stripped(said), bare, "{said}");
        }
    }
}
