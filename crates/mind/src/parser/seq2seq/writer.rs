use super::layout::{Layout, Part};
use super::reader::{Packing, Reader};
use super::vocabulary::{Choice, Vocabulary};
use crate::language::Symbol;
use crate::numerics::{
    Shape, Sink, dot, exp_all, gemm, gemm_transposed_a, ln, lstm_cell, lstm_cell_backward, softmax,
    tanh_all, transpose,
};

/// A program to learn: at each step the right choice and the allowed ones.
#[derive(Debug, Clone)]
pub(super) struct Target {
    pub choices: Vec<Choice>,
    pub allowed: Vec<Vec<Choice>>,
    /// The place of each slot in the utterance.
    pub slots: Vec<usize>,
}

impl Target {
    /// - `choices`: as [`Vocabulary::encode`] gives them; `sorts` and `slots`: of the utterance.
    pub(super) fn new(
        vocabulary: &Vocabulary,
        choices: Vec<Choice>,
        sorts: &[Symbol],
        slots: Vec<usize>,
    ) -> Target {
        let (mut expected, mut steps) = (vocabulary.start(), 0);
        let mut allowed = Vec::new();
        for &choice in &choices {
            allowed.push(vocabulary.allowed(expected, sorts));
            let operator = |token| token < vocabulary.end();
            steps += usize::from(matches!(choice, Choice::Write(token) if operator(token)));
            expected = vocabulary.after(expected, choice, steps);
        }
        Target { choices, allowed, slots }
    }
}

/// The encoder's results for a batch, prepared for the decoder.
#[derive(Debug, Clone, Default)]
pub(super) struct Sources {
    /// The keys of attention, `[words × units]`.
    pub keys: Vec<f32>,
    /// The decoder's first cells and state, `[rows × units]`.
    pub cells: Vec<f32>,
    pub states: Vec<f32>,
    /// The last of both directions, `[rows × 2·units]`.
    ends: Vec<f32>,
}

impl Sources {
    /// - `lengths`: words of each row of `reader`.
    pub(super) fn new(
        layout: Layout,
        parameters: &[f32],
        read: &[f32],
        rows: &[(usize, usize)],
    ) -> Sources {
        let units = layout.units;
        let mut out = Sources::default();
        let shape = Shape { rows: read.len() / (2 * units), inner: 2 * units, columns: units };
        out.keys.resize(shape.rows * units, 0.0);
        gemm(shape, read, &parameters[layout.at(Part::Keys)], &mut out.keys, Sink::Replace);
        for &(start, length) in rows {
            let last = (start + length - 1) * 2 * units;
            out.ends.extend_from_slice(&read[last..last + units]);
            out.ends.extend_from_slice(&read[start * 2 * units + units..][..units]);
            out.cells.extend_from_slice(&parameters[layout.at(Part::BridgeBias)]);
        }
        let shape = Shape { rows: rows.len(), inner: 2 * units, columns: units };
        let bridge = &parameters[layout.at(Part::Bridge)];
        gemm(shape, &out.ends, bridge, &mut out.cells, Sink::Add);
        out.states = out.cells.clone();
        tanh_all(&mut out.states);
        out
    }
}

/// The attention of a state: the score and the share of each word, and the context.
#[derive(Debug, Clone, Default)]
pub(super) struct Look {
    pub scores: Vec<f32>,
    pub shares: Vec<f32>,
}

impl Look {
    /// - `keys`, `read`: of one utterance; `context`: overwritten, `[2·units]`.
    pub(super) fn forward(
        units: usize,
        state: &[f32],
        keys: &[f32],
        read: &[f32],
        context: &mut [f32],
    ) -> Look {
        let scores: Vec<f32> = keys.chunks_exact(units).map(|key| dot(state, key)).collect();
        let mut shares = scores.clone();
        softmax(&mut shares);
        context.fill(0.0);
        for (share, word) in shares.iter().zip(read.chunks_exact(2 * units)) {
            context.iter_mut().zip(word).for_each(|(sum, x)| *sum += share * x);
        }
        Look { scores, shares }
    }
}

