use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::{Edition, Lexicon, Pointing, SeedSet};
use crate::ids::Digest;
use crate::language::{Mention, Program, Signature, Step, Symbol};

/// A world that programs act in. The only thing a new world must implement.
///
/// Everything is pure: no clock, no entropy, no file, no hash-map order, no floating-point number
/// in a scene (lengths are integer centimetres). An implementation is a table of facts, shared by
/// all users.
pub trait Domain: Send + Sync + 'static {
    /// The whole state of the world at one moment. Cloned for every candidate program, so cheap to
    /// clone.
    type Scene: Clone + PartialEq + Serialize + DeserializeOwned + Send + Sync + 'static;
    /// What an episode is about.
    type Task: Clone + PartialEq + Serialize + DeserializeOwned + Send + Sync + 'static;

    /// The domain's name in records; lower-case.
    fn id(&self) -> &'static str;
    /// Goes up whenever [`Domain::step`] could give another scene than before.
    fn version(&self) -> u16;
    fn signature(&self) -> &Signature;
    /// What things are called in an edition. A domain with one edition gives it for all.
    fn lexicon(&self, edition: Edition) -> &Lexicon;
    /// What every user starts with.
    fn seeds(&self) -> &SeedSet;

    /// Sets the stage for an episode. A drawn one never fulfils its goal already; a scene that a
    /// person wrote may, and no episode is then started. The same request gives the same scene and task for ever
    /// (within one [`Domain::version`]).
    fn stage(&self, request: &Stage) -> Result<(Self::Scene, Self::Task), StageError>;

    /// Carries out one primitive: binds each type to the instance for which the step can run and
    /// changes the scene. `task` breaks ties (a pick-up prefers what is not yet at its goal).
    ///
    /// - returns: the names of the instances bound, one per argument (`Mug`, or `Mug 2` when the
    ///   scene has several).
    /// - errors: [`Infeasible`]; the scene is then unchanged.
    fn step(
        &self,
        scene: &mut Self::Scene,
        task: &Self::Task,
        step: &Step,
    ) -> Result<Vec<String>, Infeasible>;

    /// As [`Domain::step`], and argument `i` is bound to the instance with the name `on[i]` (as
    /// [`Thing::name`] shows it). A missing or empty entry leaves the argument free; entries
    /// beyond the arguments are not looked at.
    ///
    /// - errors: [`Infeasible`], about the named instance; the scene is then unchanged.
    fn step_on(
        &self,
        scene: &mut Self::Scene,
        task: &Self::Task,
        step: &Step,
        on: &[Option<String>],
    ) -> Result<Vec<String>, Infeasible> {
        // A world without numbered instances can only refuse what it would not have bound anyway.
        let mut after = scene.clone();
        let bound = self.step(&mut after, task, step)?;
        let mut wished =
            on.iter().zip(&bound).filter_map(|(name, bound)| Some((name.as_ref()?, bound)));
        if let Some((name, bound)) = wished.find(|(name, bound)| name != bound) {
            return Err(Infeasible::because(format!("{step} takes the {bound}, not the {name}")));
        }
        *scene = after;
        Ok(bound)
    }

    /// Whether the task's goal holds.
    fn achieved(&self, scene: &Self::Scene, task: &Self::Task) -> bool;

    /// A program with the fewest primitives that achieves the task from `scene`; `None` when there
    /// is none within the planner's stated bound.
    fn plan(&self, scene: &Self::Scene, task: &Self::Task) -> Option<Program>;

    /// The types that a mention (no pronoun) may mean in this scene, best first: of the types that
    /// share the name, the one with the closest instance. When none of them is in the scene, the
    /// mention's own order, so that the answer can be "there is no … here".
    ///
    /// - `edition`: of the lexicon that the mention was found with.
    fn resolve(&self, edition: Edition, scene: &Self::Scene, mention: &Mention) -> Vec<Symbol>;

    /// The type of what the robot holds.
    fn held(&self, scene: &Self::Scene) -> Option<Symbol>;

    /// The type of what the robot stands at.
    fn here(&self, _scene: &Self::Scene) -> Option<Symbol> {
        None
    }

    /// Whether things of a type can ever be the `place`-th (0-based) argument of the operator,
    /// whatever the scene.
    fn fits(&self, _operator: &Symbol, _place: usize, _kind: &Symbol) -> bool {
        true
    }

    /// How many numbers [`Domain::features`] returns.
    fn feature_count(&self) -> usize;

    /// State features of a program in a scene, for the reranker. Each between -1 and 1.
    fn features(&self, scene: &Self::Scene, program: &Program) -> Vec<f32>;

    /// Whether the words ask for a state change that the scene contradicts ("turn off" what is
    /// off): the 0-based step and a sentence. Asked before the program is run, by recipes that
    /// want it.
    fn contradiction(
        &self,
        _scene: &Self::Scene,
        _words: &[String],
        _program: &Program,
    ) -> Option<(usize, String)> {
        None
    }

    /// Whether the thing that a step would work, such as a switch, is on already.
    fn is_on(&self, _scene: &Self::Scene, _step: &Step) -> bool {
        false
    }

    /// Whether a word says of the things of a type what none of them is: "the clean mug" where all
    /// mugs are dirty. A word that names no state says nothing of the kind.
    fn unlike(&self, _scene: &Self::Scene, _kind: &Symbol, _word: &str) -> bool {
        false
    }

    /// The instance of a type that words choose, by the name that [`Thing::name`] shows: the
    /// nearest of those that fit.
    ///
    /// - returns: none when the words choose nothing: nothing in them is about instances, all
    ///   instances fit, or the world does not know what they say.
    /// - errors: a sentence, when no instance is as the words say: "no Mug here is dirty".
    fn choose(
        &self,
        _scene: &Self::Scene,
        _kind: &Symbol,
        _pointing: &Pointing,
    ) -> Result<Option<String>, String> {
        Ok(None)
    }

    /// Whether a word before a name says a state that [`Domain::choose`] looks at: "dirty". Some
    /// of these words are also verbs and prepositions ("open", "clean", "on"); ask only about a
    /// word that stands between an article and the name.
    fn is_instance_word(&self, _word: &str) -> bool {
        false
    }

    /// BLAKE3 over a fixed binary form of the scene. Computed after every utterance and on every
    /// replay, so it must be cheap: no text, no allocation per object.
    fn digest(&self, scene: &Self::Scene) -> Digest;

    /// The task as one sentence in the imperative, without a full stop.
    fn goal(&self, task: &Self::Task) -> String;
    /// How far the task is: the parts of the goal, each with whether it holds.
    fn progress(&self, scene: &Self::Scene, task: &Self::Task) -> Vec<(String, bool)>;
    /// What a person sees of the scene.
    fn look(&self, scene: &Self::Scene) -> View;
    /// A step that was carried out, as a short sentence: `picks up the mug from the counter top`.
    fn narrate(&self, step: &Step, binding: &[String]) -> String;
}

