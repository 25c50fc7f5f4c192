use std::collections::BTreeMap;

use crate::ids::Digest;

/// Settings only, with a digest.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {}

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the recipe has an error at line {line}, column {column}: {reason}")]
pub struct RecipeError {
    pub line: usize,
    pub column: usize,
    pub reason: String,
}

impl Recipe {
    /// The names of the recipes that ship.
    pub const BUILTIN: [&'static str; 2] = ["default", "paper"];
    /// The TOML text of a recipe that ships.
    pub fn builtin(_name: &str) -> Option<&'static str> {
        unimplemented!()
    }
    pub fn parse(_toml: &str) -> Result<Recipe, RecipeError> {
        unimplemented!()
    }
    pub fn name(&self) -> &str {
        unimplemented!()
    }
    pub fn digest(&self) -> Digest {
        unimplemented!()
    }
}

/// What a training measured about itself.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    pub exemplars: u32,
    pub threshold: f32,
    pub figures: BTreeMap<String, f64>,
}

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TrainError {
    #[error("training failed: {reason}")]
    Failed { reason: String },
}
