use serde::{Deserialize, Serialize};

use super::{Adam, AdamSettings, Linear, LinearScratch, Rng, relu, relu_backward};

/// Linear layers with max(x, 0) between them and nothing after the last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mlp {
    /// In the order of the forward pass.
    pub layers: Vec<Linear>,
}

/// What a forward pass leaves for the backward pass; keep one per training, so that steps do not
/// allocate.
#[derive(Debug, Clone, Default)]
pub struct MlpTrace {
    /// The result of each layer, after max(x, 0) except for the last.
    outputs: Vec<Vec<f32>>,
    deltas: [Vec<f32>; 2],
    scratch: LinearScratch,
}

impl MlpTrace {
    /// What the last forward pass returned.
    pub fn output(&self) -> &[f32] {
        self.outputs.last().map_or(&[], Vec::as_slice)
    }
}

/// The gradient of each layer's parameters, with the optimiser of each.
#[derive(Debug, Clone)]
pub struct MlpGradients {
    /// Per layer, laid out as its parameters.
    pub layers: Vec<Vec<f32>>,
    optimisers: Vec<Adam>,
}

impl MlpGradients {
    /// Sets all gradients to zero.
    pub fn clear(&mut self) {
        self.layers.iter_mut().for_each(|layer| layer.fill(0.0));
    }

    /// One step of every layer down its gradient; then the gradients are zero again.
    pub fn step(&mut self, mlp: &mut Mlp) {
        let layers = mlp.layers.iter_mut().zip(&self.layers).zip(&mut self.optimisers);
        for ((layer, gradient), optimiser) in layers {
            optimiser.step(&mut layer.parameters, gradient);
        }
        self.clear();
    }
}

impl Mlp {
    /// A network with Glorot weights and zero biases.
    ///
    /// - `sizes`: of the input, of each hidden layer, of the output.
    ///
    /// - panics: fewer than two sizes.
    pub fn new(sizes: &[usize], rng: &mut Rng) -> Mlp {
        assert!(sizes.len() >= 2, "an input and an output, found sizes {sizes:?}");
        Mlp { layers: sizes.windows(2).map(|pair| Linear::new(pair[0], pair[1], rng)).collect() }
    }

    /// Numbers in a row of the input; 0 without layers.
    pub fn inputs(&self) -> usize {
        self.layers.first().map_or(0, |layer| layer.inputs)
    }

