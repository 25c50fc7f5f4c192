use super::reranker::{Featured, Reranker, RerankerSettings};
use crate::ids::Digest;
use crate::language::Symbol;
use crate::numerics::{
    Adam, AdamSettings, LinearScratch, MlpGradients, MlpTrace, Rng, ln, relu, relu_backward,
    softmax,
};
use crate::parser::WordTable;

/// One moment of the history: what could have been done, and what was right.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The utterance's words.
    pub words: Vec<String>,
    /// At least one.
    pub candidates: Vec<Featured>,
    /// The right candidate's 0-based place.
    pub right: usize,
}

/// What a training of the reranker came to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RerankerFigures {
    /// Moments with more than one candidate.
    pub choices: usize,
    /// Full passes over the history.
    pub steps: usize,
    /// Mean cross-entropy, in nats.
    pub loss: f32,
}

impl Reranker {
    /// Trains on the whole history by softmax cross-entropy over each moment's candidates, all
    /// moments in every step.
    ///
    /// - `symbols`: everything that programs may consist of.
    /// - `features`: how many state features a candidate has.
    ///
    /// Source: the paper, section 3.1.3. Same bits on every machine.
    pub fn train(
        settings: &RerankerSettings,
        words: &'static WordTable,
        symbols: Vec<Symbol>,
        features: usize,
        seed: Digest,
        history: &[Choice],
    ) -> (Reranker, RerankerFigures) {
        let mut rng = Rng::from_digest(seed);
        let mut reranker = Reranker::new(settings, words, symbols, features, &mut rng);
        let batch = Batch::new(&reranker, features, history);
        let mut figures =
            RerankerFigures { choices: batch.right.len(), ..RerankerFigures::default() };
        let mut training = Training::new(settings, &reranker);
        while figures.steps < settings.steps_max && !batch.right.is_empty() {
            figures.loss = training.step(&mut reranker, &batch);
            figures.steps += 1;
            if figures.loss < settings.stop_below {
                break;
            }
        }
        (reranker, figures)
    }

    /// The share of the moments with a choice for which the right candidate scores highest; 1 when
    /// there are none.
    pub fn share_right(&self, history: &[Choice]) -> f64 {
        let open = history.iter().filter(|choice| choice.candidates.len() > 1);
        let (mut count, mut right) = (0, 0);
        for choice in open {
            let scores = self.scores(&choice.words, &choice.candidates);
            count += 1;
            right += usize::from(scores.iter().all(|score| *score <= scores[choice.right]));
        }
        if count == 0 { 1.0 } else { right as f64 / count as f64 }
    }
}

/// A history laid out for training: words, symbols and candidates of all choices in three flat
/// lists, each choice and candidate with its range.
struct Batch {
    /// One row per word of each choice.
    word_rows: Vec<f32>,
    /// Words of each choice.
    word_counts: Vec<usize>,
    symbols: Vec<usize>,
    /// Symbols of each candidate.
    symbol_counts: Vec<usize>,
    /// Candidates of each choice.
    candidate_counts: Vec<usize>,
    features: Vec<f32>,
    feature_count: usize,
    right: Vec<usize>,
}

impl Batch {
    fn new(reranker: &Reranker, feature_count: usize, history: &[Choice]) -> Batch {
        let mut batch = Batch {
            word_rows: Vec::new(),
            word_counts: Vec::new(),
            symbols: Vec::new(),
            symbol_counts: Vec::new(),
            candidate_counts: Vec::new(),
            features: Vec::new(),
            feature_count,
            right: Vec::new(),
        };
        // A choice with one candidate teaches nothing.
        for choice in history.iter().filter(|choice| choice.candidates.len() > 1) {
            batch.word_counts.push(reranker.word_rows(&choice.words, &mut batch.word_rows));
            batch.candidate_counts.push(choice.candidates.len());
            batch.right.push(choice.right);
            for candidate in &choice.candidates {
                let symbols = reranker.symbol_numbers(&candidate.program);
                batch.symbol_counts.push(symbols.len());
                batch.symbols.extend(symbols);
                assert_eq!(candidate.features.len(), feature_count, "features of a candidate");
                batch.features.extend_from_slice(&candidate.features);
            }
        }
        batch
    }
}

