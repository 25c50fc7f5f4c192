use super::super::facts::facts;
use super::super::scene::{Index, Object};
use super::super::{SceneBuilder, facts::Room};
use super::{EXAMPLE, Household, Scene, Task};
use crate::language::Document;
use crate::limits::SCENE_OBJECTS_MAX;
use crate::world::{Stage, StageError, World};

fn stage(task: &str, seed: u64) -> Result<(Scene, Task), StageError> {
    Household::new().stage(&Stage::Task { task: task.to_owned(), seed })
}

#[test]
fn a_scene_as_large_as_allowed_is_read_back_from_its_document() {
    let mut builder = SceneBuilder::new(Room::Kitchen);
    let counter = builder.stand("CounterTop").unwrap();
    for _ in 1..SCENE_OBJECTS_MAX {
        builder.put("Apple", counter).unwrap();
    }
    assert_eq!(
        builder.put("Apple", counter).unwrap_err().to_string(),
        "a scene has at most 400 things"
    );
    let scene = builder.build();
    assert_eq!(Document::of(&scene).decode::<Scene>().unwrap(), scene);
}

#[test]
fn every_drawn_scene_is_read_back_with_the_same_digest_and_drawn_again_the_same() {
    let household = Household::new();
    for seed in 0..40 {
        let (scene, task) = household.stage(&Stage::Seed { seed }).unwrap();
        let read: Scene = Document::of(&scene).decode().unwrap();
        assert_eq!(read, scene, "seed {seed}");
        assert_eq!(household.digest(&read), household.digest(&scene), "seed {seed}");
        assert_eq!(household.stage(&Stage::Seed { seed }).unwrap(), (scene, task), "seed {seed}");
        let task_read: Task = Document::of(&task).decode().unwrap();
        assert_eq!(task_read, task, "seed {seed}");
    }
}

#[test]
fn a_scene_document_that_does_not_fit_together_is_refused_with_the_reason() {
    let (scene, _) = stage("heat Mug DiningTable", 7).unwrap();
    let text = serde_json::to_string(&scene).unwrap();
    let broken = |from: &str, to: &str| {
        let text = text.replacen(from, to, 1);
        serde_json::from_str::<Scene>(&text).unwrap_err().to_string()
    };
    assert!(broken("\"kitchen\"", "\"cellar\"").contains("\"cellar\" is not a room"));
    assert!(broken("\"type\":\"Mug\"", "\"type\":\"Mugg\"").contains("the nearest is Mug"));
    let holds = "\"robot\":{\"holds\":\"Fridge\",";
    assert!(broken("\"robot\":{", holds).contains("cannot hold the Fridge"));
    let mut looped = scene.clone();
    let bowl = facts().kind("Bowl").unwrap();
    let object = |parent| Object { kind: bowl, states: 0, x: 0, y: 0, parent: Some(parent) };
    let end = looped.objects.len() as Index;
    looped.objects.extend([object(end + 1), object(end)]);
    let error = Document::of(&looped).decode::<Scene>().unwrap_err();
    assert!(error.contains("inside itself"), "{error}");
}

#[test]
fn one_more_thing_or_one_other_state_is_another_digest() {
    let (scene, _) = stage("heat Mug DiningTable", 7).unwrap();
    let digest = scene.digest();
    let mut other = scene.clone();
    other.objects[0].states ^= 1;
    assert_ne!(other.digest(), digest);
    let mut other = scene.clone();
    other.robot.holds = Some(0);
    assert_ne!(other.digest(), digest);
    let mut other = scene.clone();
    other.objects.pop();
    assert_ne!(other.digest(), digest);
}

#[test]
fn a_task_gets_a_scene_where_it_is_possible_and_not_yet_done() {
    let household = Household::new();
    for text in [
        "place Tomato CounterTop",
        "two CD Safe",
        "nested Spoon Mug SideTable",
        "clean Mug CoffeeMachine",
        "heat Potato DiningTable",
        "cool Apple DiningTable",
        "look AlarmClock DeskLamp",
        "cool apple diningtable CLOSED",
        "place Pillow Sofa",
    ] {
        for seed in 0..5 {
            let (scene, task) = stage(text, seed).unwrap_or_else(|e| panic!("{e}"));
            assert!(!household.achieved(&scene, &task), "{text}, seed {seed}");
            assert!(household.plan(&scene, &task).is_some(), "{text}, seed {seed}");
        }
    }
    let (scene, task) = stage("free bathroom", 1).unwrap();
    assert_eq!(scene.room(), Room::Bathroom);
    assert!(!household.achieved(&scene, &task) && household.plan(&scene, &task).is_none());
}

