//! The pure function from a recipe and an ordered list of lessons to a mind.

mod lesson;
mod mind;
mod recipe;

pub use lesson::Lesson;
pub use mind::{Clash, Mind, lift, train};
pub use recipe::{Recipe, RecipeError, Report, TrainError};