/// Optimisers, gradients and room to work in.
struct Training {
    said: (Adam, Vec<f32>),
    done: (Adam, Vec<f32>),
    vectors: (Adam, Vec<f32>),
    judge: MlpGradients,
    trace: MlpTrace,
    scratch: LinearScratch,
    word_after: Vec<f32>,
    symbol_rows: Vec<f32>,
    symbol_after: Vec<f32>,
    symbol_slope: Vec<f32>,
    inputs: Vec<f32>,
    input_slope: Vec<f32>,
}

impl Training {
    fn new(settings: &RerankerSettings, reranker: &Reranker) -> Training {
        let adam = AdamSettings {
            learning_rate: settings.learning_rate,
            weight_decay: 1e-3,
            ..AdamSettings::default()
        };
        let weights = &reranker.weights;
        let part = |count: usize| (Adam::new(count, adam), vec![0.0; count]);
        Training {
            said: part(weights.said.parameters.len()),
            done: part(weights.done.parameters.len()),
            vectors: part(weights.vectors.len()),
            judge: weights.judge.gradients(adam),
            trace: MlpTrace::default(),
            scratch: LinearScratch::default(),
            word_after: Vec::new(),
            symbol_rows: Vec::new(),
            symbol_after: Vec::new(),
            symbol_slope: Vec::new(),
            inputs: Vec::new(),
            input_slope: Vec::new(),
        }
    }

    /// One step over the whole batch.
    ///
    /// - returns: the mean cross-entropy before the step.
    fn step(&mut self, reranker: &mut Reranker, batch: &Batch) -> f32 {
        let (loss, slope) = self.forward(reranker, batch);
        self.backward(reranker, batch, &slope);
        let weights = &mut reranker.weights;
        for ((adam, gradient), parameters) in [
            (&mut self.said, &mut weights.said.parameters),
            (&mut self.done, &mut weights.done.parameters),
            (&mut self.vectors, &mut weights.vectors),
        ]
        .map(|(part, parameters)| ((&mut part.0, &mut part.1), parameters))
        {
            adam.step(parameters, gradient);
            gradient.fill(0.0);
        }
        self.judge.step(&mut weights.judge);
        loss
    }

    /// - returns: the mean cross-entropy, and its slope by each candidate's score.
    fn forward(&mut self, reranker: &Reranker, batch: &Batch) -> (f32, Vec<f32>) {
        let weights = &reranker.weights;
        let hidden = weights.said.outputs;
        let words: usize = batch.word_counts.iter().sum();
        self.word_after.resize(words * hidden, 0.0);
        weights.said.forward(words, &batch.word_rows, &mut self.word_after);
        relu(&mut self.word_after);
        self.symbol_rows.clear();
        let mut start = 0;
        for count in &batch.symbol_counts {
            reranker.symbol_rows(&batch.symbols[start..start + count], &mut self.symbol_rows);
            start += count;
        }
        self.symbol_after.resize(batch.symbols.len() * hidden, 0.0);
        weights.done.forward(batch.symbols.len(), &self.symbol_rows, &mut self.symbol_after);
        relu(&mut self.symbol_after);
        self.lay_inputs(hidden, batch);
        let candidates = batch.symbol_counts.len();
        let mut slope = weights.judge.forward(candidates, &self.inputs, &mut self.trace).to_vec();
        let share = 1.0 / batch.right.len() as f32;
        let mut loss = 0.0;
        let mut rest = &mut slope[..];
        for (count, right) in batch.candidate_counts.iter().zip(&batch.right) {
            let (scores, others) = rest.split_at_mut(*count);
            softmax(scores);
            loss -= share * ln(scores[*right].max(1e-7));
            scores[*right] -= 1.0;
            scores.iter_mut().for_each(|slope| *slope *= share);
            rest = others;
        }
        (loss, slope)
    }

