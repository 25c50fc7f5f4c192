//! Checks that a reading uses every word that asks for something. A reading with unused words is
//! not taken, and the answer names them.

use super::settings::Accounting;
use crate::language::{Clause, Grammar, LiftedUtterance, Roles, Symbol, Word, WordLists};

/// A clause, and what is needed to account for its words.
pub(super) struct Account<'a> {
    /// The recipe's lists.
    pub lists: &'a WordLists,
    /// The lexicon's.
    pub adjectives: &'a [String],
    /// Of the world's operators.
    pub roles: &'a Roles,
    /// What needs no use.
    pub accounting: &'a Accounting,
    /// The words.
    pub clause: &'a Clause,
}

/// Words of time between clauses.
const ORDER: [&str; 3] = ["before", "after", "while"];

/// Words before a tool.
pub(super) const TOOLS: [&str; 2] = ["with", "using"];

/// What the words name.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Head<'a> {
    /// A known thing.
    Known,
    /// A noun that names nothing known.
    Unknown(&'a str),
    /// Nothing.
    Nothing,
}

impl<'a> Account<'a> {
    /// The words that a reading as one primitive has no use for: an unknown thing or place, and
    /// degrees of a thing that is only switched.
    ///
    /// Only words at the object, at the place of a way or of a putting, and after a joining word
    /// count. Landmarks do not count: half of those that people named in the recordings have no
    /// name here.
    pub(super) fn of_primitive(&self, operator: &Symbol) -> Vec<String> {
        let mut left = Vec::new();
        left.extend(match self.roles.goes(operator) {
            true => self.unknown_way(),
            false => self.unknown_object(),
        });
        if self.roles.puts(operator) {
            left.extend(self.unknown_place());
        }
        left.extend(self.numbers());
        if self.roles.is_door(operator) {
            left.extend(self.unknown_tool());
        }
        if self.roles.works(operator) {
            left.extend(self.towards());
            left.extend(self.degrees());
        }
        left.extend(self.unknown_joined());
        owned(left)
    }

    /// The words that a lesson has no use for: an unknown thing that the lesson did not name
    /// either.
    pub(super) fn of_lesson(&self, taught: &LiftedUtterance) -> Vec<String> {
        let in_lesson = |word: &&str| {
            taught.words.iter().any(|known| matches!(known, Word::Text(text) if text == word))
        };
        let left = self.unknown_object().into_iter().chain(self.unknown_joined());
        let left = left.chain(self.unknown_tool());
        let left = left.chain(self.numbers()).filter(|word| !in_lesson(word));
        owned(left.chain(self.other_state(taught)))
    }

