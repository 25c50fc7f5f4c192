use serde::{Deserialize, Serialize};

use crate::language::WordLists;

/// How an utterance becomes lifted clauses. Everything is off in the recipe `paper`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
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
}

/// Where an utterance may be cut into clauses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// At "and" (paper, section 3.1.1).
    And,
    /// Also at "then", comma, full stop and semicolon: a quarter of the recorded compound
    /// sentences have no "and".
    Clauses,
    /// At marks and joining words, but only where a verb follows; needs the lists.
    Verbs,
}

/// How programs meet the scene. Everything is off in the recipe `paper`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
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
}
