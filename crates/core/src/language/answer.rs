use std::fmt;

use serde::{Deserialize, Serialize};

use super::{LiftedProgram, LiftedUtterance, Program, Symbol};
use crate::ids::Seq;

/// What came of one utterance, and why. A person, an auditor or a simulated teacher may ask for any
/// of it later.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// What was done.
    pub outcome: Outcome,
    /// Why.
    pub evidence: Evidence,
    /// The type that the last mention meant: what a later "it" means while the hand is empty.
    pub mentioned: Option<Symbol>,
    /// Per step and argument the thing that words chose ("mug 2", "the other one"). Empty when
    /// words chose none; then the world chooses, now and at every replay.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub chosen: Vec<Vec<Option<String>>>,
}

impl Answer {
    /// The things that words chose for a step, by its 0-based place.
    pub fn chosen_for(&self, step: usize) -> &[Option<String>] {
        self.chosen.get(step).map_or(&[], Vec::as_slice)
    }

    /// Whether the utterance is a request for something to be done now. Only a request can be
    /// taught: no question, no statement, no prohibition.
    pub fn asks(&self) -> bool {
        self.evidence.mood.is_none()
    }

    /// Whether the program, or part of it, was a guess: it came from a network that answers
    /// everything, for words that nobody taught it.
    pub fn guessed(&self) -> bool {
        let Evidence { lifted, nearest, answered_by, .. } = &self.evidence;
        let taught = |clause: &LiftedUtterance| nearest.iter().any(|near| near.exemplar == *clause);
        let clauses = lifted.iter().zip(answered_by);
        clauses.into_iter().any(|(clause, by)| *by == Answerer::Seq2seq && !taught(clause))
    }
}

/// What was done about an utterance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The program was carried out.
    Understood {
        /// What was carried out.
        program: Program,
        /// Per step the names of the things that it acted on, one per argument.
        bindings: Vec<Vec<String>>,
    },
    /// The words were understood, but the world does not allow it. Nothing was carried out.
    Impossible {
        /// What was understood.
        program: Program,
        /// The step that cannot be carried out; 0-based.
        step: u32,
        /// A sentence that names the object and the reason.
        reason: String,
    },
    /// Nothing known is close enough. Nothing was carried out.
    NotSure,
    /// Several readings are as good, so the person is asked which was meant. Nothing was carried out.
    Asked {
        /// What is asked.
        question: Question,
    },
    /// The person asked something, or said something that needs no act, and this is the answer.
    /// Nothing was carried out.
    Told {
        /// One sentence, or a few.
        text: String,
    },
}

/// A question to the person. It is open until the next utterance, or until the episode ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Question {
    /// `Which table: the dining table or the side table?`
    pub text: String,
    /// What the person may choose from, in the order of the text. One option is a yes-or-no question.
    pub options: Vec<AnswerOption>,
}

/// One answer that a [`Question`] offers, and what is done when the person gives it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnswerOption {
    /// As it stands in the question: `the dining table`.
    pub label: String,
    /// What is carried out.
    pub program: Program,
    /// The things that each step acts on, as in [`Outcome::Understood`].
    pub bindings: Vec<Vec<String>>,
    /// As [`Answer::chosen`], for this program.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub chosen: Vec<Vec<Option<String>>>,
    /// As [`Answer::mentioned`], for this program.
    pub mentioned: Option<Symbol>,
}

/// Why the answer is what it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct Evidence {
    /// The utterance as the parser saw it, whole or clause by clause.
    pub lifted: Vec<LiftedUtterance>,
    /// The nearest exemplars, nearest first, whether or not they were near enough.
    pub nearest: Vec<Near>,
    /// The largest distance that counts as understood, in the unit of the distances in `nearest`.
    pub threshold: f32,
    /// Candidates that were dropped, with the reason.
    pub discarded: Vec<Discarded>,
    /// How many candidates the reranker had to choose from; 0 when it was not asked.
    pub reranked: u32,
    /// Which part of the parser gave the program, clause by clause as in `lifted`. Empty where
    /// there is no program, and for parsers that have one part only.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub answered_by: Vec<Answerer>,
    /// Why the utterance is not a request; none for a request, and for recipes that do not look.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mood: Option<Mood>,
    /// What each word was used for, in the order of the words: in the answer given, or else in the
    /// nearest reading that left words unused. Empty where the recipe does not account for words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accounting: Vec<Accounted>,
    /// The record with the question that this utterance answered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub replies_to: Option<Seq>,
}

impl Evidence {
    /// The words that had no use. An answer with such a word is *not sure*.
    pub fn left_over(&self) -> impl Iterator<Item = &str> {
        let unused = self.accounting.iter().filter(|word| word.used == Use::Nothing);
        unused.map(|word| word.word.as_str())
    }

    /// Why the words are not a request, or which words had no use: `a question: "did"`. None when
    /// neither holds.
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

/// Why an utterance is not a request for something to be done now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mood {
    /// It is a question.
    Asked {
        /// The words that show it: `did`.
        word: String,
    },
    /// It is a statement.
    Told {
        /// The words that show it.
        word: String,
    },
    /// It is a prohibition.
    Forbidden {
        /// The words that show it: `do not`.
        word: String,
    },
    /// It holds under a condition only.
    Conditional {
        /// The words that show it: `if`.
        word: String,
    },
    /// It is for later.
    Later {
        /// The words that show it.
        word: String,
    },
    /// What it names first is to be done last.
    Reordered {
        /// The words that show it.
        word: String,
    },
}

/// A word or phrase of an utterance, and what it was used for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Accounted {
    /// As it was said, lower-cased.
    pub word: String,
    /// What it was used for.
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
    /// Nothing. A reading that has no use for a word is not taken.
    Nothing,
}

/// The part of a parser that gave an answer. In the paper's baseline a grammar answers where it can
/// and a network otherwise; a study counts which (paper: 713 of 793 parses were the grammar's).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answerer {
    /// Rules over words.
    Grammar,
    /// A network that writes the program symbol by symbol. It answers everything.
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

/// An exemplar that came close to an utterance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Near {
    /// Its words.
    pub exemplar: LiftedUtterance,
    /// What its words mean.
    pub program: LiftedProgram,
    /// No unit; smaller is nearer.
    pub distance: f32,
    /// Which of the mind's exemplars this is; seeds come first, then lessons in order.
    pub number: u32,
}

/// A candidate program that was dropped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Discarded {
    /// With the things of the scene filled in.
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
