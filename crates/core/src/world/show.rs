use serde::{Deserialize, Serialize};

use super::World;
use crate::language::{Step, Symbol};

/// What people read and see of a world.
pub trait Show: World {
    /// The task as one sentence in the imperative, without a full stop.
    fn goal(&self, task: &Self::Task) -> String;

    /// The parts of the goal, each with whether it holds.
    fn progress(&self, scene: &Self::Scene, task: &Self::Task) -> Vec<(String, bool)>;

    /// What a person sees of the scene.
    fn look(&self, scene: &Self::Scene) -> View;

    /// A step that was carried out, as a short sentence: `picks up the mug from the counter top`.
    ///
    /// - `binding`: what [`World::step_on`] returned for the step.
    fn narrate(&self, step: &Step, binding: &[String]) -> String;
}

/// What a person sees of a scene.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct View {
    /// The room, where the robot is and what it holds: one sentence each.
    pub summary: Vec<String>,
    /// Each thing in sight: its name, where it is, and its state.
    pub things: Vec<Thing>,
}

/// One thing in a [`View`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Thing {
    /// `Mug`, or `Mug 2` when the scene has several.
    pub name: String,
    /// The type.
    pub kind: Symbol,
    /// The thing it is on or in, if any.
    pub place: Option<String>,
    /// Centimetres from the room's corner: east, north.
    pub at: (i32, i32),
    /// `open`, `on`, `dirty`, `hot`, `cold`, `held`, `here`: the states that a person should know.
    pub states: Vec<String>,
}
