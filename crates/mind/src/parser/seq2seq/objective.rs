use super::layout::Layout;
use super::reader::{Reader, Words};
use super::vocabulary::Vocabulary;
use super::writer::{Target, Writer};

/// The loss of programs, and its gradient by the parameters.
#[derive(Debug, Default)]
pub(super) struct Objective {
    reader: Reader,
    writer: Writer,
}

/// The examples: row n of the words means target n.
pub(super) struct Lessons {
    pub words: Words,
    pub targets: Vec<Target>,
}

impl Objective {
    /// The loss of each chosen row's program, in nats. `gradient` is overwritten with the gradient
    /// of their mean.
    pub(super) fn evaluate(
        &mut self,
        layout: Layout,
        parameters: &[f32],
        vocabulary: &Vocabulary,
        lessons: &Lessons,
        chosen: &[usize],
        gradient: &mut [f32],
    ) -> Vec<f64> {
        self.reader.forward(layout, parameters, &lessons.words, chosen);
        let targets: Vec<&Target> = chosen.iter().map(|&row| &lessons.targets[row]).collect();
        let weight = 1.0 / chosen.len() as f32;
        let losses =
            self.writer.forward(layout, parameters, vocabulary, &self.reader, &targets, weight);
        gradient.fill(0.0);
        let d_read = self.writer.backward(layout, parameters, &self.reader, gradient);
        self.reader.backward(layout, parameters, &d_read, gradient);
        losses
    }
}

#[cfg(test)]
mod tests {
    use super::super::layout::Part;
    use super::super::tests::{lessons, vocabulary};
    use super::super::vocabulary::slots;
    use super::*;
    use crate::numerics::{Kernel, Rng};
    use crate::parser::WordTable;
    use crate::parser::seq2seq::Seq2SeqSettings;

    fn prepared() -> (Layout, Vocabulary, Lessons, Vec<f32>) {
        let words = WordTable::builtin("paper").unwrap();
        let settings = Seq2SeqSettings::default();
        let examples = lessons();
        let vocabulary = vocabulary(&examples);
        let layout = Layout {
            dims: words.dims(),
            units: 5,
            token: 3,
            writes: vocabulary.writes(),
            tokens: vocabulary.tokens(),
        };
        let targets = examples
            .iter()
            .map(|exemplar| {
                let (sorts, places) = slots(&exemplar.utterance);
                Target::new(&vocabulary, vocabulary.encode(exemplar).unwrap(), &sorts, places)
            })
            .collect();
        let words = Words::new(&settings, words, examples.iter().map(|e| &e.utterance));
        let seed = 29;
        println!("seed {seed}");
        let mut rng = Rng::from_u64(seed);
        let parameters = (0..layout.total()).map(|_| 0.4 * rng.normal()).collect();
        (layout, vocabulary, Lessons { words, targets }, parameters)
    }

    #[test]
    fn the_gradient_agrees_with_differences_in_every_part() {
        let (layout, vocabulary, lessons, parameters) = prepared();
        let rows: Vec<usize> = (0..lessons.targets.len()).collect();
        let mut gradient = vec![0.0; layout.total()];
        let mut unused = gradient.clone();
        let mean = |parameters: &[f32], gradient: &mut [f32]| {
            let mut objective = Objective::default();
            let losses =
                objective.evaluate(layout, parameters, &vocabulary, &lessons, &rows, gradient);
            losses.iter().sum::<f64>() / losses.len() as f64
        };
        mean(&parameters, &mut gradient);
        let mut rng = Rng::from_u64(31);
        for part in Part::ALL {
            let range = layout.at(part);
            // The largest of the part, and some others.
            let largest =
                range.clone().max_by(|&a, &b| gradient[a].abs().total_cmp(&gradient[b].abs()));
            let drawn = (0..12).map(|_| range.start + rng.below(range.len()));
            for at in largest.into_iter().chain(drawn) {
                let step = 4e-3;
                let mut moved = parameters.clone();
                moved[at] = parameters[at] + step;
                let up = mean(&moved, &mut unused);
                moved[at] = parameters[at] - step;
                let down = mean(&moved, &mut unused);
                let expected = (up - down) / (2.0 * f64::from(step));
                let found = f64::from(gradient[at]);
                let allowed = 2e-3 + 1e-2 * expected.abs();
                assert!((found - expected).abs() < allowed, "{part:?} {at}: {found} {expected}");
            }
            assert!(largest.is_some_and(|at| gradient[at] != 0.0), "{part:?} learns nothing");
        }
    }

    #[test]
    fn a_row_costs_the_same_alone_and_among_others_with_every_kernel() {
        let (layout, vocabulary, lessons, parameters) = prepared();
        let rows: Vec<usize> = (0..lessons.targets.len()).collect();
        let evaluate = |rows: &[usize]| {
            let mut gradient = vec![0.0; layout.total()];
            let mut objective = Objective::default();
            let losses =
                objective.evaluate(layout, &parameters, &vocabulary, &lessons, rows, &mut gradient);
            let bits: Vec<u64> = losses.iter().map(|loss| loss.to_bits()).collect();
            (bits, gradient.iter().map(|g| g.to_bits()).collect::<Vec<u32>>())
        };
        let expected = Kernel::Plain.run(|| evaluate(&rows));
        for kernel in Kernel::available() {
            assert_eq!(kernel.run(|| evaluate(&rows)), expected, "{kernel:?}");
        }
        for &row in &rows {
            assert_eq!(evaluate(&[row]).0, [expected.0[row]]);
        }
    }
}
