use serde::{Deserialize, Serialize};

use super::recipe::ParserKind;
use super::{Recipe, TrainError};
use crate::ids::Digest;
use crate::language::{Clause, Exemplar};
use crate::parser::{
    BackedParser, Background, Calibration, ExemplarParser, ExemplarSettings, ExemplarWeights,
    FeaturesParser, FeaturesSettings, FeaturesWeights, Figures, GrammarParser, GrammarSettings,
    GrammarWeights, Parse, SemanticParser, Seq2SeqParser, Seq2SeqSettings, Seq2SeqWeights,
    TrainFault,
};
use crate::world::Words;

/// The parser of a mind, of the kind that its recipe names.
#[derive(Debug, Clone)]
pub(super) enum AnyParser {
    /// The paper's.
    Exemplar(Box<ExemplarParser>),
    /// Of recipe `default`.
    Features(Box<FeaturesParser>),
    /// A grammar alone.
    Grammar(Box<GrammarParser>),
    /// A sequence-to-sequence model alone.
    Seq2seq(Box<Seq2SeqParser>),
    /// The paper's baseline.
    Backed(Box<BackedParser>),
}

/// What a parser learned, as it is stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ParserWeights {
    /// Of the paper's parser.
    Exemplar(ExemplarWeights),
    /// Of the parser of recipe `default`.
    Features(FeaturesWeights),
    /// Of a grammar, which learns nothing.
    Grammar(GrammarWeights),
    /// Of both kinds that have a network.
    Seq2seq(Seq2SeqWeights),
}

impl AnyParser {
    /// Trains the parser that the recipe names.
    ///
    /// - `exemplars`: the world's seeds, then the lessons.
    pub(super) fn train<D: Words>(
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
            ParserKind::Grammar => GrammarParser::new(grammar(recipe)?, exemplars)
                .map(|parser| (AnyParser::Grammar(Box::new(parser)), Figures::new())),
            kind @ (ParserKind::Seq2seq | ParserKind::Backed) => {
                let (settings, signature) = (seq2seq(recipe)?, domain.signature());
                let count = seeds.exemplars.len();
                Seq2SeqParser::train(settings, words, signature, seed, exemplars, count).and_then(
                    |(model, figures)| Ok((with_grammar(recipe, kind, exemplars, model)?, figures)),
                )
            }
        };
        trained.map_err(TrainError::failed)
    }

    /// The parser that `weights` came from, given the same recipe, world and exemplars.
    ///
    /// - errors: weights of another kind than the recipe's, or that do not fit.
    pub(super) fn restore<D: Words>(
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
            (ParserKind::Grammar, ParserWeights::Grammar(GrammarWeights {})) => {
                GrammarParser::new(grammar(recipe)?, exemplars)
                    .map(|parser| AnyParser::Grammar(Box::new(parser)))
            }
            (
                kind @ (ParserKind::Seq2seq | ParserKind::Backed),
                ParserWeights::Seq2seq(weights),
            ) => {
                let (settings, signature) = (seq2seq(recipe)?, domain.signature());
                let seeds = domain.seeds().exemplars.len();
                Seq2SeqParser::restore(settings, words, signature, exemplars, seeds, weights)
                    .and_then(|model| with_grammar(recipe, kind, exemplars, model))
            }
            _ => {
                let reason = "the weights are of another kind of parser than the recipe's";
                Err(TrainFault::Weights { reason: reason.to_owned() })
            }
        };
        restored.map_err(TrainError::unreadable)
    }

    /// What it learned.
    pub(super) fn weights(&self) -> ParserWeights {
        match self {
            AnyParser::Exemplar(parser) => ParserWeights::Exemplar(parser.weights().clone()),
            AnyParser::Features(parser) => ParserWeights::Features(parser.weights().clone()),
            AnyParser::Grammar(_) => ParserWeights::Grammar(GrammarWeights {}),
            AnyParser::Seq2seq(model) => ParserWeights::Seq2seq(model.weights().clone()),
            AnyParser::Backed(both) => ParserWeights::Seq2seq(both.model.weights().clone()),
        }
    }

    /// Whether it can offer several answers for the same words, so that a reranker has a choice.
    pub(super) fn offers_choices(&self) -> bool {
        matches!(self, AnyParser::Exemplar(_) | AnyParser::Features(_))
    }

    /// Seeds first, then lessons in order.
    pub(super) fn exemplars(&self) -> &[Exemplar] {
        match self {
            AnyParser::Exemplar(parser) => parser.exemplars(),
            AnyParser::Features(parser) => parser.exemplars(),
            AnyParser::Grammar(parser) => parser.exemplars(),
            AnyParser::Seq2seq(model) => model.exemplars(),
            AnyParser::Backed(both) => both.model.exemplars(),
        }
    }

    /// The largest distance that counts as understood; 0 for a grammar. No unit.
    pub(super) fn threshold(&self) -> f32 {
        match self {
            AnyParser::Exemplar(parser) => parser.threshold(),
            AnyParser::Features(parser) => parser.threshold(),
            AnyParser::Grammar(_) => 0.0,
            AnyParser::Seq2seq(_) | AnyParser::Backed(_) => Seq2SeqParser::THRESHOLD,
        }
    }
}

