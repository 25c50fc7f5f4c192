//! A world without mugs: a panel of coloured buttons and a hand that hovers over one of them.
//! Whatever trains and runs with it knows nothing about households.

use apprentice::ids::Digest;
use apprentice::language::{
    Exemplar, LiftedUtterance, Mention, Operator, Program, Signature, Step, Symbol,
};
use apprentice::world::{
    Domain, Infeasible, Lexicon, Meaning, SeedSet, Stage, StageError, Thing, View,
};
use serde::{Deserialize, Serialize};

pub const COLOURS: [&str; 4] = ["Red", "Green", "Blue", "White"];

/// Which button the hand hovers over, and which are lit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Panel {
    pub over: u8,
    pub lit: [bool; COLOURS.len()],
}

/// The button that is to be lit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Light(pub u8);

/// `HOVER <color>` moves the hand; `PRESS <color>` lights or darkens the button under it.
pub struct Toy {
    signature: Signature,
    lexicon: Lexicon,
    seeds: SeedSet,
}

impl Toy {
    pub fn new() -> Toy {
        let operator =
            |name| Operator { name: Symbol::new(name), args: vec![Symbol::new("color")] };
        let mut lexicon = Lexicon { pronouns: vec!["it".to_owned()], ..Lexicon::default() };
        for (name, kind) in [
            ("crimson", "Red"),
            ("azure", "Blue"),
            ("red", "Red"),
            ("green", "Green"),
            ("blue", "Blue"),
            ("white", "White"),
        ] {
            let meaning = Meaning { sort: Symbol::new("color"), kind: kind.into(), count: 1 };
            lexicon.names.insert(name.to_owned(), vec![meaning]);
        }
        let exemplar = |(text, program): &(&str, &str)| Exemplar {
            utterance: LiftedUtterance::parse(text),
            program: program.parse().expect("a lifted program"),
        };
        let exemplars = [
            ("hover over the <color>", "HOVER <color:1>"),
            ("go to the <color>", "HOVER <color:1>"),
            ("point at the <color> next to the <color>", "HOVER <color:1>"),
            ("press the <color>", "PRESS <color:1>"),
            ("push the <color> down", "PRESS <color:1>"),
        ];
        let variants = [
            ("move to the <color>", "HOVER <color:1>"),
            ("hover above the <color>", "HOVER <color:1>"),
            ("push the <color>", "PRESS <color:1>"),
            ("press down the <color>", "PRESS <color:1>"),
        ];
        let unknown = [
            "paint the <color>",
            "sing to the <color>",
            "mix the <color> with the <color>",
            "tell me a joke",
            "wash the <color>",
            "eat the <color>",
        ];
        Toy {
            signature: Signature { operators: vec![operator("HOVER"), operator("PRESS")] },
            lexicon,
            seeds: SeedSet {
                exemplars: exemplars.iter().map(exemplar).collect(),
                variants: variants.iter().map(exemplar).collect(),
                unknown: unknown.iter().map(|text| LiftedUtterance::parse(text)).collect(),
            },
        }
    }
}

impl Default for Toy {
    fn default() -> Toy {
        Toy::new()
    }
}

fn colour(name: &str) -> Option<u8> {
    COLOURS.iter().position(|known| *known == name).map(|index| index as u8)
}

impl Domain for Toy {
    type Scene = Panel;
    type Task = Light;

    fn id(&self) -> &'static str {
        "toy"
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

