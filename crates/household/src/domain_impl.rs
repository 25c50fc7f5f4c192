use std::collections::BTreeSet;

use super::facts::{Kind, Room, facts};
use super::features::{FEATURE_COUNT, features};
use super::primitives::{Action, Chosen, act_on};
use super::refusal::preposition;
use super::scene::Scene;
use super::state_words::StateWord;
use super::task::{Goal, Task};
use super::words::{SORT, a};
use super::{generate, planner, pointing, polarity, scene_file, task_goal, view, words};
use crate::ids::Digest;
use crate::language::{Mention, Operator, Program, Signature, Step, Symbol};
use crate::world::{
    Edition, Features, Infeasible, Lexicon, Pointing, SeedSet, Show, Stage, StageError, View,
    Words, World,
};

/// The household as a world: facts, names and seeds, read once from the embedded tables. Make one
/// per process and share it behind an `Arc`.
#[derive(Debug)]
pub struct Household {
    signature: Signature,
    /// By edition.
    lexicons: [Lexicon; 2],
    seeds: SeedSet,
}

impl Household {
    /// Reads the embedded tables.
    ///
    /// - panics: when a table is broken; the tests read all of them.
    pub fn new() -> Household {
        let operator = |name: &str, args: usize| Operator {
            name: Symbol::new(name),
            args: vec![Symbol::new(SORT); args],
        };
        let one = ["GOTO", "PICKUP", "OPEN", "CLOSE", "TOGGLE"];
        let mut operators: Vec<Operator> = one.iter().map(|name| operator(name, 1)).collect();
        operators.push(operator("PUT", 2));
        let signature = Signature { operators };
        Household { signature, lexicons: Edition::ALL.map(words::lexicon), seeds: words::seeds() }
    }

    /// The recorded tasks of one form, in the words of [`Task::read`], each once; empty for a form
    /// that was not recorded.
    pub fn recorded_tasks(&self, form: &str) -> Vec<&'static str> {
        let rooms = Room::ALL.iter().map(|room| facts().room(*room).tasks.get(form));
        let mut tasks: Vec<&str> = rooms.flatten().flatten().map(String::as_str).collect();
        tasks.sort_unstable();
        tasks.dedup();
        tasks
    }
}

impl Default for Household {
    fn default() -> Household {
        Household::new()
    }
}

impl World for Household {
    type Scene = Scene;
    type Task = Task;

    fn id(&self) -> &'static str {
        "household"
    }

    fn version(&self) -> u16 {
        1
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn stage(&self, request: &Stage) -> Result<(Scene, Task), StageError> {
        match request {
            Stage::Seed { seed } => generate::draw_any(*seed),
            Stage::Task { task, seed } => {
                let task = Task::read(task)?;
                Ok((generate::draw_for(&task, *seed)?, task))
            }
            Stage::Scene { scene, task } => {
                let task = Task::read(task)?;
                let scene = scene_file::read(scene)?;
                check_stage(&scene, &task)?;
                Ok((scene, task))
            }
        }
    }

    fn step_on(
        &self,
        scene: &mut Scene,
        task: &Task,
        step: &Step,
        on: &[Option<String>],
    ) -> Result<Vec<String>, Infeasible> {
        self.signature.check(step).map_err(Infeasible::because)?;
        let action = Action::read(step).map_err(Infeasible::because)?;
        let chosen = chosen(scene, step, on).map_err(Infeasible::because)?;
        act_on(scene, task, action, chosen).map(|bound| bound.names(scene)).map_err(|refusal| {
            let (first, target) = refusal.first(scene, chosen).unzip();
            Infeasible {
                done: refusal.holds_already(scene, action),
                reason: refusal.sentence(scene),
                first: first.map(Action::step),
                first_on: target
                    .flatten()
                    .map(|index| Some(scene.name(index)))
                    .into_iter()
                    .collect(),
            }
        })
    }

    fn achieved(&self, scene: &Scene, task: &Task) -> bool {
        task_goal::achieved(scene, task)
    }

    fn plan(&self, scene: &Scene, task: &Task) -> Option<Program> {
        planner::plan(scene, task)
    }

    fn digest(&self, scene: &Scene) -> Digest {
        scene.digest()
    }
}

impl Words for Household {
    fn lexicon(&self, edition: Edition) -> &Lexicon {
        let [first, second] = &self.lexicons;
        match edition {
            Edition::First => first,
            Edition::Second => second,
        }
    }

    fn seeds(&self) -> &SeedSet {
        &self.seeds
    }

