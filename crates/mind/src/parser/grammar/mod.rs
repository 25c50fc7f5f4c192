//! A hand-written grammar. It answers exactly the sentences it was written for, and no lesson
//! changes it. It is the first half of the paper's baseline (section 4).

mod rules;
mod settings;
#[cfg(test)]
mod tests;

use rules::Rules;
use serde::{Deserialize, Serialize};

pub use settings::GrammarSettings;

use super::{Parse, Scored, SemanticParser, TrainFault};
use crate::language::{Answerer, Clause, Exemplar, LiftedProgram, LiftedUtterance, Near};

/// What a grammar learned: nothing. It is stored so that every mind has its weights.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GrammarWeights {}

/// A grammar, and the exemplars of the mind.
#[derive(Debug, Clone)]
pub struct GrammarParser {
    rules: Rules,
    exemplars: Vec<Exemplar>,
}

impl GrammarParser {
    /// Reads the grammar.
    ///
    /// - `exemplars`: seeds first, then lessons. An answer names the one that is like it.
    /// - errors: a grammar that cannot be read; no exemplars.
    pub fn new(
        settings: &GrammarSettings,
        exemplars: &[Exemplar],
    ) -> Result<GrammarParser, TrainFault> {
        let rules = Rules::compile(settings).map_err(|(field, value)| TrainFault::Setting {
            field,
            value,
            allowed: "a grammar as the recipes that ship have it".to_owned(),
        })?;
        match exemplars.is_empty() {
            true => Err(TrainFault::NoExemplars),
            false => Ok(GrammarParser { rules, exemplars: exemplars.to_vec() }),
        }
    }

    /// Seeds first, then lessons in order.
    pub fn exemplars(&self) -> &[Exemplar] {
        &self.exemplars
    }

    /// What the utterance means, if the grammar has it.
    pub fn read(&self, utterance: &LiftedUtterance) -> Option<LiftedProgram> {
        self.rules.read(utterance)
    }
}

impl SemanticParser for GrammarParser {
    /// One candidate at distance 0, or none.
    fn parse(&self, clause: &Clause) -> Parse {
        let Some(program) = self.read(&clause.lifted) else { return Parse::default() };
        let means = |exemplar: &Exemplar| exemplar.program.canonical() == program.canonical();
        let same = self
            .exemplars
            .iter()
            .position(|e| e.utterance == clause.lifted && e.program == program);
        let number = same.or_else(|| self.exemplars.iter().position(means));
        let near = same.map(|number| Near {
            exemplar: clause.lifted.clone(),
            program: program.clone(),
            distance: 0.0,
            number: number as u32,
        });
        let scored = Scored {
            program,
            distance: 0.0,
            number: number.map_or(Scored::OF_NONE, |number| number as u32),
            open: false,
            by: Some(Answerer::Grammar),
        };
        Parse {
            candidates: vec![scored],
            nearest: near.into_iter().collect(),
            threshold: 0.0,
            exact: 1,
        }
    }

    /// A grammar gives one reading at most.
    fn sure_of_order(&self) -> bool {
        true
    }
}
