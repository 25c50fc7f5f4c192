//! A small world and a small parser for the unit tests of this room and of `learning`: a bench
//! with blocks, boxes and lamps, and a hand. Nothing has a place: everything is within reach but
//! what is `far`, until the hand goes there.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::ids::Digest;
use crate::language::{
    Clause, Exemplar, LiftedUtterance, Mention, Near, Operator, Program, Signature, Step, Symbol,
    Utterance,
};
use crate::parser::{Parse, Scored, SemanticParser};
use crate::world::{
    Edition, Features, Infeasible, Lexicon, Meaning, Pointing, SeedSet, Show, Stage, StageError,
    Thing, View, Words, World, refuse_other_instances,
};

pub(crate) struct Bench {
    signature: Signature,
    lexicon: Lexicon,
    seeds: SeedSet,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Scene {
    pub here: BTreeSet<Symbol>,
    pub far: BTreeSet<Symbol>,
    pub held: Option<Symbol>,
    pub on: BTreeSet<Symbol>,
}

impl Scene {
    /// - `things`: names of types; `*Block` is far away.
    pub(crate) fn with(things: &str) -> Scene {
        let named = |far| {
            let things = things.split(' ').filter(move |thing| thing.starts_with('*') == far);
            things.map(|thing| Symbol::new(thing.trim_start_matches('*'))).collect()
        };
        Scene { here: named(false), far: named(true), held: None, on: BTreeSet::new() }
    }

    pub(crate) fn holding(mut self, thing: &str) -> Scene {
        self.held = Some(Symbol::new(thing));
        self.here.remove(thing);
        self
    }
}

impl Bench {
    pub(crate) fn new() -> Bench {
        let names = [
            ("block", "Block Brick"),
            ("red block", "Brick"),
            ("brick", "Brick"),
            ("box", "Box"),
            ("tool box", "ToolBox"),
            ("knife", "Knife"),
            ("lamp", "Lamp"),
            ("table", "Table"),
        ];
        let meanings = |kinds: &str| {
            let meaning = |(place, kind)| Meaning {
                sort: Symbol::new("thing"),
                kind: Symbol::new(kind),
                count: 10 - place as u32,
            };
            kinds.split(' ').enumerate().map(meaning).collect::<Vec<_>>()
        };
        let lexicon = Lexicon {
            names: names.iter().map(|(name, kinds)| (name.to_string(), meanings(kinds))).collect(),
            plurals: BTreeMap::from([("knives".to_owned(), "knife".to_owned())]),
            pronouns: vec!["it".to_owned(), "them".to_owned()],
            adjectives: ["red", "small", "wooden"].map(str::to_owned).to_vec(),
            fixtures: BTreeMap::from([(Symbol::new("Lamp"), "lamp".to_owned())]),
            ..Lexicon::default()
        };
        let seeds = [
            ("take the <thing>", "TAKE <thing:1>"),
            ("pick up the <thing>", "TAKE <thing:1>"),
            ("grab the <thing>", "TAKE <thing:1>"),
            ("put the <thing> in the <thing>", "PUT <thing:1> <thing:2>"),
            ("place the <thing> on the <thing>", "PUT <thing:1> <thing:2>"),
            ("put down", "PUT <held> Table"),
            ("turn on the <thing>", "SWITCH <thing:1>"),
            ("turn off the <thing>", "SWITCH <thing:1>"),
        ];
        let seeds = SeedSet { exemplars: exemplars(&seeds), ..SeedSet::default() };
        let operator = |(name, args): (&str, usize)| Operator {
            name: Symbol::new(name),
            args: vec![Symbol::new("thing"); args],
        };
        let operators = [("GO", 1), ("TAKE", 1), ("PUT", 2), ("SWITCH", 1)].map(operator).to_vec();
        Bench { signature: Signature { operators }, lexicon, seeds }
    }
}

impl Bench {
    pub(crate) fn with_seeds(seeds: &[(&str, &str)]) -> Bench {
        let seeds = SeedSet { exemplars: exemplars(seeds), ..SeedSet::default() };
        Bench { seeds, ..Bench::new() }
    }
}

pub(crate) fn exemplars(pairs: &[(&str, &str)]) -> Vec<Exemplar> {
    let exemplar = |(utterance, program): &(&str, &str)| Exemplar {
        utterance: LiftedUtterance::parse(utterance),
        program: program.parse().unwrap(),
    };
    pairs.iter().map(exemplar).collect()
}

pub(crate) fn say(text: &str) -> Utterance {
    Utterance::new(text).unwrap()
}

impl World for Bench {
    type Scene = Scene;
    type Task = ();

