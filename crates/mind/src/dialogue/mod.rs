//! What is said beside requests: answers to the robot's questions, "that was wrong", and questions
//! about the scene and about what was taught. Nothing here moves the robot by itself.

mod intent;
mod questions;
mod replies;

pub use intent::{About, Intent};
pub use questions::{Known, answer, in_words};

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

/// Which parts of a conversation a recipe has, and the words they are known by. All words are in
/// lower case, without marks; entries may have several words.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dialogue {
    /// Ask which is meant where a name fits things of several types here, unless recorded people meant
    /// the nearest one in at least so many of 100 uses; 0 never asks.
    pub which_below: u32,
    /// Answer questions about the scene, the last act and the lessons.
    pub questions: bool,
    /// Whole utterances that accept what a question offers: "yes".
    pub yes: BTreeSet<String>,
    /// Whole utterances that refuse everything that a question offers: "no".
    pub no: BTreeSet<String>,
    /// Whole utterances that say that the last act was wrong: "that was wrong". A word that is in
    /// `no` too refuses while a question is open.
    pub wrong: BTreeSet<String>,
}
