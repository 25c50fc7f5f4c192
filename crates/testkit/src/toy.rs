//! A world of three bells, for tests of the service, not of the household. It trains very fast. It
//! also shows that nothing outside `world/` knows about mugs.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex};

use apprentice::ids::Digest;
use apprentice::language::{
    Exemplar, LiftedUtterance, Mention, Operator, Program, Signature, Step, Symbol,
};
use apprentice::learning::Recipe;
use apprentice::service::{Config, Data};
use apprentice::world::{
    Edition, Features, Infeasible, Lexicon, Meaning, Pointing, SeedSet, Show, Stage, StageError,
    Thing, View, Words, World, refuse_other_instances,
};

/// Bells ring until they are muted. Breaking a bell makes the world panic, to test how the service
/// handles it. There are more such worlds: in `brittle`, training a reranker panics; in
/// `slow`, it waits for a gate; `fickle` does not say the same thing twice.
pub struct Bells {
    brittle: bool,
    gate: Option<Arc<Gate>>,
    fickle: Option<Arc<Fickle>>,
    signature: Signature,
    lexicon: Lexicon,
    seeds: SeedSet,
}

/// Closed until it is opened.
#[derive(Default)]
pub struct Gate {
    is_open: Mutex<bool>,
    changed: Condvar,
}

impl Gate {
    /// Opens the gate.
    pub fn open(&self) {
        *self.is_open.lock().unwrap() = true;
        self.changed.notify_all();
    }

    fn pass(&self) {
        let closed = |is_open: &mut bool| !*is_open;
        drop(self.changed.wait_while(self.is_open.lock().unwrap(), closed).unwrap());
    }
}

/// True if scenes have another digest at each call.
#[derive(Default)]
pub struct Fickle {
    pub is_on: AtomicBool,
    asked: AtomicU64,
}

/// Bells that ring.
type Ringing = BTreeSet<Symbol>;

/// The types of the bells.
pub const BELLS: [&str; 3] = ["Brass", "Silver", "Glass"];

/// A service of bells with the smallest recipe.
pub fn config(data: Data) -> Config<Bells> {
    let mut config = Config::new(Arc::new(Bells::new()), data);
    config.recipe_text = Recipe::builtin("tiny").expect("the recipe `tiny` ships").to_owned();
    config
}

fn exemplars(pairs: &[(&str, &str)]) -> Vec<Exemplar> {
    let exemplar = |(utterance, program): &(&str, &str)| Exemplar {
        utterance: LiftedUtterance::parse(utterance),
        program: program.parse().unwrap(),
    };
    pairs.iter().map(exemplar).collect()
}

impl Default for Bells {
    fn default() -> Bells {
        Bells::new()
    }
}

impl Bells {
    /// A world in which training a reranker panics.
    pub fn brittle() -> Bells {
        Bells { brittle: true, ..Bells::new() }
    }

    /// A world in which training a reranker waits until the gate is open.
    pub fn slow(gate: Arc<Gate>) -> Bells {
        Bells { gate: Some(gate), ..Bells::new() }
    }

    /// A world in which, while `fickle` is on, the decider and the fold disagree on every
    /// utterance.
    pub fn fickle(fickle: Arc<Fickle>) -> Bells {
        Bells { fickle: Some(fickle), ..Bells::new() }
    }

    /// A world without a word for breaking, so that training never breaks a bell.
    pub fn sturdy() -> Bells {
        let mut bells = Bells::new();
        bells.signature.operators.retain(|operator| operator.name.as_str() != "BREAK");
        bells.seeds.exemplars.retain(|seed| !seed.utterance.to_string().starts_with("break"));
        bells
    }

    /// The usual world.
    pub fn new() -> Bells {
        let operator = |name| Operator { name: Symbol::new(name), args: vec![Symbol::new("obj")] };
        let meaning = |kind: &str| Meaning { sort: "obj".into(), kind: kind.into(), count: 1 };
        let name = |kind: &&str| (format!("{} bell", kind.to_lowercase()), vec![meaning(kind)]);
        let lexicon = Lexicon {
            names: BELLS.iter().map(name).collect(),
            plurals: BTreeMap::new(),
            pronouns: vec!["it".to_owned()],
            adjectives: Vec::new(),
            fixtures: BTreeMap::new(),
            ..Lexicon::default()
        };
        let seeds = SeedSet {
            exemplars: exemplars(&[
                ("ring the <obj>", "RING <obj:1>"),
                ("strike the <obj>", "RING <obj:1>"),
                ("mute the <obj>", "MUTE <obj:1>"),
                ("silence the <obj>", "MUTE <obj:1>"),
                ("break the <obj>", "BREAK <obj:1>"),
            ]),
            variants: exemplars(&[
                ("ring the <obj> now", "RING <obj:1>"),
                ("please mute the <obj>", "MUTE <obj:1>"),
            ]),
            unknown: vec![
                LiftedUtterance::parse("polish the <obj>"),
                LiftedUtterance::parse("paint the <obj>"),
            ],
        };
        let operators = ["RING", "MUTE", "BREAK"].map(operator).to_vec();
        let signature = Signature { operators };
        Bells { brittle: false, gate: None, fickle: None, signature, lexicon, seeds }
    }
}

impl World for Bells {
    type Scene = Ringing;
    type Task = Ringing;

