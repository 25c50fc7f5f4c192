use serde::{Deserialize, Serialize};

/// A request for an episode.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Any task in any scene, drawn from the seed.
    Seed {
        /// Every value is legal.
        seed: u64,
    },
    /// A task, in a scene drawn from the seed that makes the task possible and not yet done.
    Task {
        /// In the domain's words (household: `clean Tomato CounterTop`).
        task: String,
        /// Every value is legal.
        seed: u64,
    },
    /// A task in a scene that a person wrote.
    Scene {
        /// The text of a scene file (TOML).
        scene: String,
        /// In the domain's words.
        task: String,
    },
}

/// Why a stage cannot be set. Its text is a sentence for the person who asked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StageError {
    /// The task is not one of this world, or names what the scene does not have.
    #[error("cannot set the task {task:?}: {reason}; {known}")]
    Task {
        /// As it was asked for.
        task: String,
        /// What is wrong with it.
        reason: String,
        /// What would have been understood, or what to do.
        known: String,
    },
    /// The scene file cannot be read.
    #[error("the scene file has an error at line {line}, column {column}: {reason}")]
    Scene {
        /// 1-based.
        line: usize,
        /// 1-based, in characters.
        column: usize,
        /// What is wrong there.
        reason: String,
    },
    /// There would be nothing to do.
    #[error("the goal is already reached: {goal}; change the scene or name another task")]
    Achieved {
        /// The task as a sentence.
        goal: String,
    },
    /// The seed draws no scene for the task.
    #[error(
        "seed {seed} gives no scene in which the task {task:?} is possible: {reason}; try another seed"
    )]
    Unsolvable {
        /// As it was asked for.
        task: String,
        /// As it was asked for.
        seed: u64,
        /// What every drawn scene lacked.
        reason: String,
    },
}
