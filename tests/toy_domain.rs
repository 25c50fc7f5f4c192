//! The toy world keeps the contract of `Domain`.

mod support;

use apprentice::language::Document;
use apprentice::world::{Domain, Stage};
use support::toy::{Light, Panel, Toy};

#[test]
fn a_plan_achieves_the_task_and_the_scene_is_read_back() {
    let toy = Toy::new();
    for seed in 0..12 {
        let (mut scene, task) = toy.stage(&Stage::Seed { seed }).unwrap();
        assert!(!toy.achieved(&scene, &task), "seed {seed}");
        for step in &toy.plan(&scene, &task).unwrap().steps {
            toy.step(&mut scene, &task, step).unwrap();
        }
        assert!(toy.achieved(&scene, &task), "seed {seed}");
        assert_eq!(Document::of(&scene).decode::<Panel>().unwrap(), scene);
        assert_eq!(Document::of(&task).decode::<Light>().unwrap(), task);
    }
}

#[test]
fn the_panel_refuses_with_a_reason() {
    let toy = Toy::new();
    let (mut scene, task) =
        toy.stage(&Stage::Task { task: "light Red".to_owned(), seed: 0 }).unwrap();
    let before = scene.clone();
    let refused = toy.step(&mut scene, &task, &"PRESS Red".parse().unwrap()).unwrap_err();
    assert_eq!(refused.reason, "the hand is over Green, not over Red");
    assert_eq!(scene, before);
    assert!(toy.stage(&Stage::Task { task: "light Pink".to_owned(), seed: 0 }).is_err());
    assert!(toy.stage(&Stage::Scene { scene: "bright".into(), task: "light Red".into() }).is_err());
}
