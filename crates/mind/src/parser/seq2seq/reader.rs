use std::collections::BTreeMap;

use super::Seq2SeqSettings;
use super::layout::{Layout, Part};
use crate::language::{LiftedUtterance, Word};
use crate::numerics::{
    Shape, Sink, gemm, gemm_transposed_a, lstm_cell, lstm_cell_backward, transpose,
};
use crate::parser::WordTable;

/// Utterances as the network reads them: each distinct word once, with its vector.
#[derive(Debug, Clone, Default)]
pub(super) struct Words {
    /// `[distinct × dims]`.
    pub vectors: Vec<f32>,
    /// Per utterance its words, as numbers of distinct ones.
    pub rows: Vec<Vec<usize>>,
}

impl Words {
    pub(super) fn new<'u>(
        settings: &Seq2SeqSettings,
        words: &WordTable,
        utterances: impl IntoIterator<Item = &'u LiftedUtterance>,
    ) -> Words {
        let mut known: BTreeMap<&Word, usize> = BTreeMap::new();
        let mut out = Words::default();
        for utterance in utterances {
            let number = |word| {
                let next = known.len();
                *known.entry(word).or_insert_with(|| {
                    out.vectors.extend(vector(settings, words, word));
                    next
                })
            };
            out.rows.push(utterance.words.iter().map(number).collect());
        }
        out
    }
}

/// A slot is read as the word of its sort, and the word of its fixture if lifting kept it.
fn vector(settings: &Seq2SeqSettings, words: &WordTable, word: &Word) -> Vec<f32> {
    let mut vector = match word {
        Word::Text(text) => words.vector(text),
        Word::Slot { sort, fixture } => {
            let stands = settings.slot_words.get(sort.as_str());
            let mut vector = words.vector(stands.map_or(sort.as_str(), String::as_str));
            if let Some(fixture) = fixture {
                let add = words.vector(fixture);
                vector.iter_mut().zip(add).for_each(|(x, add)| *x += add);
            }
            vector
        }
    };
    vector.iter_mut().for_each(|x| *x *= settings.word_scale);
    vector
}

/// Rows of different lengths, packed step by step. The longest rows come first, so the rows that
/// have a word at a step are the first ones.
#[derive(Debug, Clone, Default)]
pub(super) struct Packing {
    /// The row at each place.
    pub order: Vec<usize>,
    /// Per step, how many rows have a word, and where the step begins.
    pub steps: Vec<(usize, usize)>,
    /// Places of all steps.
    pub total: usize,
}

impl Packing {
    pub(super) fn new(lengths: &[usize]) -> Packing {
        let mut order: Vec<usize> = (0..lengths.len()).collect();
        // The sort is stable: rows of equal length keep their order.
        order.sort_by_key(|&row| std::cmp::Reverse(lengths[row]));
        let longest = lengths.iter().copied().max().unwrap_or(0);
        let mut packing = Packing { order, ..Packing::default() };
        for step in 0..longest {
            let going = lengths.iter().filter(|&&length| length > step).count();
            packing.steps.push((going, packing.total));
            packing.total += going;
        }
        packing
    }
}

/// The results of one direction of the encoder.
#[derive(Debug, Clone, Default)]
struct Direction {
    /// Of each distinct word, `[distinct × 4·units]`.
    projected: Vec<f32>,
    /// The rest packed: `[total × 4·units]`, `[total × units]`.
    gates: Vec<f32>,
    cells: Vec<f32>,
    squashed: Vec<f32>,
    states: Vec<f32>,
}

/// The encoder: an LSTM in each direction over each utterance of a batch.
#[derive(Debug, Clone, Default)]
pub(super) struct Reader {
    packing: Packing,
    directions: [Direction; 2],
    /// The distinct words of this batch: their vectors, and per row the numbers of its words.
    vectors: Vec<f32>,
    rows: Vec<Vec<usize>>,
    /// Where each row begins in `read`.
    pub starts: Vec<usize>,
    /// Both states at each word, row by row, `[words × 2·units]`.
    pub read: Vec<f32>,
}