    /// "A cold bowl", after a lesson about "a warm mug".
    fn other_state(&self, taught: &LiftedUtterance) -> Option<&'a str> {
        let state = |word: &str| self.accounting.states.iter().position(|set| set.contains(word));
        let in_lesson = taught.words.iter().filter_map(|word| match word {
            Word::Text(text) => state(text),
            Word::Slot { .. } => None,
        });
        let in_lesson: Vec<usize> = in_lesson.collect();
        let mut said = self.texts().filter_map(|(_, word)| Some((state(word)?, word))).peekable();
        let (_, first) = *said.peek()?;
        let other = !in_lesson.is_empty() && said.all(|(state, _)| !in_lesson.contains(&state));
        other.then_some(first)
    }

    /// The words that a clause without a step has no use for: a way to an unknown thing.
    pub(super) fn of_idle(&self) -> Vec<String> {
        let ways = self.texts().filter(|(_, word)| self.lists.destination.contains(*word));
        let unknown = ways.filter_map(|(at, _)| self.unknown_at(at + 1, false));
        owned(unknown)
    }

    /// "2 apples", "20 %": no step has a number.
    fn numbers(&self) -> Option<&'a str> {
        // "For 2 seconds" is a duration, which the parser judges.
        let lasts = |at: usize| match self.words().get(at + 1) {
            Some(Word::Text(next)) => self.lists.lasting.contains(next),
            _ => false,
        };
        let number = |(at, word): &(usize, &str)| {
            word.bytes().all(|byte| byte.is_ascii_digit()) && !lasts(*at)
        };
        self.texts().find(number).map(|(_, word)| word)
    }

    /// "Open the fridge with the hammer", "wash it with the zork".
    fn unknown_tool(&self) -> Option<&'a str> {
        let with = self.texts().find(|(_, word)| TOOLS.contains(word))?;
        self.unknown_at(with.0 + 1, false)
    }

    /// "Turn the lamp to the left": a thing that is only switched goes nowhere. "Next to the cup"
    /// and "to the left of the cup" say where it is.
    fn towards(&self) -> Option<&'a str> {
        let text = |at: usize| match self.words().get(at) {
            Some(Word::Text(word)) => Some(word.as_str()),
            _ => None,
        };
        let aside = |word: &str| {
            self.lists.stop.contains(word)
                || self.lists.determiners.contains(word)
                || self.accounting.harmless.contains(word)
        };
        let near = |at: usize| {
            let of = (at + 1..self.words().len())
                .find(|&at| !text(at).is_some_and(|w| aside(w) && w != "of"));
            at.checked_sub(1).and_then(text).is_some_and(aside) || of.and_then(text) == Some("of")
        };
        let to = |(at, word): &(usize, &str)| self.lists.destination.contains(*word) && !near(*at);
        self.texts().find(to).map(|(_, word)| word)
    }

    /// "Turn the lamp up", "red": at the end of the clause or before a function word.
    fn degrees(&self) -> Option<&'a str> {
        let ends = |at: usize| match self.words().get(at + 1) {
            None => true,
            Some(Word::Text(next)) => self.lists.stop.contains(next),
            Some(Word::Slot { .. }) => {
                self.grammar().main_verb(self.words()).is_some_and(|verb| verb.at + 1 == at)
            }
        };
        let degree =
            |(at, word): &(usize, &str)| self.accounting.degrees.contains(*word) && ends(*at);
        self.texts().find(degree).map(|(_, word)| word)
    }

    fn words(&self) -> &'a [Word] {
        &self.clause.lifted.words
    }

    fn texts(&self) -> impl Iterator<Item = (usize, &'a str)> {
        self.words().iter().enumerate().filter_map(|(at, word)| match word {
            Word::Text(text) => Some((at, text.as_str())),
            Word::Slot { .. } => None,
        })
    }

    fn grammar(&self) -> Grammar<'a> {
        Grammar { lists: self.lists, adjectives: self.adjectives }
    }

    /// After the verb and its particles.
    fn object_at(&self) -> usize {
        let after = self.grammar().main_verb(self.words()).map_or(0, |verb| verb.at + 1);
        let passed = |word: &&Word| match word {
            Word::Text(text) => {
                self.lists.passed.contains(text)
                    || self.lists.verb_particles.contains(text)
                    || self.lists.adverbs.contains(text)
            }
            Word::Slot { .. } => false,
        };
        after + self.words()[after..].iter().take_while(passed).count()
    }

    fn unknown_object(&self) -> Option<&'a str> {
        self.unknown_at(self.object_at(), true)
    }

    /// For a way, after the first word of direction; for "face the …", the object.
    fn unknown_way(&self) -> Option<&'a str> {
        let verb = self.grammar().main_verb(self.words()).map_or(0, |verb| verb.at);
        let mut ways = self.texts().filter(|(at, word)| {
            *at > verb && (self.lists.toward.contains(*word) || *word == "on" || *word == "in")
        });
        let from = ways.next().map_or_else(|| self.object_at(), |(at, _)| at + 1);
        self.unknown_at(from, false)
    }

    /// For a putting, after the first preposition before a thing.
    fn unknown_place(&self) -> Option<&'a str> {
        let onto = |word: &str| self.lists.onto.contains(word) || self.lists.inside.contains(word);
        // "To the left of the drain" is a landmark, not the place.
        let aside = |at: usize| {
            let mut after = self.words()[at + 1..].iter();
            let next = after.find(|word| match word {
                Word::Text(text) => !self.lists.determiners.contains(text),
                Word::Slot { .. } => true,
            });
            matches!(next, Some(Word::Text(text)) if self.lists.stop.contains(text)
                || self.accounting.harmless.contains(text))
        };
        let places = self.texts().filter(|(at, word)| {
            onto(word) && !(self.lists.destination.contains(*word) && aside(*at))
        });
        places.map(|(at, _)| self.head(at + 1, false)).find_map(|head| match head {
            Head::Nothing => None,
            Head::Known => Some(None),
            Head::Unknown(word) => Some(Some(word)),
        })?
    }

    /// "The mug and the banana", "and sing": after a joining word.
    fn unknown_joined(&self) -> Option<&'a str> {
        let verb = self.grammar().main_verb(self.words()).map(|verb| verb.at);
        // "Before opening it" and "after a moment" say when, and ask for no step.
        let joins = |word: &str| self.lists.cuts.contains(word) && !ORDER.contains(&word);
        let mut joined = self.texts().filter(|(_, word)| joins(word));
        joined.find_map(|(at, word)| match (self.head(at + 1, false), self.words().get(at + 1)) {
            (Head::Unknown(word), _) => Some(word),
            (_, Some(Word::Text(next))) if self.is_content(next) => Some(next.as_str()),
            // "Go and the mug".
            (Head::Known, next) if verb.is_some_and(|verb| verb + 1 == at) => match next {
                Some(Word::Text(next)) if !self.lists.determiners.contains(next) => None,
                _ => Some(word),
            },
            _ => None,
        })
    }

    /// Whether a word is not a function word.
    fn is_content(&self, word: &str) -> bool {
        let lists = self.lists;
        !lists.stop.contains(word)
            && !lists.silent.contains(word)
            && !lists.determiners.contains(word)
            && !lists.adverbs.contains(word)
            && !lists.particles.contains(word)
            && !lists.joints.contains(word)
            && !lists.purposes.contains(word)
            && !lists.verbs.contains(&lists.base(word))
            && !lists.noun_verbs.contains(word)
            && !self.accounting.harmless.contains(word)
            && !self.grammar().is_adjective(word)
    }

    /// The noun at `at` that names nothing known, if there is one.
    fn unknown_at(&self, at: usize, object: bool) -> Option<&'a str> {
        match self.head(at, object) {
            Head::Unknown(word) => Some(word),
            Head::Known | Head::Nothing => None,
        }
    }

    /// What the words from `at` on name: the last noun before a word of another sort.
    ///
    /// - `object`: whether this is the object. A part of an object is another thing.
    fn head(&self, mut at: usize, object: bool) -> Head<'a> {
        let part = |text: &String| !object && self.accounting.parts.contains(text);
        let words = self.words();
        let mut unknown = None;
        let mut determined = false;
        while let Some(word) = words.get(at) {
            match word {
                Word::Slot { .. } => {
                    // "The apple pie" is not an apple.
                    return match words.get(at + 1) {
                        Some(Word::Text(next)) if self.is_noun(next, false) && !part(next) => {
                            Head::Unknown(next)
                        }
                        _ => Head::Known,
                    };
                }
                Word::Text(text) if self.lists.determiners.contains(text) => determined = true,
                // "The hammer near the fridge".
                Word::Text(text) if unknown.is_some() && self.lists.stop.contains(text) => break,
                Word::Text(text) if self.grammar().is_adjective(text) => {}
                // "The open space".
                Word::Text(text)
                    if determined && (self.accounting.harmless.contains(text) || part(text)) =>
                {
                    unknown = None;
                }
                Word::Text(text) if self.is_noun(text, determined) => unknown = Some(text.as_str()),
                // "The left side of the fridge", "the door of the fridge".
                Word::Text(text) if text == "of" && unknown.is_none() => {}
                Word::Text(_) if unknown.is_none() && self.leads_to_of(at) => {}
                Word::Text(_) => break,
            }
            at += 1;
        }
        unknown.map_or(Head::Nothing, Head::Unknown)
    }

    /// Whether there is a harmless noun at `at`, and then "of".
    fn leads_to_of(&self, at: usize) -> bool {
        let text = |at: usize| match self.words().get(at) {
            Some(Word::Text(text)) => Some(text.as_str()),
            _ => None,
        };
        let harmless =
            |word: &str| self.accounting.harmless.contains(word) || self.lists.stop.contains(word);
        text(at).is_some_and(harmless)
            && (text(at + 1) == Some("of")
                || (text(at + 1).is_some_and(harmless) && text(at + 2) == Some("of")))
    }

    /// Whether a word may be the name of a thing.
    ///
    /// - `determined`: whether an article is before it: "the drink" is a noun.
    fn is_noun(&self, word: &str, determined: bool) -> bool {
        let lists = self.lists;
        let aside = lists.stop.contains(word)
            || lists.silent.contains(word)
            || lists.adverbs.contains(word)
            || lists.particles.contains(word)
            || lists.joints.contains(word)
            || lists.determiners.contains(word)
            || lists.landmarks.contains(word)
            || lists.toward.contains(word)
            || lists.leaving.contains(word)
            || lists.lasting.contains(word)
            || lists.is_portion(word)
            || self.accounting.harmless.contains(word)
            || self.grammar().is_adjective(word)
            || !word.chars().all(char::is_alphabetic);
        let acts = word.ends_with("ing")
            || word.ends_with("ed")
            || lists.verbs.contains(word)
            || lists.noun_verbs.contains(word);
        !aside && (determined || !acts)
    }
}

fn owned<'w>(words: impl IntoIterator<Item = &'w str>) -> Vec<String> {
    let mut left: Vec<String> = Vec::new();
    for word in words {
        if left.iter().all(|known| known != word) {
            left.push(word.to_owned());
        }
    }
    left
}
