use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::frames::Frames;
use super::mood::Moods;
use super::verbs::Verbs;
use crate::language::WordLists;

/// How an utterance becomes lifted clauses. Everything is off in the recipe `paper`.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Abstraction {
    /// Drop the lexicon's adjectives before a name: "the red mug" is lifted as "the mug".
    pub adjectives: bool,
    /// Of names in a row, keep the last one: "the desk lamp table".
    pub compounds: bool,
    /// Also try the utterance without `from the <obj>`, because the place of a thing is often not
    /// an argument.
    pub locations: bool,
    /// Keep the word of a typed fixture beside its slot: `<obj=sink>`.
    pub fixtures: bool,
    /// Read a word of five letters or more that is in no table as the name that differs from it by
    /// one letter.
    pub spelling: bool,
    /// Where an utterance is cut.
    pub split: Split,
    /// Words by what they do in a clause. With them a name that is a verb too ("microwave") is read
    /// as a verb where an object follows, and "a slice of the apple" as the apple.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lists: Option<WordLists>,
    /// Phrases around a request, which are removed before anything is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<Frames>,
    /// The words that mark a question, a statement or a prohibition. These are never carried out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moods: Option<Moods>,
    /// Other words for what the seeds say.
    #[serde(default, skip_serializing_if = "Verbs::is_empty")]
    pub verbs: Verbs,
    /// Compose letters and accents before reading (Unicode NFC).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub composed: bool,
    /// A number after a name says which thing: "mug 2".
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub numbers: bool,
}

/// Where an utterance may be cut into clauses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// At "and" (paper, section 3.1.1).
    #[default]
    And,
    /// Also at "then", comma, full stop and semicolon: a quarter of the recorded compound
    /// sentences have no "and".
    Clauses,
    /// At marks and joining words, but only where a verb follows; needs the lists.
    Verbs,
}

/// How programs meet the scene. Everything is off in the recipe `paper`.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Execution {
    /// "turn off" what is off is impossible, with that reason.
    pub polarity: bool,
    /// When a step fails because one other step is missing, and the world names that step (going
    /// there first), carry the other one out before it.
    pub approach: bool,
    /// Decline several primitives in one utterance that only make sense for a purpose that was not
    /// named: put something somewhere, then turn something on.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub purposes: bool,
    /// Do nothing unless the reading has a use for every word.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accounting: Option<Accounting>,
    /// Verbs of carrying take the thing along, and do not only walk.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub carrying: Option<Carrying>,
    /// When the thing of the likeliest kind is here but cannot be used, do not take another kind
    /// with the same name.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub kinds: bool,
    /// Skip steps of a lesson whose effect holds already.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub effects: bool,
    /// Words choose between things of one kind.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub instances: bool,
}

/// Words with a fixed part in the accounting of words. Data of a recipe.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Accounting {
    /// Nouns that need no use, because they name no thing of their own: "the DOOR of the fridge",
    /// "the other SIDE".
    pub harmless: BTreeSet<String>,
    /// Such nouns that need no use in a phrase of place only: "on the LID of the toilet", "on the
    /// top SHELF" of a fridge that was just opened.
    pub parts: BTreeSet<String>,
    /// Words that ask for more than switching: "turn the lamp UP", "RED".
    pub degrees: BTreeSet<String>,
    /// Verbs of looking. With a light they ask for more than going there: "LOOK at the book in the
    /// light".
    pub looking: BTreeSet<String>,
    /// Words before that light: "BY the lamp".
    pub lighting: BTreeSet<String>,
    /// Words for the state that a thing is to have, in sets that exclude each other. A lesson with
    /// a word of one set ("a warm mug") does not answer a request with a word of another ("a cold
    /// bowl").
    pub states: Vec<BTreeSet<String>>,
}

/// Verbs that carry a thing.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Carrying {
    /// Verbs that leave it at the place: "bring".
    pub leaving: BTreeSet<String>,
    /// Verbs that may end with it in the hand: "carry".
    pub keeping: BTreeSet<String>,
}
