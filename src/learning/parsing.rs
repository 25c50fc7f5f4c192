use serde::{Deserialize, Serialize};

use super::recipe::ParserKind;
use super::{Recipe, TrainError};
use crate::ids::Digest;
use crate::language::{Clause, Exemplar};
use crate::parser::{
    Background, Calibration, ExemplarParser, ExemplarSettings, ExemplarWeights, FeaturesParser,
    FeaturesSettings, FeaturesWeights, Figures, Parse, SemanticParser, TrainFault,
};
use crate::world::Domain;

/// The parser of a mind, of the kind that its recipe names.
#[derive(Debug, Clone)]
pub enum AnyParser {
    Exemplar(Box<ExemplarParser>),
    Features(Box<FeaturesParser>),
}

/// What a parser of some kind learned, for storing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ParserWeights {
    Exemplar(ExemplarWeights),
    Features(FeaturesWeights),
}

impl AnyParser {
    /// - `exemplars`: the domain's seeds, then the lessons.
    pub fn train<D: Domain>(
        recipe: &Recipe,
        domain: &D,
        seed: Digest,
        exemplars: &[Exemplar],
    ) -> Result<(AnyParser, Figures), TrainError> {
        let seeds = domain.seeds();
        let calibration = Calibration { variants: &seeds.variants, unknown: &seeds.unknown };
        let words = recipe.words();
        let trained = match recipe.settings().parser.kind {
            ParserKind::Exemplar => {
                ExemplarParser::train(exemplar(recipe)?, words, seed, exemplars, calibration)
                    .map(|(parser, figures)| (AnyParser::Exemplar(Box::new(parser)), figures))
            }
            ParserKind::Features => {
                let (settings, background) = features(recipe, domain)?;
                let count = seeds.exemplars.len();
                FeaturesParser::train(settings, words, background, exemplars, count, calibration)
                    .map(|(parser, figures)| (AnyParser::Features(Box::new(parser)), figures))
            }
        };
        trained.map_err(TrainError::failed)
    }

    /// - errors: weights of another kind than the recipe's, or that do not fit.
    pub fn restore<D: Domain>(
        recipe: &Recipe,
        domain: &D,
        exemplars: &[Exemplar],
        weights: ParserWeights,
    ) -> Result<AnyParser, TrainError> {
        let words = recipe.words();
        let restored = match (recipe.settings().parser.kind, weights) {
            (ParserKind::Exemplar, ParserWeights::Exemplar(weights)) => {
                ExemplarParser::restore(exemplar(recipe)?, words, exemplars, weights)
                    .map(|parser| AnyParser::Exemplar(Box::new(parser)))
            }
            (ParserKind::Features, ParserWeights::Features(weights)) => {
                let (settings, background) = features(recipe, domain)?;
                let seeds = domain.seeds().exemplars.len();
                FeaturesParser::restore(settings, words, background, exemplars, seeds, weights)
                    .map(|parser| AnyParser::Features(Box::new(parser)))
            }
            _ => {
                let reason = "the weights are of another kind of parser than the recipe's";
                Err(TrainFault::Weights { reason: reason.to_owned() })
            }
        };
        restored.map_err(TrainError::unreadable)
    }

    pub fn weights(&self) -> ParserWeights {
        match self {
            AnyParser::Exemplar(parser) => ParserWeights::Exemplar(parser.weights().clone()),
            AnyParser::Features(parser) => ParserWeights::Features(parser.weights().clone()),
        }
    }

    pub fn exemplars(&self) -> &[Exemplar] {
        match self {
            AnyParser::Exemplar(parser) => parser.exemplars(),
            AnyParser::Features(parser) => parser.exemplars(),
        }
    }

    pub fn threshold(&self) -> f32 {
        match self {
            AnyParser::Exemplar(parser) => parser.threshold(),
            AnyParser::Features(parser) => parser.threshold(),
        }
    }
}

impl SemanticParser for AnyParser {
    fn parse(&self, clause: &Clause) -> Parse {
        match self {
            AnyParser::Exemplar(parser) => parser.parse(clause),
            AnyParser::Features(parser) => parser.parse(clause),
        }
    }

    fn chain(&self, so_far: f32, next: f32) -> f32 {
        match self {
            AnyParser::Exemplar(parser) => parser.chain(so_far, next),
            AnyParser::Features(parser) => parser.chain(so_far, next),
        }
    }

    fn sure_of_order(&self) -> bool {
        match self {
            AnyParser::Exemplar(parser) => parser.sure_of_order(),
            AnyParser::Features(parser) => parser.sure_of_order(),
        }
    }
}

fn exemplar(recipe: &Recipe) -> Result<&ExemplarSettings, TrainError> {
    let settings = recipe.settings().parser.exemplar.as_ref();
    settings.ok_or_else(|| TrainError::failed("the recipe has no section [parser.exemplar]"))
}

fn features<'a, D: Domain>(
    recipe: &'a Recipe,
    domain: &'a D,
) -> Result<(&'a FeaturesSettings, Background<'a>), TrainError> {
    let settings = recipe.settings();
    let lists = settings.abstraction.lists.as_ref();
    let Some((features, lists)) = settings.parser.features.as_ref().zip(lists) else {
        let reason = "the recipe lacks the section [parser.features] or [abstraction.lists]";
        return Err(TrainError::failed(reason));
    };
    let lexicon = domain.lexicon();
    let background = Background {
        lists,
        adjectives: &lexicon.adjectives,
        fixtures: &lexicon.fixtures,
        roles: &lexicon.roles,
        habits: lexicon.habits.as_ref(),
    };
    Ok((features, background))
}