    fn resolve(&self, edition: Edition, scene: &Scene, mention: &Mention) -> Vec<Symbol> {
        let lexicon = self.lexicon(edition);
        // What is in sight comes before what is shut away, as when walking there.
        let distance = |name: &Symbol| {
            let kind = Kind::named(name.as_str())?;
            scene.of(kind).map(|i| (scene.shut_in(i).is_some(), scene.distance(i).0)).min()
        };
        let mut here: Vec<(bool, (bool, i64), usize)> = mention
            .types
            .iter()
            .enumerate()
            .filter_map(|(rank, name)| {
                let rare = lexicon.rarely_means(&mention.surface, name);
                distance(name).map(|far| (rare, far, rank))
            })
            .collect();
        if here.is_empty() {
            return mention.types.clone();
        }
        // A rare meaning comes after all others, even if it is nearer. Of equally near kinds, the
        // one that people mean more often by the name comes first.
        here.sort_unstable();
        here.into_iter().map(|(_, _, rank)| mention.types[rank].clone()).collect()
    }

    fn present(&self, scene: &Scene) -> BTreeSet<Symbol> {
        scene.objects.iter().map(|object| object.kind.symbol().clone()).collect()
    }

    fn held(&self, scene: &Scene) -> Option<Symbol> {
        scene.robot.holds.map(|index| scene.object(index).kind.symbol().clone())
    }

    fn here(&self, scene: &Scene) -> Option<Symbol> {
        scene.robot.at.map(|index| scene.object(index).kind.symbol().clone())
    }

    fn fits(&self, operator: &Symbol, place: usize, kind: &Symbol) -> bool {
        let Some(kind) = Kind::named(kind.as_str()) else { return false };
        match (operator.as_str(), place) {
            ("PICKUP" | "PUT", 0) => kind.pickupable(),
            ("PUT", _) => kind.receptacle(),
            ("TOGGLE", _) => kind.toggleable(),
            ("OPEN" | "CLOSE", _) => kind.openable(),
            _ => true,
        }
    }

    fn contradiction(
        &self,
        scene: &Scene,
        words: &[String],
        program: &Program,
    ) -> Option<(usize, String)> {
        polarity::contradiction(scene, words, program)
    }

    fn is_on(&self, scene: &Scene, step: &Step) -> bool {
        polarity::is_on(scene, step)
    }

    fn unlike(&self, scene: &Scene, kind: &Symbol, word: &str) -> bool {
        polarity::unlike(scene, kind, word)
    }

    fn choose(
        &self,
        scene: &Scene,
        kind: &Symbol,
        pointing: &Pointing,
    ) -> Result<Option<String>, String> {
        pointing::choose(scene, kind, pointing)
    }

    fn is_instance_word(&self, word: &str) -> bool {
        StateWord::read(word).is_some()
    }

    fn is_as(&self, scene: &Scene, thing: &str, word: &str) -> Option<bool> {
        StateWord::read(word)?.holds(scene, scene.named(thing)?)
    }

    fn called(&self, name: &str) -> String {
        view::said(name)
    }

    fn preposition(&self, kind: &Symbol) -> &'static str {
        facts().kind(kind.as_str()).map_or("on", preposition)
    }
}

impl Features for Household {
    fn feature_count(&self) -> usize {
        FEATURE_COUNT
    }

    fn features(&self, scene: &Scene, program: &Program) -> Vec<f32> {
        features(scene, program)
    }
}

impl Show for Household {
    fn goal(&self, task: &Task) -> String {
        task.sentence()
    }

    fn progress(&self, scene: &Scene, task: &Task) -> Vec<(String, bool)> {
        task_goal::progress(scene, task)
    }

    fn look(&self, scene: &Scene) -> View {
        view::look(scene)
    }

    fn narrate(&self, step: &Step, binding: &[String]) -> String {
        view::narrate(step, binding)
    }
}

/// The instances with the names `on`, one per argument of the step.
///
/// - errors: a sentence, when there is no such thing or it is of another kind than the argument.
fn chosen(scene: &Scene, step: &Step, on: &[Option<String>]) -> Result<Chosen, String> {
    let mut chosen = [None, None];
    for ((slot, name), kind) in chosen.iter_mut().zip(on).zip(&step.args) {
        let Some(name) = name else { continue };
        let Some(index) = scene.named(name) else {
            let short: String = name.chars().take(40).collect();
            return Err(format!("there is nothing called {short:?} here"));
        };
        let kind = facts().find(kind.as_str())?;
        if scene.object(index).kind != kind {
            return Err(format!("the {name} is not {}", a(kind.name())));
        }
        *slot = Some(index);
    }
    Ok(chosen)
}

/// Whether a scene that a person wrote has what the task names.
fn check_stage(scene: &Scene, task: &Task) -> Result<(), StageError> {
    let refuse = |reason: String| {
        Err(StageError::Task {
            task: task.to_string(),
            reason,
            known: "add it to the scene file or name another task".to_owned(),
        })
    };
    for kind in task.needs() {
        if scene.of(kind).next().is_none() {
            return refuse(format!("there is no {kind} in the scene, and the task needs one"));
        }
    }
    match task.goal {
        Goal::Two { thing, .. } if scene.of(thing).count() < 2 => {
            refuse(format!("there is only one {thing} in the scene, and the task needs two"))
        }
        Goal::Free(Some(room)) if room != scene.room() => {
            refuse(format!("the scene is a {}", scene.room().said()))
        }
        _ => Ok(()),
    }
}
