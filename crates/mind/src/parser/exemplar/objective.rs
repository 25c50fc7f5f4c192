use super::ExemplarSettings;
use super::batch::Batch;
use super::encoder::{Pass, forward, transform_positions};
use super::layout::Layout;
use crate::numerics::{
    Shape, Sink, dot, gemm, gemm_transposed_a, relu_backward, sigmoid_all, sum, transpose,
};

/// The loss of the pair classifier over all pairs of exemplars, and its gradient.
///
/// Over-sampling positive pairs until they balance the negative ones has the same expectation as
/// giving all positive pairs together the weight of all negative pairs together. That is done here,
/// over the whole n × n matrix, so that each utterance is embedded once per step.
pub(super) struct Objective<'a> {
    settings: &'a ExemplarSettings,
    layout: Layout,
    batch: &'a Batch,
    encoded_positions: Vec<f32>,
    /// 1 where two exemplars have the same program, else 0; `[rows × rows]`.
    truth: Vec<f32>,
    /// The weight of each pair; all together 1.
    weight: Vec<f32>,
    /// Weight of one positive and of one negative pair.
    weights: [f64; 2],
    pass: Pass,
    work: Work,
}

/// Memory for one step. Nothing is allocated after the first step.
#[derive(Default)]
struct Work {
    positions: Vec<f32>,
    transposed: Vec<f32>,
    cosines: Vec<f32>,
    slopes: Vec<f32>,
    embeddings: Vec<f32>,
    middle: Vec<f32>,
    sums: Vec<f32>,
    cells: Vec<f32>,
    tokens: Vec<f32>,
    position_slopes: Vec<f32>,
    inputs: Vec<f32>,
}

