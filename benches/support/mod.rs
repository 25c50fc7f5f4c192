//! Shared parts of the benchmarks.

use std::sync::Arc;

use apprentice::language::{Program, Utterance};
use apprentice::learning::Lesson;
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Stage, World};

/// `count` lessons with different utterances of our own, each for one of four programs.
pub fn lessons(domain: &Household, count: usize) -> Vec<Lesson<Scene, Task>> {
    let wash = "GOTO SinkBasin; PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug";
    let chill = "GOTO Fridge; OPEN Fridge; PUT Mug Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Mug";
    let heat = "GOTO Microwave; OPEN Microwave; PUT Mug Microwave; CLOSE Microwave; \
                TOGGLE Microwave; TOGGLE Microwave; OPEN Microwave; PICKUP Mug";
    let stow = "GOTO Cabinet; OPEN Cabinet; PUT Mug Cabinet; CLOSE Cabinet";
    let kinds = [
        (wash, ["wash", "rinse", "clean", "scrub", "bathe"]),
        (chill, ["chill", "cool", "refrigerate", "freeze", "ice"]),
        (heat, ["heat", "warm", "cook", "microwave", "reheat"]),
        (stow, ["stow", "store", "hide", "shelve", "stash"]),
    ];
    let ends =
        ["", "now", "please", "for me", "quickly", "again", "well", "today", "first", "at last"];
    let task = "free kitchen".to_owned();
    let (scene, task) = domain.stage(&Stage::Task { task, seed: 1 }).expect("a free kitchen");
    let (scene, task) = (Arc::new(scene), Arc::new(task));
    let lesson = |number: usize| {
        let (program, verbs) = &kinds[number % 4];
        let verb = verbs[number / 4 % 5];
        let end = ends[number / 20 % 10];
        let again = if number / 200 > 0 { "just " } else { "" };
        Lesson {
            utterance: Utterance::new(&format!("{again}{verb} the mug {end}")).expect("words"),
            program: program.parse::<Program>().expect("a program"),
            scene: scene.clone(),
            task: task.clone(),
            mentioned: None,
        }
    };
    (0..count).map(lesson).collect()
}
