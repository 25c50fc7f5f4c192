//! What every protocol takes and what every report begins with.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use apprentice::learning::Recipe;
use apprentice::parallel::Progress;
use serde::Serialize;

use super::people::People;
use super::scenes::Staging;

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
    /// Sentences that an episode teaches.
    pub lessons: usize,
    pub teachers: Teachers,
    pub staging: Staging,
    /// Failures kept of each kind, with their sentences.
    pub failures: usize,
    /// Failures drawn of each verdict, without their sentences.
    pub cases: usize,
}

/// Whose sentences an episode teaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Teachers {
    /// All are one person's.
    #[default]
    One,
    /// Each is another person's.
    Several,
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
    /// How scenes were staged; none for plain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub staging: Option<String>,
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

impl fmt::Display for Teachers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Teachers::One => "one",
            Teachers::Several => "several",
        })
    }
}

impl FromStr for Teachers {
    type Err = String;
    fn from_str(text: &str) -> Result<Teachers, String> {
        match text {
            "one" => Ok(Teachers::One),
            "several" => Ok(Teachers::Several),
            other => Err(format!("{other:?} is neither one nor several")),
        }
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
            staging: (setting.staging != Staging::Plain).then(|| setting.staging.to_string()),
            unstaged: Unstaged::default(),
        }
    }
}
