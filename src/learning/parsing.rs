use serde::{Deserialize, Serialize};

use super::recipe::ParserKind;
use super::{Recipe, TrainError};
use crate::ids::Digest;
use crate::language::{Clause, Exemplar};
use crate::parser::{Calibration, ExemplarParser, ExemplarWeights, Figures, Parse, SemanticParser};
use crate::world::SeedSet;

/// The parser of a mind, of the kind that its recipe names.
#[derive(Debug, Clone)]
pub enum AnyParser {
    Exemplar(ExemplarParser),
}

/// What a parser of some kind learned, for storing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ParserWeights {
    Exemplar(ExemplarWeights),
}

impl AnyParser {
    pub fn train(
        recipe: &Recipe,
        seed: Digest,
        exemplars: &[Exemplar],
        seeds: &SeedSet,
    ) -> Result<(AnyParser, Figures), TrainError> {
        let calibration = Calibration { variants: &seeds.variants, unknown: &seeds.unknown };
        let settings = &recipe.settings().parser;
        let failed = |fault: crate::parser::TrainFault| TrainError::failed(fault);
        match settings.kind {
            ParserKind::Exemplar => {
                let (settings, words) = (&settings.exemplar, recipe.words());
                let trained = ExemplarParser::train(settings, words, seed, exemplars, calibration);
                let (parser, figures) = trained.map_err(failed)?;
                Ok((AnyParser::Exemplar(parser), figures))
            }
        }
    }

    /// - errors: weights of another kind than the recipe's, or that do not fit.
    pub fn restore(
        recipe: &Recipe,
        exemplars: &[Exemplar],
        weights: ParserWeights,
    ) -> Result<AnyParser, TrainError> {
        let settings = &recipe.settings().parser;
        match (settings.kind, weights) {
            (ParserKind::Exemplar, ParserWeights::Exemplar(weights)) => {
                let (settings, words) = (&settings.exemplar, recipe.words());
                let restored = ExemplarParser::restore(settings, words, exemplars, weights);
                Ok(AnyParser::Exemplar(restored.map_err(TrainError::unreadable)?))
            }
        }
    }

    pub fn weights(&self) -> ParserWeights {
        match self {
            AnyParser::Exemplar(parser) => ParserWeights::Exemplar(parser.weights().clone()),
        }
    }

    pub fn exemplars(&self) -> &[Exemplar] {
        match self {
            AnyParser::Exemplar(parser) => parser.exemplars(),
        }
    }

    pub fn threshold(&self) -> f32 {
        match self {
            AnyParser::Exemplar(parser) => parser.threshold(),
        }
    }
}

impl SemanticParser for AnyParser {
    fn parse(&self, clause: &Clause) -> Parse {
        match self {
            AnyParser::Exemplar(parser) => parser.parse(clause),
        }
    }
}
