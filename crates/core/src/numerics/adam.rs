use serde::{Deserialize, Serialize};

use super::lanes::{Lanes, One, dispatch};

/// How far and how steadily [`Adam`] steps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AdamSettings {
    /// How far a step goes.
    pub learning_rate: f32,
    /// Memory of the gradient's mean, between 0 and 1.
    pub beta1: f32,
    /// Memory of the gradient's square, between 0 and 1.
    pub beta2: f32,
    /// Added to the divisor, so that it is never zero.
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
    /// An optimiser before its first step.
    ///
    /// - `parameters`: how many there are.
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
        let step = Step {
            beta: [beta1, beta2],
            fresh: [1.0 - beta1, 1.0 - beta2],
            unbias,
            epsilon,
            rate,
            keep,
        };
        let lists = Lists {
            count: parameters.len(),
            parameters: parameters.as_mut_ptr(),
            gradient: gradient.as_ptr(),
            mean: self.mean.as_mut_ptr(),
            square: self.square.as_mut_ptr(),
        };
        // SAFETY: all four lists have `count` numbers: two were checked, `new` made the other two
        // so.
        unsafe { run(step, lists) }
    }
}

#[derive(Clone, Copy)]
struct Step {
    beta: [f32; 2],
    fresh: [f32; 2],
    unbias: f32,
    epsilon: f32,
    rate: f32,
    keep: f32,
}

#[derive(Clone, Copy)]
struct Lists {
    count: usize,
    parameters: *mut f32,
    gradient: *const f32,
    mean: *mut f32,
    square: *mut f32,
}

dispatch!(run, all, (step: Step, lists: Lists));

/// # Safety
/// The machine has the instruction set of `L`. The lists are valid for reads of `count` numbers,
/// and all but the gradient for writes.
#[inline(always)]
unsafe fn all<L: Lanes>(step: Step, lists: Lists) {
    let mut at = 0;
    // SAFETY: before each call, at least as many numbers are left as it touches.
    unsafe {
        while lists.count - at >= L::WIDTH {
            some::<L>(step, lists, at);
            at += L::WIDTH;
        }
        while at < lists.count {
            some::<One>(step, lists, at);
            at += 1;
        }
    }
}

/// The step of the `L::WIDTH` parameters from `at` on.
///
/// # Safety
/// As [`all`], with `at + L::WIDTH <= count`.
#[inline(always)]
unsafe fn some<L: Lanes>(step: Step, lists: Lists, at: usize) {
    // SAFETY: all places are below `count`.
    unsafe {
        let slope = L::load(lists.gradient.add(at));
        let moved = |old, beta, fresh, new| {
            L::add(L::mul(L::splat(beta), old), L::mul(L::splat(fresh), new))
        };
        let mean = L::load(lists.mean.add(at));
        let mean = moved(mean, step.beta[0], step.fresh[0], slope);
        let square = L::load(lists.square.add(at));
        let square = moved(square, step.beta[1], step.fresh[1], L::mul(slope, slope));
        L::store(lists.mean.add(at), mean);
        L::store(lists.square.add(at), square);
        let spread = L::sqrt(L::mul(square, L::splat(step.unbias)));
        let length = L::div(mean, L::add(spread, L::splat(step.epsilon)));
        let kept = L::mul(L::load(lists.parameters.add(at)), L::splat(step.keep));
        L::store(lists.parameters.add(at), L::sub(kept, L::mul(L::splat(step.rate), length)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{Kernel, Rng};

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
    fn every_kernel_takes_the_same_steps() {
        let seed = 31;
        println!("seed {seed}");
        let walk = || {
            let mut rng = Rng::from_u64(seed);
            let mut at: Vec<f32> = (0..101).map(|_| rng.normal()).collect();
            let settings = AdamSettings { weight_decay: 0.01, ..AdamSettings::default() };
            let mut adam = Adam::new(at.len(), settings);
            for _ in 0..20 {
                let slope: Vec<f32> = at.iter().map(|x| x * rng.normal()).collect();
                adam.step(&mut at, &slope);
            }
            at.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
        };
        let expected = Kernel::Plain.run(walk);
        for kernel in Kernel::available() {
            assert_eq!(kernel.run(walk), expected, "{kernel:?}");
        }
    }

    #[test]
    fn decay_pulls_towards_zero_without_a_gradient() {
        let mut at = [1.0];
        let settings = AdamSettings { weight_decay: 0.5, ..AdamSettings::default() };
        Adam::new(1, settings).step(&mut at, &[0.0]);
        assert!((at[0] - 0.9995).abs() < 1e-6);
    }
}
