//! The time from the last lesson to a mind that can answer, and the time of one answer. Compare the
//! rows of one run; `docs/performance.md` has the table.

mod support;

use std::hint::black_box;
use std::time::Duration;

use apprentice::grounding::Moment;
use apprentice::language::Utterance;
use apprentice::learning::{Recipe, train};
use apprentice::world::household::Household;
use apprentice::world::{Stage, World};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

/// Seeds of the household. The other examples are lessons.
const SEEDS: usize = 44;

fn training(criterion: &mut Criterion) {
    let domain = Household::new();
    let mut group = criterion.benchmark_group("train");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for name in Recipe::BUILTIN {
        let recipe = Recipe::parse(Recipe::builtin(name).expect("it ships")).expect("it parses");
        for examples in [SEEDS, 100, 200, 500] {
            let lessons = support::lessons(&domain, examples - SEEDS);
            group.bench_with_input(BenchmarkId::new(name, examples), &lessons, |bench, lessons| {
                bench.iter(|| train(&domain, &recipe, black_box(lessons)).expect("it trains"));
            });
        }
    }
    group.finish();
}

fn answering(criterion: &mut Criterion) {
    let domain = Household::new();
    let task = "free kitchen".to_owned();
    let (scene, task) = domain.stage(&Stage::Task { task, seed: 1 }).expect("a free kitchen");
    let utterance = Utterance::new("pick up the red mug from the table").expect("words");
    let mut group = criterion.benchmark_group("interpret");
    for name in Recipe::BUILTIN {
        let recipe = Recipe::parse(Recipe::builtin(name).expect("it ships")).expect("it parses");
        let mind = train(&domain, &recipe, &support::lessons(&domain, 56)).expect("it trains");
        group.bench_function(BenchmarkId::new(name, 100), |bench| {
            bench.iter(|| {
                let moment = Moment {
                    domain: &domain,
                    scene: &scene,
                    task: &task,
                    mentioned: None,
                    handled: &[],
                };
                mind.interpret(moment, black_box(&utterance))
            });
        });
    }
    group.finish();
}

criterion_group!(benches, training, answering);
criterion_main!(benches);
