use super::batch::{Batch, encode_positions};
use super::layout::Layout;
use super::tokens::Token;
use super::{ExemplarSettings, ExemplarWeights, TrainFault};
use crate::numerics::{Shape, Sink, gemm, normalise, relu};
use crate::parser::WordTable;

/// Word positions whose transform is kept. Longer utterances are rare, and compute the rest.
const POSITIONS_KEPT: usize = 32;

/// The network in use: from tokens to embeddings.
#[derive(Debug, Clone)]
pub(super) struct Encoder {
    settings: ExemplarSettings,
    words: &'static WordTable,
    layout: Layout,
    sorts: Vec<String>,
    /// Transformed positions with the bias in, `[POSITIONS_KEPT × hidden]`.
    positions: Vec<f32>,
}

/// The results of a pass through the network, for the backward pass. The next pass uses the memory
/// again.
#[derive(Debug, Clone, Default)]
pub(super) struct Pass {
    /// Whole token vectors, `[tokens × dims]`.
    pub inputs: Vec<f32>,
    /// `[tokens × hidden]`.
    pub tokens: Vec<f32>,
    /// `[cells × hidden]`, after max(x, 0).
    pub cells: Vec<f32>,
    /// `[rows × hidden]`.
    pub sums: Vec<f32>,
    /// `[rows × hidden]`, after max(x, 0).
    pub middle: Vec<f32>,
    /// `[rows × embedding]`, of unit length where the settings say so.
    pub embeddings: Vec<f32>,
    /// `[rows]`, before normalising.
    pub norms: Vec<f32>,
}

impl Encoder {
    pub(super) fn new(
        settings: &ExemplarSettings,
        words: &'static WordTable,
        weights: &ExemplarWeights,
    ) -> Result<Encoder, TrainFault> {
        let layout = Layout {
            dims: words.dims(),
            hidden: settings.hidden,
            embedding: settings.embedding,
            sorts: weights.sorts.len(),
        };
        let fits = |holds: bool, reason: &str| match holds {
            true => Ok(()),
            false => Err(TrainFault::Weights { reason: reason.to_owned() }),
        };
        let (found, expected) = (weights.parameters.len(), layout.total());
        fits(found == expected, &format!("{found} parameters, expected {expected}"))?;
        fits(weights.parameters.all_finite(), "a parameter is not a finite number")?;
        let threshold = weights.threshold;
        fits(threshold.is_finite() && threshold >= 0.0, "the threshold is no distance")?;
        fits(weights.sorts.windows(2).all(|pair| pair[0] < pair[1]), "sorts are out of order")?;
        let mut encoded = Vec::new();
        encode_positions(settings, layout.dims, 0, POSITIONS_KEPT, &mut encoded);
        let mut positions = Vec::new();
        transform_positions(layout, &weights.parameters, &encoded, &mut positions);
        let (settings, sorts) = (settings.clone(), weights.sorts.clone());
        Ok(Encoder { settings, words, layout, sorts, positions })
    }

    /// The embeddings, `[rows × embedding]`. A row does not depend on other rows.
    ///
    /// - `parameters`: of the weights that this encoder was made for.
    pub(super) fn embed(&self, parameters: &[f32], rows: &[Vec<Token>]) -> Vec<f32> {
        let batch = Batch::new(&self.settings, self.words, &self.sorts, rows);
        let mut longer = Vec::new();
        let positions = if batch.positions <= POSITIONS_KEPT {
            &self.positions
        } else {
            let mut encoded = Vec::new();
            let dims = self.layout.dims;
            encode_positions(&self.settings, dims, 0, batch.positions, &mut encoded);
            transform_positions(self.layout, parameters, &encoded, &mut longer);
            &longer
        };
        let mut pass = Pass::default();
        forward(&self.settings, self.layout, parameters, &batch, positions, &mut pass);
        pass.embeddings
    }
}

/// `out = encoded · W + bias`, `[positions × hidden]`.
pub(super) fn transform_positions(
    layout: Layout,
    parameters: &[f32],
    encoded: &[f32],
    out: &mut Vec<f32>,
) {
    let rows = encoded.len() / layout.dims;
    affine(
        Shape { rows, inner: layout.dims, columns: layout.hidden },
        encoded,
        &parameters[layout.transform()],
        &parameters[layout.transform_bias()],
        out,
    );
}

/// Tokens and positions are transformed separately and added, cut at 0, summed over the utterance,
/// and passed through the MLP. `positions` holds at least the rows that `batch` needs.
pub(super) fn forward(
    settings: &ExemplarSettings,
    layout: Layout,
    parameters: &[f32],
    batch: &Batch,
    positions: &[f32],
    pass: &mut Pass,
) {
    let Layout { dims, hidden, embedding, .. } = layout;
    pass.inputs.clear();
    pass.inputs.extend_from_slice(&batch.fixed);
    for (input, sort) in pass.inputs.chunks_exact_mut(dims).zip(&batch.sorts) {
        if let Some(sort) = sort {
            let vector = &parameters[layout.sort(*sort)];
            input.iter_mut().zip(vector).for_each(|(x, v)| *x += v);
        }
    }
    pass.tokens.resize(batch.tokens() * hidden, 0.0);
    let shape = Shape { rows: batch.tokens(), inner: dims, columns: hidden };
    gemm(shape, &pass.inputs, &parameters[layout.transform()], &mut pass.tokens, Sink::Replace);

    pass.cells.resize(batch.cells.len() * hidden, 0.0);
    for (cell, &(token, position)) in pass.cells.chunks_exact_mut(hidden).zip(&batch.cells) {
        let token = &pass.tokens[token as usize * hidden..][..hidden];
        let position = &positions[position as usize * hidden..][..hidden];
        for ((x, t), p) in cell.iter_mut().zip(token).zip(position) {
            let sum = t + p;
            *x = if sum > 0.0 { sum } else { 0.0 };
        }
    }
    pass.sums.clear();
    pass.sums.resize(batch.rows() * hidden, 0.0);
    for (row, sum) in pass.sums.chunks_exact_mut(hidden).enumerate() {
        for &cell in batch.row(row) {
            let cell = &pass.cells[cell as usize * hidden..][..hidden];
            sum.iter_mut().zip(cell).for_each(|(x, c)| *x += c);
        }
    }

    let shape = Shape { rows: batch.rows(), inner: hidden, columns: hidden };
    let (first, bias) = (&parameters[layout.first()], &parameters[layout.first_bias()]);
    affine(shape, &pass.sums, first, bias, &mut pass.middle);
    relu(&mut pass.middle);
    let shape = Shape { columns: embedding, ..shape };
    let (second, bias) = (&parameters[layout.second()], &parameters[layout.second_bias()]);
    affine(shape, &pass.middle, second, bias, &mut pass.embeddings);
    pass.norms.clear();
    for row in pass.embeddings.chunks_exact_mut(embedding) {
        pass.norms.push(if settings.normalise { normalise(row) } else { 1.0 });
    }
}

/// `out = x · weights + bias`.
fn affine(shape: Shape, x: &[f32], weights: &[f32], bias: &[f32], out: &mut Vec<f32>) {
    out.clear();
    for _ in 0..shape.rows {
        out.extend_from_slice(bias);
    }
    gemm(shape, x, weights, out, Sink::Add);
}
