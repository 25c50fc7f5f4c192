use super::lanes::{Lanes, One, dispatch};

/// eˣ, relative error below 2e-7. For x below −87 or above 88 it is the value at that limit, so
/// that no result is infinite, zero or denormal (denormals are slow).
pub fn exp(x: f32) -> f32 {
    // SAFETY: one lane needs no instruction set.
    unsafe { exp_lanes::<One>(x) }
}

/// Replaces every entry by its [`exp`], with the same bits.
pub fn exp_all(x: &mut [f32]) {
    // SAFETY: the pointer and the length are those of one slice.
    unsafe { exp_each(x.as_mut_ptr(), x.len()) }
}

/// 1 / (1 + e⁻ˣ), strictly between 0 and 1 while |x| < 16.
pub fn sigmoid(x: f32) -> f32 {
    // SAFETY: one lane needs no instruction set.
    unsafe { sigmoid_lanes::<One>(x) }
}

/// Replaces every entry by its [`sigmoid`], with the same bits.
pub fn sigmoid_all(x: &mut [f32]) {
    // SAFETY: the pointer and the length are those of one slice.
    unsafe { sigmoid_each(x.as_mut_ptr(), x.len()) }
}

/// The natural logarithm.
pub fn ln(x: f32) -> f32 {
    libm::logf(x)
}

/// The hyperbolic tangent.
pub fn tanh(x: f32) -> f32 {
    libm::tanhf(x)
}

/// Replaces every entry by its tanh, computed as 2σ(2x) − 1: absolute error below 2e-7. Networks
/// use it because [`tanh`] would take most of their time. Its bits are not those of [`tanh`].
pub fn tanh_all(x: &mut [f32]) {
    // SAFETY: the pointer and the length are those of one slice.
    unsafe { tanh_each(x.as_mut_ptr(), x.len()) }
}

/// `x` in radians.
pub fn sin(x: f32) -> f32 {
    libm::sinf(x)
}

/// `x` in radians.
pub fn cos(x: f32) -> f32 {
    libm::cosf(x)
}

/// Turns logits into probabilities that sum to 1. An empty slice stays empty.
pub fn softmax(logits: &mut [f32]) {
    let largest = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    logits.iter_mut().for_each(|x| *x -= largest);
    exp_all(logits);
    let sum = logits.iter().fold(0.0, |sum, x| sum + x);
    logits.iter_mut().for_each(|x| *x /= sum);
}

/// Binary cross-entropy of a probability against the truth, in nats. The probability of the truth
/// counts as at least 1e-7, so that one confident error does not make a sum infinite.
pub fn bce(probability: f32, truth: bool) -> f32 {
    let given = if truth { probability } else { 1.0 - probability };
    -ln(given.max(1e-7))
}

/// Binary cross-entropy of a logit against the truth, in nats: ln(1 + e⁻ᶻ), where z is the logit if
/// `truth` holds and its negative if not. The gradient by the logit is `sigmoid(logit) − truth`.
pub fn bce_with_logit(logit: f32, truth: bool) -> f32 {
    let z = if truth { logit } else { -logit };
    libm::log1pf(exp(-z.abs())) + (-z).max(0.0)
}

dispatch!(exp_each, exp_body, (x: *mut f32, count: usize));
dispatch!(sigmoid_each, sigmoid_body, (x: *mut f32, count: usize));

dispatch!(tanh_each, tanh_body, (x: *mut f32, count: usize));

/// # Safety
/// The machine has the instruction set of `L`; `x` is valid for reads and writes of `count`
/// numbers.
#[inline(always)]
unsafe fn exp_body<L: Lanes>(x: *mut f32, count: usize) {
    let mut at = 0;
    // SAFETY: before each access, at least as many numbers are left as it touches.
    unsafe {
        while count - at >= L::WIDTH {
            L::store(x.add(at), exp_lanes::<L>(L::load(x.add(at))));
            at += L::WIDTH;
        }
        while at < count {
            One::store(x.add(at), exp_lanes::<One>(One::load(x.add(at))));
            at += 1;
        }
    }
}

/// # Safety
/// The machine has the instruction set of `L`; `x` is valid for reads and writes of `count`
/// numbers.
#[inline(always)]
unsafe fn sigmoid_body<L: Lanes>(x: *mut f32, count: usize) {
    let mut at = 0;
    // SAFETY: before each access, at least as many numbers are left as it touches.
    unsafe {
        while count - at >= L::WIDTH {
            L::store(x.add(at), sigmoid_lanes::<L>(L::load(x.add(at))));
            at += L::WIDTH;
        }
        while at < count {
            One::store(x.add(at), sigmoid_lanes::<One>(One::load(x.add(at))));
            at += 1;
        }
    }
}

/// # Safety
/// The machine has the instruction set of `L`; `x` is valid for reads and writes of `count`
/// numbers.
#[inline(always)]
unsafe fn tanh_body<L: Lanes>(x: *mut f32, count: usize) {
    let mut at = 0;
    // SAFETY: before each access, at least as many numbers are left as it touches.
    unsafe {
        while count - at >= L::WIDTH {
            L::store(x.add(at), tanh_lanes::<L>(L::load(x.add(at))));
            at += L::WIDTH;
        }
        while at < count {
            One::store(x.add(at), tanh_lanes::<One>(One::load(x.add(at))));
            at += 1;
        }
    }
}

