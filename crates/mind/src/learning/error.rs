use std::fmt;

use crate::limits::LESSONS_MAX;

/// Why there is no mind. The previous one stays in use.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TrainError {
    #[error("training failed: {reason}")]
    Failed { reason: String },
    #[error("there are {found} lessons; at most {LESSONS_MAX} can be learned, so forget some")]
    TooManyLessons { found: usize },
    #[error("the seed {seed:?} is not understood any more: no exemplar is within {threshold}")]
    SeedUnheard { seed: String, threshold: String },
    #[error(
        "the seed {seed:?} would no longer mean {program}: {swallower} makes it {found}; forget \
         that lesson or say it in other words"
    )]
    SeedLost { seed: String, program: String, found: String, swallower: String },
    #[error("the stored mind cannot be read: {reason}")]
    Unreadable { reason: String },
}

impl TrainError {
    pub(super) fn failed(reason: impl fmt::Display) -> TrainError {
        TrainError::Failed { reason: reason.to_string() }
    }

    pub(super) fn unreadable(reason: impl fmt::Display) -> TrainError {
        TrainError::Unreadable { reason: reason.to_string() }
    }
}
