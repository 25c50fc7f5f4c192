use super::layout::{Layout, Part};
use super::objective::{Lessons, Objective};
use super::reader::Words;
use super::vocabulary::{Vocabulary, slots};
use super::writer::Target;
use super::{Seq2SeqSettings, layout_of, learned};
use crate::ids::Digest;
use crate::language::Exemplar;
use crate::numerics::{Adam, AdamSettings, Floats, Rng, dot, fill_uniform, glorot};
use crate::parser::{Figures, TrainFault, WordTable};

/// Trains from scratch: the parameters, and what happened.
pub(super) fn train(
    settings: &Seq2SeqSettings,
    words: &'static WordTable,
    vocabulary: &Vocabulary,
    seed: Digest,
    examples: &[Exemplar],
    seeds: usize,
) -> Result<(Floats, Figures), TrainFault> {
    if let Some(number) = examples.iter().position(|e| e.utterance.words.is_empty()) {
        return Err(TrainFault::NoWords { number });
    }
    // A program with a slot that its utterance does not have cannot be written. No utterance can
    // ask for it either.
    let encoded: Vec<(&Exemplar, _)> = learned(examples, seeds)
        .filter_map(|exemplar| Some((exemplar, vocabulary.encode(exemplar)?)))
        .collect();
    if encoded.is_empty() {
        return Err(TrainFault::NoExemplars);
    }
    let known: Vec<&Exemplar> = encoded.iter().map(|(exemplar, _)| *exemplar).collect();
    let targets = encoded.iter().map(|(exemplar, choices)| {
        let (sorts, places) = slots(&exemplar.utterance);
        Target::new(vocabulary, choices.clone(), &sorts, places)
    });
    let lessons = Lessons {
        targets: targets.collect(),
        words: Words::new(settings, words, known.iter().map(|exemplar| &exemplar.utterance)),
    };
    let clashes = |one: &Exemplar| {
        known.iter().any(|other| other.utterance == one.utterance && other.program != one.program)
    };
    let fits: Vec<bool> = known.iter().map(|exemplar| !clashes(exemplar)).collect();

    let layout = layout_of(settings, words, vocabulary);
    let salted = [&seed.0, settings.salt.as_bytes()].concat();
    let mut rng = Rng::from_digest(Digest::of(&salted));
    let mut parameters = start(layout, &mut rng);
    let learning_rate = settings.learning_rate;
    let mut adam =
        Adam::new(layout.total(), AdamSettings { learning_rate, ..AdamSettings::default() });
    let mut objective = Objective::default();
    let mut gradient = vec![0.0; layout.total()];
    let mut order: Vec<usize> = (0..known.len()).collect();
    let (mut epochs, mut steps, mut clipped) = (0, 0, 0);
    let (mut worst, mut mean) = (f64::INFINITY, f64::INFINITY);
    while worst > f64::from(settings.stop_loss) && epochs < settings.epochs_max {
        rng.shuffle(&mut order);
        (worst, mean) = (0.0, 0.0);
        for chosen in order.chunks(settings.batch) {
            let losses = objective.evaluate(
                layout,
                &parameters,
                vocabulary,
                &lessons,
                chosen,
                &mut gradient,
            );
            for (&row, &loss) in chosen.iter().zip(&losses) {
                mean += loss / known.len() as f64;
                worst = if fits[row] && loss > worst { loss } else { worst };
            }
            let length = dot(&gradient, &gradient).sqrt();
            if length > settings.clip {
                clipped += 1;
                let shorter = settings.clip / length;
                gradient.iter_mut().for_each(|x| *x *= shorter);
            }
            adam.step(&mut parameters, &gradient);
            steps += 1;
        }
        epochs += 1;
        if !mean.is_finite() {
            break;
        }
    }
    if !mean.is_finite() || !parameters.all_finite() {
        return Err(TrainFault::Diverged { step: steps, loss: mean.to_string() });
    }
    let figures = [
        ("exemplars", examples.len() as f64),
        ("learned", known.len() as f64),
        ("epochs", epochs as f64),
        ("steps", steps as f64),
        ("clipped", f64::from(clipped)),
        ("loss", mean),
        ("loss_worst", worst),
    ];
    let figures = figures.map(|(name, value)| (name.to_owned(), value));
    Ok((parameters, Figures::from(figures)))
}

/// Glorot weights; biases 0, those of forget gates 1, so that nothing is forgotten at first.
fn start(layout: Layout, rng: &mut Rng) -> Floats {
    let mut parameters = Floats::zeros(layout.total());
    let units = layout.units;
    for part in Part::ALL {
        let (rows, columns) = layout.shape(part);
        let values = &mut parameters[layout.at(part)];
        match part {
            Part::ReadBias(_) | Part::WriteBias => values[units..2 * units].fill(1.0),
            Part::BridgeBias | Part::OutputBias => {}
            Part::Tokens => fill_uniform(values, 0.5, rng),
            // Four gates of `units` columns each.
            Part::ReadWord(_) | Part::ReadState(_) | Part::WriteInput | Part::WriteState => {
                glorot(rows, columns / 4, values, rng);
            }
            Part::Bridge | Part::Keys | Part::Output => glorot(rows, columns, values, rng),
        }
    }
    parameters
}
