use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Stage, StageError};
use crate::ids::Digest;
use crate::language::{Program, Signature, Step};

/// The physics of a world: scenes, tasks, and what each primitive does.
///
/// Everything is pure: no clock, no entropy, no file, no hash-map order, no floating-point number
/// in a scene (lengths are integer centimetres). An implementation is a table of facts, shared by
/// all users.
pub trait World: Send + Sync + 'static {
    /// The whole state of the world at one moment. Cloned for every candidate program, so cheap to
    /// clone.
    type Scene: Clone + PartialEq + Serialize + DeserializeOwned + Send + Sync + 'static;
    /// What an episode is about.
    type Task: Clone + PartialEq + Serialize + DeserializeOwned + Send + Sync + 'static;

    /// The world's name in records; lower-case.
    fn id(&self) -> &'static str;

    /// Goes up whenever [`World::step_on`] could give another scene than before.
    fn version(&self) -> u16;

    /// The operators, and the sorts of their arguments.
    fn signature(&self) -> &Signature;

    /// Sets the stage for an episode. The same request gives the same scene and task in every run
    /// of the same [`World::version`]. The goal of a drawn stage does not hold yet; that of a scene
    /// that a person wrote may hold, and then no episode is started.
    ///
    /// - errors: [`StageError`], a sentence for the person who asked.
    fn stage(&self, request: &Stage) -> Result<(Self::Scene, Self::Task), StageError>;

    /// Carries out one primitive: binds each type to an instance for which the step can run, and
    /// changes the scene.
    ///
    /// - `task`: breaks ties (a pick-up prefers what is not yet at its goal).
    /// - `on`: argument `i` is bound to the instance with the name `on[i]` (as [`Thing::name`]
    ///   shows it). A missing or empty entry leaves the argument free. Entries beyond the arguments
    ///   are ignored. A world without numbered instances calls [`refuse_other_instances`].
    /// - returns: the names of the instances bound, one per argument (`Mug`, or `Mug 2` when the
    ///   scene has several).
    /// - errors: [`Infeasible`], about the named instance if there is one; the scene is then
    ///   unchanged.
    ///
    /// [`Thing::name`]: super::Thing::name
    fn step_on(
        &self,
        scene: &mut Self::Scene,
        task: &Self::Task,
        step: &Step,
        on: &[Option<String>],
    ) -> Result<Vec<String>, Infeasible>;

    /// [`World::step_on`] with every argument free. Do not write it again for a world.
    ///
    /// - errors: as [`World::step_on`].
    fn step(
        &self,
        scene: &mut Self::Scene,
        task: &Self::Task,
        step: &Step,
    ) -> Result<Vec<String>, Infeasible> {
        self.step_on(scene, task, step, &[])
    }

    /// Whether the task's goal holds.
    fn achieved(&self, scene: &Self::Scene, task: &Self::Task) -> bool;

    /// A program with the fewest primitives that achieves the task from `scene`; none when there
    /// is none within the planner's stated bound.
    fn plan(&self, scene: &Self::Scene, task: &Self::Task) -> Option<Program>;

    /// BLAKE3 over a fixed binary form of the scene. Computed after every utterance and on every
    /// replay, so it must be cheap: no text, no allocation per object.
    fn digest(&self, scene: &Self::Scene) -> Digest;
}

/// [`World::step_on`] for a world without numbered instances, where a type has one instance at most
/// or the world alone chooses between them: carries the step out, and refuses it when another
/// instance was bound than `on` names.
///
/// - `act`: carries the step out in a scene; returns the names of the instances bound.
/// - errors: those of `act`, and a sentence about the named instance; the scene is then unchanged.
pub fn refuse_other_instances<S: Clone>(
    scene: &mut S,
    step: &Step,
    on: &[Option<String>],
    act: impl FnOnce(&mut S) -> Result<Vec<String>, Infeasible>,
) -> Result<Vec<String>, Infeasible> {
    let mut after = scene.clone();
    let bound = act(&mut after)?;
    let mut wished =
        on.iter().zip(&bound).filter_map(|(name, bound)| Some((name.as_ref()?, bound)));
    if let Some((name, bound)) = wished.find(|(name, bound)| name != bound) {
        return Err(Infeasible::because(format!("{step} takes the {bound}, not the {name}")));
    }
    *scene = after;
    Ok(bound)
}

/// Why a step cannot be carried out: a sentence that names the object and the reason.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct Infeasible {
    /// The sentence.
    pub reason: String,
    /// The one step that is missing before this one, where one is enough: going to what is out of
    /// reach, opening what is shut. Recipes may take it unasked.
    pub first: Option<Step>,
    /// The instances for `first`, to be passed to [`World::step_on`] with it. Empty when the
    /// refused instance was not chosen: `first` then binds freely.
    pub first_on: Vec<Option<String>>,
    /// Whether what the step is for holds already: it is open, it is in the hand. Recipes may skip
    /// such a step of a lesson.
    pub done: bool,
}

impl Infeasible {
    /// A refusal that no single step before it would change.
    pub fn because(reason: String) -> Infeasible {
        Infeasible { reason, first: None, first_on: Vec::new(), done: false }
    }
}
