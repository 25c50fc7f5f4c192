use apprentice_core::ids::Seq;
use apprentice_core::world::Stage;
use serde::{Deserialize, Serialize};

/// What a person may tell the service to do. It is recorded, or refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    /// Begin an episode.
    StartEpisode {
        /// Its scene and its task.
        stage: Stage,
    },
    /// Say something to the robot.
    Say {
        /// At most [`UTTERANCE_BYTES_MAX`](apprentice_core::limits::UTTERANCE_BYTES_MAX) bytes.
        utterance: String,
    },
    /// End the episode before its goal is reached. It counts as abandoned.
    Done,
    /// Say which actions an utterance meant.
    Teach {
        /// The record of the answer to the utterance.
        explains: Seq,
        /// Numbers of actions of the episode: without a gap, and all after the utterance. Empty: no
        /// action explains it.
        actions: Vec<u32>,
        /// What to do if the lesson contradicts a former one.
        #[serde(default)]
        on_clash: OnClash,
    },
    /// End the teaching, and train on what was taught.
    FinishTeaching,
    /// Forget a lesson.
    Forget {
        /// The record of the lesson.
        lesson: Seq,
    },
    /// What the robot did last is not what was meant.
    MarkWrong,
    /// Withdraw. No command is accepted afterwards.
    Close {
        /// May be empty.
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
    pub const NAMES: [&str; 8] = [
        "start_episode",
        "say",
        "done",
        "teach",
        "finish_teaching",
        "forget",
        "mark_wrong",
        "close",
    ];
}
