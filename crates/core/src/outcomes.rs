//! How an episode ended. The log and the wire write it in the same form.

use serde::{Deserialize, Serialize};

/// How an episode came to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// The goal was reached.
    Achieved,
    /// The person ended it.
    Abandoned,
}