    fn id(&self) -> &'static str {
        "bench"
    }

    fn version(&self) -> u16 {
        1
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn stage(&self, request: &Stage) -> Result<(Scene, ()), StageError> {
        panic!("the bench sets no stage, asked for {request:?}")
    }

    fn step_on(
        &self,
        scene: &mut Scene,
        _: &(),
        step: &Step,
        on: &[Option<String>],
    ) -> Result<Vec<String>, Infeasible> {
        refuse_other_instances(scene, step, on, |scene| act(scene, step))
    }

    fn achieved(&self, _: &Scene, _: &()) -> bool {
        false
    }

    fn plan(&self, _: &Scene, _: &()) -> Option<Program> {
        None
    }

    fn digest(&self, scene: &Scene) -> Digest {
        Digest::of(format!("{scene:?}").as_bytes())
    }
}

impl Words for Bench {
    fn lexicon(&self, _: Edition) -> &Lexicon {
        &self.lexicon
    }

    fn seeds(&self) -> &SeedSet {
        &self.seeds
    }

    fn resolve(&self, _: Edition, scene: &Scene, mention: &Mention) -> Vec<Symbol> {
        let held = |kind: &&Symbol| scene.held.as_ref() == Some(*kind);
        let here = |kind: &&Symbol| scene.here.contains(*kind) || held(kind);
        let mut types: Vec<Symbol> = mention.types.iter().filter(here).cloned().collect();
        types.extend(mention.types.iter().filter(|kind| scene.far.contains(*kind)).cloned());
        if types.is_empty() { mention.types.clone() } else { types }
    }

    fn present(&self, scene: &Scene) -> BTreeSet<Symbol> {
        scene.here.iter().chain(&scene.far).chain(&scene.held).cloned().collect()
    }

    fn held(&self, scene: &Scene) -> Option<Symbol> {
        scene.held.clone()
    }

    fn here(&self, _: &Scene) -> Option<Symbol> {
        None
    }

    fn fits(&self, _: &Symbol, _: usize, _: &Symbol) -> bool {
        true
    }

    fn contradiction(
        &self,
        scene: &Scene,
        words: &[String],
        program: &Program,
    ) -> Option<(usize, String)> {
        let step = program.steps.iter().position(|step| step.operator == "SWITCH")?;
        let thing = &program.steps[step].args[0];
        let off = words.iter().any(|word| word == "off");
        (off && !scene.on.contains(thing)).then(|| (step, format!("the {thing} is already off")))
    }

    fn is_on(&self, _: &Scene, _: &Step) -> bool {
        false
    }

    fn unlike(&self, _: &Scene, _: &Symbol, _: &str) -> bool {
        false
    }

    fn choose(&self, _: &Scene, _: &Symbol, _: &Pointing) -> Result<Option<String>, String> {
        Ok(None)
    }

    fn is_instance_word(&self, _: &str) -> bool {
        false
    }

    fn is_as(&self, _: &Scene, _: &str, _: &str) -> Option<bool> {
        None
    }

    fn called(&self, name: &str) -> String {
        name.to_lowercase()
    }

    fn preposition(&self, _: &Symbol) -> &'static str {
        "on"
    }
}

impl Features for Bench {
    fn feature_count(&self) -> usize {
        2
    }

    fn features(&self, scene: &Scene, program: &Program) -> Vec<f32> {
        let far = program.steps.iter().any(|step| scene.far.contains(&step.args[0]));
        vec![f32::from(u8::from(scene.held.is_some())), f32::from(u8::from(far))]
    }
}

