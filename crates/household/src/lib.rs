//! A household: four kinds of rooms, a hundred kinds of things, and a robot with one hand.
//!
//! Everything that is true of a household stands in `data/` as readable tables, embedded
//! in the binary; this room turns them into a world. Washing, heating and cooling are no commands:
//! they follow from where a thing is when a faucet runs, a microwave runs or a fridge is closed.

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
