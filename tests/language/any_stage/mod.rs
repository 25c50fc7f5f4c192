//! Any command in any phase, on any stage: what is proposed can be applied, and the records fold
//! again to the same state. The tests use the household, with random scenes and tasks of every
//! kind.
//!
//! - `APPRENTICE_SEED`: seed of the first person, random and printed by default. The next person
//!   has one more.
//! - `APPRENTICE_PEOPLE`: 10,000 by default.

mod person;
mod scenes;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use apprentice::client::{Command, RejectionCode};
use apprentice::learning::{Recipe, train};
use apprentice::world::Stage;
use apprentice::world::household::Household;
use apprentice_testkit::chance;
use person::{Counts, House, Person, live};

fn house() -> House {
    let domain = Arc::new(Household::new());
    let recipe_text = Recipe::builtin("default").unwrap().to_owned();
    let recipe = Recipe::parse(&recipe_text).unwrap();
    let base = Arc::new(train(&*domain, &recipe, &[]).unwrap());
    House { domain, recipe_text, base }
}

#[test]
fn whatever_is_asked_on_any_stage_its_records_fold_again() {
    let (seed, people) = (chance::seed(), chance::number("APPRENTICE_PEOPLE", 10_000));
    let house = house();
    let next = AtomicU64::new(0);
    let work = || {
        let mut counts = Counts::default();
        loop {
            let person = next.fetch_add(1, Ordering::Relaxed);
            if person >= people {
                return counts;
            }
            let theirs = seed.wrapping_add(person);
            let lived = catch_unwind(AssertUnwindSafe(|| live(&house, theirs, &mut counts)));
            assert!(lived.is_ok(), "again with APPRENTICE_SEED={theirs} APPRENTICE_PEOPLE=1");
        }
    };
    let threads = thread::available_parallelism().map_or(2, usize::from);
    let counts = thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let done = workers.into_iter().map(|worker| worker.join().expect("a person failed"));
        done.fold(Counts::default(), Counts::plus)
    });
    println!("{counts:#?}");
    // With fewer people the rare cases may not happen.
    if people >= 1_000 {
        counts.assert_that_all_was_met();
    }
}

#[test]
fn a_stage_whose_goal_holds_is_refused_in_one_sentence() {
    let scene = "room = \"kitchen\"\n[[thing]]\ntype = \"CounterTop\"\n\
                 [[thing]]\ntype = \"Mug\"\non = \"CounterTop\"\n";
    let house = house();
    for (task, refused) in [
        (
            "place Mug CounterTop",
            Some(
                "the goal is already reached: put a mug on the counter top; \
            change the scene or name another task",
            ),
        ),
        // Everything must happen at least once.
        ("free", None),
    ] {
        let stage = Stage::Scene { scene: scene.to_owned(), task: task.to_owned() };
        let mut person = Person::new(&house, 1, &mut Counts::default());
        let started = person.give(&Command::StartEpisode { stage }.into(), &mut Counts::default());
        match (started, refused) {
            (Ok(_), None) => {}
            (Err(rejection), Some(sentence)) => {
                assert_eq!(rejection.code(), RejectionCode::BadStage);
                assert_eq!(rejection.to_string(), sentence);
            }
            (started, _) => panic!("{task}: {started:?}"),
        }
    }
}
