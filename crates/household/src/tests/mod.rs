//! Behaviour of the household, told in its own words.

mod facts;
mod matching;
mod names;
mod planner;
mod pointing;
mod primitives;
mod speed;
mod stages;
mod talk;
mod told;

use super::{Household, Scene, Task};
use crate::language::{Mention, Program, Symbol};
use crate::world::{Edition, Stage, Words, World};

pub(super) const EXAMPLE: &str = include_str!("../../data/example_scene.toml");

/// The example kitchen.
pub(super) fn kitchen(task: &str) -> (Household, Scene, Task) {
    let household = Household::new();
    let stage = Stage::Scene { scene: EXAMPLE.to_owned(), task: task.to_owned() };
    let (scene, task) = household.stage(&stage).unwrap();
    (household, scene, task)
}

/// Runs a program; the instances it bound, or the first refusal.
pub(super) fn run(
    household: &Household,
    scene: &mut Scene,
    task: &Task,
    program: &str,
) -> Result<Vec<String>, String> {
    let program: Program = program.parse().unwrap();
    let mut bound = Vec::new();
    for step in &program.steps {
        let before = scene.clone();
        match household.step(scene, task, step) {
            Ok(names) => bound.push(names.join(" + ")),
            Err(infeasible) => {
                assert_eq!(*scene, before, "a refused step changes nothing");
                return Err(infeasible.reason);
            }
        }
    }
    Ok(bound)
}

/// A name of the lexicon, as it is found in an utterance.
pub(super) fn mention(household: &Household, edition: Edition, surface: &str) -> Mention {
    let meanings = &household.lexicon(edition).names[surface];
    Mention {
        surface: surface.to_owned(),
        sort: Symbol::new("obj"),
        types: meanings.iter().map(|meaning| meaning.kind.clone()).collect(),
        pronoun: false,
        plural: false,
    }
}