#[test]
fn a_task_that_makes_no_sense_gets_one_clear_sentence() {
    for (task, reason) in [
        ("", "it is empty"),
        ("cleen Mug Sink", "\"cleen\" is not a form of task; the nearest is clean"),
        ("clean Mug", "clean takes 2 names of things, but you gave 1"),
        ("clean Mugg CounterTop", "there is no kind of thing called \"Mugg\"; the nearest is Mug"),
        ("clean Book Desk", "a Book cannot be washed"),
        ("place Sofa Bed", "a Sofa cannot be picked up"),
        ("place Mug Sofa", "a Mug does not go on a Sofa"),
        ("cool Apple Fridge", "this task already puts the thing in the Fridge; name another place"),
        ("look Book Fridge", "a Fridge is not a lamp"),
        (
            "free cellar",
            "\"cellar\" is not a room; the rooms are kitchen, living_room, bedroom, bathroom",
        ),
    ] {
        let error = stage(task, 1).unwrap_err();
        let StageError::Task { reason: found, known, .. } = &error else { panic!("{error}") };
        assert_eq!(found, reason, "{task}");
        assert!(known.contains("nested THING CARRIER PLACE"));
    }
    assert!(stage(&"x".repeat(100_000), 1).unwrap_err().to_string().len() < 1_000);
}

#[test]
fn a_scene_file_with_an_error_is_told_line_column_and_reason() {
    let fails = |scene: &str| {
        let stage = Stage::Scene { scene: scene.to_owned(), task: "free".to_owned() };
        match Household::new().stage(&stage).unwrap_err() {
            StageError::Scene { line, column, reason } => (line, column, reason),
            other => panic!("{other}"),
        }
    };
    let (line, column, reason) = fails("room = \"kitchen\"\nstands_at = \"Fridge\n");
    assert_eq!((line, column), (2, 20), "{reason}");
    let (line, _, reason) = fails("room = \"attic\"");
    assert_eq!(line, 1);
    assert!(reason.contains("expected one of kitchen"), "{reason}");
    let thing = "room = \"kitchen\"\n[[thing]]\ntype = \"Mug\"\n";
    let (line, column, reason) = fails(&format!("{thing}on = \"CounterTop\""));
    assert_eq!((line, column), (4, 6));
    assert_eq!(reason, "there is no \"CounterTop\" among the things above it");
    let (line, _, reason) = fails(&format!("{thing}states = [\"asleep\"]"));
    assert_eq!(line, 4);
    assert!(reason.contains("is not a state; expected open, closed"), "{reason}");
    let two = "[[thing]]\ntype = \"Desk\"\n[[thing]]\ntype = \"Pen\"\non = \"Desk\"\nat = [1, 2]";
    let (line, column, reason) = fails(&format!("room = \"bedroom\"\n{two}"));
    assert_eq!((line, column), (7, 6));
    assert_eq!(reason, "a thing in or on another one has the same place; leave out `at`");
    let (_, _, reason) = fails(&format!("{thing}states = [\"open\"]"));
    assert_eq!(reason, "a Mug cannot be open");
    let (line, _, reason) = fails("room = \"kitchen\"\ncolour = 1");
    assert_eq!(line, 2);
    assert!(reason.contains("unknown field"), "{reason}");
    let (line, column, _) = fails("room = \"kitchen\" # ä\n[[thing]]\ntype = [");
    assert_eq!((line, column > 0), (3, true));
    assert!(fails(&" ".repeat(300_000)).2.contains("the limit is"));
}

#[test]
fn a_scene_file_must_have_what_the_task_needs() {
    let stage = Stage::Scene { scene: EXAMPLE.to_owned(), task: "place Potato CounterTop".into() };
    let error = Household::new().stage(&stage).unwrap_err().to_string();
    assert!(error.contains("there is no Potato in the scene, and the task needs one"), "{error}");
}
