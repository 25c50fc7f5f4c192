use serde::{Deserialize, Serialize};

use super::{Floats, Rng, Shape, Sink, gemm, gemm_transposed_a, glorot, transpose};

/// `y = x·W + b`. Parameters lie flat: `W` row-major `[inputs × outputs]`, then `b` `[outputs]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Linear {
    /// Numbers in a row of `x`.
    pub inputs: usize,
    /// Numbers in a row of `y`.
    pub outputs: usize,
    /// `W`, then `b`.
    pub parameters: Floats,
}

/// Memory for [`Linear::backward`]. Keep one per training, so that steps do not allocate.
#[derive(Debug, Clone, Default)]
pub struct LinearScratch {
    transposed: Vec<f32>,
}

impl Linear {
    /// Glorot weights, zero bias.
    pub fn new(inputs: usize, outputs: usize, rng: &mut Rng) -> Linear {
        let mut parameters = Floats::zeros(inputs * outputs + outputs);
        glorot(inputs, outputs, &mut parameters[..inputs * outputs], rng);
        Linear { inputs, outputs, parameters }
    }

    /// `W`: row-major `[inputs × outputs]`.
    pub fn weights(&self) -> &[f32] {
        &self.parameters[..self.inputs * self.outputs]
    }

    /// `b`: `[outputs]`.
    pub fn bias(&self) -> &[f32] {
        &self.parameters[self.inputs * self.outputs..]
    }

    /// Whether there are as many parameters as the sizes say. Check it after reading a layer back.
    pub fn is_whole(&self) -> bool {
        self.inputs
            .checked_add(1)
            .and_then(|rows| rows.checked_mul(self.outputs))
            .is_some_and(|count| count == self.parameters.len())
    }

    /// Computes `y`.
    ///
    /// - `x`: `[rows × inputs]`; `y`: `[rows × outputs]`, overwritten.
    /// - panics: a slice does not have its size.
    pub fn forward(&self, rows: usize, x: &[f32], y: &mut [f32]) {
        for row in y.chunks_exact_mut(self.outputs) {
            row.copy_from_slice(self.bias());
        }
        gemm(self.shape(rows), x, self.weights(), y, Sink::Add);
    }

    /// Adds the gradient of the parameters to `gradient`, and writes the gradient of `x`.
    ///
    /// - `x`: what [`Linear::forward`] was given; `dy`: `[rows × outputs]`, the gradient of its
    ///   result.
    /// - `gradient`: laid out as `parameters`.
    /// - `dx`: `[rows × inputs]`, overwritten; none if it is not needed.
    /// - panics: a slice does not have its size.
    pub fn backward(
        &self,
        rows: usize,
        x: &[f32],
        dy: &[f32],
        gradient: &mut [f32],
        dx: Option<&mut [f32]>,
        scratch: &mut LinearScratch,
    ) {
        let (inputs, outputs) = (self.inputs, self.outputs);
        let (weights, bias) = gradient.split_at_mut(inputs * outputs);
        let shape = Shape { rows: inputs, inner: rows, columns: outputs };
        gemm_transposed_a(shape, x, dy, weights, Sink::Add);
        for row in dy.chunks_exact(outputs) {
            bias.iter_mut().zip(row).for_each(|(sum, d)| *sum += d);
        }
        if let Some(dx) = dx {
            transpose(inputs, outputs, self.weights(), &mut scratch.transposed);
            let shape = Shape { rows, inner: outputs, columns: inputs };
            gemm(shape, dy, &scratch.transposed, dx, Sink::Replace);
        }
    }

    fn shape(&self, rows: usize) -> Shape {
        Shape { rows, inner: self.inputs, columns: self.outputs }
    }
}

/// Replaces every x by max(x, 0).
pub fn relu(x: &mut [f32]) {
    x.iter_mut().for_each(|x| *x = if *x > 0.0 { *x } else { 0.0 });
}

/// Sets the gradient to 0 where [`relu`] gave 0; `y` is the result of [`relu`].
pub fn relu_backward(y: &[f32], dy: &mut [f32]) {
    for (d, &y) in dy.iter_mut().zip(y) {
        *d = if y > 0.0 { *d } else { 0.0 };
    }
}
