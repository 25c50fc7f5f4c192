//! The protocol *one-shot*: teach one person's sentence for washing, heating or cooling.

use apprentice::learning::TrainError;

use super::corpus::Corpus;
use super::lessons::{LessonsReport, Material, groups, lessons};
use super::primitives::{UNTAUGHT, is_primitive};
use super::report::Setting;

/// Runs the protocol on the steps of a corpus.
///
/// - errors: the training without any lesson fails.
pub fn one_shot(setting: &Setting<'_>, corpus: &Corpus) -> Result<LessonsReport, TrainError> {
    let material = Material {
        protocol: "one-shot",
        groups: groups(&UNTAUGHT, &corpus.steps),
        primitives: corpus.steps.iter().filter(|row| is_primitive(row)).collect(),
    };
    lessons(setting, &material)
}