impl<'a> Objective<'a> {
    /// `classes[i] == classes[j]` says that exemplars i and j have the same program.
    pub(super) fn new(
        settings: &'a ExemplarSettings,
        layout: Layout,
        batch: &'a Batch,
        classes: &[usize],
        encoded_positions: Vec<f32>,
    ) -> Objective<'a> {
        let rows = classes.len();
        let mut truth = Vec::with_capacity(rows * rows);
        for one in classes {
            truth.extend(classes.iter().map(|two| if one == two { 1.0 } else { 0.0 }));
        }
        let counted = |at: usize| settings.self_pairs || at / rows != at % rows;
        let counts = (0..rows * rows).filter(|&at| counted(at)).fold([0, 0], |mut counts, at| {
            counts[(truth[at] == 0.0) as usize] += 1;
            counts
        });
        // A class without a pair leaves its half unused, so that nothing is divided by zero.
        let weights = counts.map(|count: usize| 0.5 / count.max(1) as f64);
        let weight = (0..rows * rows).map(|at| match counted(at) {
            true => weights[(truth[at] == 0.0) as usize] as f32,
            false => 0.0,
        });
        let weight = weight.collect();
        let (pass, work) = (Pass::default(), Work::default());
        Objective { settings, layout, batch, encoded_positions, truth, weight, weights, pass, work }
    }

    /// Overwrites `gradient`; returns the loss in nats, before the step that follows.
    pub(super) fn evaluate(&mut self, parameters: &[f32], gradient: &mut [f32]) -> f64 {
        let Objective { settings, layout, batch, pass, work, .. } = self;
        let encoded = &self.encoded_positions;
        transform_positions(*layout, parameters, encoded, &mut work.positions);
        forward(settings, *layout, parameters, batch, &work.positions, pass);
        gradient.fill(0.0);
        let loss = self.pairs(parameters, gradient);
        self.network(parameters, gradient);
        self.words(parameters, gradient);
        loss
    }

    /// From embeddings to the loss, and back to the gradient of the embeddings.
    fn pairs(&mut self, parameters: &[f32], gradient: &mut [f32]) -> f64 {
        let Objective { layout, batch, pass, work, truth, weight, .. } = self;
        let (rows, width) = (batch.rows(), layout.embedding);
        let [a_at, b_at] = layout.classifier();
        let (a, b) = (parameters[a_at], parameters[b_at]);
        transpose(rows, width, &pass.embeddings, &mut work.transposed);
        work.cosines.resize(rows * rows, 0.0);
        let shape = Shape { rows, inner: width, columns: rows };
        gemm(shape, &pass.embeddings, &work.transposed, &mut work.cosines, Sink::Replace);
        work.slopes.clear();
        work.slopes.extend(work.cosines.iter().map(|cosine| a * cosine + b));
        sigmoid_all(&mut work.slopes);
        let loss = cross_entropy(&work.slopes, truth, weight, self.weights);
        for ((slope, truth), weight) in work.slopes.iter_mut().zip(truth).zip(weight) {
            *slope = (*slope - *truth) * *weight;
        }
        gradient[a_at] = dot(&work.slopes, &work.cosines);
        gradient[b_at] = sum(&work.slopes);
        // The matrix is symmetric and has each pair twice, hence 2a.
        work.embeddings.resize(rows * width, 0.0);
        let shape = Shape { rows, inner: rows, columns: width };
        gemm(shape, &work.slopes, &pass.embeddings, &mut work.embeddings, Sink::Replace);
        let unit = self.settings.normalise;
        let slopes = work.embeddings.chunks_exact_mut(width);
        let points = pass.embeddings.chunks_exact(width);
        for ((slope, point), norm) in slopes.zip(points).zip(&pass.norms) {
            slope.iter_mut().for_each(|s| *s *= 2.0 * a);
            if unit && *norm > 0.0 {
                // Only the part at right angles to the unit vector changes its direction.
                let along = dot(slope, point);
                slope.iter_mut().zip(point).for_each(|(s, p)| *s = (*s - along * p) / norm);
            }
        }
        loss
    }

    /// Back through the MLP, to the gradient of the sums.
    fn network(&mut self, parameters: &[f32], gradient: &mut [f32]) {
        let Objective { layout, batch, pass, work, .. } = self;
        let Layout { hidden, embedding, .. } = *layout;
        let rows = batch.rows();
        let shape = Shape { rows: hidden, inner: rows, columns: embedding };
        let slope = &mut gradient[layout.second()];
        gemm_transposed_a(shape, &pass.middle, &work.embeddings, slope, Sink::Replace);
        add_rows(&work.embeddings, &mut gradient[layout.second_bias()]);
        transpose(hidden, embedding, &parameters[layout.second()], &mut work.transposed);
        work.middle.resize(rows * hidden, 0.0);
        let shape = Shape { rows, inner: embedding, columns: hidden };
        gemm(shape, &work.embeddings, &work.transposed, &mut work.middle, Sink::Replace);
        relu_backward(&pass.middle, &mut work.middle);

        let shape = Shape { rows: hidden, inner: rows, columns: hidden };
        let slope = &mut gradient[layout.first()];
        gemm_transposed_a(shape, &pass.sums, &work.middle, slope, Sink::Replace);
        add_rows(&work.middle, &mut gradient[layout.first_bias()]);
        transpose(hidden, hidden, &parameters[layout.first()], &mut work.transposed);
        work.sums.resize(rows * hidden, 0.0);
        let shape = Shape { rows, inner: hidden, columns: hidden };
        gemm(shape, &work.middle, &work.transposed, &mut work.sums, Sink::Replace);
    }

    /// Back through the sum and the word transform.
    fn words(&mut self, parameters: &[f32], gradient: &mut [f32]) {
        let Objective { layout, batch, pass, work, .. } = self;
        let Layout { dims, hidden, .. } = *layout;
        reset(&mut work.cells, pass.cells.len());
        for (row, slope) in work.sums.chunks_exact(hidden).enumerate() {
            for &cell in batch.row(row) {
                let cell = &mut work.cells[cell as usize * hidden..][..hidden];
                cell.iter_mut().zip(slope).for_each(|(x, s)| *x += s);
            }
        }
        relu_backward(&pass.cells, &mut work.cells);
        reset(&mut work.tokens, batch.tokens() * hidden);
        reset(&mut work.position_slopes, batch.positions * hidden);
        for (slope, &(token, position)) in work.cells.chunks_exact(hidden).zip(&batch.cells) {
            let token = &mut work.tokens[token as usize * hidden..][..hidden];
            token.iter_mut().zip(slope).for_each(|(x, s)| *x += s);
            let position = &mut work.position_slopes[position as usize * hidden..][..hidden];
            position.iter_mut().zip(slope).for_each(|(x, s)| *x += s);
        }
        let slope = &mut gradient[layout.transform()];
        let shape = Shape { rows: dims, inner: batch.tokens(), columns: hidden };
        gemm_transposed_a(shape, &pass.inputs, &work.tokens, slope, Sink::Replace);
        let shape = Shape { inner: batch.positions, ..shape };
        let encoded = &self.encoded_positions;
        gemm_transposed_a(shape, encoded, &work.position_slopes, slope, Sink::Add);
        add_rows(&work.position_slopes, &mut gradient[layout.transform_bias()]);

        let trainable = |token: &usize| batch.sorts[*token].is_some();
        transpose(dims, hidden, &parameters[layout.transform()], &mut work.transposed);
        work.inputs.resize(dims, 0.0);
        let shape = Shape { rows: 1, inner: hidden, columns: dims };
        for token in (0..batch.tokens()).filter(trainable) {
            let slope = &work.tokens[token * hidden..][..hidden];
            gemm(shape, slope, &work.transposed, &mut work.inputs, Sink::Replace);
            let sort = batch.sorts[token].expect("only tokens with a sort are left");
            let vector = &mut gradient[layout.sort(sort)];
            vector.iter_mut().zip(&work.inputs).for_each(|(x, s)| *x += s);
        }
    }
}