/// A parser with another threshold than its own.
#[derive(Debug, Clone, Copy)]
pub(super) struct Within<'a> {
    parser: &'a AnyParser,
    threshold: f32,
}

impl AnyParser {
    /// The parser with this threshold. None for parsers without one: a grammar and a
    /// sequence-to-sequence model do not compare distances.
    pub(super) fn within(&self, threshold: f32) -> Option<Within<'_>> {
        let has_one = matches!(self, AnyParser::Exemplar(_) | AnyParser::Features(_));
        has_one.then_some(Within { parser: self, threshold })
    }
}

impl SemanticParser for Within<'_> {
    fn parse(&self, clause: &Clause) -> Parse {
        match self.parser {
            AnyParser::Exemplar(parser) => parser.parse_within(clause, self.threshold),
            AnyParser::Features(parser) => parser.parse_within(clause, self.threshold),
            other => other.parse(clause),
        }
    }

    fn chain(&self, so_far: f32, next: f32) -> f32 {
        self.parser.chain(so_far, next)
    }

    fn sure_of_order(&self) -> bool {
        self.parser.sure_of_order()
    }
}

impl SemanticParser for AnyParser {
    fn parse(&self, clause: &Clause) -> Parse {
        match self {
            AnyParser::Exemplar(parser) => parser.parse(clause),
            AnyParser::Features(parser) => parser.parse(clause),
            AnyParser::Grammar(parser) => parser.parse(clause),
            AnyParser::Seq2seq(parser) => parser.parse(clause),
            AnyParser::Backed(parser) => parser.parse(clause),
        }
    }

    fn chain(&self, so_far: f32, next: f32) -> f32 {
        match self {
            AnyParser::Exemplar(parser) => parser.chain(so_far, next),
            AnyParser::Features(parser) => parser.chain(so_far, next),
            AnyParser::Grammar(parser) => parser.chain(so_far, next),
            AnyParser::Seq2seq(parser) => parser.chain(so_far, next),
            AnyParser::Backed(parser) => parser.chain(so_far, next),
        }
    }

    fn sure_of_order(&self) -> bool {
        match self {
            AnyParser::Exemplar(parser) => parser.sure_of_order(),
            AnyParser::Features(parser) => parser.sure_of_order(),
            AnyParser::Grammar(parser) => parser.sure_of_order(),
            AnyParser::Seq2seq(parser) => parser.sure_of_order(),
            AnyParser::Backed(parser) => parser.sure_of_order(),
        }
    }
}

/// The model, with the grammar before it where the recipe wants both.
fn with_grammar(
    recipe: &Recipe,
    kind: ParserKind,
    exemplars: &[Exemplar],
    model: Seq2SeqParser,
) -> Result<AnyParser, TrainFault> {
    let grammar = recipe.settings().parser.grammar.as_ref().filter(|_| kind == ParserKind::Backed);
    let Some(grammar) = grammar else { return Ok(AnyParser::Seq2seq(Box::new(model))) };
    let grammar = GrammarParser::new(grammar, exemplars)?;
    Ok(AnyParser::Backed(Box::new(BackedParser { grammar, model })))
}

fn seq2seq(recipe: &Recipe) -> Result<&Seq2SeqSettings, TrainError> {
    let settings = recipe.settings().parser.seq2seq.as_ref();
    settings.ok_or_else(|| TrainError::failed("the recipe has no section [parser.seq2seq]"))
}

fn grammar(recipe: &Recipe) -> Result<&GrammarSettings, TrainError> {
    let settings = recipe.settings().parser.grammar.as_ref();
    settings.ok_or_else(|| TrainError::failed("the recipe has no section [parser.grammar]"))
}

fn exemplar(recipe: &Recipe) -> Result<&ExemplarSettings, TrainError> {
    let settings = recipe.settings().parser.exemplar.as_ref();
    settings.ok_or_else(|| TrainError::failed("the recipe has no section [parser.exemplar]"))
}

fn features<'a, D: Words>(
    recipe: &'a Recipe,
    domain: &'a D,
) -> Result<(&'a FeaturesSettings, Background<'a>), TrainError> {
    let settings = recipe.settings();
    let lists = settings.abstraction.lists.as_ref();
    let Some((features, lists)) = settings.parser.features.as_ref().zip(lists) else {
        let reason = "the recipe lacks the section [parser.features] or [abstraction.lists]";
        return Err(TrainError::failed(reason));
    };
    let lexicon = domain.lexicon(settings.words.edition);
    let background = Background {
        lists,
        adjectives: &lexicon.adjectives,
        fixtures: &lexicon.fixtures,
        roles: &lexicon.roles,
        habits: lexicon.habits.as_ref(),
    };
    Ok((features, background))
}
