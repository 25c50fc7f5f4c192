use std::collections::BTreeMap;

use super::ExemplarSettings;
use super::tokens::Token;
use crate::parser::WordTable;

/// Utterances prepared for the network. Because W(e + p) = We + Wp, each distinct token and each
/// position is transformed only once.
#[derive(Debug, Clone, Default)]
pub(super) struct Batch {
    /// Fixed part of each distinct token's vector, `[tokens × dims]`.
    pub fixed: Vec<f32>,
    /// For each distinct token, the sort whose trainable vector is added.
    pub sorts: Vec<Option<usize>>,
    /// Positions that occur: 0 up to below this.
    pub positions: usize,
    /// Distinct (token, position).
    pub cells: Vec<(u32, u32)>,
    /// The cells of all utterances, one after another, in the order of their words.
    pub places: Vec<u32>,
    /// Where each utterance ends in `places`.
    pub ends: Vec<u32>,
}

impl Batch {
    /// `sorts`: the sorts that have a trainable vector, sorted. A sort without one has the vector
    /// of its start word.
    pub(super) fn new(
        settings: &ExemplarSettings,
        words: &WordTable,
        sorts: &[String],
        rows: &[Vec<Token>],
    ) -> Batch {
        let mut batch = Batch { positions: 1, ..Batch::default() };
        let mut tokens: BTreeMap<&Token, u32> = BTreeMap::new();
        let mut cells: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for row in rows {
            for (position, token) in row.iter().enumerate() {
                let next = tokens.len() as u32;
                let token = *tokens.entry(token).or_insert_with(|| {
                    batch.add_token(settings, words, sorts, token);
                    next
                });
                let position = if settings.positions { position } else { 0 };
                batch.positions = batch.positions.max(position + 1);
                let cell = (token, position as u32);
                let next = cells.len() as u32;
                let place = *cells.entry(cell).or_insert(next);
                if place == next {
                    batch.cells.push(cell);
                }
                batch.places.push(place);
            }
            batch.ends.push(batch.places.len() as u32);
        }
        batch
    }

    fn add_token(
        &mut self,
        settings: &ExemplarSettings,
        words: &WordTable,
        sorts: &[String],
        token: &Token,
    ) {
        let mut vector = vec![0.0; words.dims()];
        let mut sort = None;
        match token {
            Token::Word(word) => words.write_vector(word, &mut vector),
            Token::Slot { sort: name, fixture } => {
                if let Some(word) = fixture {
                    words.write_vector(word, &mut vector);
                    vector.iter_mut().for_each(|x| *x *= settings.fixture_weight);
                }
                sort = sorts.binary_search(name).ok();
                if sort.is_none() {
                    let start = words.vector(start_word(settings, name));
                    vector.iter_mut().zip(start).for_each(|(x, add)| *x += add);
                }
            }
        }
        vector.iter_mut().for_each(|x| *x *= settings.word_scale);
        self.fixed.extend(vector);
        self.sorts.push(sort);
    }

    pub(super) fn rows(&self) -> usize {
        self.ends.len()
    }

    pub(super) fn tokens(&self) -> usize {
        self.sorts.len()
    }

    /// The cells of one utterance.
    pub(super) fn row(&self, index: usize) -> &[u32] {
        let start = if index == 0 { 0 } else { self.ends[index - 1] };
        &self.places[start as usize..self.ends[index] as usize]
    }
}

/// The word that a sort's vector starts from.
pub(super) fn start_word<'a>(settings: &'a ExemplarSettings, sort: &'a str) -> &'a str {
    settings.slot_words.get(sort).map_or(sort, String::as_str)
}

/// Sinusoids of falling frequency for the positions `first..first + count`, `[count × dims]`.
/// Source: Vaswani et al. 2017.
pub(super) fn encode_positions(
    settings: &ExemplarSettings,
    dims: usize,
    first: usize,
    count: usize,
    out: &mut Vec<f32>,
) {
    out.clear();
    out.resize(count * dims, 0.0);
    if !settings.positions {
        return;
    }
    for pair in 0..dims.div_ceil(2) {
        let rate = libm::pow(10_000.0, -(2.0 * pair as f64) / dims as f64);
        for row in 0..count {
            let angle = (first + row) as f64 * rate;
            for (column, value) in [(2 * pair, libm::sin(angle)), (2 * pair + 1, libm::cos(angle))]
            {
                if column < dims {
                    out[row * dims + column] = value as f32 * settings.position_scale;
                }
            }
        }
    }
}
