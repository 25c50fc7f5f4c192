use serde::{Deserialize, Serialize};

/// The weights of the two judges, and how sure they must be. Learned once from recorded people
/// (`tools/features.py`, `docs/features.md`); none of them is trained per person.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeaturesSettings {
    /// The smallest threshold for primitives, as a probability. Each training calibrates the
    /// threshold between this and the next field.
    pub threshold_min: f32,
    /// The largest threshold for primitives, as a probability.
    pub threshold_max: f32,
    /// The smallest threshold for a lesson, as a probability. Calibrated as that for primitives.
    pub lesson_min: f32,
    /// The largest threshold for a lesson, as a probability.
    pub lesson_max: f32,
    /// From this probability on the lesson is taken, whatever the words mean as primitives.
    pub lesson_decides: f32,
    /// Added to every primitive's logit for each word that says more than one primitive does
    /// ("to chill it", "for a minute"). Not learned: recorded primitives hardly have such words.
    ///
    /// Release 0.1 did not have it, and its recipes keep their digest without it.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub unread: f32,
    /// Whether the own words of a seed keep their meaning for every fixture: "turn off the
    /// microwave".
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub seeds_of_any_fixture: bool,
    /// Of the judge of primitives.
    pub primitive: PrimitiveWeights,
    /// Of the judge of lessons.
    pub lesson: LessonSettings,
}

/// Weights of the primitive judge, one per feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrimitiveWeights {
    /// Cosine to the nearest seed of the operator.
    pub cosine: f32,
    /// Cosine between the main verb and the nearest of those seeds.
    pub verb: f32,
    /// `cosine` less the best of the other operators.
    pub margin: f32,
    /// `verb` less the best of the other operators.
    pub verb_margin: f32,
    /// Number of words that are not silent.
    pub length: f32,
    /// Naive Bayes on habits, less the best other operator.
    pub habit: f32,
    /// Log of how often the verb meant the operator.
    pub verb_habit: f32,
    /// Log of how often the verb with its particle meant the operator.
    pub particle_habit: f32,
    /// Words that nobody used, by weight.
    pub unfamiliar: f32,
    /// Whether the clause names nothing.
    pub nothing_named: f32,
    /// A constant.
    pub one: f32,
}

/// The two sets of weights of the lesson judge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LessonSettings {
    /// For a lesson that begins with what is in the hand: one request.
    pub request: LessonWeights,
    /// For a lesson that fetches first: a whole task, in which a fixture may only be the place
    /// where it ends.
    pub task: LessonWeights,
}

/// Weights of the lesson judge, one per feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LessonWeights {
    /// Cosine between the utterance and the lesson.
    pub cosine: f32,
    /// Cosine with words weighed by how rare they are among simple requests.
    pub rare_cosine: f32,
    /// How well the lesson's words cover the utterance's.
    pub cover: f32,
    /// How well the utterance's words cover the lesson's.
    pub cover_back: f32,
    /// The best nearness of words that simple requests hardly use.
    pub new: f32,
    /// The mean nearness of the lesson's words that simple requests hardly use.
    pub new_back: f32,
    /// The best cosine between main verbs.
    pub verb: f32,
    /// Whether a fixture of the lesson's program is named.
    pub fixture_shared: f32,
    /// How many other fixtures are named.
    pub fixture_foreign: f32,
    /// Cosine to the lesson less that to the nearest seed.
    pub lead: f32,
    /// Log of the number of words.
    pub length: f32,
    /// Nearness of new words to the fixtures of the lesson's program.
    pub about_program: f32,
    /// A constant.
    pub one: f32,
}

fn is_nothing(weight: &f32) -> bool {
    *weight == 0.0
}

impl FeaturesSettings {
    /// Checks every value.
    ///
    /// - errors: the field and what was expected.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let fields = [
            ("threshold_min", self.threshold_min, 0.01),
            ("threshold_max", self.threshold_max, self.threshold_min),
            ("lesson_min", self.lesson_min, 0.01),
            ("lesson_max", self.lesson_max, self.lesson_min),
            ("lesson_decides", self.lesson_decides, 0.01),
        ];
        for (field, value, min) in fields {
            if !(min..=0.99).contains(&value) {
                let reason =
                    format!("{field} is {value}; expected a probability between {min} and 0.99");
                return Err((field, reason));
            }
        }
        if !(-50.0..=0.0).contains(&self.unread) {
            let reason = format!("unread is {}; expected between -50 and 0", self.unread);
            return Err(("unread", reason));
        }
        Ok(())
    }
}
