use std::hint::black_box;
use std::time::{Duration, Instant};

use super::super::{Room, SceneBuilder};
use super::{Household, run};
use crate::language::{Document, Step};
use crate::world::{Features, Stage, World};

/// Prints figures; asserts nothing about time, which depends on who else uses the machine.
#[test]
fn digest_step_and_planner_figures() {
    let household = Household::new();
    let (scene, task) =
        household.stage(&Stage::Task { task: "cool Apple DiningTable".into(), seed: 3 }).unwrap();
    let each = |name: &str, times: u32, work: &mut dyn FnMut()| {
        let start = Instant::now();
        (0..times).for_each(|_| work());
        println!("{name}: {:?}", start.elapsed() / times);
    };
    println!("{} things", scene.objects.len());
    each("digest", 10_000, &mut || {
        black_box(household.digest(black_box(&scene)));
    });
    each("clone", 10_000, &mut || {
        black_box(black_box(&scene).clone());
    });
    let step: Step = "GOTO Apple".parse().unwrap();
    each("clone and step", 10_000, &mut || {
        let mut after = scene.clone();
        black_box(household.step(&mut after, &task, &step)).unwrap();
    });
    let program = household.plan(&scene, &task).unwrap();
    each("features", 1_000, &mut || {
        black_box(household.features(&scene, &program));
    });
    let (mut total, mut worst) = (Duration::ZERO, (Duration::ZERO, String::new()));
    for seed in 0..100 {
        let (scene, task) = household.stage(&Stage::Seed { seed }).unwrap();
        let start = Instant::now();
        black_box(household.plan(&scene, &task));
        let took = start.elapsed();
        total += took;
        worst = worst.max((took, format!("seed {seed}: {task}")));
    }
    println!("plan: {:?} on average, {worst:?} at worst", total / 100);
    let bytes = Document::of(&scene).as_json().to_string().len();
    println!("document: {bytes} bytes");
    let mut scene = scene;
    run(&household, &mut scene, &task, &program.to_string()).unwrap();
}

#[test]
fn a_crowd_of_things_does_not_overwhelm_the_planner() {
    for (things, places, task, fewest) in [
        (190, 200, "two Apple DiningTable", 9),
        (130, 200, "nested Apple Bowl DiningTable", 7),
        (385, 5, "heat Apple DiningTable closed", 15),
    ] {
        let mut builder = SceneBuilder::new(Room::Kitchen);
        let fridge = builder.stand("Fridge").unwrap();
        builder.stand("Microwave").unwrap();
        for _ in 0..places {
            builder.stand("DiningTable").unwrap();
        }
        for number in 0..things {
            builder.put(if number % 3 == 1 { "Bowl" } else { "Apple" }, fridge).unwrap();
        }
        let scene = builder.build();
        let start = Instant::now();
        let plan = Household::new().plan(&scene, &task.parse().unwrap());
        let steps = plan.map(|plan| plan.steps.len());
        println!("{task} among {} things: {:?}", scene.objects.len(), start.elapsed());
        assert_eq!(steps, Some(fewest), "{task}");
    }
}
