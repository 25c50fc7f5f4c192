use serde::{Deserialize, Serialize};

use super::moment::Moment;
use crate::language::{Program, Symbol};
use crate::limits::{PROGRAM_STEPS_MAX, UTTERANCE_WORDS_MAX};
use crate::numerics::{
    Floats, Linear, Mlp, MlpTrace, Rng, cos, exp, fill_normal, normalise, relu, sin,
};
use crate::parser::WordTable;
use crate::world::Features;

/// The sizes of the reranker and how it is trained.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RerankerSettings {
    /// Width of the sums over words and over the program's symbols.
    pub hidden: usize,
    /// Width of a symbol's learned vector.
    pub symbol: usize,
    /// Full passes over the history.
    pub steps_max: usize,
    /// How far a step goes.
    pub learning_rate: f32,
    /// Training stops when the mean cross-entropy falls below this many nats.
    pub stop_below: f32,
}

/// Scores ground programs in a scene. A score depends on the utterance (word vectors and positions,
/// transformed and summed), on the state features, and on the program (learned vectors of its
/// operators and arguments with their positions, transformed and summed). Scores can only be
/// compared with each other. Source: the paper, section 3.1.3.
#[derive(Debug, Clone)]
pub struct Reranker {
    words: &'static WordTable,
    pub(super) weights: RerankerWeights,
    places: Places,
}

/// What training found, as it is stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RerankerWeights {
    /// In order; the row of a symbol in `vectors` is its place plus 1, row 0 is for all others.
    pub(super) symbols: Vec<Symbol>,
    /// Row-major, `[symbols + 1 × symbol width]`.
    pub(super) vectors: Floats,
    /// Transforms a word with its position.
    pub(super) said: Linear,
    /// Transforms a symbol with its position.
    pub(super) done: Linear,
    /// From both sums and the state features to the score.
    pub(super) judge: Mlp,
}

/// A program with its state features, [`Features::feature_count`] numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Featured {
    /// What would be carried out.
    pub program: Program,
    /// What the world says about it.
    pub features: Vec<f32>,
}

impl Reranker {
    /// Random weights, before training.
    pub(super) fn new(
        settings: &RerankerSettings,
        words: &'static WordTable,
        mut symbols: Vec<Symbol>,
        features: usize,
        rng: &mut Rng,
    ) -> Reranker {
        symbols.sort();
        symbols.dedup();
        let mut vectors = Floats::zeros((symbols.len() + 1) * settings.symbol);
        fill_normal(&mut vectors, 0.3, rng);
        let hidden = settings.hidden;
        let said = Linear::new(words.dims(), hidden, rng);
        let done = Linear::new(settings.symbol, hidden, rng);
        let judge = Mlp::new(&[2 * hidden + features, hidden, 1], rng);
        let weights = RerankerWeights { symbols, vectors, said, done, judge };
        let places = Places::new(&weights);
        Reranker { words, weights, places }
    }

    /// A trained reranker from its stored weights.
    ///
    /// - errors: a sentence, when the weights do not fit together, the word table or `features`.
    pub fn restore(
        words: &'static WordTable,
        weights: RerankerWeights,
        features: usize,
    ) -> Result<Reranker, String> {
        let RerankerWeights { symbols, vectors, said, done, judge } = &weights;
        let whole = said.is_whole() && done.is_whole() && judge.is_whole();
        let sizes_fit = said.inputs == words.dims()
            && said.outputs == done.outputs
            && judge.inputs().checked_sub(features) == said.outputs.checked_mul(2)
            && judge.outputs() == 1
            && done.inputs.checked_mul(symbols.len() + 1) == Some(vectors.len());
        let ordered = symbols.windows(2).all(|pair| pair[0] < pair[1]);
        let finite = vectors.all_finite()
            && said.parameters.all_finite()
            && done.parameters.all_finite()
            && judge.layers.iter().all(|layer| layer.parameters.all_finite());
        if !(whole && sizes_fit && ordered && finite && done.inputs > 0 && said.outputs > 0) {
            return Err("the reranker's weights do not fit together".to_owned());
        }
        let places = Places::new(&weights);
        Ok(Reranker { words, weights, places })
    }

    /// What training found.
    pub fn weights(&self) -> &RerankerWeights {
        &self.weights
    }

