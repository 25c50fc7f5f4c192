//! The same lessons give the same mind, to the bit: in any build, with any kernel, on any number of
//! threads, and after a life in the log. A pinned digest that changes is a decision: say why in the
//! commit, and in the changelog, since old logs then name minds that training no longer gives.

use std::sync::Arc;
use std::thread;

use apprentice::ids::Digest;
use apprentice::language::{Program, Utterance};
use apprentice::learning::{Lesson, Mind, Recipe, train};
use apprentice::numerics::Kernel;
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Domain, Stage};

const WASH: &str = "GOTO SinkBasin; PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug";
const COOL: &str =
    "GOTO Fridge; OPEN Fridge; PUT Mug Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Mug";

/// What somebody taught, in order.
fn history(lessons: &[(&str, &str)]) -> Vec<Lesson<Scene, Task>> {
    let task = "free kitchen".to_owned();
    let (scene, task) = Household::new().stage(&Stage::Task { task, seed: 11 }).unwrap();
    let (scene, task) = (Arc::new(scene), Arc::new(task));
    let lesson = |(utterance, program): &(&str, &str)| Lesson {
        utterance: Utterance::new(utterance).unwrap(),
        program: program.parse::<Program>().unwrap(),
        scene: scene.clone(),
        task: task.clone(),
        mentioned: None,
    };
    lessons.iter().map(lesson).collect()
}

fn histories() -> [(&'static str, Vec<Lesson<Scene, Task>>); 3] {
    [
        ("nothing", history(&[])),
        ("one", history(&[("wash the coffee mug", WASH)])),
        (
            "four",
            history(&[
                ("wash the coffee mug", WASH),
                ("chill the mug", COOL),
                ("rinse off the mug, please", WASH),
                ("cool it down", COOL),
            ]),
        ),
    ]
}

fn mind(recipe: &str, lessons: &[Lesson<Scene, Task>]) -> Mind {
    let recipe = Recipe::parse(Recipe::builtin(recipe).unwrap()).unwrap();
    train(&Household::new(), &recipe, lessons).unwrap()
}

fn digests(recipe: &str) -> Vec<String> {
    let digest = |(name, lessons): &(&str, Vec<_>)| {
        format!("{recipe} {name} {}", mind(recipe, lessons).digest().short())
    };
    histories().iter().map(digest).collect()
}

#[test]
fn trained_minds_have_their_pinned_digests() {
    let found: Vec<String> = ["paper", "default"].iter().flat_map(|r| digests(r)).collect();
    let pinned = include_str!("determinism_digests.txt");
    assert_eq!(found.join("\n"), pinned.trim(), "see the head of this file before changing a pin");
}

#[test]
fn kernels_and_threads_do_not_change_a_bit() {
    let expected = digests("paper");
    for kernel in Kernel::available() {
        Kernel::force(Some(kernel));
        assert_eq!(digests("paper"), expected, "{kernel:?}");
    }
    Kernel::force(None);
    for threads in [2, 8] {
        let trained: Vec<_> = thread::scope(|scope| {
            let started: Vec<_> =
                (0..threads).map(|_| scope.spawn(|| digests("default"))).collect();
            started.into_iter().map(|one| one.join().unwrap()).collect()
        });
        assert!(trained.windows(2).all(|pair| pair[0] == pair[1]), "{threads} threads");
    }
}

#[test]
fn a_mind_is_its_bytes_and_never_another_ones() {
    let household = Household::new();
    let recipe = Recipe::parse(Recipe::builtin("default").unwrap()).unwrap();
    for (name, lessons) in histories() {
        let trained = mind("default", &lessons);
        let bytes = trained.to_bytes();
        assert_eq!(Digest::of(&bytes), trained.digest(), "{name}");
        let read = Mind::from_bytes(&household, &recipe, &bytes).unwrap();
        assert_eq!(read.digest(), trained.digest(), "{name}");
        for cut in [0, 1, bytes.len() / 2, bytes.len() - 1] {
            assert!(Mind::from_bytes(&household, &recipe, &bytes[..cut]).is_err(), "{name} {cut}");
        }
    }
}

#[test]
fn what_was_forgotten_leaves_no_trace() {
    let [_, _, (_, mut four)] = histories();
    let forgotten = four.remove(1);
    let never = history(&[
        ("wash the coffee mug", WASH),
        ("rinse off the mug, please", WASH),
        ("cool it down", COOL),
    ]);
    for recipe in ["paper", "default"] {
        assert_eq!(mind(recipe, &four).digest(), mind(recipe, &never).digest(), "{recipe}");
    }
    assert_eq!(forgotten.utterance.as_str(), "chill the mug");
}
