use super::Rng;

/// Uniform in ±√(6 / (inputs + outputs)): keeps the size of signals about equal both ways.
/// Source: Glorot and Bengio 2010.
pub fn glorot(inputs: usize, outputs: usize, out: &mut [f32], rng: &mut Rng) {
    let reach = (6.0 / (inputs + outputs).max(1) as f32).sqrt();
    fill_uniform(out, reach, rng);
}

/// Uniform in `[−reach, reach)`.
pub fn fill_uniform(out: &mut [f32], reach: f32, rng: &mut Rng) {
    out.iter_mut().for_each(|x| *x = rng.between(-reach, reach));
}

/// Normal with mean 0 and the given standard deviation.
pub fn fill_normal(out: &mut [f32], deviation: f32, rng: &mut Rng) {
    out.iter_mut().for_each(|x| *x = rng.normal() * deviation);
}
