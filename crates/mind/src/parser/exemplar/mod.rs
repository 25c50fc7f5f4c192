//! The paper's parser: an utterance means what its nearest exemplar means, if that is within the
//! threshold. Source: the paper, section 3.

mod batch;
mod encoder;
mod index;
mod layout;
mod objective;
mod settings;
mod threshold;
mod tokens;
mod train;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use encoder::Encoder;
use index::ExemplarIndex;
use tokens::Tokeniser;

pub use settings::{ExemplarSettings, ThresholdReading};

use super::{Parse, Scored, SemanticParser, WordTable};
use crate::ids::Digest;
use crate::language::{Clause, Exemplar, LiftedUtterance, Near};
use crate::limits::CANDIDATES_MAX;
use crate::numerics::Floats;

/// What a training measured about itself, by name.
pub type Figures = BTreeMap<String, f64>;

/// Utterances that only set the threshold; the network never sees them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Calibration<'a> {
    /// Other wordings with their right programs.
    pub variants: &'a [Exemplar],
    /// Requests that no exemplar covers: accepting one is always wrong.
    pub unknown: &'a [LiftedUtterance],
}

/// Why there is no parser.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TrainFault {
    /// A setting has a value that no training can use.
    #[error("the parser setting {field} is {value}; allowed is {allowed}")]
    Setting {
        /// Its name.
        field: &'static str,
        /// Its value.
        value: String,
        /// The allowed values, in words.
        allowed: String,
    },
    /// There are no exemplars.
    #[error("there is no exemplar to learn from")]
    NoExemplars,
    /// An exemplar has no words.
    #[error("exemplar {number} has no words")]
    NoWords {
        /// Its place; 0-based.
        number: usize,
    },
    /// The loss is not finite.
    #[error("the loss became {loss} at step {step}; lower the learning rate")]
    Diverged {
        /// The step.
        step: usize,
        /// The loss, in nats.
        loss: String,
    },
    /// Stored weights do not belong to these settings and exemplars.
    #[error("the learned weights do not fit: {reason}; train again")]
    Weights {
        /// A sentence.
        reason: String,
    },
}

/// What a training learned. Settings, word table, exemplars and these weights make the parser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExemplarWeights {
    /// The sorts that have a trainable vector, in order.
    pub sorts: Vec<String>,
    /// The network and the classifier, laid out by `layout.rs`.
    pub parameters: Floats,
    /// L2 between embeddings.
    pub threshold: f32,
}

/// The exemplars, the network that embeds utterances, and the threshold.
#[derive(Debug, Clone)]
pub struct ExemplarParser {
    tokeniser: Tokeniser,
    encoder: Encoder,
    weights: ExemplarWeights,
    exemplars: Vec<Exemplar>,
    /// Exemplar numbers by lifted form, then by age.
    by_form: Vec<u32>,
    index: ExemplarIndex,
    nearest: usize,
}

impl ExemplarParser {
    /// Learns from `examples` and sets the threshold by `calibration`. A pure function: equal
    /// arguments give equal bits, on every machine.
    pub fn train(
        settings: &ExemplarSettings,
        words: &'static WordTable,
        seed: Digest,
        examples: &[Exemplar],
        calibration: Calibration<'_>,
    ) -> Result<(ExemplarParser, Figures), TrainFault> {
        settings.check()?;
        let (sorts, parameters, mut figures) = train::train(settings, words, seed, examples)?;
        // The threshold is set with the trained parser.
        let weights = ExemplarWeights { sorts, parameters, threshold: settings.beta };
        let mut parser = ExemplarParser::restore(settings, words, examples, weights)?;
        parser.weights.threshold =
            threshold::calibrate(settings, &parser, calibration, &mut figures);
        threshold::measure(&parser, &mut figures);
        Ok((parser, figures))
    }

