use super::facts::{Kind, Room, facts};
use super::features::{FEATURE_COUNT, features};
use super::primitives::{Action, act};
use super::scene::Scene;
use super::task::{Goal, Task};
use super::words::SORT;
use super::{generate, planner, polarity, scene_file, task_goal, view, words};
use crate::ids::Digest;
use crate::language::{Mention, Operator, Program, Signature, Step, Symbol};
use crate::world::{Domain, Infeasible, Lexicon, SeedSet, Stage, StageError, View};

/// The household world: facts, names and seeds, read once from the embedded tables. One is made
/// per process and shared behind an `Arc`.
#[derive(Debug)]
pub struct Household {
    signature: Signature,
    lexicon: Lexicon,
    seeds: SeedSet,
}

impl Household {
    pub fn new() -> Household {
        let operator = |name: &str, args: usize| Operator {
            name: Symbol::new(name),
            args: vec![Symbol::new(SORT); args],
        };
        let one = ["GOTO", "PICKUP", "OPEN", "CLOSE", "TOGGLE"];
        let mut operators: Vec<Operator> = one.iter().map(|name| operator(name, 1)).collect();
        operators.push(operator("PUT", 2));
        let signature = Signature { operators };
        Household { signature, lexicon: words::lexicon(), seeds: words::seeds() }
    }

    /// The recorded combinations of things for one form of task, in the words of [`Task::read`],
    /// each once; none for a form that is not recorded.
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

impl Domain for Household {
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

    fn lexicon(&self) -> &Lexicon {
        &self.lexicon
    }

    fn seeds(&self) -> &SeedSet {
        &self.seeds
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

    fn step(&self, scene: &mut Scene, task: &Task, step: &Step) -> Result<Vec<String>, Infeasible> {
        let infeasible = |reason: String| Infeasible { reason, first: None };
        self.signature.check(step).map_err(infeasible)?;
        let action = Action::read(step).map_err(infeasible)?;
        match act(scene, task, action) {
            Ok(bound) => Ok(bound.names(scene)),
            Err(refusal) => Err(Infeasible {
                reason: refusal.sentence(scene),
                first: refusal.first(scene).map(Action::step),
            }),
        }
    }

    fn achieved(&self, scene: &Scene, task: &Task) -> bool {
        task_goal::achieved(scene, task)
    }

    fn plan(&self, scene: &Scene, task: &Task) -> Option<Program> {
        planner::plan(scene, task)
    }

    fn resolve(&self, scene: &Scene, mention: &Mention) -> Vec<Symbol> {
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
                let rare = words::rarely_means(&self.lexicon, &mention.surface, name);
                distance(name).map(|far| (rare, far, rank))
            })
            .collect();
        if here.is_empty() {
            return mention.types.clone();
        }
        // A meaning that hardly anybody has in mind waits until no other is here, however near it
        // is. Of equally near kinds the one that people mean more often by the name.
        here.sort_unstable();
        here.into_iter().map(|(_, _, rank)| mention.types[rank].clone()).collect()
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

    fn feature_count(&self) -> usize {
        FEATURE_COUNT
    }

    fn features(&self, scene: &Scene, program: &Program) -> Vec<f32> {
        features(scene, program)
    }

    fn contradiction(
        &self,
        scene: &Scene,
        words: &[String],
        program: &Program,
    ) -> Option<(usize, String)> {
        polarity::contradiction(scene, words, program)
    }

    fn unlike(&self, scene: &Scene, kind: &Symbol, word: &str) -> bool {
        polarity::unlike(scene, kind, word)
    }

    fn digest(&self, scene: &Scene) -> Digest {
        scene.digest()
    }

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
