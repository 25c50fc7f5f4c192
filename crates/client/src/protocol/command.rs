use apprentice_core::ids::Seq;
use apprentice_core::world::Stage;
use serde::{Deserialize, Serialize};

/// What a person may tell the service to do. It is recorded, or refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    StartEpisode {
        stage: Stage,
    },
    Say {
        utterance: String,
    },
    /// End the episode early; it counts as abandoned.
    Done,
    /// The utterance recorded at `explains` stands for these actions of the episode (counted from
    /// 1, a contiguous run, all after the utterance). No action at all means "nothing did".
    Teach {
        explains: Seq,
        actions: Vec<u32>,
        #[serde(default)]
        on_clash: OnClash,
    },
    /// No more teaching: train on what was taught.
    FinishTeaching,
    /// Take back the lesson recorded at `lesson`.
    Forget {
        lesson: Seq,
    },
    /// Withdraw for good. The reason may be empty.
    Close {
        reason: String,
    },
}

/// What to do when a new lesson has the lifted form of an old one and another program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum OnClash {
    /// Refuse with the code `clash`, and name the old lesson; nothing is recorded.
    #[default]
    Ask,
    /// Forget the old lesson and learn the new one, in one batch.
    Replace,
    /// Keep both and let the scene decide.
    Keep,
}

/// A question that changes nothing and is never recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Query {
    /// What the robot sees and holds.
    Look,
    /// The exemplars that answers come from.
    Known,
    /// Phase, goal, progress, actions so far and what may be taught.
    Status,
}

impl Command {
    /// The commands, as they are spelled on the wire.
    pub const NAMES: [&str; 7] =
        ["start_episode", "say", "done", "teach", "finish_teaching", "forget", "close"];
}