    /// The 0-based place of the best of `programs`; the first among equals.
    ///
    /// - panics: `programs` is empty.
    pub fn best<'p, D: Features>(
        &self,
        moment: &Moment<'_, D>,
        words: &[String],
        programs: impl Iterator<Item = &'p Program>,
    ) -> usize {
        let featured: Vec<Featured> = programs.map(|program| featured(moment, program)).collect();
        let scores = self.scores(words, &featured);
        let ranked = scores.iter().enumerate().rev().max_by(|a, b| a.1.total_cmp(b.1));
        ranked.expect("there is at least one program to choose from").0
    }

    /// One score per candidate; no unit.
    pub fn scores(&self, words: &[String], candidates: &[Featured]) -> Vec<f32> {
        let weights = &self.weights;
        let hidden = weights.said.outputs;
        let (mut rows, mut after) = (Vec::new(), Vec::new());
        let mut utterance = vec![0.0; hidden];
        let count = self.word_rows(words, &mut rows);
        transform_and_sum(&weights.said, count, &rows, &mut after, &mut utterance);
        let mut inputs = Vec::with_capacity(candidates.len() * weights.judge.inputs());
        let mut program = vec![0.0; hidden];
        for candidate in candidates {
            rows.clear();
            let symbols = self.symbol_numbers(&candidate.program);
            self.symbol_rows(&symbols, &mut rows);
            transform_and_sum(&weights.done, symbols.len(), &rows, &mut after, &mut program);
            inputs.extend_from_slice(&utterance);
            inputs.extend_from_slice(&program);
            inputs.extend_from_slice(&candidate.features);
        }
        let mut trace = MlpTrace::default();
        weights.judge.forward(candidates.len(), &inputs, &mut trace).to_vec()
    }

    /// Appends a row for each word: its vector plus its position's. Returns the number of rows.
    pub(super) fn word_rows(&self, words: &[String], rows: &mut Vec<f32>) -> usize {
        let width = self.words.dims();
        let words = words.iter().filter(|word| word.chars().any(char::is_alphanumeric));
        let mut count = 0;
        for (word, place) in words.zip(self.places.said.chunks_exact(width)) {
            let start = rows.len();
            rows.extend_from_slice(&self.words.vector(word));
            // Unit length: frequent words have long vectors, and training fails with long sums.
            normalise(&mut rows[start..]);
            add(&mut rows[start..], place);
            count += 1;
        }
        count
    }

    /// The rows of the program's operators and arguments in the learned vectors, in order.
    pub(super) fn symbol_numbers(&self, program: &Program) -> Vec<usize> {
        let symbols = &self.weights.symbols;
        let number = |symbol: &Symbol| symbols.binary_search(symbol).map_or(0, |place| place + 1);
        let step_symbols =
            program.steps.iter().flat_map(|step| std::iter::once(&step.operator).chain(&step.args));
        step_symbols.take(SYMBOLS_MAX).map(number).collect()
    }

    pub(super) fn symbol_rows(&self, symbols: &[usize], rows: &mut Vec<f32>) {
        let width = self.weights.done.inputs;
        for (symbol, place) in symbols.iter().zip(self.places.done.chunks_exact(width)) {
            let start = rows.len();
            rows.extend_from_slice(&self.weights.vectors[symbol * width..(symbol + 1) * width]);
            add(&mut rows[start..], place);
        }
    }
}

/// The program with what the world says about it.
pub fn featured<D: Features>(moment: &Moment<'_, D>, program: &Program) -> Featured {
    let features = moment.domain.features(moment.scene, program);
    Featured { program: program.clone(), features }
}

/// Symbols of a program that are read: an operator with up to two arguments per step.
const SYMBOLS_MAX: usize = 3 * PROGRAM_STEPS_MAX;

/// Position vectors, sine and cosine in turn (Vaswani et al. 2017), scaled down so that a word
/// outweighs its place.
#[derive(Debug, Clone)]
struct Places {
    said: Vec<f32>,
    done: Vec<f32>,
}

impl Places {
    fn new(weights: &RerankerWeights) -> Places {
        Places {
            said: places(UTTERANCE_WORDS_MAX, weights.said.inputs),
            done: places(SYMBOLS_MAX, weights.done.inputs),
        }
    }
}

fn places(count: usize, width: usize) -> Vec<f32> {
    const SCALE: f32 = 0.3;
    /// ln 10,000.
    const LN_PERIOD: f32 = 9.210_34;
    let rate = |pair: usize| exp(-LN_PERIOD * (2 * pair) as f32 / width as f32);
    let rates: Vec<f32> = (0..width.div_ceil(2)).map(rate).collect();
    let mut out = Vec::with_capacity(count * width);
    for place in 0..count {
        for at in 0..width {
            let angle = place as f32 * rates[at / 2];
            out.push(SCALE * if at % 2 == 0 { sin(angle) } else { cos(angle) });
        }
    }
    out
}

fn add(to: &mut [f32], what: &[f32]) {
    to.iter_mut().zip(what).for_each(|(to, what)| *to += what);
}

/// `sum = Σ relu(row · W + b)` over `count` rows.
fn transform_and_sum(
    layer: &Linear,
    count: usize,
    rows: &[f32],
    after: &mut Vec<f32>,
    sum: &mut [f32],
) {
    after.resize(count * layer.outputs, 0.0);
    layer.forward(count, rows, after);
    relu(after);
    sum.fill(0.0);
    after.chunks_exact(layer.outputs).for_each(|row| add(sum, row));
}