impl Reader {
    /// - `chosen`: the rows of `words` that make the batch; none is empty.
    pub(super) fn forward(
        &mut self,
        layout: Layout,
        parameters: &[f32],
        words: &Words,
        chosen: &[usize],
    ) {
        self.take(layout, words, chosen);
        let units = layout.units;
        self.read.clear();
        self.read.resize(self.packing.total * 2 * units, 0.0);
        for side in 0..2 {
            let mut direction = std::mem::take(&mut self.directions[side]);
            self.run(layout, parameters, side, &mut direction);
            for (step, &(going, start)) in self.packing.steps.iter().enumerate() {
                for place in 0..going {
                    let at = self.place(side, step, place);
                    let state = &direction.states[(start + place) * units..][..units];
                    self.read[at * 2 * units + side * units..][..units].copy_from_slice(state);
                }
            }
            self.directions[side] = direction;
        }
    }

    /// The distinct words of the batch, and where its rows begin.
    fn take(&mut self, layout: Layout, words: &Words, chosen: &[usize]) {
        let mut known: BTreeMap<usize, usize> = BTreeMap::new();
        self.vectors.clear();
        self.rows.clear();
        self.starts.clear();
        let mut start = 0;
        for &row in chosen {
            let number = |word: &usize| {
                let next = known.len();
                *known.entry(*word).or_insert_with(|| {
                    let vector = &words.vectors[word * layout.dims..][..layout.dims];
                    self.vectors.extend_from_slice(vector);
                    next
                })
            };
            self.rows.push(words.rows[row].iter().map(number).collect());
            self.starts.push(start);
            start += words.rows[row].len();
        }
        let lengths: Vec<usize> = self.rows.iter().map(Vec::len).collect();
        self.packing = Packing::new(&lengths);
    }

    /// The word that a direction reads at a step, as a place in [`Reader::read`].
    fn place(&self, side: usize, step: usize, place: usize) -> usize {
        let row = self.packing.order[place];
        let position = if side == 0 { step } else { self.rows[row].len() - 1 - step };
        self.starts[row] + position
    }

    fn word(&self, side: usize, step: usize, place: usize) -> usize {
        let row = self.packing.order[place];
        self.rows[row][self.place(side, step, place) - self.starts[row]]
    }

    fn run(&self, layout: Layout, parameters: &[f32], side: usize, out: &mut Direction) {
        let Layout { dims, units, .. } = layout;
        let wide = 4 * units;
        let distinct = self.vectors.len() / dims;
        out.projected.clear();
        for _ in 0..distinct {
            out.projected.extend_from_slice(&parameters[layout.at(Part::ReadBias(side))]);
        }
        let shape = Shape { rows: distinct, inner: dims, columns: wide };
        let weights = &parameters[layout.at(Part::ReadWord(side))];
        gemm(shape, &self.vectors, weights, &mut out.projected, Sink::Add);
        let total = self.packing.total;
        for (list, width) in [
            (&mut out.gates, wide),
            (&mut out.cells, units),
            (&mut out.squashed, units),
            (&mut out.states, units),
        ] {
            list.clear();
            list.resize(total * width, 0.0);
        }
        let weights = &parameters[layout.at(Part::ReadState(side))];
        let nothing = vec![0.0; self.rows.len() * units];
        let mut previous = 0;
        for (step, &(going, start)) in self.packing.steps.iter().enumerate() {
            let gates = &mut out.gates[start * wide..(start + going) * wide];
            for (place, gates) in gates.chunks_exact_mut(wide).enumerate() {
                let word = self.word(side, step, place);
                gates.copy_from_slice(&out.projected[word * wide..][..wide]);
            }
            let (old_cells, cells) = out.cells.split_at_mut(start * units);
            let (old_states, states) = out.states.split_at_mut(start * units);
            let before = if step == 0 {
                &nothing[..going * units]
            } else {
                let shape = Shape { rows: going, inner: units, columns: wide };
                let state = &old_states[previous * units..][..going * units];
                gemm(shape, state, weights, gates, Sink::Add);
                &old_cells[previous * units..][..going * units]
            };
            lstm_cell(
                units,
                gates,
                before,
                &mut cells[..going * units],
                &mut out.squashed[start * units..][..going * units],
                &mut states[..going * units],
            );
            previous = start;
        }
    }