/// ln of the probability of each allowed choice.
///
/// - `written`: scores of what can be written; `copied`: of each slot.
pub(super) fn log_probabilities(
    allowed: &[Choice],
    written: &[f32],
    copied: impl Fn(usize) -> f32,
) -> Vec<f32> {
    let score = |choice: &Choice| match *choice {
        Choice::Write(token) => written[token],
        Choice::Copy(slot) => copied(slot),
    };
    let mut logs: Vec<f32> = allowed.iter().map(score).collect();
    let largest = logs.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let mut powers: Vec<f32> = logs.iter().map(|x| x - largest).collect();
    exp_all(&mut powers);
    let whole = largest + ln(powers.iter().fold(0.0, |sum, x| sum + x));
    logs.iter_mut().for_each(|x| *x -= whole);
    logs
}

/// The decoder over a batch with the right tokens as input, and its backward pass.
#[derive(Debug, Clone, Default)]
pub(super) struct Writer {
    packing: Packing,
    sources: Sources,
    /// Packed by step: state and context `[total × 3·units]`, cells before the step `[total ×
    /// units]`.
    seen: Vec<f32>,
    cells: Vec<f32>,
    looks: Vec<Look>,
    /// The gradient of the scores of what is written, `[total × writes]`, and of what is copied, by
    /// word of the utterance.
    d_written: Vec<f32>,
    d_copied: Vec<Vec<(usize, f32)>>,
    /// Of the step to the next state: last token and context `[total × (token + 2·units)]`, gates.
    inputs: Vec<f32>,
    gates: Vec<f32>,
    squashed: Vec<f32>,
    told: Vec<usize>,
}

impl Writer {
    /// The loss of each row's program, in nats. The gradients of `backward` are those of their sum
    /// times `weight`.
    pub(super) fn forward(
        &mut self,
        layout: Layout,
        parameters: &[f32],
        vocabulary: &Vocabulary,
        reader: &Reader,
        targets: &[&Target],
        weight: f32,
    ) -> Vec<f64> {
        let Layout { units, token, writes, .. } = layout;
        let (wide, input) = (4 * units, token + 2 * units);
        let lengths: Vec<usize> = targets.iter().map(|target| target.choices.len()).collect();
        self.packing = Packing::new(&lengths);
        let total = self.packing.total;
        self.sources = Sources::new(layout, parameters, &reader.read, &reader.extents());
        for (list, width) in [
            (&mut self.seen, 3 * units),
            (&mut self.cells, units),
            (&mut self.inputs, input),
            (&mut self.gates, wide),
            (&mut self.squashed, units),
            (&mut self.d_written, writes),
        ] {
            list.clear();
            list.resize(total * width, 0.0);
        }
        self.looks.clear();
        self.d_copied.clear();
        self.told.clear();
        self.told.resize(total, 0);
        let rows = targets.len();
        let mut states = vec![0.0; rows * units];
        let mut cells = vec![0.0; rows * units];
        for (place, &row) in self.packing.order.iter().enumerate() {
            let from = row * units..(row + 1) * units;
            states[place * units..][..units].copy_from_slice(&self.sources.states[from.clone()]);
            cells[place * units..][..units].copy_from_slice(&self.sources.cells[from]);
        }
        let mut losses = vec![0.0; rows];
        for step in 0..self.packing.steps.len() {
            let (going, start) = self.packing.steps[step];
            self.cells[start * units..][..going * units].copy_from_slice(&cells[..going * units]);
            for place in 0..going {
                let (from, length) = reader.extent(self.packing.order[place]);
                let state = &states[place * units..][..units];
                let seen = &mut self.seen[(start + place) * 3 * units..][..3 * units];
                let (kept, context) = seen.split_at_mut(units);
                kept.copy_from_slice(state);
                let keys = &self.sources.keys[from * units..][..length * units];
                let read = &reader.read[from * 2 * units..][..length * 2 * units];
                self.looks.push(Look::forward(units, state, keys, read, context));
            }
            self.judge(layout, parameters, targets, step, weight, &mut losses);
            let Some(&(next, _)) = self.packing.steps.get(step + 1) else { break };
            for place in 0..next {
                let target = targets[self.packing.order[place]];
                let told = vocabulary.told(target.choices[step]);
                let at = start + place;
                self.told[at] = told;
                let embedding = &parameters[layout.at(Part::Tokens)][told * token..][..token];
                let into = &mut self.inputs[at * input..][..input];
                into[..token].copy_from_slice(embedding);
                let context = &self.seen[at * 3 * units + units..][..2 * units];
                into[token..].copy_from_slice(context);
                let gates = &mut self.gates[at * wide..][..wide];
                gates.copy_from_slice(&parameters[layout.at(Part::WriteBias)]);
            }
            let gates = &mut self.gates[start * wide..][..next * wide];
            let shape = Shape { rows: next, inner: input, columns: wide };
            let inputs = &self.inputs[start * input..][..next * input];
            gemm(shape, inputs, &parameters[layout.at(Part::WriteInput)], gates, Sink::Add);
            let shape = Shape { rows: next, inner: units, columns: wide };
            let weights = &parameters[layout.at(Part::WriteState)];
            gemm(shape, &states[..next * units], weights, gates, Sink::Add);
            let before = &self.cells[start * units..][..next * units];
            lstm_cell(
                units,
                gates,
                before,
                &mut cells[..next * units],
                &mut self.squashed[start * units..][..next * units],
                &mut states[..next * units],
            );
        }
        losses
    }

