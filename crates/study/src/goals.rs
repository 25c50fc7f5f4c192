//! The protocol *goals*: teach one person's sentence for a whole task.

use apprentice::learning::TrainError;

use super::corpus::Corpus;
use super::lessons::{LessonsReport, Material, groups, lessons};
use super::primitives::is_primitive;
use super::report::Setting;

/// The tasks that are taught.
pub const TASKS: [&str; 4] = [
    "pick_clean_then_place_in_recep",
    "pick_heat_then_place_in_recep",
    "pick_cool_then_place_in_recep",
    "look_at_obj_in_light",
];

/// Runs the protocol on the whole-task sentences of a corpus.
///
/// - errors: the training without any lesson fails.
pub fn goals(setting: &Setting<'_>, corpus: &Corpus) -> Result<LessonsReport, TrainError> {
    let material = Material {
        protocol: "goals",
        groups: groups(&TASKS, &corpus.goals),
        primitives: corpus.steps.iter().filter(|row| is_primitive(row)).collect(),
    };
    lessons(setting, &material)
}
