use super::{sigmoid_all, tanh_all};

/// One step of a long short-term memory for some rows: in place of the sums that go into the gates,
/// what comes out of them; then the new cells and the new state.
///
/// A row of `gates` holds four parts of `units` numbers: input, forget and output gate (logistic),
/// then the candidate (tanh). Source: Hochreiter and Schmidhuber 1997, with the forget gate of
/// Gers, Schmidhuber and Cummins 2000.
///
/// - `gates`: `[rows × 4·units]`; `before`: the cells before, `[rows × units]`.
/// - `cells`, `squashed` (tanh of the cells), `state`: `[rows × units]`, overwritten.
/// - panics: a slice does not have its size.
pub fn lstm_cell(
    units: usize,
    gates: &mut [f32],
    before: &[f32],
    cells: &mut [f32],
    squashed: &mut [f32],
    state: &mut [f32],
) {
    let rows = gates.len() / (4 * units);
    assert!([before.len(), cells.len(), squashed.len(), state.len()] == [rows * units; 4]);
    for (row, gates) in gates.chunks_exact_mut(4 * units).enumerate() {
        let (open, candidate) = gates.split_at_mut(3 * units);
        sigmoid_all(open);
        tanh_all(candidate);
        let place = row * units..(row + 1) * units;
        let (before, cells) = (&before[place.clone()], &mut cells[place]);
        for (unit, cell) in cells.iter_mut().enumerate() {
            *cell = open[units + unit] * before[unit] + open[unit] * candidate[unit];
        }
    }
    squashed.copy_from_slice(cells);
    tanh_all(squashed);
    for (row, gates) in gates.chunks_exact(4 * units).enumerate() {
        let output = &gates[2 * units..3 * units];
        let place = row * units..(row + 1) * units;
        for ((state, squashed), open) in
            state[place.clone()].iter_mut().zip(&squashed[place]).zip(output)
        {
            *state = open * squashed;
        }
    }
}

/// The way back through [`lstm_cell`].
///
/// - `gates`, `before`, `squashed`: what the step left.
/// - `d_state`: the gradient of the state. `d_cells`: that of the new cells by what comes later;
///   becomes that of the cells before.
/// - `d_gates`: overwritten with the gradient of the sums that went into the gates.
pub fn lstm_cell_backward(
    units: usize,
    gates: &[f32],
    before: &[f32],
    squashed: &[f32],
    d_state: &[f32],
    d_cells: &mut [f32],
    d_gates: &mut [f32],
) {
    let rows = gates.len() / (4 * units);
    assert!([before.len(), squashed.len(), d_state.len(), d_cells.len()] == [rows * units; 4]);
    assert_eq!(d_gates.len(), gates.len());
    for row in 0..rows {
        let gates = &gates[row * 4 * units..(row + 1) * 4 * units];
        let d_gates = &mut d_gates[row * 4 * units..(row + 1) * 4 * units];
        let (d_input, d_rest) = d_gates.split_at_mut(units);
        let (d_forget, d_rest) = d_rest.split_at_mut(units);
        let (d_output, d_candidate) = d_rest.split_at_mut(units);
        for unit in 0..units {
            let at = row * units + unit;
            let [input, forget, output, candidate] =
                [0, 1, 2, 3].map(|part| gates[part * units + unit]);
            let squashed = squashed[at];
            let d_cell = d_cells[at] + d_state[at] * output * (1.0 - squashed * squashed);
            d_input[unit] = d_cell * candidate * input * (1.0 - input);
            d_forget[unit] = d_cell * before[at] * forget * (1.0 - forget);
            d_output[unit] = d_state[at] * squashed * output * (1.0 - output);
            d_candidate[unit] = d_cell * input * (1.0 - candidate * candidate);
            d_cells[at] = d_cell * forget;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{Kernel, Rng};

    const UNITS: usize = 5;
    const ROWS: usize = 3;

    /// A weighted sum of the new state and cells.
    fn value(gates: &[f32], before: &[f32], weights: &[f32]) -> f64 {
        let (mut gates, count) = (gates.to_vec(), ROWS * UNITS);
        let mut out = vec![0.0; 3 * count];
        let (cells, rest) = out.split_at_mut(count);
        let (squashed, state) = rest.split_at_mut(count);
        lstm_cell(UNITS, &mut gates, before, cells, squashed, state);
        let all = state.iter().chain(cells.iter()).zip(weights);
        all.map(|(x, w)| f64::from(*x) * f64::from(*w)).sum()
    }

    #[test]
    fn the_gradient_of_a_step_agrees_with_differences() {
        let seed = 23;
        println!("seed {seed}");
        let mut rng = Rng::from_u64(seed);
        let mut draw = |count: usize| (0..count).map(|_| rng.normal()).collect::<Vec<f32>>();
        let count = ROWS * UNITS;
        let (sums, before, weights) = (draw(4 * count), draw(count), draw(2 * count));
        let (mut gates, mut out) = (sums.clone(), vec![0.0; 3 * count]);
        let (cells, rest) = out.split_at_mut(count);
        let (squashed, state) = rest.split_at_mut(count);
        lstm_cell(UNITS, &mut gates, &before, cells, squashed, state);
        let (d_state, d_later) = weights.split_at(count);
        let (mut d_cells, mut d_gates) = (d_later.to_vec(), vec![0.0; 4 * count]);
        lstm_cell_backward(UNITS, &gates, &before, squashed, d_state, &mut d_cells, &mut d_gates);
        let step = 1e-2;
        let slope = |gates: [&[f32]; 2], before: [&[f32]; 2]| {
            let [one, other] = [0, 1].map(|i| value(gates[i], before[i], &weights));
            (one - other) / (2.0 * f64::from(step))
        };
        let moved = |list: &[f32], at: usize| {
            let [mut up, mut down] = [list.to_vec(), list.to_vec()];
            up[at] += step;
            down[at] -= step;
            [up, down]
        };
        for (at, &found) in d_gates.iter().enumerate() {
            let [up, down] = moved(&sums, at);
            let expected = slope([&up, &down], [&before, &before]);
            assert!((expected - f64::from(found)).abs() < 1e-3, "{at}");
        }
        for (at, &found) in d_cells.iter().enumerate() {
            let [up, down] = moved(&before, at);
            let expected = slope([&sums, &sums], [&up, &down]);
            assert!((expected - f64::from(found)).abs() < 1e-3, "{at}");
        }
    }

    #[test]
    fn every_kernel_takes_the_same_step() {
        let mut rng = Rng::from_u64(3);
        let gates: Vec<f32> = (0..4 * ROWS * UNITS).map(|_| 3.0 * rng.normal()).collect();
        let before: Vec<f32> = (0..ROWS * UNITS).map(|_| rng.normal()).collect();
        let weights = vec![1.0; 2 * ROWS * UNITS];
        let run = |kernel: Kernel| kernel.run(|| value(&gates, &before, &weights).to_bits());
        let expected = run(Kernel::Plain);
        for kernel in Kernel::available() {
            assert_eq!(run(kernel), expected, "{kernel:?}");
        }
    }
}
