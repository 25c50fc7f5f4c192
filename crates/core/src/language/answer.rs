use std::fmt;

use serde::{Deserialize, Serialize};

use super::{LiftedProgram, LiftedUtterance, Program, Symbol};

/// What came of one utterance, and why: everything a person, an auditor or a simulated teacher may
/// ask about it later.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    pub outcome: Outcome,
    pub evidence: Evidence,
    /// The type that the last mention meant: what a later "it" means while the hand is empty.
    pub mentioned: Option<Symbol>,
    /// Per step and argument the thing that words chose ("mug 2", "the other one"). Empty when they
    /// chose none; where it is, the world chooses, now and whenever the record is read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub chosen: Vec<Vec<Option<String>>>,
}

impl Answer {
    /// The things that words chose for a step, by its 0-based place.
    pub fn chosen_for(&self, step: usize) -> &[Option<String>] {
        self.chosen.get(step).map_or(&[], Vec::as_slice)
    }

    /// Whether somebody asked for something to be done now. What is asked, told or forbidden is not
    /// there to be taught.
    pub fn asks(&self) -> bool {
        self.evidence.mood.is_none()
    }

    /// Whether a part that answers whatever is said gave the program, or some of it, for words that
    /// it was never taught.
    pub fn guessed(&self) -> bool {
        let Evidence { lifted, nearest, answered_by, .. } = &self.evidence;
        let taught = |clause: &LiftedUtterance| nearest.iter().any(|near| near.exemplar == *clause);
        let clauses = lifted.iter().zip(answered_by);
        clauses.into_iter().any(|(clause, by)| *by == Answerer::Seq2seq && !taught(clause))
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The program was carried out. `bindings[i]` names the things that step `i` acted on.
    Understood { program: Program, bindings: Vec<Vec<String>> },
    /// The words were known and the world forbids it: nothing was carried out. `step` is 0-based.
    Impossible { program: Program, step: u32, reason: String },
    /// Nothing known is close enough. Nothing was carried out.
    NotSure,
}

/// Why the answer is what it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct Evidence {
    /// The utterance as the parser saw it, whole or clause by clause.
    pub lifted: Vec<LiftedUtterance>,
    /// The nearest exemplars, nearest first, whether or not they were near enough.
    pub nearest: Vec<Near>,
    /// The threshold that `nearest` was held against, in the same unit as its distances.
    pub threshold: f32,
    /// Candidates that were dropped, with the reason.
    pub discarded: Vec<Discarded>,
    /// How many candidates the reranker had to choose from; 0 when it was not asked.
    pub reranked: u32,
    /// Which part of the parser gave the program, clause by clause as in `lifted`. Empty where
    /// there is no program, and for parsers that have one part only.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub answered_by: Vec<Answerer>,
    /// Why the utterance is no request, where it is none and the recipe tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mood: Option<Mood>,
    /// What each word was used for, in the order of the words; of the answer that was told, or of
    /// the nearest one that left words over. Empty where the recipe does not account for words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accounting: Vec<Accounted>,
}

impl Evidence {
    /// The words that the answer would have passed over: why it is *not sure*.
    pub fn left_over(&self) -> impl Iterator<Item = &str> {
        let unused = self.accounting.iter().filter(|word| word.used == Use::Nothing);
        unused.map(|word| word.word.as_str())
    }

    /// Which words make the utterance no request, or were used for nothing: `a question: "did"`.
    pub fn passed_over(&self) -> Option<String> {
        if let Some(mood) = &self.mood {
            let (what, word) = match mood {
                Mood::Asked { word } => ("a question", word),
                Mood::Told { word } => ("a statement", word),
                Mood::Forbidden { word } => ("forbidden", word),
                Mood::Conditional { word } => ("a condition", word),
                Mood::Later { word } => ("not now", word),
                Mood::Reordered { word } => ("another order", word),
            };
            return Some(format!("{what}: \"{word}\""));
        }
        let words: Vec<String> = self.left_over().map(|word| format!("\"{word}\"")).collect();
        (!words.is_empty()).then(|| format!("nothing for {}", words.join(", ")))
    }
}

/// Why an utterance is no request for something to be done now. Each names the words that say so.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mood {
    Asked {
        word: String,
    },
    Told {
        word: String,
    },
    Forbidden {
        word: String,
    },
    Conditional {
        word: String,
    },
    Later {
        word: String,
    },
    /// What comes first in it is to be done last.
    Reordered {
        word: String,
    },
}

/// A word or phrase of an utterance, and what it was used for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Accounted {
    pub word: String,
    #[serde(rename = "as")]
    pub used: Use,
}

/// What a word was used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Use {
    /// Address, courtesy, filler.
    Frame,
    /// The verb with its particle, or a word that a lesson has too.
    Verb,
    /// A thing, by its name or a pronoun, that the program acts on.
    Thing,
    /// Which of several things.
    Attribute,
    /// Where the thing is, or what it is near; it chose nothing that the program acts on.
    Landmark,
    /// Order, articles, prepositions and other words that ask for nothing.
    Harmless,
    /// Nothing: the reading passes it over, so it is not taken.
    Nothing,
}

/// A part of a parser that answers by itself: in the paper's baseline a grammar answers first, else
/// a network, and a study counts which (paper: 713 of 793 parses were the grammar's).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answerer {
    Grammar,
    Seq2seq,
}

impl fmt::Display for Answerer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Answerer::Grammar => "the grammar",
            Answerer::Seq2seq => "the sequence-to-sequence model",
        })
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Near {
    pub exemplar: LiftedUtterance,
    pub program: LiftedProgram,
    /// No unit; smaller is nearer.
    pub distance: f32,
    /// Which of the mind's exemplars this is; seeds come first, then lessons in order.
    pub number: u32,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Discarded {
    pub program: Program,
    /// A sentence that names the object and the reason.
    pub reason: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_model_guesses_and_only_at_words_it_was_not_taught() {
        let clauses = ["go to <obj>", "wash <obj>"].map(LiftedUtterance::parse);
        let answer = |answered_by: &[Answerer], nearest: Vec<Near>| {
            let answered_by = answered_by.to_vec();
            let lifted = clauses.to_vec();
            let evidence = Evidence { lifted, nearest, answered_by, ..Evidence::default() };
            Answer { outcome: Outcome::NotSure, evidence, mentioned: None, chosen: Vec::new() }
        };
        let (grammar, model) = (Answerer::Grammar, Answerer::Seq2seq);
        let taught = Near {
            exemplar: clauses[1].clone(),
            program: "WASH <obj:1>".parse().unwrap(),
            distance: 0.1,
            number: 3,
        };
        assert!(answer(&[grammar, model], Vec::new()).guessed());
        assert!(!answer(&[grammar, model], vec![taught.clone()]).guessed());
        assert!(answer(&[model, model], vec![taught]).guessed());
        assert!(!answer(&[grammar, grammar], Vec::new()).guessed());
        assert!(!answer(&[], Vec::new()).guessed());
    }
}
