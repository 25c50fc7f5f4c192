//! Which recorded people choices may be made on, and which are kept for the table.

use std::fmt;
use std::str::FromStr;

use sha2::{Digest as _, Sha256};

/// A part of the recorded people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum People {
    /// Those that settings, seeds and weights may be chosen on: about two thirds.
    Choosing,
    /// Those that nobody looks at until the table is made, once.
    HeldOut,
    All,
}

impl People {
    pub const NAMES: [&'static str; 3] = ["choosing", "held-out", "all"];

    /// - `user`: the opaque identifier of the corpus.
    pub fn include(self, user: &str) -> bool {
        match self {
            People::Choosing => !held_out(user),
            People::HeldOut => held_out(user),
            People::All => true,
        }
    }
}

/// A person is held out when the SHA-256 of their identifier, read as one big-endian number, is
/// divisible by three. A rule on the name alone stays the same when people are added or removed.
fn held_out(user: &str) -> bool {
    // 256 leaves 1 when divided by 3, so the number leaves what the sum of its bytes leaves.
    let sum: u32 = Sha256::digest(user.as_bytes()).iter().map(|byte| u32::from(*byte)).sum();
    sum.is_multiple_of(3)
}

impl fmt::Display for People {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(People::NAMES[*self as usize])
    }
}

impl FromStr for People {
    type Err = String;
    fn from_str(text: &str) -> Result<People, String> {
        match text {
            "choosing" => Ok(People::Choosing),
            "held-out" => Ok(People::HeldOut),
            "all" => Ok(People::All),
            other => Err(format!("{other:?} is not one of {}", People::NAMES.join(", "))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_are_fixed_for_ever() {
        // The bytes of these SHA-256 digests sum to 3759 and 4092, 3730 and 4399.
        assert!(held_out("ab") && held_out("ada"));
        assert!(!held_out("abc") && !held_out(""));
        let held = (0..3000).filter(|number| held_out(&format!("user {number}"))).count();
        assert!((900..1100).contains(&held), "{held} of 3000");
    }

    #[test]
    fn everybody_is_in_exactly_one_part() {
        for number in 0..100 {
            let user = format!("user {number}");
            assert_ne!(People::Choosing.include(&user), People::HeldOut.include(&user));
            assert!(People::All.include(&user));
        }
        assert_eq!("held-out".parse(), Ok(People::HeldOut));
        assert_eq!(People::HeldOut.to_string(), "held-out");
        assert!("nobody".parse::<People>().unwrap_err().contains("choosing, held-out, all"));
    }
}
