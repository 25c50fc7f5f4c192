//! Teachers at a real service inside the process.

use std::sync::Arc;

use apprentice::client::Client;
use apprentice::ids::{Seq, UserId};
use apprentice::learning::Recipe;
use apprentice::service::{Config, Data, Service};
use apprentice::world::Stage;
use apprentice::world::household::Household;

use super::*;

const TASK: &str = "cool Mug CounterTop";

/// A service whose minds learn nothing, so that nothing is trained.
fn service(household: &Arc<Household>) -> Service {
    let mut config = Config::new(household.clone(), Data::Memory);
    config.recipe_text = Recipe::builtin("grammar").unwrap().to_owned();
    Service::start(config).unwrap()
}

fn teacher(changes: &[(&str, &str)]) -> Teacher {
    let changed = changes.iter().fold(Teacher::TEXT.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    Teacher::parse(&changed).unwrap()
}

/// One episode; returns what was said and how the person is afterwards.
fn live(client: &Client, household: &Household, teacher: &Teacher) -> (Vec<Turn>, Person) {
    let mut person = Person::new(teacher);
    let stage = Stage::Task { task: TASK.to_owned(), seed: 5 };
    let user = client.user().as_str();
    let episode = SimulatedEpisode {
        seed: 1,
        user,
        number: 1,
        task: TASK,
        stage: &stage,
        household,
        teacher,
    };
    let wire = Wire { client, alive: &|| true };
    let turns = teach(&mut person, &wire, &episode, format!("test {user} 1")).unwrap();
    (turns, person)
}

fn client(service: &Service, name: &str) -> Client {
    service.connect(UserId::new(name).unwrap()).unwrap()
}

#[test]
fn a_teacher_reaches_the_goal_and_teaches_what_was_not_understood() {
    let household = Arc::new(Household::new());
    let service = service(&household);
    let teacher = teacher(&[
        ("whole = 0.35", "whole = 1.0"),
        ("part = 0.55", "part = 0.0"),
        ("\ntrust = 0.7", "\ntrust = 1.0"),
        ("effort = 0.9", "effort = 1.0"),
        ("forgetfulness = 0.1", "forgetfulness = 0.0"),
    ]);
    let client = client(&service, "ada");
    let (turns, _) = live(&client, &household, &teacher);
    let status = client.status().unwrap();
    assert!(status.progress.iter().all(|(_, done)| *done), "{:?}", status.progress);
    assert!(status.lessons >= 1, "{status:?}");
    // The whole task was asked for first, and only that is a first try.
    assert!(turns[0].first && turns[1..].iter().all(|turn| !turn.first), "{turns:?}");
    assert!(turns[0].meant.steps.len() >= 10, "{turns:?}");
    assert_eq!(Seq::new(turns[0].seq), Seq::new(3));
}

#[test]
fn a_teacher_without_ambition_speaks_in_primitives_and_one_without_effort_teaches_nothing() {
    let household = Arc::new(Household::new());
    let service = service(&household);
    let teacher = teacher(&[
        ("whole = 0.35", "whole = 0.0"),
        ("part = 0.55", "part = 0.0"),
        ("walks_left_out = 0.5", "walks_left_out = 0.0"),
        ("effort = 0.9", "effort = 0.0"),
        ("effort_primitives = 0.5", "effort_primitives = 0.0"),
    ]);
    let client = client(&service, "ben");
    let (turns, _) = live(&client, &household, &teacher);
    assert!(turns.iter().all(|turn| turn.meant.steps.len() == 1), "{turns:?}");
    let status = client.status().unwrap();
    assert!(status.progress.iter().all(|(_, done)| *done), "{:?}", status.progress);
    assert_eq!(status.lessons, 0);
}

#[test]
fn asking_again_under_the_same_place_gives_the_same_episode_and_records_nothing() {
    let household = Arc::new(Household::new());
    let service = service(&household);
    let teacher = teacher(&[]);
    let client = client(&service, "cleo");
    let first = live(&client, &household, &teacher);
    let seq = client.status().unwrap().seq;
    assert_eq!(live(&client, &household, &teacher), first);
    assert_eq!(client.status().unwrap().seq, seq);
}

#[test]
fn a_polite_teacher_gets_on_and_is_the_same_each_time() {
    let household = Arc::new(Household::new());
    let service = service(&household);
    let teacher = Teacher::parse(Teacher::builtin("teacher-2").unwrap()).unwrap();
    let client = client(&service, "dora");
    let first = live(&client, &household, &teacher);
    let status = client.status().unwrap();
    assert!(!first.0.is_empty());
    assert_eq!(live(&client, &household, &teacher), first);
    assert_eq!(client.status().unwrap().seq, status.seq);
}

#[test]
fn meaning_is_free_of_walks_and_doors_and_of_nothing_else() {
    use apprentice::language::Program;
    use apprentice::world::World;
    let household = Household::new();
    let stage = Stage::Task { task: TASK.to_owned(), seed: 5 };
    let (scene, task) = household.stage(&stage).unwrap();
    let plan = household.plan(&scene, &task).unwrap();
    let run = |program: &Program| {
        let mut scene = scene.clone();
        for step in &program.steps {
            household.step(&mut scene, &task, step).unwrap();
        }
        scene
    };
    let first = |count: usize| Program { steps: plan.steps[..count].to_vec() };
    let picked = plan.steps.iter().position(|step| step.operator == "PICKUP").unwrap() + 1;
    let fetch = first(picked);
    let check = |meant: &Program, done: &Program, expected: bool| {
        let right = carried_out_as_meant(&household, &task, &scene, meant, &run(done));
        assert_eq!(right, expected, "{meant} / {done}");
    };
    check(&fetch, &fetch, true);
    check(&fetch, &first(1), false);
    check(&plan, &plan, true);
    check(&plan, &fetch, false);
    // Walking on afterwards makes no difference to having fetched it, and all to having walked.
    let walked_on = first(picked + 1);
    check(&fetch, &walked_on, true);
    check(&first(1), &Program { steps: vec![walked_on.steps[picked].clone()] }, false);
    // Missing walks are added, and what is so already is left out.
    let bare = Program { steps: vec![fetch.steps[picked - 1].clone()] };
    let found = aim(&household, &scene, &task, &bare.steps).unwrap();
    check(&fetch, &found.program, true);
    let again = aim(&household, &run(&fetch), &task, &bare.steps).unwrap();
    assert!(again.program.steps.is_empty());
}

#[test]
fn a_run_of_actions_is_what_was_meant_and_nothing_else() {
    use apprentice::language::Program;
    let actions: Program =
        "GOTO Egg; PICKUP Egg; GOTO Pan; GOTO Fridge; OPEN Fridge; PUT Egg Fridge; TOGGLE Faucet"
            .parse()
            .unwrap();
    let check = |meant: &str, after: usize, expected: Option<(u32, u32)>| {
        let meant = meant.parse().unwrap();
        assert_eq!(run_for(&meant, &actions.steps, after), expected, "{meant} after {after}");
    };
    check("PICKUP Egg", 0, Some((1, 2)));
    check("GOTO Egg; PICKUP Egg; GOTO Fridge; PUT Egg Fridge", 0, Some((1, 6)));
    check("PUT Egg Fridge", 2, Some((3, 6)));
    check("PUT Egg Fridge", 0, None);
    check("TOGGLE Faucet", 3, None);
    check("GOTO Pan", 2, Some((3, 3)));
    check("GOTO Pan", 0, None);
    check("GOTO Pan", 7, None);
}
