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
    /// Swallow the lexicon's adjectives before a name: "the red mug" lifts as "the mug" does.
    pub adjectives: bool,
    /// Of two names side by side keep the last: "the desk lamp table".
    pub compounds: bool,
    /// Also try the utterance without `from the <obj>`: where a thing is, is often no argument.
    pub locations: bool,
    /// Keep the word of a typed fixture beside its slot: `<obj=sink>`.
    pub fixtures: bool,
    /// Read a word of five letters or more that is in no table as the name one slip away from it.
    pub spelling: bool,
    pub split: Split,
    /// Words by what they do in a clause. With them a name that is a verb too ("microwave") is read
    /// as a verb where an object follows, and "a slice of the apple" as the apple.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lists: Option<WordLists>,
    /// What people put around a request, taken away before anything is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<Frames>,
    /// Words by which a question, a statement or a prohibition is known; none is carried out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moods: Option<Moods>,
    /// Other words for what the seeds say.
    #[serde(default, skip_serializing_if = "Verbs::is_empty")]
    pub verbs: Verbs,
    /// Read a letter and its accent as one, however they were typed (Unicode NFC).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub composed: bool,
    /// A number behind a name says which: "mug 2".
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
    /// When a step fails only for want of another that the world itself names (going there
    /// first), do that one before it.
    pub approach: bool,
    /// Decline several primitives in one utterance that only make sense as a means to something
    /// that nobody named: put something somewhere and then turn something on.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub purposes: bool,
    /// Every word of a reading is accounted for, or nothing is done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accounting: Option<Accounting>,
    /// Taking something somewhere is never a walk without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub carrying: Option<Carrying>,
    /// Another kind of thing that shares the name is never taken for one that is here and cannot be
    /// used.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub kinds: bool,
    /// Steps of a lesson whose effect holds already are passed over.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub effects: bool,
    /// Words choose between things of one kind.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub instances: bool,
}

/// What may be passed over when words are accounted for. Data of a recipe.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Accounting {
    /// Nouns that name no thing of their own: "the DOOR of the fridge", "the other SIDE".
    pub harmless: BTreeSet<String>,
    /// The same where something is put or is, and not where the thing itself stands: "on the LID of
    /// the toilet", "on the top SHELF" of a fridge that was just opened.
    pub parts: BTreeSet<String>,
    /// Words that ask more of a thing than to be switched: "turn the lamp UP", "RED".
    pub degrees: BTreeSet<String>,
    /// Verbs of looking, which ask for more than going there where a light is named: "LOOK at the
    /// book in the light".
    pub looking: BTreeSet<String>,
    /// What stands before the light then: "BY the lamp".
    pub lighting: BTreeSet<String>,
    /// Words of what is to come of a thing, set by set: a lesson whose words say one ("a warm mug") is
    /// not for a request that says another ("a cold bowl").
    pub states: Vec<BTreeSet<String>>,
}

/// Verbs that take a thing along.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Carrying {
    /// They leave it there: "bring".
    pub leaving: BTreeSet<String>,
    /// They may end with it in the hand: "carry".
    pub keeping: BTreeSet<String>,
}