/// # Safety
/// The machine has the instruction set of `L`.
#[inline(always)]
unsafe fn tanh_lanes<L: Lanes>(x: L::Vector) -> L::Vector {
    // SAFETY: the caller has the instruction set, and no pointer is used.
    unsafe {
        let half = sigmoid_lanes::<L>(L::add(x, x));
        L::sub(L::add(half, half), L::splat(1.0))
    }
}

/// # Safety
/// The machine has the instruction set of `L`.
#[inline(always)]
unsafe fn sigmoid_lanes<L: Lanes>(x: L::Vector) -> L::Vector {
    // SAFETY: the caller has the instruction set, and no pointer is used.
    unsafe {
        let power = exp_lanes::<L>(L::sub(L::splat(0.0), x));
        L::div(L::splat(1.0), L::add(L::splat(1.0), power))
    }
}

/// eˣ = 2ⁿ · eʳ with |r| ≤ ln 2 / 2, eʳ by its series to the seventh power (the first term left
/// out is below 6e-9). ln 2 is split so that n·high is exact.
///
/// # Safety
/// The machine has the instruction set of `L`.
#[inline(always)]
unsafe fn exp_lanes<L: Lanes>(x: L::Vector) -> L::Vector {
    // Adding and taking away 1.5 · 2²³ rounds to the nearest whole number in every instruction set.
    const ROUND: f32 = 12_582_912.0;
    const HIGH: f32 = 0.693_359_4;
    const LOW: f32 = -2.121_944_4e-4;
    const SERIES: [f32; 7] = [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0];
    // SAFETY: the caller has the instruction set, and no pointer is used.
    unsafe {
        let x = L::max(L::min(x, L::splat(88.0)), L::splat(-87.0));
        let scaled = L::mul(x, L::splat(std::f32::consts::LOG2_E));
        let whole = L::sub(L::add(scaled, L::splat(ROUND)), L::splat(ROUND));
        let rest = L::sub(x, L::mul(whole, L::splat(HIGH)));
        let rest = L::sub(rest, L::mul(whole, L::splat(LOW)));
        let mut sum = L::splat(1.0 / 5040.0);
        for coefficient in SERIES {
            sum = L::add(L::mul(sum, rest), L::splat(coefficient));
        }
        L::mul(sum, L::power_of_two(whole))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{Kernel, Rng};

    #[test]
    fn exp_is_close_and_the_same_in_every_kernel() {
        let mut rng = Rng::from_u64(5);
        let mut inputs: Vec<f32> = (0..4_003).map(|_| rng.between(-86.0, 87.9)).collect();
        inputs.extend([0.0, -0.0, 1e-8, f32::INFINITY, f32::NEG_INFINITY, -1e9, 1e9]);
        for kernel in Kernel::available() {
            let (mut exps, mut sigmoids) = (inputs.clone(), inputs.clone());
            kernel.run(|| {
                exp_all(&mut exps);
                sigmoid_all(&mut sigmoids);
            });
            for ((&x, e), s) in inputs.iter().zip(exps).zip(sigmoids) {
                assert_eq!(e.to_bits(), exp(x).to_bits(), "{kernel:?} exp {x}");
                assert_eq!(s.to_bits(), sigmoid(x).to_bits(), "{kernel:?} sigmoid {x}");
                let exact = libm::exp((x as f64).clamp(-87.0, 88.0));
                assert!(((e as f64) / exact - 1.0).abs() < 2e-7, "exp {x}: {e} not {exact}");
            }
        }
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(sigmoid(0.0), 0.5);
    }

    #[test]
    fn tanh_of_a_list_is_close_and_the_same_in_every_kernel() {
        let mut rng = Rng::from_u64(6);
        let mut inputs: Vec<f32> = (0..1_003).map(|_| rng.between(-12.0, 12.0)).collect();
        inputs.extend([0.0, -0.0, 1e-8, f32::INFINITY, f32::NEG_INFINITY, -1e9, 1e9]);
        let run = |kernel: Kernel| {
            let mut out = inputs.clone();
            kernel.run(|| tanh_all(&mut out));
            out
        };
        let expected = run(Kernel::Plain);
        for (&x, &found) in inputs.iter().zip(&expected) {
            assert!((f64::from(found) - libm::tanh(f64::from(x))).abs() < 2e-7, "{x}: {found}");
        }
        for kernel in Kernel::available() {
            let same = run(kernel).iter().zip(&expected).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(same, "{kernel:?}");
        }
    }

    #[test]
    fn softmax_survives_large_logits() {
        let mut logits = [1_000.0, 1_000.0, -1_000.0];
        softmax(&mut logits);
        assert_eq!(logits[0], 0.5);
        assert!(logits[2] < 1e-30);
        softmax(&mut []);
    }

    #[test]
    fn cross_entropy_agrees_with_its_logit_form() {
        for logit in [-9.0, -1.0, 0.0, 0.5, 7.0] {
            for truth in [true, false] {
                let gap = bce(sigmoid(logit), truth) - bce_with_logit(logit, truth);
                assert!(gap.abs() < 1e-3, "{logit} {truth} {gap}");
            }
        }
        assert_eq!(bce_with_logit(-200.0, true), 200.0);
    }
}
