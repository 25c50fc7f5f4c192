use std::fmt;

use crate::limits::LESSONS_MAX;

/// Why there is no mind. The previous one stays in use.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TrainError {
    /// The parser could not be trained.
    #[error("training failed: {reason}")]
    Failed {
        /// A sentence.
        reason: String,
    },
    /// There are more than [`LESSONS_MAX`] lessons.
    #[error("there are {found} lessons; at most {LESSONS_MAX} can be learned, so forget some")]
    TooManyLessons {
        /// How many.
        found: usize,
    },
    /// The trained parser does not understand a seed.
    #[error("the seed {seed:?} is not understood any more: no exemplar is within {threshold}")]
    SeedUnheard {
        /// Its words.
        seed: String,
        /// Of the trained parser.
        threshold: String,
    },
    /// The trained parser understands a seed as something else.
    #[error(
        "the seed {seed:?} would no longer mean {program}: {swallower} makes it {found}; forget \
         that lesson or say it in other words"
    )]
    SeedLost {
        /// Its words.
        seed: String,
        /// What it means.
        program: String,
        /// What it would mean.
        found: String,
        /// The lesson or seed whose program that is.
        swallower: String,
    },
    /// The bytes are not a mind of this recipe and these seeds.
    #[error("the stored mind cannot be read: {reason}")]
    Unreadable {
        /// A sentence.
        reason: String,
    },
}

impl TrainError {
    pub(super) fn failed(reason: impl fmt::Display) -> TrainError {
        TrainError::Failed { reason: reason.to_string() }
    }

    pub(super) fn unreadable(reason: impl fmt::Display) -> TrainError {
        TrainError::Unreadable { reason: reason.to_string() }
    }
}
