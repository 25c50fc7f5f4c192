use std::collections::BTreeSet;

use super::{Calibration, ExemplarParser, ExemplarSettings, Figures, ThresholdReading};
use crate::language::{LiftedProgram, LiftedUtterance};

/// One comparison that the threshold would accept from `distance` on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trial {
    /// The exemplar.
    number: u32,
    distance: f32,
    right: bool,
}

/// The threshold in the reading of `settings.threshold`, never below `settings.beta`. Notes what it
/// accepts in `figures`.
pub(super) fn calibrate(
    settings: &ExemplarSettings,
    parser: &ExemplarParser,
    calibration: Calibration<'_>,
    figures: &mut Figures,
) -> f32 {
    let Calibration { variants, unknown } = calibration;
    let asked = variants.iter().map(|variant| (&variant.utterance, Some(&variant.program)));
    let variant_trials = trials(parser, asked.collect());
    // An unknown request has no right program; it is only known that the programs of the variants
    // are wrong for it. If a lesson is nearest, nothing is known: it may be what the person taught.
    // Counting it as wrong would make the threshold smaller with every lesson.
    let answered: BTreeSet<LiftedProgram> =
        variants.iter().map(|variant| variant.program.canonical()).collect();
    let asked = unknown.iter().map(|utterance| (utterance, None)).collect();
    let unknown_trials: Vec<Vec<Trial>> = trials(parser, asked)
        .into_iter()
        .filter(|trials| {
            let program = |trial: &Trial| &parser.exemplars[trial.number as usize].program;
            trials.first().is_some_and(|trial| answered.contains(&program(trial).canonical()))
        })
        .collect();
    // Trials are sorted: the first is the nearest exemplar, whose program would be the answer.
    let first = |trials: &[Vec<Trial>]| -> Vec<Trial> {
        trials.iter().filter_map(|trials| trials.first().copied()).collect()
    };
    let (answers, guesses) = (first(&variant_trials), first(&unknown_trials));
    let found = match settings.threshold {
        ThresholdReading::AcceptedRight => {
            largest_precise([answers.clone(), guesses.clone()].concat(), settings.precision)
        }
        ThresholdReading::PairsRight => {
            largest_precise(variant_trials.concat(), settings.precision)
        }
        ThresholdReading::Covered => smallest_covering(&variant_trials, settings.precision),
    };
    let threshold = found.unwrap_or(0.0).max(settings.beta);
    let accepted = |trial: &&Trial| trial.distance <= threshold;
    let right = answers.iter().filter(accepted).filter(|trial| trial.right).count();
    let wrong = answers.iter().filter(accepted).filter(|trial| !trial.right).count();
    let unknown_accepted = guesses.iter().filter(accepted).count();
    let forced = answers.iter().filter(|trial| trial.right).count();
    let share = |count: usize, of: usize| if of == 0 { 0.0 } else { count as f64 / of as f64 };
    let noted = [
        ("threshold", threshold as f64),
        ("threshold_unfloored", found.unwrap_or(0.0) as f64),
        ("variants", answers.len() as f64),
        ("variants_right", share(right, answers.len())),
        ("variants_wrong", share(wrong, answers.len())),
        ("variants_right_forced", share(forced, answers.len())),
        ("unknown", guesses.len() as f64),
        ("unknown_accepted", share(unknown_accepted, guesses.len())),
        ("accepted_precision", share(right, right + wrong + unknown_accepted)),
    ];
    figures.extend(noted.map(|(name, value)| (name.to_owned(), value)));
    threshold
}

/// Notes the share of exemplars whose nearest exemplar has their own program, without the rule for
/// exact forms. It is below 1 only if different programs have the same words except stop words.
pub(super) fn measure(parser: &ExemplarParser, figures: &mut Figures) {
    let exemplars = parser.exemplars.iter();
    let asked = exemplars.map(|exemplar| (&exemplar.utterance, Some(&exemplar.program)));
    let recalled = |trials: &&Vec<Trial>| trials.first().is_some_and(|trial| trial.right);
    let count = trials(parser, asked.collect()).iter().filter(recalled).count();
    let share = count as f64 / parser.exemplars.len() as f64;
    figures.insert("self_recall".to_owned(), share);
}

