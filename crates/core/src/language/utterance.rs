use std::fmt;

use serde::{Deserialize, Serialize};

use crate::limits::{UTTERANCE_BYTES_MAX, UTTERANCE_WORDS_MAX};
use crate::plain::{self, Hidden};

/// What a person typed, checked but otherwise untouched.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Utterance(String);

/// Why a text is not an utterance. A sentence for the person who typed it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UtteranceError {
    /// There is no text.
    #[error("that is empty; type what the robot should do")]
    Empty,
    /// There are only marks and signs.
    #[error("there are no words in that; type what the robot should do")]
    NoWords,
    /// There are more than [`UTTERANCE_BYTES_MAX`] bytes.
    #[error("that has {found} bytes; the limit is {UTTERANCE_BYTES_MAX}, so say it in parts")]
    TooManyBytes {
        /// Bytes found.
        found: usize,
    },
    /// There are more than [`UTTERANCE_WORDS_MAX`] words.
    #[error("that has {found} words; the limit is {UTTERANCE_WORDS_MAX}, so say it in parts")]
    TooManyWords {
        /// Words found.
        found: usize,
    },
    /// There is a character that a reader cannot see.
    #[error("in that, {0}")]
    Hidden(Hidden),
}

impl Utterance {
    /// A new utterance. White space around the text is dropped; tabs count as blanks.
    ///
    /// - errors: empty, without a single word, too long in bytes or words, or with a
    ///   [hidden](plain::check) character.
    pub fn new(text: &str) -> Result<Utterance, UtteranceError> {
        Utterance::admit(text, plain::check)
    }

    /// An utterance from a record. Older versions refused control characters alone, so their
    /// records may have other hidden characters.
    ///
    /// - errors: as [`Utterance::new`], but of the hidden characters only control characters are
    ///   refused.
    pub fn recorded(text: &str) -> Result<Utterance, UtteranceError> {
        Utterance::admit(text, |text| match (1..).zip(text.chars()).find(|(_, c)| c.is_control()) {
            Some((place, found)) => Err(Hidden { found, place }),
            None => Ok(()),
        })
    }

    fn admit(
        text: &str,
        check: impl Fn(&str) -> Result<(), Hidden>,
    ) -> Result<Utterance, UtteranceError> {
        if text.len() > UTTERANCE_BYTES_MAX {
            return Err(UtteranceError::TooManyBytes { found: text.len() });
        }
        let text = text.trim().replace('\t', " ");
        if text.is_empty() {
            return Err(UtteranceError::Empty);
        }
        check(&text).map_err(UtteranceError::Hidden)?;
        let words = tokens(&text).iter().filter(|token| is_word(token)).count();
        match words {
            0 => Err(UtteranceError::NoWords),
            found if found > UTTERANCE_WORDS_MAX => Err(UtteranceError::TooManyWords { found }),
            _ => Ok(Utterance(text)),
        }
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The words and clause marks, lower-cased; see [`tokens`].
    pub fn tokens(&self) -> Vec<String> {
        tokens(&self.0)
    }
}

impl TryFrom<String> for Utterance {
    type Error = UtteranceError;
    fn try_from(text: String) -> Result<Utterance, UtteranceError> {
        Utterance::recorded(&text)
    }
}

impl From<Utterance> for String {
    fn from(utterance: Utterance) -> String {
        utterance.0
    }
}

impl fmt::Display for Utterance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Whether a token of [`tokens`] is a clause mark.
pub fn is_mark(token: &str) -> bool {
    matches!(token, "," | "." | ";")
}

fn is_word(token: &str) -> bool {
    token.chars().any(char::is_alphanumeric)
}

/// Lower-cased words (letters, digits, inner apostrophes) and the clause marks `,` `.` `;`, in
/// order; everything else separates words.
///
/// Only ASCII apostrophes join ("don't"); a hyphen separates ("dish-rag" is two words), as people
/// write compounds either way.
pub fn tokens(text: &str) -> Vec<String> {
    let mut out = Vec::new();
    let mut word = String::new();
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        let joins =
            c == '\'' && !word.is_empty() && chars.peek().is_some_and(|n| n.is_alphanumeric());
        if c.is_alphanumeric() || joins {
            word.extend(c.to_lowercase());
            continue;
        }
        if !word.is_empty() {
            out.push(std::mem::take(&mut word));
        }
        if matches!(c, ',' | '.' | ';') {
            out.push(c.to_string());
        }
    }
    if !word.is_empty() {
        out.push(word);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_clause_marks_are_kept() {
        assert_eq!(
            tokens("Pick up the Mug, then DON'T wash-it."),
            ["pick", "up", "the", "mug", ",", "then", "don't", "wash", "it", "."]
        );
    }

    #[test]
    fn bad_utterances_get_one_clear_sentence() {
        assert_eq!(Utterance::new("  "), Err(UtteranceError::Empty));
        assert_eq!(Utterance::new("🤖 !!"), Err(UtteranceError::NoWords));
        let hidden = |found, place| Err(UtteranceError::Hidden(Hidden { found, place }));
        assert_eq!(Utterance::new("a\u{0}b"), hidden('\0', 2));
        assert_eq!(Utterance::new("pick\u{202e}up"), hidden('\u{202e}', 5));
        let long = "go ".repeat(10_000);
        assert!(matches!(Utterance::new(&long), Err(UtteranceError::TooManyBytes { .. })));
        let wordy = "go ".repeat(200);
        assert!(matches!(Utterance::new(&wordy), Err(UtteranceError::TooManyWords { found: 200 })));
        assert!(Utterance::new("wash the <b>mug</b> 🍵").is_ok());
        // Older versions recorded it, so every version reads it.
        assert!(Utterance::recorded("pick\u{202e}up").is_ok());
        assert_eq!(Utterance::recorded("a\u{1b}b"), hidden('\u{1b}', 2));
    }
}