    /// Adds the gradient of the encoder's parameters to `gradient`.
    ///
    /// - `d_read`: the gradient of `read`.
    pub(super) fn backward(
        &self,
        layout: Layout,
        parameters: &[f32],
        d_read: &[f32],
        gradient: &mut [f32],
    ) {
        for side in 0..2 {
            self.back(layout, parameters, side, d_read, gradient);
        }
    }

    fn back(
        &self,
        layout: Layout,
        parameters: &[f32],
        side: usize,
        d_read: &[f32],
        gradient: &mut [f32],
    ) {
        let Layout { dims, units, .. } = layout;
        let wide = 4 * units;
        let direction = &self.directions[side];
        let distinct = self.vectors.len() / dims;
        let mut weights = Vec::new();
        transpose(units, wide, &parameters[layout.at(Part::ReadState(side))], &mut weights);
        let mut d_gates = vec![0.0; self.packing.total * wide];
        let mut d_states = vec![0.0; self.rows.len() * units];
        let mut d_cells = vec![0.0; self.rows.len() * units];
        let nothing = vec![0.0; self.rows.len() * units];
        // The state before each step, packed like the gates; nothing before the first.
        let mut before = vec![0.0; self.packing.total * units];
        for (step, &(going, start)) in self.packing.steps.iter().enumerate().rev() {
            for place in 0..going {
                let at = self.place(side, step, place);
                let add = &d_read[at * 2 * units + side * units..][..units];
                let state = &mut d_states[place * units..][..units];
                state.iter_mut().zip(add).for_each(|(x, add)| *x += add);
            }
            let previous = step.checked_sub(1).map(|step| self.packing.steps[step].1);
            let cells = match previous {
                Some(previous) => &direction.cells[previous * units..][..going * units],
                None => &nothing[..going * units],
            };
            let d_gates = &mut d_gates[start * wide..(start + going) * wide];
            lstm_cell_backward(
                units,
                &direction.gates[start * wide..(start + going) * wide],
                cells,
                &direction.squashed[start * units..][..going * units],
                &d_states[..going * units],
                &mut d_cells[..going * units],
                d_gates,
            );
            if let Some(previous) = previous {
                let states = &direction.states[previous * units..][..going * units];
                before[start * units..][..going * units].copy_from_slice(states);
                let shape = Shape { rows: going, inner: wide, columns: units };
                gemm(shape, d_gates, &weights, &mut d_states[..going * units], Sink::Replace);
            }
        }
        let total = self.packing.total;
        let shape = Shape { rows: units, inner: total, columns: wide };
        let of = |part| layout.at(part);
        let into = &mut gradient[of(Part::ReadState(side))];
        gemm_transposed_a(shape, &before, &d_gates, into, Sink::Add);
        let mut d_projected = vec![0.0; distinct * wide];
        for (step, &(going, start)) in self.packing.steps.iter().enumerate() {
            for place in 0..going {
                let word = self.word(side, step, place);
                let add = &d_gates[(start + place) * wide..][..wide];
                let sum = &mut d_projected[word * wide..][..wide];
                sum.iter_mut().zip(add).for_each(|(x, add)| *x += add);
            }
        }
        let shape = Shape { rows: dims, inner: distinct, columns: wide };
        let into = &mut gradient[of(Part::ReadWord(side))];
        gemm_transposed_a(shape, &self.vectors, &d_projected, into, Sink::Add);
        let bias = &mut gradient[of(Part::ReadBias(side))];
        for row in d_projected.chunks_exact(wide) {
            bias.iter_mut().zip(row).for_each(|(sum, d)| *sum += d);
        }
    }
}

impl Reader {
    /// Where a row begins in [`Reader::read`], and how many words it has.
    pub(super) fn extent(&self, row: usize) -> (usize, usize) {
        (self.starts[row], self.rows[row].len())
    }

    pub(super) fn extents(&self) -> Vec<(usize, usize)> {
        (0..self.rows.len()).map(|row| self.extent(row)).collect()
    }
}