    fn stage(&self, request: &Stage) -> Result<(Panel, Light), StageError> {
        let dark = |seed: u64, light: u8| {
            let over = (u64::from(light) + 1 + seed % 3) as u8 % COLOURS.len() as u8;
            (Panel { over, lit: [false; COLOURS.len()] }, Light(light))
        };
        let read = |task: &str| {
            let words: Vec<&str> = task.split_whitespace().collect();
            let light = if let ["light", name] = words[..] { colour(name) } else { None };
            light.ok_or_else(|| StageError::Task {
                task: task.to_owned(),
                reason: "it is no task of the panel".to_owned(),
                known: format!("known: light COLOUR, of {}", COLOURS.join(", ")),
            })
        };
        match request {
            Stage::Seed { seed } => Ok(dark(*seed, (seed % COLOURS.len() as u64) as u8)),
            Stage::Task { task, seed } => Ok(dark(*seed, read(task)?)),
            Stage::Scene { scene, task } => match (scene.trim(), read(task)?) {
                ("dark", light) => Ok(dark(0, light)),
                _ => {
                    let reason = "expected the one word: dark".to_owned();
                    Err(StageError::Scene { line: 1, column: 1, reason })
                }
            },
        }
    }

    fn step(&self, scene: &mut Panel, _: &Light, step: &Step) -> Result<Vec<String>, Infeasible> {
        self.signature.check(step).map_err(|reason| Infeasible { reason })?;
        let name = step.args[0].as_str();
        let Some(target) = colour(name) else {
            return Err(Infeasible { reason: format!("there is no {name} here") });
        };
        if step.operator == "HOVER" {
            scene.over = target;
        } else if scene.over == target {
            scene.lit[usize::from(target)] ^= true;
        } else {
            let over = COLOURS[usize::from(scene.over)];
            return Err(Infeasible { reason: format!("the hand is over {over}, not over {name}") });
        }
        Ok(vec![name.to_owned()])
    }

    fn achieved(&self, scene: &Panel, task: &Light) -> bool {
        scene.lit[usize::from(task.0)]
    }

    fn plan(&self, scene: &Panel, task: &Light) -> Option<Program> {
        let name = COLOURS[usize::from(task.0)];
        let program = match scene.over == task.0 {
            true => format!("PRESS {name}"),
            false => format!("HOVER {name}; PRESS {name}"),
        };
        (!self.achieved(scene, task)).then(|| program.parse().expect("a program"))
    }

    fn resolve(&self, _: &Panel, mention: &Mention) -> Vec<Symbol> {
        mention.types.clone()
    }

    fn held(&self, _: &Panel) -> Option<Symbol> {
        None
    }

    fn feature_count(&self) -> usize {
        2
    }

    fn features(&self, scene: &Panel, program: &Program) -> Vec<f32> {
        let mut after = scene.clone();
        let run = program.steps.iter().filter(|s| self.step(&mut after, &Light(0), s).is_ok());
        let ran = run.count() as f32;
        vec![ran / program.steps.len().max(1) as f32, if after == *scene { -1.0 } else { 1.0 }]
    }

    fn digest(&self, scene: &Panel) -> Digest {
        let [red, green, blue, white] = scene.lit.map(u8::from);
        Digest::of(&[scene.over, red, green, blue, white])
    }

    fn goal(&self, task: &Light) -> String {
        format!("light {}", COLOURS[usize::from(task.0)])
    }

    fn progress(&self, scene: &Panel, task: &Light) -> Vec<(String, bool)> {
        let name = COLOURS[usize::from(task.0)];
        vec![(format!("{name} is lit"), self.achieved(scene, task))]
    }

    fn look(&self, scene: &Panel) -> View {
        let thing = |(index, name): (usize, &&str)| Thing {
            name: (*name).to_owned(),
            kind: Symbol::new(name),
            place: None,
            at: (10 * index as i32, 0),
            states: if scene.lit[index] { vec!["on".to_owned()] } else { vec![] },
        };
        let over = COLOURS[usize::from(scene.over)];
        View {
            summary: vec![format!("the hand is over {over}")],
            things: COLOURS.iter().enumerate().map(thing).collect(),
        }
    }

    fn narrate(&self, step: &Step, binding: &[String]) -> String {
        let verb = if step.operator == "HOVER" { "hovers over" } else { "presses" };
        format!("{verb} {}", binding.join(", "))
    }
}
