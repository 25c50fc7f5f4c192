//! What a sentence says that its speaker carried: nobody recorded it.

use apprentice::language::Symbol;
use apprentice::world::Lexicon;
use apprentice::world::household::Kind;

use super::corpus::Row;
use super::renaming::{NAME_WORDS_MAX, singular};
use super::score;

/// Verbs that bring their object along.
const VERBS: [&str; 20] = [
    "bring",
    "brings",
    "bringing",
    "brought",
    "take",
    "takes",
    "taking",
    "carry",
    "carries",
    "carrying",
    "move",
    "moves",
    "moving",
    "return",
    "returns",
    "returning",
    "deliver",
    "delivers",
    "delivering",
    "carried",
];
/// Where a verb's object ends, or was never meant to begin.
const ENDS: [&str; 21] = [
    "to", "into", "in", "on", "onto", "toward", "towards", "from", "at", "by", "with", "and",
    "then", "near", "beside", "until", "of", "for", ",", ".", ";",
];
/// Words that may stand before the name of an object: "back the other clean".
const BEFORE_MAX: usize = 4;

/// What was in the hand of somebody who asked for a walk with these words: "bring the mug to the
/// sink", or "take it to the sink" after the mug was picked up. None for other requests, and where
/// the object is no thing that can be carried, or the place to go to.
pub fn carried(lexicon: &Lexicon, row: &Row) -> Option<Kind> {
    if !score::core(&row.program).is_some_and(score::walks) {
        return None;
    }
    let tokens = row.sentence.tokens();
    let after = |(at, token): (usize, &String)| VERBS.contains(&token.as_str()).then_some(at + 1);
    let mut objects = tokens.iter().enumerate().filter_map(after);
    objects.find_map(|from| object(lexicon, row, &tokens[from..]))
}

/// The object at the start of what follows a verb.
fn object(lexicon: &Lexicon, row: &Row, words: &[String]) -> Option<Kind> {
    let goes_to = |kind: &Symbol| {
        row.program.steps.iter().any(|step| step.args.iter().any(|arg| arg == kind))
    };
    for (at, word) in words.iter().enumerate().take(BEFORE_MAX + 1) {
        if ENDS.contains(&word.as_str()) {
            return None;
        }
        let carriable = |symbol: &Symbol| Kind::named(symbol.as_str()).filter(|k| k.pickupable());
        if word == "it" {
            return row.hand.as_ref().filter(|kind| !goes_to(kind)).and_then(carriable);
        }
        let longest = NAME_WORDS_MAX.min(words.len() - at);
        let names = (1..=longest).rev().find_map(|count| singular(lexicon, &words[at..at + count]));
        let Some(meanings) = names.map(|name| &lexicon.names[&name]) else { continue };
        if meanings.iter().any(|meaning| goes_to(&meaning.kind)) {
            return None;
        }
        // What the recording had in the hand, where the name may mean it; else what is here.
        let recorded = meanings.iter().find(|meaning| row.hand.as_ref() == Some(&meaning.kind));
        let here = meanings
            .iter()
            .filter(|meaning| row.room.kinds().any(|kind| *kind.symbol() == meaning.kind));
        return recorded.into_iter().chain(here).find_map(|meaning| carriable(&meaning.kind));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use apprentice::world::Words;
    use apprentice::world::household::{Household, Room};

    #[test]
    fn the_object_of_a_verb_that_brings_was_in_the_hand() {
        let household = Household::new();
        let check = |sentence: &str, program: &str, hand: Option<&str>, expected: Option<&str>| {
            let hand = hand.map(Symbol::new);
            let row = Row { hand, ..Row::about(Room::Kitchen, sentence, program) };
            let found = carried(household.lexicon(apprentice::world::Edition::First), &row);
            assert_eq!(found.map(Kind::name), expected, "{sentence}");
        };
        check("Bring the mug to the sink.", "GOTO SinkBasin", None, Some("Mug"));
        check("turn around and carry the dirty mug over there", "GOTO Fridge", None, Some("Mug"));
        check("take it to the fridge", "GOTO Fridge", Some("Apple"), Some("Apple"));
        check("take it to the fridge", "GOTO Fridge", None, None);
        check("move to the fridge where the apple is", "GOTO Fridge", None, None);
        check("return to the mug", "GOTO Mug", None, None);
        check("take the mug", "GOTO Mug", None, None);
        check("take a left to the fridge", "GOTO Fridge", Some("Apple"), None);
        check("bring the mug to the sink", "PUT Mug SinkBasin", None, None);
        check("go to the sink", "GOTO SinkBasin", Some("Mug"), None);
    }
}