/// Each utterance, with its right program if it has one, against every exemplar, nearest first.
fn trials(
    parser: &ExemplarParser,
    asked: Vec<(&LiftedUtterance, Option<&LiftedProgram>)>,
) -> Vec<Vec<Trial>> {
    let utterances: Vec<_> = asked.iter().map(|(utterance, _)| *utterance).collect();
    let embeddings = parser.embed_all(&utterances);
    let width = embeddings.len() / asked.len().max(1);
    let against_all = |(embedding, (utterance, program)): (&[f32], (&LiftedUtterance, _))| {
        let slots = utterance.slots();
        let trial = |(number, distance): (u32, f32)| {
            let found = &parser.exemplars[number as usize].program;
            let right = program == Some(found);
            // A program that the mentions cannot fill is never a candidate.
            (found.slots() <= slots).then_some(Trial { number, distance, right })
        };
        let mut trials: Vec<Trial> = parser.index.every(embedding).filter_map(trial).collect();
        // Stable: among equals the older exemplar stays first.
        trials.sort_by(|one, two| one.distance.total_cmp(&two.distance));
        trials
    };
    embeddings.chunks_exact(width.max(1)).zip(asked).map(against_all).collect()
}

/// The largest distance at which at least `precision` of the trials within it are right.
fn largest_precise(mut trials: Vec<Trial>, precision: f64) -> Option<f32> {
    trials.sort_by(|one, two| one.distance.total_cmp(&two.distance));
    let mut found = None;
    let mut right = 0;
    for (index, trial) in trials.iter().enumerate() {
        right += trial.right as usize;
        // Equal distances are accepted together or not at all.
        let last = trials.get(index + 1).is_none_or(|next| next.distance > trial.distance);
        if last && right as f64 >= precision * (index + 1) as f64 {
            found = Some(trial.distance);
        }
    }
    found
}

/// The smallest distance within which `share` of the utterances have a right exemplar; if fewer
/// have one, the distance that covers all that have.
fn smallest_covering(utterances: &[Vec<Trial>], share: f64) -> Option<f32> {
    let nearest_right = |trials: &Vec<Trial>| trials.iter().find(|trial| trial.right).copied();
    let mut right: Vec<f32> =
        utterances.iter().filter_map(nearest_right).map(|trial| trial.distance).collect();
    right.sort_by(f32::total_cmp);
    let needed = (share * utterances.len() as f64).ceil() as usize;
    let index = needed.max(1).min(right.len()).checked_sub(1)?;
    Some(right[index])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trials(text: &str) -> Vec<Trial> {
        let trial = |word: &str| {
            let (distance, right) = (word.trim_end_matches(['+', '-']), word.ends_with('+'));
            Trial { number: 0, distance: distance.parse().unwrap(), right }
        };
        text.split_whitespace().map(trial).collect()
    }

    #[test]
    fn the_threshold_is_the_largest_distance_that_is_precise_enough() {
        assert_eq!(largest_precise(trials("0.1+ 0.2+ 0.3- 0.4+"), 0.75), Some(0.4));
        assert_eq!(largest_precise(trials("0.1+ 0.2+ 0.3- 0.4-"), 0.9), Some(0.2));
        assert_eq!(largest_precise(trials("0.1-"), 0.9), None);
        assert_eq!(largest_precise(Vec::new(), 0.9), None);
    }

    #[test]
    fn equal_distances_stand_or_fall_together() {
        assert_eq!(largest_precise(trials("0.1+ 0.2+ 0.2-"), 0.9), Some(0.1));
    }

    #[test]
    fn covering_counts_utterances_that_no_exemplar_answers() {
        let utterances = [trials("0.1- 0.5+"), trials("0.2+ 0.3+"), trials("0.4-")];
        assert_eq!(smallest_covering(&utterances, 0.3), Some(0.2));
        assert_eq!(smallest_covering(&utterances, 0.6), Some(0.5));
        assert_eq!(smallest_covering(&utterances, 1.0), Some(0.5));
        assert_eq!(smallest_covering(&[], 0.9), None);
    }
}