    /// Numbers in a row of the output; 0 without layers.
    pub fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.outputs)
    }

    /// Whether layers fit together and have all their parameters. Check it after reading a network
    /// back.
    pub fn is_whole(&self) -> bool {
        !self.layers.is_empty()
            && self.layers.iter().all(Linear::is_whole)
            && self.layers.windows(2).all(|pair| pair[0].outputs == pair[1].inputs)
    }

    /// Zero gradients, and an optimiser per layer before its first step.
    pub fn gradients(&self, settings: AdamSettings) -> MlpGradients {
        let count = |layer: &Linear| layer.parameters.len();
        MlpGradients {
            layers: self.layers.iter().map(|layer| vec![0.0; count(layer)]).collect(),
            optimisers: self.layers.iter().map(|layer| Adam::new(count(layer), settings)).collect(),
        }
    }

    /// Computes the output.
    ///
    /// - `x`: `[rows × inputs]`.
    /// - returns: `[rows × outputs]`, which stays readable in `trace`.
    pub fn forward<'t>(&self, rows: usize, x: &[f32], trace: &'t mut MlpTrace) -> &'t [f32] {
        trace.outputs.resize_with(self.layers.len(), Vec::new);
        for (index, layer) in self.layers.iter().enumerate() {
            let (before, after) = trace.outputs.split_at_mut(index);
            let input = before.last().map_or(x, Vec::as_slice);
            let output = &mut after[0];
            output.resize(rows * layer.outputs, 0.0);
            layer.forward(rows, input, output);
            if index + 1 < self.layers.len() {
                relu(output);
            }
        }
        trace.output()
    }

    /// Adds the gradient of the parameters to `gradients`, and writes the gradient of `x`.
    ///
    /// - `x`, `trace`: those of the forward pass; `dy`: `[rows × outputs]`, the gradient of its
    ///   result.
    /// - `dx`: `[rows × inputs]`, overwritten; none if it is not needed.
    pub fn backward(
        &self,
        rows: usize,
        x: &[f32],
        trace: &mut MlpTrace,
        dy: &[f32],
        gradients: &mut MlpGradients,
        mut dx: Option<&mut [f32]>,
    ) {
        let MlpTrace { outputs, deltas: [delta, next], scratch } = trace;
        delta.clear();
        delta.extend_from_slice(dy);
        for (index, layer) in self.layers.iter().enumerate().rev() {
            let gradient = &mut gradients.layers[index];
            if index == 0 {
                layer.backward(rows, x, delta, gradient, dx.take(), scratch);
                return;
            }
            let input = &outputs[index - 1];
            next.resize(input.len(), 0.0);
            layer.backward(rows, input, delta, gradient, Some(next), scratch);
            relu_backward(input, next);
            std::mem::swap(delta, next);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loss(mlp: &Mlp, rows: usize, x: &[f32], aim: &[f32]) -> f64 {
        let mut trace = MlpTrace::default();
        let y = mlp.forward(rows, x, &mut trace);
        y.iter().zip(aim).map(|(y, aim)| ((y - aim) as f64).powi(2) / 2.0).sum()
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        let seed = 21;
        println!("seed {seed}");
        let mut rng = Rng::from_u64(seed);
        let rows = 5;
        let mut mlp = Mlp::new(&[6, 9, 7, 3], &mut rng);
        let mut x: Vec<f32> = (0..rows * 6).map(|_| rng.normal()).collect();
        let aim: Vec<f32> = (0..rows * 3).map(|_| rng.normal()).collect();
        let mut trace = MlpTrace::default();
        let mut gradients = mlp.gradients(AdamSettings::default());
        let y = mlp.forward(rows, &x, &mut trace);
        let dy: Vec<f32> = y.iter().zip(&aim).map(|(y, aim)| y - aim).collect();
        let mut dx = vec![0.0; x.len()];
        mlp.backward(rows, &x, &mut trace, &dy, &mut gradients, Some(&mut dx));
        // Small enough to cross few kinks of max(x, 0), large enough for f32.
        let step = 2e-3;
        let agree = |expected: f64, found: f32, what: &str| {
            let gap = (expected - found as f64).abs();
            assert!(gap < 4e-3 + 0.01 * expected.abs(), "{what}: {expected} against {found}");
        };
        for layer in 0..mlp.layers.len() {
            for index in (0..mlp.layers[layer].parameters.len()).step_by(5) {
                let kept = mlp.layers[layer].parameters[index];
                mlp.layers[layer].parameters[index] = kept + step;
                let above = loss(&mlp, rows, &x, &aim);
                mlp.layers[layer].parameters[index] = kept - step;
                let below = loss(&mlp, rows, &x, &aim);
                mlp.layers[layer].parameters[index] = kept;
                let slope = (above - below) / (2.0 * step as f64);
                agree(slope, gradients.layers[layer][index], "a parameter");
            }
        }
        for index in 0..x.len() {
            let kept = x[index];
            x[index] = kept + step;
            let above = loss(&mlp, rows, &x, &aim);
            x[index] = kept - step;
            let below = loss(&mlp, rows, &x, &aim);
            x[index] = kept;
            agree((above - below) / (2.0 * step as f64), dx[index], "an input");
        }
    }

    #[test]
    fn training_fits_exclusive_or() {
        let mut rng = Rng::from_u64(2);
        let mut mlp = Mlp::new(&[2, 8, 1], &mut rng);
        let x = [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0];
        let aim = [0.0, 1.0, 1.0, 0.0];
        let settings = AdamSettings { learning_rate: 0.05, ..AdamSettings::default() };
        let mut gradients = mlp.gradients(settings);
        let mut trace = MlpTrace::default();
        for _ in 0..300 {
            let y = mlp.forward(4, &x, &mut trace);
            let dy: Vec<f32> = y.iter().zip(&aim).map(|(y, aim)| y - aim).collect();
            mlp.backward(4, &x, &mut trace, &dy, &mut gradients, None);
            gradients.step(&mut mlp);
        }
        assert!(loss(&mlp, 4, &x, &aim) < 1e-3);
        assert!(mlp.is_whole());
    }
}
