//! Which of several things of a kind the words of a clause mean.

use crate::language::{Clause, Program, Symbol, Word, WordLists};
use crate::world::{Edition, Lexicon, Pointing, Words};

/// Ordinals, from the first.
const ORDINALS: [&str; 10] =
    ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth"];
/// Another one than what was handled last.
const OTHER: [&str; 2] = ["other", "another"];
/// Words that say that a thing is where the robot is.
const HERE: [&str; 1] = ["here"];

/// What the words around the mention at `place` (0-based) say about which thing is meant.
///
/// - `types`: per mention the types that it may mean here.
/// - `program`: what the clause is read as.
pub(super) fn pointing<D: Words>(
    domain: &D,
    edition: Edition,
    lists: &WordLists,
    clause: &Clause,
    types: &[Vec<Symbol>],
    place: usize,
    program: &Program,
) -> Pointing {
    let words = &clause.lifted.words;
    let slots = (0..words.len()).filter(|&at| matches!(words[at], Word::Slot { .. }));
    let slots: Vec<usize> = slots.collect();
    let Some(&at) = slots.get(place) else { return Pointing::default() };
    let mut said: Vec<String> = modifiers(domain, lists, words, at);
    let before = said.len();
    said.extend(stated_behind(domain, words, at));
    said.extend(clause.attributes.get(place).cloned().unwrap_or_default());
    let mut found = Pointing::default();
    // "Another mug" has it as an article.
    let article = at.checked_sub(before + 1).and_then(|i| words.get(i));
    found.other = matches!(article, Some(Word::Text(word)) if OTHER.contains(&word.as_str()));
    for word in said {
        let ordinal = ORDINALS.iter().position(|known| *known == word);
        match word.as_str() {
            _ if word.bytes().all(|byte| byte.is_ascii_digit()) => {
                // A number too long to be one names nothing that there is.
                found.number = Some(word.parse().unwrap_or(u32::MAX));
            }
            _ if ordinal.is_some() => found.ordinal = ordinal.map(|place| place as u32 + 1),
            _ if numbered(&word).is_some() => found.ordinal = numbered(&word),
            "last" => found.last_of_all = true,
            "same" => found.same = true,
            other if OTHER.contains(&other) => found.other = true,
            _ => found.words.push(word),
        }
    }
    let text = |at: usize| match words.get(at) {
        Some(Word::Text(text)) => Some(text.as_str()),
        _ => None,
    };
    let is_here = |at: usize| text(at).is_some_and(|word| HERE.contains(&word));
    let described = matches!(text(at + 1), Some("that" | "which")) && text(at + 2) == Some("is");
    found.here = is_here(at + 1) || (described && is_here(at + 3));
    found.place = where_it_is(lists, domain.lexicon(edition), clause, types, place, &slots);
    // "Put the mug on the table" says where to, not which mug.
    let goal = |kind: &Symbol| program.steps.iter().any(|step| step.args.contains(kind));
    if found.place.iter().flatten().any(goal) {
        found.place = None;
    }
    found
}

/// "2nd".
fn numbered(word: &str) -> Option<u32> {
    let digits = word.trim_end_matches(char::is_alphabetic);
    let ending = &word[digits.len()..];
    let ordinal = matches!(ending, "st" | "nd" | "rd" | "th") && !digits.is_empty();
    ordinal.then(|| digits.parse().unwrap_or(u32::MAX))
}

/// "The fork THAT IS CLEAN".
fn stated_behind<D: Words>(domain: &D, words: &[Word], at: usize) -> Option<String> {
    let text = |at: usize| match words.get(at) {
        Some(Word::Text(text)) => Some(text.as_str()),
        _ => None,
    };
    let described = matches!(text(at + 1), Some("that" | "which")) && text(at + 2) == Some("is");
    let state = text(at + 3).filter(|word| described && domain.is_instance_word(word))?;
    // "That is on the table" is a place.
    (!matches!(state, "on" | "off") || text(at + 4).is_none()).then(|| state.to_owned())
}

/// The words before a slot that say a state: "the DIRTY fork".
fn modifiers<D: Words>(domain: &D, lists: &WordLists, words: &[Word], at: usize) -> Vec<String> {
    let mut found = Vec::new();
    for before in (0..at).rev() {
        let Word::Text(word) = &words[before] else { break };
        let article = before.checked_sub(1).and_then(|before| words.get(before));
        let described = matches!(article, Some(Word::Text(word)) if lists.determiners.contains(word))
            || !found.is_empty();
        let state = domain.is_instance_word(word)
            || ORDINALS.contains(&word.as_str())
            || numbered(word).is_some()
            || OTHER.contains(&word.as_str())
            || word == "same";
        if !state || !described || lists.determiners.contains(word) {
            break;
        }
        found.insert(0, word.clone());
    }
    found
}

/// The types of what a thing is said to be on, in or from, right behind its name.
fn where_it_is(
    lists: &WordLists,
    lexicon: &Lexicon,
    clause: &Clause,
    types: &[Vec<Symbol>],
    place: usize,
    slots: &[usize],
) -> Option<Vec<Symbol>> {
    const ON: [&str; 5] = ["on", "in", "inside", "from", "off"];
    const LYING: [&str; 12] = [
        "is", "lies", "stands", "sits", "lying", "standing", "sitting", "located", "placed",
        "resting", "laying", "hanging",
    ];
    let next = place + 1;
    let (from, to) = (*slots.get(place)?, *slots.get(next)?);
    let between: Vec<&str> = clause.lifted.words[from + 1..to]
        .iter()
        .filter_map(|word| match word {
            Word::Text(text) if text == "that" || text == "which" => None,
            Word::Text(text) if !lists.determiners.contains(text) => Some(text.as_str()),
            _ => None,
        })
        .collect();
    let said = match between.as_slice() {
        [preposition] => ON.contains(preposition),
        ["out" | "off" | "inside", "of"] => true,
        ["from", inside] => ON.contains(inside),
        [how, preposition] => LYING.contains(how) && ON.contains(preposition),
        _ => false,
    };
    let mention = clause.mentions.get(next).filter(|mention| said && !mention.pronoun)?;
    // "In the sink" is not on the counter that some call so.
    let usual = |kind: &&Symbol| !lexicon.rarely_means(&mention.surface, kind);
    Some(types.get(next)?.iter().filter(usual).cloned().collect())
}