    /// One row per candidate: the sum over the words, the sum over its symbols, its features.
    fn lay_inputs(&mut self, hidden: usize, batch: &Batch) {
        let width = 2 * hidden + batch.feature_count;
        self.inputs.clear();
        self.inputs.resize(batch.symbol_counts.len() * width, 0.0);
        let mut features = batch.features.chunks(batch.feature_count.max(1));
        let mut rows = self.inputs.chunks_exact_mut(width);
        let mut words = self.word_after.chunks_exact(hidden);
        let mut symbols = self.symbol_after.chunks_exact(hidden);
        let mut counts = batch.symbol_counts.iter();
        let mut utterance = vec![0.0; hidden];
        for (word_count, candidates) in batch.word_counts.iter().zip(&batch.candidate_counts) {
            utterance.fill(0.0);
            words.by_ref().take(*word_count).for_each(|row| add(&mut utterance, row));
            for _ in 0..*candidates {
                let row = rows.next().expect("a row per candidate");
                let count = *counts.next().expect("a count per candidate");
                row[..hidden].copy_from_slice(&utterance);
                let sum = &mut row[hidden..2 * hidden];
                symbols.by_ref().take(count).for_each(|symbol| add(sum, symbol));
                if batch.feature_count > 0 {
                    let features = features.next().expect("features per candidate");
                    row[2 * hidden..].copy_from_slice(features);
                }
            }
        }
    }

    fn backward(&mut self, reranker: &Reranker, batch: &Batch, slope: &[f32]) {
        let weights = &reranker.weights;
        let hidden = weights.said.outputs;
        let width = 2 * hidden + batch.feature_count;
        let candidates = batch.symbol_counts.len();
        self.input_slope.resize(candidates * width, 0.0);
        let into = Some(&mut self.input_slope[..]);
        weights.judge.backward(
            candidates,
            &self.inputs,
            &mut self.trace,
            slope,
            &mut self.judge,
            into,
        );
        // Each row of a sum has the slope of the sum.
        let mut word_slope = vec![0.0; self.word_after.len()];
        let mut symbol_slope = vec![0.0; self.symbol_after.len()];
        let mut rows = self.input_slope.chunks_exact(width);
        let mut words = word_slope.chunks_exact_mut(hidden);
        let mut symbols = symbol_slope.chunks_exact_mut(hidden);
        let mut counts = batch.symbol_counts.iter();
        let mut utterance = vec![0.0; hidden];
        for (word_count, of_choice) in batch.word_counts.iter().zip(&batch.candidate_counts) {
            utterance.fill(0.0);
            for _ in 0..*of_choice {
                let row = rows.next().expect("a row per candidate");
                let count = *counts.next().expect("a count per candidate");
                add(&mut utterance, &row[..hidden]);
                for symbol in symbols.by_ref().take(count) {
                    symbol.copy_from_slice(&row[hidden..2 * hidden]);
                }
            }
            words.by_ref().take(*word_count).for_each(|word| word.copy_from_slice(&utterance));
        }
        relu_backward(&self.word_after, &mut word_slope);
        relu_backward(&self.symbol_after, &mut symbol_slope);
        let word_total: usize = batch.word_counts.iter().sum();
        let (gradient, scratch) = (&mut self.said.1, &mut self.scratch);
        weights.said.backward(word_total, &batch.word_rows, &word_slope, gradient, None, scratch);
        self.symbol_slope.resize(self.symbol_rows.len(), 0.0);
        weights.done.backward(
            batch.symbols.len(),
            &self.symbol_rows,
            &symbol_slope,
            &mut self.done.1,
            Some(&mut self.symbol_slope),
            scratch,
        );
        let symbol_width = weights.done.inputs;
        for (symbol, slope) in batch.symbols.iter().zip(self.symbol_slope.chunks(symbol_width)) {
            add(&mut self.vectors.1[symbol * symbol_width..(symbol + 1) * symbol_width], slope);
        }
    }
}

