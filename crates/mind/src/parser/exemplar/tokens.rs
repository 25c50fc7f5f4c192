use std::collections::BTreeSet;

use super::ExemplarSettings;
use crate::language::{LiftedUtterance, Word};

/// What the network reads at one place of an utterance.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Token {
    Word(String),
    Slot { sort: String, fixture: Option<String> },
}

/// Drops stop words.
#[derive(Debug, Clone)]
pub(super) struct Tokeniser {
    stop_words: BTreeSet<String>,
}

impl Tokeniser {
    pub(super) fn new(settings: &ExemplarSettings) -> Tokeniser {
        Tokeniser { stop_words: settings.stop_words.iter().cloned().collect() }
    }

    /// The tokens without stop words; with them where nothing else would be left.
    pub(super) fn tokens(&self, utterance: &LiftedUtterance) -> Vec<Token> {
        let kept: Vec<Token> = utterance
            .words
            .iter()
            .filter(|word| !matches!(word, Word::Text(text) if self.stop_words.contains(text)))
            .map(token)
            .collect();
        if kept.is_empty() { utterance.words.iter().map(token).collect() } else { kept }
    }
}

fn token(word: &Word) -> Token {
    match word {
        Word::Text(text) => Token::Word(text.clone()),
        Word::Slot { sort, fixture } => {
            Token::Slot { sort: sort.as_str().to_owned(), fixture: fixture.clone() }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn printed(text: &str) -> String {
        let tokeniser = Tokeniser::new(&ExemplarSettings::default());
        let tokens = tokeniser.tokens(&LiftedUtterance::parse(text));
        let print = |token: &Token| match token {
            Token::Word(word) => word.clone(),
            Token::Slot { sort, .. } => format!("<{sort}>"),
        };
        tokens.iter().map(print).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn stop_words_go_unless_nothing_else_is_there() {
        assert_eq!(printed("put the <obj> down on the <obj>"), "put <obj> <obj>");
        assert_eq!(printed("the <obj> to the <obj>"), "<obj> <obj>");
        assert_eq!(printed("back up"), "back up");
        assert_eq!(printed(""), "");
    }
}
