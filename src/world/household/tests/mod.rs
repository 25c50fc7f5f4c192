//! Behaviour of the household, told in its own words.

mod facts;
mod matching;
mod planner;
mod primitives;
mod speed;
mod stages;
mod talk;

use super::{Household, Scene, Task};
use crate::language::Program;
use crate::world::{Domain, Stage};

pub(super) const EXAMPLE: &str = include_str!("../../../../data/household/example_scene.toml");

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