fn add(to: &mut [f32], what: &[f32]) {
    to.iter_mut().zip(what).for_each(|(to, what)| *to += what);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::Program;

    fn history(rng: &mut Rng) -> Vec<Choice> {
        let words = ["grab", "the", "box", "wash", "it", "zonk"];
        let programs = ["TAKE Box", "GO Box; TAKE Box", "SWITCH Lamp", "GO Moon"];
        let draw = |rng: &mut Rng| Featured {
            program: programs[rng.below(4)].parse::<Program>().unwrap(),
            features: vec![rng.normal(), rng.normal()],
        };
        let choice = |_| Choice {
            words: (0..1 + rng.below(4)).map(|_| words[rng.below(6)].to_owned()).collect(),
            candidates: (0..2 + rng.below(3)).map(|_| draw(rng)).collect(),
            right: rng.below(2),
        };
        (0..5).map(choice).collect()
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        let seed = 5;
        println!("seed {seed}");
        let mut rng = Rng::from_u64(seed);
        let settings = RerankerSettings {
            hidden: 6,
            symbol: 5,
            steps_max: 1,
            learning_rate: 1e-3,
            stop_below: 0.0,
        };
        let words = WordTable::builtin("paper").unwrap();
        let symbols = ["TAKE", "GO", "Box", "SWITCH", "Lamp"].map(Symbol::new).to_vec();
        let mut reranker = Reranker::new(&settings, words, symbols, 2, &mut rng);
        let history = history(&mut rng);
        let batch = Batch::new(&reranker, 2, &history);
        let mut training = Training::new(&settings, &reranker);
        let (_, slope) = training.forward(&reranker, &batch);
        training.backward(&reranker, &batch, &slope);
        let found = [
            training.said.1.clone(),
            training.done.1.clone(),
            training.vectors.1.clone(),
            training.judge.layers[0].clone(),
            training.judge.layers[1].clone(),
        ];
        fn part(reranker: &mut Reranker, which: usize) -> &mut [f32] {
            let weights = &mut reranker.weights;
            match which {
                0 => &mut weights.said.parameters,
                1 => &mut weights.done.parameters,
                2 => &mut weights.vectors,
                3 => &mut weights.judge.layers[0].parameters,
                _ => &mut weights.judge.layers[1].parameters,
            }
        }
        let step = 2e-3;
        for (which, gradient) in found.iter().enumerate() {
            assert!(gradient.iter().any(|slope| *slope != 0.0), "part {which} has no slope");
            for index in (0..gradient.len()).step_by(gradient.len() / 17 + 1) {
                let kept = part(&mut reranker, which)[index];
                let mut loss_at = |value| {
                    part(&mut reranker, which)[index] = value;
                    training.forward(&reranker, &batch).0 as f64
                };
                let (above, below) = (loss_at(kept + step), loss_at(kept - step));
                part(&mut reranker, which)[index] = kept;
                let expected = (above - below) / (2.0 * step as f64);
                let gap = (expected - gradient[index] as f64).abs();
                assert!(
                    gap < 3e-3 + 0.03 * expected.abs(),
                    "part {which}, number {index}: {expected} against {}",
                    gradient[index]
                );
            }
        }
    }

    #[test]
    fn the_batch_scores_as_a_single_moment_does() {
        let mut rng = Rng::from_u64(8);
        let settings = RerankerSettings {
            hidden: 6,
            symbol: 5,
            steps_max: 1,
            learning_rate: 1e-3,
            stop_below: 0.0,
        };
        let words = WordTable::builtin("paper").unwrap();
        let reranker = Reranker::new(&settings, words, vec![Symbol::new("GO")], 2, &mut rng);
        let history = history(&mut rng);
        let batch = Batch::new(&reranker, 2, &history);
        let mut training = Training::new(&settings, &reranker);
        training.forward(&reranker, &batch);
        let scores: Vec<f32> = training.trace.output().to_vec();
        let single = history.iter().flat_map(|c| reranker.scores(&c.words, &c.candidates));
        for (batch, single) in scores.iter().zip(single) {
            assert!((batch - single).abs() < 1e-4, "{batch} against {single}");
        }
    }
}