    /// The scores of a step, their loss and their gradient.
    fn judge(
        &mut self,
        layout: Layout,
        parameters: &[f32],
        targets: &[&Target],
        step: usize,
        weight: f32,
        losses: &mut [f64],
    ) {
        let Layout { units, writes, .. } = layout;
        let (going, start) = self.packing.steps[step];
        let written = &mut self.d_written[start * writes..][..going * writes];
        for row in written.chunks_exact_mut(writes) {
            row.copy_from_slice(&parameters[layout.at(Part::OutputBias)]);
        }
        let shape = Shape { rows: going, inner: 3 * units, columns: writes };
        let seen = &self.seen[start * 3 * units..][..going * 3 * units];
        gemm(shape, seen, &parameters[layout.at(Part::Output)], written, Sink::Add);
        for (place, written) in written.chunks_exact_mut(writes).enumerate() {
            let row = self.packing.order[place];
            let target = targets[row];
            let scores = &self.looks[start + place].scores;
            let allowed = &target.allowed[step];
            let logs = log_probabilities(allowed, written, |slot| scores[target.slots[slot]]);
            let mut shares = logs.clone();
            exp_all(&mut shares);
            written.fill(0.0);
            let mut copied = Vec::new();
            for ((choice, log), share) in allowed.iter().zip(logs).zip(shares) {
                let right = *choice == target.choices[step];
                if right {
                    losses[row] -= f64::from(log);
                }
                let d = weight * (share - if right { 1.0 } else { 0.0 });
                match *choice {
                    Choice::Write(token) => written[token] = d,
                    Choice::Copy(slot) => copied.push((target.slots[slot], d)),
                }
            }
            self.d_copied.push(copied);
        }
    }

