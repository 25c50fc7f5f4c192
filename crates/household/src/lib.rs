//! A household: four kinds of rooms, a hundred kinds of things, and a robot with one hand.
//!
//! The facts of a household are readable tables in `data/`, embedded in the binary; this crate
//! turns them into a world. There are no primitives for washing, heating and cooling: a thing
//! becomes clean, hot or cold when it is in the right place while a faucet runs, a microwave runs
//! or a fridge is closed.

use apprentice_core::{ids, language, limits, world};

mod bound;
mod builder;
mod domain_impl;
mod effects;
mod facts;
mod features;
mod generate;
mod matching;
mod planner;
mod pointing;
mod polarity;
mod primitives;
mod random;
mod refusal;
mod scene;
mod scene_file;
mod scene_text;
mod state_words;
mod task;
mod task_goal;
pub mod told;
mod view;
mod words;

#[cfg(test)]
mod tests;

pub use builder::{BuildError, ObjectId, SceneBuilder};
pub use domain_impl::Household;
pub use facts::{Kind, Room};
pub use matching::MatchingScene;
pub use scene::Scene;
pub use task::Task;
