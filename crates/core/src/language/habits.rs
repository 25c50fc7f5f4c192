use std::collections::BTreeMap;

use super::Symbol;

/// How often recorded people used a word in a clause that meant each operator: what is known about
/// a language before anybody taught anything. Counts of single words, no sentences.
///
/// `V:` marks a clause's main verb; `V:pick_up` is a verb with its particle, `V:take+from` a verb
/// with a function word after its object, `n:2` the number of things named.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Habits {
    /// The operators, in the order of the counts.
    pub order: Vec<Symbol>,
    /// Clauses per operator.
    pub clauses: Vec<u32>,
    pub words: BTreeMap<String, Vec<u32>>,
}

impl Habits {
    /// Per operator; none for a word that nobody used.
    pub fn counts(&self, word: &str) -> Option<&[u32]> {
        self.words.get(word).map(Vec::as_slice)
    }

    /// The share of all clauses in which a word stood, as verb or not.
    pub fn rate(&self, word: &str) -> f64 {
        let uses = |word: &str| self.counts(word).map_or(0, |row| row.iter().sum::<u32>());
        let all: u32 = self.clauses.iter().sum();
        let found = uses(word) + uses(&format!("V:{word}"));
        f64::from(found) / f64::from(all.max(1))
    }
}

/// Which of a domain's operators play a part that the choice of arguments depends on. A domain
/// that names none has its programs filled in the order of the slots.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Roles {
    /// Going to its argument.
    pub going: Option<Symbol>,
    /// Taking its argument into the hand.
    pub taking: Option<Symbol>,
    /// Putting what is in the hand (first argument) in or on a place (second).
    pub putting: Option<Symbol>,
    /// Getting at what is in its argument, or shutting it away.
    pub doors: Vec<Symbol>,
}

impl Roles {
    pub fn goes(&self, operator: &Symbol) -> bool {
        self.going.as_ref() == Some(operator)
    }

    pub fn takes(&self, operator: &Symbol) -> bool {
        self.taking.as_ref() == Some(operator)
    }

    pub fn puts(&self, operator: &Symbol) -> bool {
        self.putting.as_ref() == Some(operator)
    }

    /// Working its argument, as a switch is worked: none of the other parts.
    pub fn works(&self, operator: &Symbol) -> bool {
        !self.goes(operator)
            && !self.takes(operator)
            && !self.puts(operator)
            && !self.is_door(operator)
    }

    pub fn is_door(&self, operator: &Symbol) -> bool {
        self.doors.contains(operator)
    }
}
