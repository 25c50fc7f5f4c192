use super::layout::{Layout, Part};
use super::reader::{Reader, Words};
use super::vocabulary::{Choice, Expected, Vocabulary, slots};
use super::writer::{Look, Sources, log_probabilities};
use crate::language::{LiftedProgram, LiftedUtterance};
use crate::numerics::{Shape, Sink, exp, gemm, lstm_cell};

/// A program being written.
#[derive(Debug, Clone)]
struct Draft {
    choices: Vec<Choice>,
    /// Operators among the choices.
    steps: usize,
    expected: Expected,
    /// ln of the probability.
    log: f32,
    state: Vec<f32>,
    cells: Vec<f32>,
}

/// The likeliest program that the search finds for an utterance, with its probability among all
/// programs that the grammar of programs allows. None if no operator has an argument here.
///
/// Among drafts of equal probability, the one whose earlier draft was likelier comes first, then
/// the one whose choice comes first in the vocabulary.
///
/// - `words`: of this utterance alone.
pub(super) fn likeliest(
    layout: Layout,
    parameters: &[f32],
    vocabulary: &Vocabulary,
    words: &Words,
    utterance: &LiftedUtterance,
    beam: usize,
) -> Option<(LiftedProgram, f32)> {
    let units = layout.units;
    let (sorts, places) = slots(utterance);
    let mut reader = Reader::default();
    reader.forward(layout, parameters, words, &[0]);
    let sources = Sources::new(layout, parameters, &reader.read, &reader.extents());
    let mut drafts = vec![Draft {
        choices: Vec::new(),
        steps: 0,
        expected: vocabulary.start(),
        log: 0.0,
        state: sources.states.clone(),
        cells: sources.cells.clone(),
    }];
    let mut best: Option<(Vec<Choice>, f32)> = None;
    // Every step has an operator, so the search ends with the longest program.
    while !drafts.is_empty() {
        let mut longer: Vec<(usize, Choice, f32, Vec<f32>)> = Vec::new();
        for (number, draft) in drafts.iter().enumerate() {
            let mut seen = vec![0.0; 3 * units];
            let (state, context) = seen.split_at_mut(units);
            state.copy_from_slice(&draft.state);
            let look = Look::forward(units, &draft.state, &sources.keys, &reader.read, context);
            let mut written = parameters[layout.at(Part::OutputBias)].to_vec();
            let shape = Shape { rows: 1, inner: 3 * units, columns: layout.writes };
            let output = &parameters[layout.at(Part::Output)];
            gemm(shape, &seen, output, &mut written, Sink::Add);
            let allowed = vocabulary.allowed(draft.expected, &sorts);
            let copied = |slot: usize| look.scores[places[slot]];
            let logs = log_probabilities(&allowed, &written, copied);
            for (choice, log) in allowed.into_iter().zip(logs) {
                longer.push((number, choice, draft.log + log, seen[units..].to_vec()));
            }
        }
        // Stable, so ties stay in the order they were found in.
        longer.sort_by(|one, other| other.2.total_cmp(&one.2));
        let known = best.as_ref().map_or(f32::NEG_INFINITY, |(_, log)| *log);
        // A draft only becomes less likely.
        longer.retain(|(_, _, log, _)| *log > known);
        longer.truncate(beam);
        let mut next = Vec::new();
        for (number, choice, log, context) in longer {
            let draft = &drafts[number];
            let mut choices = draft.choices.clone();
            choices.push(choice);
            if choice == Choice::Write(vocabulary.end()) {
                if best.as_ref().is_none_or(|(_, known)| log > *known) {
                    best = Some((choices, log));
                }
                continue;
            }
            let operator = matches!(choice, Choice::Write(token) if token < vocabulary.end());
            let steps = draft.steps + usize::from(operator);
            let expected = vocabulary.after(draft.expected, choice, steps);
            let told = vocabulary.told(choice);
            let (state, cells) = step(layout, parameters, draft, told, &context);
            next.push(Draft { choices, steps, expected, log, state, cells });
        }
        drafts = next;
    }
    let (choices, log) = best?;
    Some((vocabulary.decode(&choices, &sorts), exp(log)))
}

/// The decoder's state and cells after a token.
fn step(
    layout: Layout,
    parameters: &[f32],
    draft: &Draft,
    told: usize,
    context: &[f32],
) -> (Vec<f32>, Vec<f32>) {
    let Layout { units, token, .. } = layout;
    let mut input = parameters[layout.at(Part::Tokens)][told * token..][..token].to_vec();
    input.extend_from_slice(context);
    let mut gates = parameters[layout.at(Part::WriteBias)].to_vec();
    let shape = Shape { rows: 1, inner: input.len(), columns: 4 * units };
    gemm(shape, &input, &parameters[layout.at(Part::WriteInput)], &mut gates, Sink::Add);
    let shape = Shape { rows: 1, inner: units, columns: 4 * units };
    let weights = &parameters[layout.at(Part::WriteState)];
    gemm(shape, &draft.state, weights, &mut gates, Sink::Add);
    let (mut cells, mut squashed) = (vec![0.0; units], vec![0.0; units]);
    let mut state = vec![0.0; units];
    lstm_cell(units, &mut gates, &draft.cells, &mut cells, &mut squashed, &mut state);
    (state, cells)
}