    /// The parser that `weights` came from, given the same settings, table and exemplars.
    ///
    /// - errors: settings, exemplars or weights that cannot belong together.
    pub fn restore(
        settings: &ExemplarSettings,
        words: &'static WordTable,
        examples: &[Exemplar],
        weights: ExemplarWeights,
    ) -> Result<ExemplarParser, TrainFault> {
        settings.check()?;
        if examples.is_empty() {
            return Err(TrainFault::NoExemplars);
        }
        let tokeniser = Tokeniser::new(settings);
        let encoder = Encoder::new(settings, words, &weights)?;
        let utterances = examples.iter().map(|exemplar| &exemplar.utterance);
        let rows: Vec<_> = utterances.map(|utterance| tokeniser.tokens(utterance)).collect();
        let embeddings = encoder.embed(&weights.parameters, &rows);
        let index = ExemplarIndex::new(settings.embedding, embeddings)?;
        let mut by_form: Vec<u32> = (0..examples.len() as u32).collect();
        // Stable: among equal forms the older stays first.
        by_form.sort_by_key(|&number| &examples[number as usize].utterance);
        let (exemplars, nearest) = (examples.to_vec(), settings.nearest);
        Ok(ExemplarParser { tokeniser, encoder, weights, exemplars, by_form, index, nearest })
    }

    /// What training learned.
    pub fn weights(&self) -> &ExemplarWeights {
        &self.weights
    }

    /// The exemplars, in the order of training. A [`Scored::number`] is a place in this list.
    pub fn exemplars(&self) -> &[Exemplar] {
        &self.exemplars
    }

    /// The largest distance of an exemplar that is understood (L2 between embeddings).
    pub fn threshold(&self) -> f32 {
        self.weights.threshold
    }

    /// The embedding of an utterance: `[embedding]`, of length 1 if the settings say so.
    pub fn embed(&self, lifted: &LiftedUtterance) -> Vec<f32> {
        self.embed_all(&[lifted])
    }

    /// The embeddings of several utterances: `[utterances × embedding]`, each row as
    /// [`ExemplarParser::embed`] gives it.
    fn embed_all(&self, utterances: &[&LiftedUtterance]) -> Vec<f32> {
        let rows: Vec<_> = utterances.iter().map(|u| self.tokeniser.tokens(u)).collect();
        self.encoder.embed(&self.weights.parameters, &rows)
    }

    /// The exemplars of exactly this lifted form, oldest first. More than one means that they may
    /// disagree; the oldest is then the answer.
    pub fn exact(&self, lifted: &LiftedUtterance) -> &[u32] {
        let form = |number: &u32| &self.exemplars[*number as usize].utterance;
        let start = self.by_form.partition_point(|number| form(number) < lifted);
        let count = self.by_form[start..].partition_point(|number| form(number) == lifted);
        &self.by_form[start..start + count]
    }

    fn near(&self, (number, distance): (u32, f32)) -> Near {
        let Exemplar { utterance, program } = self.exemplars[number as usize].clone();
        Near { exemplar: utterance, program, distance, number }
    }

    /// [`SemanticParser::parse`] with another threshold than its own.
    pub fn parse_within(&self, clause: &Clause, threshold: f32) -> Parse {
        let lifted = &clause.lifted;
        if lifted.words.is_empty() {
            return Parse { threshold, ..Parse::default() };
        }
        let exact = self.exact(lifted);
        let found = self.index.near(&self.embed(lifted), threshold, self.nearest);
        let within = found.iter().copied().filter(|&(_, distance)| distance <= threshold);
        // An exact form comes first even where dropped stop words make others equally near.
        let ordered = exact.iter().map(|&number| (number, 0.0)).chain(within);
        let mut candidates: Vec<Scored> = Vec::new();
        let mut exact_programs = 0;
        for (place, (number, distance)) in ordered.enumerate() {
            let program = &self.exemplars[number as usize].program;
            // A program with more slots than there are mentions can never be filled.
            if program.slots() <= lifted.slots()
                && candidates.len() < CANDIDATES_MAX
                && candidates.iter().all(|known| known.program != *program)
            {
                candidates.push(Scored {
                    program: program.clone(),
                    distance,
                    number,
                    open: false,
                    by: None,
                });
                exact_programs += usize::from(place < exact.len());
            }
        }
        let mut nearest: Vec<(u32, f32)> = exact.iter().map(|&number| (number, 0.0)).collect();
        nearest.extend(found.iter().filter(|(number, _)| !exact.contains(number)));
        nearest.truncate(self.nearest);
        Parse {
            candidates,
            nearest: nearest.into_iter().map(|near| self.near(near)).collect(),
            threshold,
            exact: exact_programs,
        }
    }
}

impl SemanticParser for ExemplarParser {
    fn parse(&self, clause: &Clause) -> Parse {
        self.parse_within(clause, self.threshold())
    }
}

#[cfg(test)]
mod tests;
