use std::collections::{BTreeMap, BTreeSet};

use super::batch::{Batch, encode_positions, start_word};
use super::layout::Layout;
use super::objective::Objective;
use super::tokens::{Token, Tokeniser};
use super::{ExemplarSettings, Figures, TrainFault};
use crate::ids::Digest;
use crate::language::{Exemplar, LiftedProgram};
use crate::numerics::{Adam, AdamSettings, Floats, Rng, glorot};
use crate::parser::WordTable;

/// Full-batch training from scratch: the sorts, the parameters, and what happened.
pub(super) fn train(
    settings: &ExemplarSettings,
    words: &'static WordTable,
    seed: Digest,
    examples: &[Exemplar],
) -> Result<(Vec<String>, Floats, Figures), TrainFault> {
    if examples.is_empty() {
        return Err(TrainFault::NoExemplars);
    }
    if let Some(number) = examples.iter().position(|e| e.utterance.words.is_empty()) {
        return Err(TrainFault::NoWords { number });
    }
    let tokeniser = Tokeniser::new(settings);
    let rows: Vec<_> = examples.iter().map(|e| tokeniser.tokens(&e.utterance)).collect();
    let sorts = sorts(&rows);
    let batch = Batch::new(settings, words, &sorts, &rows);
    let layout = Layout {
        dims: words.dims(),
        hidden: settings.hidden,
        embedding: settings.embedding,
        sorts: sorts.len(),
    };
    let mut parameters = start(settings, words, seed, layout, &sorts);
    let mut encoded = Vec::new();
    encode_positions(settings, layout.dims, 0, batch.positions, &mut encoded);
    let mut objective = Objective::new(settings, layout, &batch, &classes(examples), encoded);
    let mut adam = Adam::new(
        layout.total(),
        AdamSettings {
            learning_rate: settings.learning_rate,
            weight_decay: settings.weight_decay,
            ..AdamSettings::default()
        },
    );
    let mut gradient = vec![0.0; layout.total()];
    let mut steps = 0;
    let mut loss = objective.evaluate(&parameters, &mut gradient);
    while loss > settings.stop_loss as f64 && steps < settings.steps_max {
        adam.step(&mut parameters, &gradient);
        steps += 1;
        loss = objective.evaluate(&parameters, &mut gradient);
        if !loss.is_finite() {
            break;
        }
    }
    if !loss.is_finite() || !parameters.all_finite() {
        return Err(TrainFault::Diverged { step: steps, loss: loss.to_string() });
    }
    let [a, b] = layout.classifier().map(|at| parameters[at] as f64);
    let figures = [
        ("exemplars", examples.len() as f64),
        ("distinct_tokens", batch.tokens() as f64),
        ("steps", steps as f64),
        ("loss", loss),
        ("a", a),
        ("b", b),
    ];
    let figures = figures.map(|(name, value)| (name.to_owned(), value));
    Ok((sorts, parameters, Figures::from(figures)))
}

fn sorts(rows: &[Vec<Token>]) -> Vec<String> {
    let sort = |token: &Token| match token {
        Token::Slot { sort, .. } => Some(sort.clone()),
        Token::Word(_) => None,
    };
    rows.iter().flatten().filter_map(sort).collect::<BTreeSet<_>>().into_iter().collect()
}

/// Numbers the distinct programs; programs are the same when they agree up to slot numbering.
fn classes(examples: &[Exemplar]) -> Vec<usize> {
    let mut known: BTreeMap<LiftedProgram, usize> = BTreeMap::new();
    let mut class = |exemplar: &Exemplar| {
        let next = known.len();
        *known.entry(exemplar.program.canonical()).or_insert(next)
    };
    examples.iter().map(&mut class).collect()
}

fn start(
    settings: &ExemplarSettings,
    words: &WordTable,
    seed: Digest,
    layout: Layout,
    sorts: &[String],
) -> Floats {
    let salted = [&seed.0, settings.salt.as_bytes()].concat();
    let mut rng = Rng::from_digest(Digest::of(&salted));
    let Layout { dims, hidden, embedding, .. } = layout;
    let mut parameters = Floats::zeros(layout.total());
    glorot(dims, hidden, &mut parameters[layout.transform()], &mut rng);
    glorot(hidden, hidden, &mut parameters[layout.first()], &mut rng);
    glorot(hidden, embedding, &mut parameters[layout.second()], &mut rng);
    for (index, sort) in sorts.iter().enumerate() {
        let vector = words.vector(start_word(settings, sort));
        let scaled = vector.iter().map(|x| x * settings.word_scale);
        parameters[layout.sort(index)].iter_mut().zip(scaled).for_each(|(x, v)| *x = v);
    }
    let [a, b] = layout.classifier();
    parameters[a] = settings.a_start;
    parameters[b] = settings.b_start;
    parameters
}
