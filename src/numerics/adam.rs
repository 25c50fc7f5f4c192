use serde::{Deserialize, Serialize};

/// How far and how steadily [`Adam`] steps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AdamSettings {
    pub learning_rate: f32,
    /// Memory of the gradient's mean, between 0 and 1.
    pub beta1: f32,
    /// Memory of the gradient's square, between 0 and 1.
    pub beta2: f32,
    pub epsilon: f32,
    /// Share of each parameter taken away per step and unit of learning rate (decoupled).
    pub weight_decay: f32,
}

impl Default for AdamSettings {
    fn default() -> AdamSettings {
        AdamSettings {
            learning_rate: 1e-3,
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-8,
            weight_decay: 0.0,
        }
    }
}

/// The optimiser of Kingma and Ba 2015, with decoupled weight decay, over one flat list of
/// parameters.
#[derive(Debug, Clone)]
pub struct Adam {
    settings: AdamSettings,
    mean: Vec<f32>,
    square: Vec<f32>,
    decay1: f64,
    decay2: f64,
}

impl Adam {
    pub fn new(parameters: usize, settings: AdamSettings) -> Adam {
        let zeros = vec![0.0; parameters];
        Adam { settings, mean: zeros.clone(), square: zeros, decay1: 1.0, decay2: 1.0 }
    }

    /// One step down the gradient. Allocates nothing.
    ///
    /// - panics: a list does not have the length given to [`Adam::new`].
    pub fn step(&mut self, parameters: &mut [f32], gradient: &[f32]) {
        assert_eq!(parameters.len(), self.mean.len(), "parameters of this optimiser");
        assert_eq!(gradient.len(), self.mean.len(), "gradient of this optimiser");
        let AdamSettings { learning_rate, beta1, beta2, epsilon, weight_decay } = self.settings;
        // Powers by repeated multiplication in f64: no power function is needed.
        self.decay1 *= beta1 as f64;
        self.decay2 *= beta2 as f64;
        let rate = learning_rate / (1.0 - self.decay1) as f32;
        let unbias = 1.0 / (1.0 - self.decay2) as f32;
        let keep = 1.0 - learning_rate * weight_decay;
        let state = self.mean.iter_mut().zip(&mut self.square);
        for ((parameter, &slope), (mean, square)) in parameters.iter_mut().zip(gradient).zip(state)
        {
            *mean = beta1 * *mean + (1.0 - beta1) * slope;
            *square = beta2 * *square + (1.0 - beta2) * (slope * slope);
            let scale = (*square * unbias).sqrt() + epsilon;
            *parameter = *parameter * keep - rate * *mean / scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_finds_the_bottom_of_a_bowl() {
        let mut at = [3.0, -2.0];
        let settings = AdamSettings { learning_rate: 0.1, ..AdamSettings::default() };
        let mut adam = Adam::new(2, settings);
        for _ in 0..400 {
            let slope = [2.0 * (at[0] - 1.0), 20.0 * (at[1] - 0.5)];
            adam.step(&mut at, &slope);
        }
        assert!((at[0] - 1.0).abs() < 1e-2 && (at[1] - 0.5).abs() < 1e-2, "{at:?}");
    }

    #[test]
    fn the_first_step_is_as_long_as_the_learning_rate() {
        let mut at = [0.0];
        Adam::new(1, AdamSettings::default()).step(&mut at, &[123.0]);
        assert!((at[0] + 1e-3).abs() < 1e-8);
    }

    #[test]
    fn decay_pulls_towards_zero_without_a_gradient() {
        let mut at = [1.0];
        let settings = AdamSettings { weight_decay: 0.5, ..AdamSettings::default() };
        Adam::new(1, settings).step(&mut at, &[0.0]);
        assert!((at[0] - 0.9995).abs() < 1e-6);
    }
}