fn reset(numbers: &mut Vec<f32>, count: usize) {
    numbers.clear();
    numbers.resize(count, 0.0);
}

/// Adds the rows of `x` to `out`.
fn add_rows(x: &[f32], out: &mut [f32]) {
    for row in x.chunks_exact(out.len()) {
        out.iter_mut().zip(row).for_each(|(sum, x)| *sum += x);
    }
}

/// Balanced cross-entropy in nats. One logarithm per pair would take most of the time, so forty
/// probabilities at a time are multiplied first: each is at least 1e-7, and 1e-280 is still a
/// number.
fn cross_entropy(probabilities: &[f32], truth: &[f32], weight: &[f32], weights: [f64; 2]) -> f64 {
    let mut loss = [0.0, 0.0];
    let pieces = probabilities.chunks(40).zip(truth.chunks(40)).zip(weight.chunks(40));
    for ((probabilities, truth), weight) in pieces {
        let mut products = [1.0f64, 1.0];
        for ((&probability, &truth), &weight) in probabilities.iter().zip(truth).zip(weight) {
            let negative = (truth == 0.0) as usize;
            let given = [probability, 1.0 - probability][negative].max(1e-7);
            products[negative] *= if weight > 0.0 { given as f64 } else { 1.0 };
        }
        for (loss, product) in loss.iter_mut().zip(products) {
            *loss -= libm::log(product);
        }
    }
    loss[0] * weights[0] + loss[1] * weights[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::LiftedUtterance;
    use crate::numerics::Rng;
    use crate::parser::WordTable;
    use crate::parser::exemplar::batch::encode_positions;
    use crate::parser::exemplar::tokens::Tokeniser;

    fn check_gradients(settings: &ExemplarSettings) {
        let words = WordTable::builtin("paper").unwrap();
        let utterances = [
            "wash the <obj>",
            "rinse <obj> <obj> please",
            "put the <obj> in the <color>",
            "drop <obj> <obj=sink>",
            "go <obj>",
        ];
        let tokeniser = Tokeniser::new(settings);
        let rows = utterances.map(|text| tokeniser.tokens(&LiftedUtterance::parse(text)));
        let sorts = ["color".to_owned(), "obj".to_owned()];
        let batch = Batch::new(settings, words, &sorts, &rows);
        let layout = Layout {
            dims: words.dims(),
            hidden: settings.hidden,
            embedding: settings.embedding,
            sorts: sorts.len(),
        };
        let mut encoded = Vec::new();
        encode_positions(settings, layout.dims, 0, batch.positions, &mut encoded);
        let mut objective = Objective::new(settings, layout, &batch, &[0, 0, 1, 1, 2], encoded);
        let seed = 41;
        println!("seed {seed}");
        let mut rng = Rng::from_u64(seed);
        let mut parameters: Vec<f32> = (0..layout.total()).map(|_| rng.normal() * 0.3).collect();
        let [a, b] = layout.classifier();
        (parameters[a], parameters[b]) = (2.0, -0.5);
        let mut gradient = vec![0.0; layout.total()];
        objective.evaluate(&parameters, &mut gradient);
        let mut unused = gradient.clone();
        let parts = [
            layout.transform(),
            layout.transform_bias(),
            layout.first(),
            layout.first_bias(),
            layout.second(),
            layout.second_bias(),
            layout.sort(0),
            layout.sort(1),
            a..b + 1,
        ];
        for part in parts {
            // The whole part along its own gradient: large against the rounding of f32, and every
            // parameter has its say.
            let length = gradient[part.clone()].iter().map(|g| g * g).sum::<f32>().sqrt();
            assert!(length > 1e-6, "no gradient in {part:?}");
            let step = 1e-3;
            let mut moved = |by: f32| {
                let mut moved = parameters.clone();
                for at in part.clone() {
                    moved[at] += by * gradient[at] / length;
                }
                objective.evaluate(&moved, &mut unused)
            };
            let slope = (moved(step) - moved(-step)) / (2.0 * step as f64);
            let gap = (slope / length as f64 - 1.0).abs();
            assert!(gap < 0.03, "{part:?}: slope {slope}, gradient {length}");
        }
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        let small = ExemplarSettings { hidden: 12, embedding: 7, ..ExemplarSettings::default() };
        check_gradients(&small);
        check_gradients(&ExemplarSettings { normalise: false, ..small.clone() });
        check_gradients(&ExemplarSettings { self_pairs: true, positions: false, ..small.clone() });
        check_gradients(&ExemplarSettings { fixture_weight: 0.4, position_scale: 1.0, ..small });
    }

    #[test]
    fn a_loss_summed_by_products_is_the_loss_summed_by_logarithms() {
        let seed = 43;
        println!("seed {seed}");
        let mut rng = Rng::from_u64(seed);
        let count = 1_003;
        let given: Vec<f32> = (0..count).map(|_| rng.uniform()).collect();
        let truth: Vec<f32> = (0..count).map(|_| (rng.below(5) == 0) as u8 as f32).collect();
        let weight: Vec<f32> = (0..count).map(|_| (rng.below(3) > 0) as u8 as f32).collect();
        let mut expected = 0.0;
        for index in 0..count {
            let positive = truth[index] == 1.0;
            let share = if positive { 0.5 } else { 0.01 };
            let loss = crate::numerics::bce(given[index], positive) as f64;
            expected += weight[index] as f64 * share * loss;
        }
        let found = cross_entropy(&given, &truth, &weight, [0.5, 0.01]);
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} against {expected}");
        let certain = vec![0.0; 80];
        let found = cross_entropy(&certain, &[1.0; 80], &[1.0; 80], [1.0, 1.0]);
        assert!((found / 80.0 - 16.118).abs() < 1e-2, "{found}");
    }
}
