use serde::{Deserialize, Serialize};

/// What the two judges weigh and how sure they must be. Learned once, from recorded people
/// (`tools/features.py`, `docs/features.md`); nothing of it is trained per person.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeaturesSettings {
    /// The threshold for primitives is calibrated at each training, but stays between these.
    pub threshold_min: f32,
    pub threshold_max: f32,
    /// The same for the threshold of a lesson.
    pub lesson_min: f32,
    pub lesson_max: f32,
    /// From this probability on a lesson decides, whatever its words mean as primitives.
    pub lesson_decides: f32,
    /// Added to every primitive's logit for each word that says more than one primitive does
    /// ("to chill it", "for a minute"). Not learned: recorded primitives hardly have such words.
    ///
    /// Release 0.1 did not have it, and its recipes keep their digest without it.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub unread: f32,
    /// The seeds' own words are theirs whatever fixture is named: "turn off the microwave".
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub seeds_of_any_fixture: bool,
    pub primitive: PrimitiveWeights,
    pub lesson: LessonSettings,
}

/// Weights of the primitive judge, one per feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrimitiveWeights {
    /// Cosine to the nearest seed of the operator; the same between main verbs.
    pub cosine: f32,
    pub verb: f32,
    /// Each less the best of the other operators.
    pub margin: f32,
    pub verb_margin: f32,
    pub length: f32,
    /// Naive Bayes on habits, less the best other operator.
    pub habit: f32,
    /// Log of how often the verb, and the verb with its particle, meant the operator.
    pub verb_habit: f32,
    pub particle_habit: f32,
    /// Words that nobody used, by weight.
    pub unfamiliar: f32,
    pub nothing_named: f32,
    pub one: f32,
}

/// The lesson judge has two sets of weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LessonSettings {
    /// For a lesson that begins with what is in the hand: one request.
    pub request: LessonWeights,
    /// For a lesson that fetches first: a whole task, in which a fixture may be no more than the
    /// place where it ends.
    pub task: LessonWeights,
}

/// Weights of the lesson judge, one per feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LessonWeights {
    pub cosine: f32,
    /// Cosine with words weighed by how rare they are among simple requests.
    pub rare_cosine: f32,
    /// How well the lesson's words cover the utterance's, and the other way round.
    pub cover: f32,
    pub cover_back: f32,
    /// The best, and the mean, nearness of words that simple requests hardly use.
    pub new: f32,
    pub new_back: f32,
    pub verb: f32,
    /// Whether a fixture of the lesson's program is named; how many others are.
    pub fixture_shared: f32,
    pub fixture_foreign: f32,
    /// Cosine to the lesson less that to the nearest seed.
    pub lead: f32,
    pub length: f32,
    /// Nearness of new words to the fixtures of the lesson's program.
    pub about_program: f32,
    pub one: f32,
}

fn is_nothing(weight: &f32) -> bool {
    *weight == 0.0
}

impl FeaturesSettings {
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
