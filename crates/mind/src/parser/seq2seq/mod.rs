//! The neural half of the paper's baseline: a sequence-to-sequence model with attention and
//! copying, after Jia and Liang 2016 ("Data Recombination for Neural Semantic Parsing").
//!
//! A bidirectional LSTM reads the lifted utterance. An LSTM writes the lifted program token by
//! token, with attention to what was read. Slots are copied from their places in the utterance, by
//! their attention scores. Only tokens that lead to a program are allowed. Words have the recipe's
//! fixed vectors, so a word that was never taught is treated like words with similar vectors.
//!
//! It always answers: the paper's baseline has no *not sure*.

mod layout;
mod objective;
mod reader;
mod search;
mod settings;
#[cfg(test)]
mod tests;
mod train;
mod vocabulary;
mod writer;

use layout::Layout;
use reader::Words;
use serde::{Deserialize, Serialize};
use vocabulary::Vocabulary;

pub use settings::Seq2SeqSettings;

use super::{Figures, Parse, Scored, SemanticParser, TrainFault, WordTable};
use crate::ids::Digest;
use crate::language::{
    Answerer, Clause, Exemplar, LiftedProgram, LiftedUtterance, Near, Signature,
};
use crate::numerics::Floats;

/// What was learned. The tokens of programs follow from the exemplars.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seq2SeqWeights {
    /// Laid out by `layout.rs`.
    pub parameters: Floats,
}

/// A trained model, and the exemplars that it was trained on.
#[derive(Debug, Clone)]
pub struct Seq2SeqParser {
    settings: Seq2SeqSettings,
    words: &'static WordTable,
    vocabulary: Vocabulary,
    layout: Layout,
    weights: Seq2SeqWeights,
    exemplars: Vec<Exemplar>,
}

impl Seq2SeqParser {
    /// The largest distance that counts as understood. A distance is 1 − the probability of a
    /// program, so all are within it.
    pub const THRESHOLD: f32 = 1.0;

    /// Trains a model. A pure function: equal arguments give equal bits, on every machine.
    ///
    /// - `examples`: `seeds` seeds, then lessons in order.
    pub fn train(
        settings: &Seq2SeqSettings,
        words: &'static WordTable,
        signature: &Signature,
        seed: Digest,
        examples: &[Exemplar],
        seeds: usize,
    ) -> Result<(Seq2SeqParser, Figures), TrainFault> {
        settings.check()?;
        let known: Vec<&Exemplar> = learned(examples, seeds).collect();
        let vocabulary = Vocabulary::new(signature, &known);
        let (parameters, figures) =
            train::train(settings, words, &vocabulary, seed, examples, seeds)?;
        let weights = Seq2SeqWeights { parameters };
        let parser = Seq2SeqParser::restore(settings, words, signature, examples, seeds, weights)?;
        Ok((parser, figures))
    }

    /// The parser that `weights` came from, given the same settings, table and exemplars.
    ///
    /// - errors: settings, exemplars or weights that cannot belong together.
    pub fn restore(
        settings: &Seq2SeqSettings,
        words: &'static WordTable,
        signature: &Signature,
        examples: &[Exemplar],
        seeds: usize,
        weights: Seq2SeqWeights,
    ) -> Result<Seq2SeqParser, TrainFault> {
        settings.check()?;
        let known: Vec<&Exemplar> = learned(examples, seeds).collect();
        let vocabulary = Vocabulary::new(signature, &known);
        let layout = layout_of(settings, words, &vocabulary);
        let wrong = |reason: String| Err(TrainFault::Weights { reason });
        let (found, expected) = (weights.parameters.len(), layout.total());
        if found != expected {
            return wrong(format!("{found} parameters, expected {expected}"));
        }
        if !weights.parameters.all_finite() {
            return wrong("a parameter is not a finite number".to_owned());
        }
        let (settings, exemplars) = (settings.clone(), examples.to_vec());
        Ok(Seq2SeqParser { settings, words, vocabulary, layout, weights, exemplars })
    }

    /// What training learned.
    pub fn weights(&self) -> &Seq2SeqWeights {
        &self.weights
    }

    /// Seeds first, then lessons in order.
    pub fn exemplars(&self) -> &[Exemplar] {
        &self.exemplars
    }

    /// The likeliest program and its probability; `None` for no words, or where nothing was named
    /// and no program names anything either.
    pub fn write(&self, utterance: &LiftedUtterance) -> Option<(LiftedProgram, f32)> {
        if utterance.words.is_empty() {
            return None;
        }
        let words = Words::new(&self.settings, self.words, [utterance]);
        search::likeliest(
            self.layout,
            &self.weights.parameters,
            &self.vocabulary,
            &words,
            utterance,
            self.settings.beam,
        )
    }
}

/// The examples that are learned from. A seed keeps its program, so a lesson with a seed's words
/// and another program is none of them.
fn learned(examples: &[Exemplar], seeds: usize) -> impl Iterator<Item = &Exemplar> {
    let (first, lessons) = examples.split_at(seeds.min(examples.len()));
    let against = |lesson: &&Exemplar| {
        first
            .iter()
            .any(|seed| seed.utterance == lesson.utterance && seed.program != lesson.program)
    };
    first.iter().chain(lessons.iter().filter(move |lesson| !against(lesson)))
}

fn layout_of(settings: &Seq2SeqSettings, words: &WordTable, vocabulary: &Vocabulary) -> Layout {
    Layout {
        dims: words.dims(),
        units: settings.units,
        token: settings.token,
        writes: vocabulary.writes(),
        tokens: vocabulary.tokens(),
    }
}

impl SemanticParser for Seq2SeqParser {
    /// One candidate, whose distance is 1 − its probability: always within the threshold.
    fn parse(&self, clause: &Clause) -> Parse {
        let lifted = &clause.lifted;
        let threshold = Seq2SeqParser::THRESHOLD;
        let Some((program, probability)) = self.write(lifted) else {
            return Parse { threshold, ..Parse::default() };
        };
        let distance = (1.0 - probability).clamp(0.0, threshold);
        let learned =
            |exemplar: &Exemplar| exemplar.utterance == *lifted && exemplar.program == program;
        let number = self.exemplars.iter().position(learned).map(|number| number as u32);
        let near = number.map(|number| Near {
            exemplar: lifted.clone(),
            program: program.clone(),
            distance,
            number,
        });
        let scored = Scored {
            program,
            distance,
            number: number.unwrap_or(Scored::OF_NONE),
            open: false,
            by: Some(Answerer::Seq2seq),
        };
        Parse {
            candidates: vec![scored],
            nearest: near.into_iter().collect(),
            threshold,
            // What it was taught as a whole is not read in parts.
            exact: usize::from(number.is_some()),
        }
    }

    /// One reading is all that it gives.
    fn sure_of_order(&self) -> bool {
        true
    }
}