impl Show for Bench {
    fn goal(&self, _: &()) -> String {
        "do nothing".to_owned()
    }

    fn progress(&self, _: &Scene, _: &()) -> Vec<(String, bool)> {
        Vec::new()
    }

    fn look(&self, scene: &Scene) -> View {
        let thing = |kind: &Symbol| Thing {
            name: kind.to_string(),
            kind: kind.clone(),
            place: None,
            at: (0, 0),
            states: Vec::new(),
        };
        View { summary: Vec::new(), things: scene.here.iter().map(thing).collect() }
    }

    fn narrate(&self, step: &Step, _: &[String]) -> String {
        step.to_string()
    }
}

/// Carries one primitive out. It changes nothing when it refuses.
fn act(scene: &mut Scene, step: &Step) -> Result<Vec<String>, Infeasible> {
    let thing = &step.args[0];
    let refuse = |reason: String| Err(Infeasible::because(reason));
    let present = scene.here.contains(thing) || scene.held.as_ref() == Some(thing);
    if step.operator == "GO" {
        if !present && !scene.far.remove(thing) {
            return refuse(format!("there is no {thing}"));
        }
        scene.here.insert(thing.clone());
        return Ok(vec![thing.to_string()]);
    }
    if scene.far.contains(thing) {
        let first = Some(format!("GO {thing}").parse().unwrap());
        let reason = format!("the {thing} is too far away");
        return Err(Infeasible { reason, first, first_on: Vec::new(), done: false });
    }
    if !present {
        return refuse(format!("there is no {thing}"));
    }
    match step.operator.as_str() {
        "TAKE" => match &scene.held {
            Some(held) => return refuse(format!("the hand already holds the {held}")),
            None if ["Lamp", "Table", "Brick"].contains(&thing.as_str()) => {
                return refuse(format!("the {thing} is too heavy"));
            }
            None => {
                scene.here.remove(thing);
                scene.held = Some(thing.clone());
            }
        },
        "PUT" if scene.held.as_ref() != Some(thing) => {
            return refuse(format!("the hand does not hold the {thing}"));
        }
        "PUT" => {
            scene.held = None;
            scene.here.insert(thing.clone());
        }
        _ if thing != "Lamp" => return refuse(format!("the {thing} has no switch")),
        _ if !scene.on.remove(thing) => {
            scene.on.insert(thing.clone());
        }
        _ => {}
    }
    Ok(step.args.iter().map(Symbol::to_string).collect())
}

/// Compares lifted utterances by the words they share; no training.
pub(crate) struct Overlap {
    pub exemplars: Vec<Exemplar>,
    pub threshold: f32,
}

impl SemanticParser for Overlap {
    fn parse(&self, clause: &Clause) -> Parse {
        let words = &clause.lifted.words;
        let near = |(number, exemplar): (usize, &Exemplar)| {
            let other = &exemplar.utterance.words;
            let mut rest = other.clone();
            let mut take =
                |word| rest.iter().position(|other| other == word).map(|place| rest.remove(place));
            let shared = words.iter().filter_map(&mut take).count();
            let distance = if *other == *words {
                0.0
            } else {
                1.0 - shared as f32 / (words.len() + other.len() - shared) as f32
            };
            let (exemplar, program) = (exemplar.utterance.clone(), exemplar.program.clone());
            Near { exemplar, program, distance, number: number as u32 }
        };
        let mut nearest: Vec<Near> = self.exemplars.iter().enumerate().map(near).collect();
        nearest.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        let mut candidates: Vec<Scored> = Vec::new();
        let mut exact = 0;
        for near in nearest.iter().filter(|near| near.distance <= self.threshold) {
            if candidates.iter().all(|known| known.program != near.program) {
                let Near { program, distance, number, .. } = near.clone();
                candidates.push(Scored { program, distance, number, open: false, by: None });
                exact += usize::from(near.distance == 0.0);
            }
        }
        nearest.truncate(3);
        Parse { candidates, nearest, threshold: self.threshold, exact }
    }
}