    fn id(&self) -> &'static str {
        "bells"
    }

    fn version(&self) -> u16 {
        1
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    /// A task is the bells that must ring, like `Brass Glass`. At first all are silent.
    fn stage(&self, request: &Stage) -> Result<(Ringing, Ringing), StageError> {
        let task = match request {
            Stage::Seed { seed } => BELLS[*seed as usize % 3].to_owned(),
            Stage::Task { task, .. } | Stage::Scene { task, .. } => task.clone(),
        };
        let bells: Ringing = task.split(' ').map(Symbol::new).collect();
        match bells.iter().find(|bell| !BELLS.contains(&bell.as_str())) {
            None => Ok((Ringing::new(), bells)),
            Some(bell) => Err(StageError::Task {
                task: task.clone(),
                reason: format!("{bell:?} is no bell"),
                known: format!("bells are {}", BELLS.join(", ")),
            }),
        }
    }

    fn step_on(
        &self,
        scene: &mut Ringing,
        _: &Ringing,
        step: &Step,
        on: &[Option<String>],
    ) -> Result<Vec<String>, Infeasible> {
        refuse_other_instances(scene, step, on, |scene| act(scene, step))
    }

    fn achieved(&self, scene: &Ringing, task: &Ringing) -> bool {
        scene == task
    }

    fn plan(&self, _: &Ringing, task: &Ringing) -> Option<Program> {
        let ring = |bell: &Symbol| Step { operator: "RING".into(), args: vec![bell.clone()] };
        Some(Program { steps: task.iter().map(ring).collect() })
    }

    fn digest(&self, scene: &Ringing) -> Digest {
        let fickle = self.fickle.iter().filter(|fickle| fickle.is_on.load(Ordering::SeqCst));
        let asked: Vec<u64> =
            fickle.map(|fickle| fickle.asked.fetch_add(1, Ordering::SeqCst)).collect();
        match &asked[..] {
            [] => Digest::of(format!("{scene:?}").as_bytes()),
            asked => Digest::of(format!("{scene:?} {asked:?}").as_bytes()),
        }
    }
}

impl Words for Bells {
    fn lexicon(&self, _: Edition) -> &Lexicon {
        &self.lexicon
    }

    fn seeds(&self) -> &SeedSet {
        &self.seeds
    }

    fn resolve(&self, _: Edition, _: &Ringing, mention: &Mention) -> Vec<Symbol> {
        mention.types.clone()
    }

    fn present(&self, _: &Ringing) -> BTreeSet<Symbol> {
        BELLS.map(Symbol::new).into()
    }

    fn held(&self, _: &Ringing) -> Option<Symbol> {
        None
    }

    fn here(&self, _: &Ringing) -> Option<Symbol> {
        None
    }

    fn fits(&self, _: &Symbol, _: usize, _: &Symbol) -> bool {
        true
    }

    fn contradiction(&self, _: &Ringing, _: &[String], _: &Program) -> Option<(usize, String)> {
        None
    }

    fn is_on(&self, _: &Ringing, _: &Step) -> bool {
        false
    }

    fn unlike(&self, _: &Ringing, _: &Symbol, _: &str) -> bool {
        false
    }

    fn choose(&self, _: &Ringing, _: &Symbol, _: &Pointing) -> Result<Option<String>, String> {
        Ok(None)
    }

    fn is_instance_word(&self, _: &str) -> bool {
        false
    }

    fn is_as(&self, _: &Ringing, _: &str, _: &str) -> Option<bool> {
        None
    }

    fn called(&self, name: &str) -> String {
        name.to_lowercase()
    }

    fn preposition(&self, _: &Symbol) -> &'static str {
        "on"
    }
}

impl Features for Bells {
    fn feature_count(&self) -> usize {
        1
    }

    fn features(&self, scene: &Ringing, _: &Program) -> Vec<f32> {
        assert!(!self.brittle, "the world is brittle");
        self.gate.iter().for_each(|gate| gate.pass());
        vec![scene.len() as f32 / 3.0]
    }
}

impl Show for Bells {
    fn goal(&self, task: &Ringing) -> String {
        let bells: Vec<&str> = task.iter().map(Symbol::as_str).collect();
        format!("let ring: {}", bells.join(", "))
    }

    fn progress(&self, scene: &Ringing, task: &Ringing) -> Vec<(String, bool)> {
        task.iter().map(|bell| (bell.to_string(), scene.contains(bell))).collect()
    }

    fn look(&self, scene: &Ringing) -> View {
        let thing = |kind: &&str| Thing {
            name: (*kind).to_owned(),
            kind: Symbol::new(kind),
            place: None,
            at: (0, 0),
            states: scene.contains(*kind).then(|| "ringing".to_owned()).into_iter().collect(),
        };
        View { summary: Vec::new(), things: BELLS.iter().map(thing).collect() }
    }
    fn narrate(&self, step: &Step, binding: &[String]) -> String {
        format!("{} {}", step.operator.as_str().to_lowercase(), binding.join(" "))
    }
}

/// Carries one primitive out. It changes nothing when it refuses.
fn act(scene: &mut Ringing, step: &Step) -> Result<Vec<String>, Infeasible> {
    let bell = &step.args[0];
    let changed = match step.operator.as_str() {
        "RING" => scene.insert(bell.clone()),
        "MUTE" => scene.remove(bell.as_str()),
        _ => panic!("the bell broke"),
    };
    match changed {
        true => Ok(vec![bell.to_string()]),
        false => {
            let reason = format!("the {bell} bell is so already");
            Err(Infeasible::because(reason))
        }
    }
}
