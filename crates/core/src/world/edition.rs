use serde::{Deserialize, Serialize};

/// Which edition of a domain's words a recipe reads. A later edition mends what an earlier one
/// names wrongly; the earlier one stays, so that what was answered with it is answered so again.
///
/// Written as its number; 1 where a recipe says nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "i64", into = "i64")]
pub enum Edition {
    #[default]
    First,
    Second,
}

impl Edition {
    pub const ALL: [Edition; 2] = [Edition::First, Edition::Second];

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
