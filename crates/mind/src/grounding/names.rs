use crate::language::Mention;
use crate::world::{Lexicon, Meaning, NameSummary};

/// Letters that a name must have before a slip in it is forgiven: shorter ones are one slip from
/// too many other words.
const FORGIVEN_LETTERS_MIN: usize = 5;

/// Finds the lexicon's names in a run of words.
#[derive(Debug)]
pub(crate) struct Names<'a> {
    lexicon: &'a Lexicon,
    summary: &'a NameSummary,
}

impl<'a> Names<'a> {
    /// The names of this lexicon.
    pub(crate) fn new(lexicon: &'a Lexicon) -> Names<'a> {
        Names { lexicon, summary: lexicon.summary() }
    }

    /// The longest name or pronoun that `words` starts with, and how many words it takes.
    pub(crate) fn starting(&self, words: &[&str]) -> Option<(usize, Mention)> {
        let first = words.first()?;
        for count in (1..=self.summary.longest.min(words.len())).rev() {
            let window = &words[..count];
            if let Some(mention) = self.named(window) {
                return Some((count, mention));
            }
        }
        let pronoun = self.lexicon.pronouns.iter().any(|pronoun| pronoun == first);
        pronoun.then(|| (1, self.pronoun(first)))
    }

    /// Like [`Names::starting`] for words that contain a slip of the finger.
    ///
    /// - `known`: whether a word is in ordinary use; such a word is never a misspelt name, or
    ///   "place" would turn into a plate.
    pub(super) fn misspelt(
        &self,
        words: &[&str],
        known: &dyn Fn(&str) -> bool,
    ) -> Option<(usize, Mention)> {
        // A slip may also swallow a blank: "coffeemug" is one word of a two-word name.
        for count in (1..=self.summary.longest.min(words.len())).rev() {
            let window = &words[..count];
            if window.iter().all(|word| known(word)) {
                continue;
            }
            let said = window.join(" ");
            let near = self.lexicon.names.iter().filter(|(name, meanings)| {
                name.len() >= FORGIVEN_LETTERS_MIN
                    && !meanings.is_empty()
                    && one_slip_apart(&said, name)
            });
            // The commonest of the near names; the first in the alphabet among equals.
            let uses = |meanings: &[Meaning]| meanings.iter().map(|m| m.count).max();
            let best = near.rev().max_by_key(|(_, meanings)| uses(meanings));
            if let Some((name, meanings)) = best {
                return Some((count, mention(name, meanings, false)));
            }
        }
        None
    }

    fn named(&self, window: &[&str]) -> Option<Mention> {
        let (last, before) = window.split_last()?;
        let phrase = |last: &str| {
            let mut phrase = String::new();
            for word in before {
                phrase.push_str(word);
                phrase.push(' ');
            }
            phrase + last
        };
        let find = |name: String, plural: bool| {
            let meanings = self.lexicon.names.get(&name).filter(|meanings| !meanings.is_empty())?;
            Some(mention(&name, meanings, plural))
        };
        let irregular = || self.lexicon.plurals.get(*last).map(String::as_str);
        find(phrase(last), false)
            .or_else(|| find(phrase(irregular()?), true))
            .or_else(|| singulars(last).find_map(|singular| find(phrase(&singular), true)))
    }

    fn pronoun(&self, word: &str) -> Mention {
        Mention {
            surface: word.to_owned(),
            sort: self.summary.sort.clone(),
            types: Vec::new(),
            pronoun: true,
            plural: word == "them" || word == "they",
        }
    }
}

fn mention(name: &str, meanings: &[Meaning], plural: bool) -> Mention {
    // A name with meanings of several sorts is one of the likeliest sort: a slot has one sort.
    let sort = meanings[0].sort.clone();
    let same_sort = meanings.iter().filter(|meaning| meaning.sort == sort);
    Mention {
        surface: name.to_owned(),
        types: same_sort.map(|meaning| meaning.kind.clone()).collect(),
        sort,
        pronoun: false,
        plural,
    }
}

/// What a regular plural may be the plural of. Only those that are names count, so guessing wide
/// does no harm.
fn singulars(word: &str) -> impl Iterator<Item = String> {
    let y = word.strip_suffix("ies").map(|stem| format!("{stem}y"));
    let es = word.strip_suffix("es").map(str::to_owned);
    let s = word.strip_suffix('s').filter(|stem| !stem.ends_with('s')).map(str::to_owned);
    [s, es, y].into_iter().flatten().filter(|stem| stem.len() >= 2)
}

/// Whether two different words become equal by one insertion, deletion, change or swap of
/// neighbours.
pub(super) fn one_slip_apart(a: &str, b: &str) -> bool {
    if a.len().abs_diff(b.len()) > 4 {
        return false;
    }
    if a.is_ascii() && b.is_ascii() {
        return one_apart(a.as_bytes(), b.as_bytes());
    }
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    one_apart(&a, &b)
}

fn one_apart<L: PartialEq>(a: &[L], b: &[L]) -> bool {
    let (short, long) = if a.len() <= b.len() { (a, b) } else { (b, a) };
    if long.len() - short.len() > 1 {
        return false;
    }
    let Some(at) = short.iter().zip(long).position(|(x, y)| x != y) else {
        return long.len() == short.len() + 1;
    };
    if short.len() + 1 == long.len() {
        return short[at..] == long[at + 1..];
    }
    let changed = short[at + 1..] == long[at + 1..];
    let swapped = at + 1 < short.len()
        && short[at] == long[at + 1]
        && short[at + 1] == long[at]
        && short[at + 2..] == long[at + 2..];
    changed || swapped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slip_is_an_insertion_a_deletion_a_change_or_a_swap() {
        for said in ["tomat", "tommato", "tomado", "tomaot", "xtomato", "tomatoo"] {
            assert!(one_slip_apart(said, "tomato"), "{said}");
        }
        for said in ["tomato", "toma", "otmaot", "potaro", ""] {
            assert!(!one_slip_apart(said, "tomato"), "{said}");
        }
    }
}
