use serde::{Deserialize, Serialize};

/// Which edition of a world's words a recipe reads. A later edition corrects an earlier one. The
/// earlier one stays, so that a replay gives the answers of that time.
///
/// Written as its number, from 1. A recipe that names no edition reads the first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "i64", into = "i64")]
pub enum Edition {
    /// The words of release 0.1.
    #[default]
    First,
    /// The words of release 0.2.
    Second,
}

impl Edition {
    /// All editions, oldest first.
    pub const ALL: [Edition; 2] = [Edition::First, Edition::Second];

    /// Whether this is the first edition.
    pub fn is_first(&self) -> bool {
        *self == Edition::First
    }
}

impl From<Edition> for i64 {
    fn from(edition: Edition) -> i64 {
        match edition {
            Edition::First => 1,
            Edition::Second => 2,
        }
    }
}

impl TryFrom<i64> for Edition {
    type Error = String;

    fn try_from(number: i64) -> Result<Edition, String> {
        let found = Edition::ALL.into_iter().find(|edition| i64::from(*edition) == number);
        found.ok_or_else(|| format!("there is no edition {number} of the words; expected 1 or 2"))
    }
}
