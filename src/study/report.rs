//! What every protocol takes and what every report begins with.

use std::collections::BTreeMap;

use serde::Serialize;

use super::parallel::Progress;
use super::people::People;
use crate::learning::Recipe;

/// What a protocol is run with.
#[derive(Clone, Copy)]
pub struct Setting<'a> {
    pub recipe: &'a Recipe,
    /// Each draws its own rows and scenes and trains with its own training seed.
    pub seeds: &'a [u64],
    /// Rows of each seed, or episodes; all rows, or [`super::lessons::EPISODES`], without it.
    pub limit: Option<usize>,
    pub people: People,
    pub threads: usize,
    pub progress: &'a dyn Progress,
    /// Sentences of the teacher that an episode teaches.
    pub lessons: usize,
    /// Failures kept of each kind.
    pub failures: usize,
}

/// What every report begins with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Base {
    pub protocol: String,
    pub recipe: String,
    /// The first digits of the recipe's digest.
    pub recipe_digest: String,
    pub people: String,
    pub seeds: Vec<u64>,
    /// Rows left out because what they mean cannot be done in any scene that could be set.
    pub unstaged: Unstaged,
}

/// Rows left out, by reason.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Unstaged {
    pub n: usize,
    pub reasons: BTreeMap<String, usize>,
}

impl Unstaged {
    pub fn add(&mut self, reason: String) {
        self.n += 1;
        *self.reasons.entry(reason).or_default() += 1;
    }
}

impl Base {
    pub fn new(protocol: &str, setting: &Setting<'_>) -> Base {
        Base {
            protocol: protocol.to_owned(),
            recipe: setting.recipe.name().to_owned(),
            recipe_digest: setting.recipe.digest().short(),
            people: setting.people.to_string(),
            seeds: setting.seeds.to_vec(),
            unstaged: Unstaged::default(),
        }
    }
}
