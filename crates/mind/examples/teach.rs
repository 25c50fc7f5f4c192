//! The mind inside another program, without a service: teach it one thing, then say it of another.
//!
//! `cargo run --package apprentice-mind --example teach`

use std::error::Error;
use std::sync::Arc;

use apprentice_core::language::{Outcome, Utterance};
use apprentice_core::world::{Stage, World};
use apprentice_household::Household;
use apprentice_mind::grounding::Moment;
use apprentice_mind::learning::{Lesson, Recipe, train};

/// What is said after the lesson "wash the mug".
pub const SAID: [&str; 3] =
    ["wash the tomato", "did you wash the tomato?", "wash the tomato with the banana"];

/// What each of [`SAID`] is taken for.
pub fn outcomes() -> Result<Vec<Outcome>, Box<dyn Error>> {
    let household = Household::new();
    let recipe = Recipe::parse(Recipe::builtin(Recipe::DEFAULT).expect("it ships"))?;
    let kitchen = Stage::Task { task: "clean Tomato CounterTop".to_owned(), seed: 7 };
    let (scene, task) = household.stage(&kitchen)?;

    let utterance = Utterance::new("wash the mug")?;
    let program = "PICKUP Mug; GOTO SinkBasin; PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet";
    let (scene_then, task_then) = (Arc::new(scene.clone()), Arc::new(task));
    let lesson = Lesson {
        utterance,
        program: program.parse()?,
        scene: scene_then,
        task: task_then,
        mentioned: None,
    };
    let mind = train(&household, &recipe, &[lesson])?;

    let (domain, scene, task) = (&household, &scene, &task);
    let moment = || Moment { domain, scene, task, mentioned: None, handled: &[] };
    let said = SAID.into_iter();
    said.map(|text| Ok(mind.interpret(moment(), &Utterance::new(text)?).outcome)).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    for (text, outcome) in SAID.iter().zip(outcomes()?) {
        println!("{text}: {outcome:?}");
    }
    Ok(())
}
