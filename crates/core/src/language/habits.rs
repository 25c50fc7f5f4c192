use std::collections::BTreeMap;

use super::Symbol;

/// How often recorded people used a word in a clause that meant each operator. This is what is
/// known about a language before anybody has taught anything. It counts single words and holds no
/// sentences.
///
/// `V:` marks a clause's main verb; `V:pick_up` is a verb with its particle, `V:take+from` a verb
/// with a function word after its object, `n:2` the number of things named.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Habits {
    /// The operators, in the order of the counts.
    pub order: Vec<Symbol>,
    /// Clauses per operator.
    pub clauses: Vec<u32>,
    /// Per word, how many clauses of each operator have it.
    pub words: BTreeMap<String, Vec<u32>>,
}

impl Habits {
    /// How many clauses of each operator have the word, in the order of [`Habits::order`]; none for
    /// a word that nobody used.
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

/// The operators of a world that the choice of arguments depends on. In a world that names none,
/// programs are filled in the order of their slots.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Roles {
    /// Going to its argument.
    pub going: Option<Symbol>,
    /// Taking its argument into the hand.
    pub taking: Option<Symbol>,
    /// Putting what is in the hand (first argument) in or on a place (second).
    pub putting: Option<Symbol>,
    /// Opening or shutting its argument.
    pub doors: Vec<Symbol>,
}

impl Roles {
    /// Whether the operator goes to its argument.
    pub fn goes(&self, operator: &Symbol) -> bool {
        self.going.as_ref() == Some(operator)
    }

    /// Whether the operator takes its argument into the hand.
    pub fn takes(&self, operator: &Symbol) -> bool {
        self.taking.as_ref() == Some(operator)
    }

    /// Whether the operator puts its first argument in or on its second.
    pub fn puts(&self, operator: &Symbol) -> bool {
        self.putting.as_ref() == Some(operator)
    }

    /// Whether the operator has none of these roles: it works its argument, as a switch is worked.
    pub fn works(&self, operator: &Symbol) -> bool {
        !self.goes(operator)
            && !self.takes(operator)
            && !self.puts(operator)
            && !self.is_door(operator)
    }

    /// Whether the operator opens or shuts its argument.
    pub fn is_door(&self, operator: &Symbol) -> bool {
        self.doors.contains(operator)
    }
}