    /// Adds the gradient of the decoder's parameters to `gradient`, and gives that of what was
    /// read, `[words × 2·units]`.
    pub(super) fn backward(
        &self,
        layout: Layout,
        parameters: &[f32],
        reader: &Reader,
        gradient: &mut [f32],
    ) -> Vec<f32> {
        let Layout { units, token, writes, .. } = layout;
        let (wide, input) = (4 * units, token + 2 * units);
        let rows = self.packing.order.len();
        let turned = |part: Part| {
            let (rows, columns) = layout.shape(part);
            let mut out = Vec::new();
            transpose(rows, columns, &parameters[layout.at(part)], &mut out);
            out
        };
        let (output, write_input) = (turned(Part::Output), turned(Part::WriteInput));
        let write_state = turned(Part::WriteState);
        let mut d_read = vec![0.0; reader.read.len()];
        let mut d_keys = vec![0.0; self.sources.keys.len()];
        let mut d_gates = vec![0.0; self.packing.total * wide];
        let mut d_inputs = vec![0.0; rows * input];
        // Of the state and cells that a step leaves; then of those that it found.
        let (mut d_states, mut d_cells) = (vec![0.0; rows * units], vec![0.0; rows * units]);
        let mut d_seen = vec![0.0; rows * 3 * units];
        for (step, &(going, start)) in self.packing.steps.iter().enumerate().rev() {
            let next = self.packing.steps.get(step + 1).map_or(0, |&(next, _)| next);
            let shape = Shape { rows: going, inner: writes, columns: 3 * units };
            let d_written = &self.d_written[start * writes..][..going * writes];
            gemm(shape, d_written, &output, &mut d_seen[..going * 3 * units], Sink::Replace);
            if next > 0 {
                let d_gates = &mut d_gates[start * wide..][..next * wide];
                lstm_cell_backward(
                    units,
                    &self.gates[start * wide..][..next * wide],
                    &self.cells[start * units..][..next * units],
                    &self.squashed[start * units..][..next * units],
                    &d_states[..next * units],
                    &mut d_cells[..next * units],
                    d_gates,
                );
                let shape = Shape { rows: next, inner: wide, columns: input };
                gemm(shape, d_gates, &write_input, &mut d_inputs[..next * input], Sink::Replace);
                let shape = Shape { rows: next, inner: wide, columns: units };
                gemm(shape, d_gates, &write_state, &mut d_states[..next * units], Sink::Replace);
            }
            for place in 0..next {
                let d_input = &d_inputs[place * input..][..input];
                let told = self.told[start + place];
                let into = &mut gradient[layout.at(Part::Tokens)][told * token..][..token];
                add(into, &d_input[..token]);
                add(&mut d_seen[place * 3 * units + units..][..2 * units], &d_input[token..]);
            }
            for place in 0..going {
                let d_seen = &d_seen[place * 3 * units..][..3 * units];
                let d_state = &mut d_states[place * units..][..units];
                add(d_state, &d_seen[..units]);
                let (from, length) = reader.extent(self.packing.order[place]);
                let at = start + place;
                let state = &self.seen[at * 3 * units..][..units];
                let look = &self.looks[at];
                let d_context = &d_seen[units..];
                let read = &reader.read[from * 2 * units..][..length * 2 * units];
                let d_shares: Vec<f32> =
                    read.chunks_exact(2 * units).map(|word| dot(d_context, word)).collect();
                let mean = dot(&d_shares, &look.shares);
                let mut d_scores: Vec<f32> =
                    look.shares.iter().zip(&d_shares).map(|(s, d)| s * (d - mean)).collect();
                for &(word, d) in &self.d_copied[at] {
                    d_scores[word] += d;
                }
                for (word, (share, d_score)) in look.shares.iter().zip(&d_scores).enumerate() {
                    let place = from + word;
                    scaled(&mut d_read[place * 2 * units..][..2 * units], *share, d_context);
                    scaled(&mut d_keys[place * units..][..units], *d_score, state);
                    let key = &self.sources.keys[place * units..][..units];
                    scaled(d_state, *d_score, key);
                }
            }
        }
        self.weights_back(layout, &d_gates, gradient);
        self.sources_back(
            layout,
            parameters,
            reader,
            [&d_states, &d_cells],
            &d_keys,
            gradient,
            &mut d_read,
        );
        d_read
    }