/// A request for an episode.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Any task in any scene, drawn from the seed.
    Seed { seed: u64 },
    /// A task given in the domain's words (household: `clean Tomato CounterTop`), in a scene
    /// drawn from the seed that makes it possible and not yet done.
    Task { task: String, seed: u64 },
    /// A scene file's text (TOML) and a task in the domain's words.
    Scene { scene: String, task: String },
}

/// Why no stage could be set. A sentence for the person who asked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StageError {
    /// `known` lists what would have been understood.
    #[error("cannot set the task {task:?}: {reason}; {known}")]
    Task { task: String, reason: String, known: String },
    #[error("the scene file has an error at line {line}, column {column}: {reason}")]
    Scene { line: usize, column: usize, reason: String },
    /// There would be nothing to do.
    #[error("the goal is already reached: {goal}; change the scene or name another task")]
    Achieved { goal: String },
    #[error(
        "seed {seed} gives no scene in which the task {task:?} is possible: {reason}; try another seed"
    )]
    Unsolvable { task: String, seed: u64, reason: String },
}

/// Why a step cannot be carried out: a sentence that names the object and the reason.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct Infeasible {
    pub reason: String,
    /// The step that would have to come first, where one step is what is missing: going to what is
    /// out of reach, opening what is shut. Recipes may take it unasked.
    pub first: Option<Step>,
    /// The instances for `first`, to be passed to [`Domain::step_on`] with it. Empty when the
    /// refused instance was not chosen: `first` then binds freely.
    pub first_on: Vec<Option<String>>,
    /// Whether what the step is for holds already: it is open, it is in the hand. Recipes may pass
    /// such a step of a lesson over.
    pub done: bool,
}

impl Infeasible {
    /// A refusal that no single step would mend.
    pub fn because(reason: String) -> Infeasible {
        Infeasible { reason, first: None, first_on: Vec::new(), done: false }
    }
}

/// What a person sees of a scene.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct View {
    /// The room, where the robot is and what it holds: one sentence each.
    pub summary: Vec<String>,
    /// Each thing in sight: its name, where it is, and its state.
    pub things: Vec<Thing>,
}

/// One thing in a [`View`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Thing {
    /// `Mug`, or `Mug 2` when the scene has several.
    pub name: String,
    /// The type.
    pub kind: Symbol,
    /// The thing it is on or in, if any.
    pub place: Option<String>,
    /// Centimetres from the room's corner: east, north.
    pub at: (i32, i32),
    /// `open`, `on`, `dirty`, `hot`, `cold`, `held`, `here`: what is worth knowing.
    pub states: Vec<String>,
}
