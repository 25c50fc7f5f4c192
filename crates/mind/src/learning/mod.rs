//! The pure function from a recipe and an ordered list of lessons to a mind.

mod bundle;
mod code;
mod error;
mod history;
mod lesson;
mod lift;
mod mind;
mod parsing;
/// Recipes: the settings of minds, and their files.
pub mod recipe;
#[cfg(test)]
mod tests;
mod train;

pub use crate::language::Report;
pub use code::{code_digest, mind_schema, pinned};
pub use error::TrainError;
pub use lesson::Lesson;
pub use lift::lift;
pub use mind::Mind;
pub use recipe::{Recipe, RecipeError};
pub use train::train;