    /// The gradient of the matrices that all steps use.
    fn weights_back(&self, layout: Layout, d_gates: &[f32], gradient: &mut [f32]) {
        let Layout { units, token, writes, .. } = layout;
        let (wide, input, total) = (4 * units, token + 2 * units, self.packing.total);
        let of = |part| layout.at(part);
        let shape = Shape { rows: 3 * units, inner: total, columns: writes };
        let into = &mut gradient[of(Part::Output)];
        gemm_transposed_a(shape, &self.seen, &self.d_written, into, Sink::Add);
        let bias = &mut gradient[of(Part::OutputBias)];
        self.d_written.chunks_exact(writes).for_each(|row| add(bias, row));
        // Rows that no next step came from have no gradient.
        let shape = Shape { rows: input, inner: total, columns: wide };
        let into = &mut gradient[of(Part::WriteInput)];
        gemm_transposed_a(shape, &self.inputs, d_gates, into, Sink::Add);
        let states: Vec<f32> =
            self.seen.chunks_exact(3 * units).flat_map(|row| &row[..units]).copied().collect();
        let shape = Shape { rows: units, inner: total, columns: wide };
        let into = &mut gradient[of(Part::WriteState)];
        gemm_transposed_a(shape, &states, d_gates, into, Sink::Add);
        let bias = &mut gradient[of(Part::WriteBias)];
        d_gates.chunks_exact(wide).for_each(|row| add(bias, row));
    }

    /// Through the first state and the keys, back to what was read.
    #[allow(clippy::too_many_arguments)]
    fn sources_back(
        &self,
        layout: Layout,
        parameters: &[f32],
        reader: &Reader,
        [d_states, d_cells]: [&[f32]; 2],
        d_keys: &[f32],
        gradient: &mut [f32],
        d_read: &mut [f32],
    ) {
        let units = layout.units;
        let rows = self.packing.order.len();
        let mut d_first = vec![0.0; rows * units];
        for (place, &row) in self.packing.order.iter().enumerate() {
            for unit in 0..units {
                let state = self.sources.states[row * units + unit];
                let at = place * units + unit;
                d_first[row * units + unit] = d_cells[at] + d_states[at] * (1.0 - state * state);
            }
        }
        let of = |part| layout.at(part);
        let shape = Shape { rows: 2 * units, inner: rows, columns: units };
        let into = &mut gradient[of(Part::Bridge)];
        gemm_transposed_a(shape, &self.sources.ends, &d_first, into, Sink::Add);
        let bias = &mut gradient[of(Part::BridgeBias)];
        d_first.chunks_exact(units).for_each(|row| add(bias, row));
        let mut turned = Vec::new();
        transpose(2 * units, units, &parameters[of(Part::Bridge)], &mut turned);
        let mut d_ends = vec![0.0; rows * 2 * units];
        let shape = Shape { rows, inner: units, columns: 2 * units };
        gemm(shape, &d_first, &turned, &mut d_ends, Sink::Replace);
        for (row, d_end) in d_ends.chunks_exact(2 * units).enumerate() {
            let (start, length) = reader.extent(row);
            let last = (start + length - 1) * 2 * units;
            add(&mut d_read[last..last + units], &d_end[..units]);
            add(&mut d_read[start * 2 * units + units..][..units], &d_end[units..]);
        }
        let words = d_keys.len() / units;
        let shape = Shape { rows: 2 * units, inner: words, columns: units };
        let into = &mut gradient[of(Part::Keys)];
        gemm_transposed_a(shape, &reader.read, d_keys, into, Sink::Add);
        transpose(2 * units, units, &parameters[of(Part::Keys)], &mut turned);
        let shape = Shape { rows: words, inner: units, columns: 2 * units };
        gemm(shape, d_keys, &turned, d_read, Sink::Add);
    }
}

fn add(into: &mut [f32], add: &[f32]) {
    into.iter_mut().zip(add).for_each(|(x, add)| *x += add);
}

fn scaled(into: &mut [f32], scale: f32, add: &[f32]) {
    into.iter_mut().zip(add).for_each(|(x, add)| *x += scale * add);
}
