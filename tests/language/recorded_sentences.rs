//! The recipes on recorded sentences, each for one pick-up, put-down or switch, in scenes in which
//! the right primitive can run. Needs the shared data folder; without it the test is skipped with a
//! message.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use apprentice::grounding::Moment;
use apprentice::language::{Outcome, Program, Step, Utterance};
use apprentice::learning::{Lesson, Mind, Recipe, train};
use apprentice::world::household::{Household, Room, Scene, SceneBuilder, Task};
use apprentice::world::{Stage, World};
use serde::Deserialize;

/// For each of the three primitives.
const SENTENCES: usize = 100;

#[derive(Deserialize)]
struct Row {
    u: String,
    act: String,
    prims: Option<Vec<String>>,
    core: Option<String>,
    suspect: Option<bool>,
}

struct Case {
    utterance: Utterance,
    right: Step,
    scene: Scene,
}

/// Recorded sentences for washing, heating and cooling, with their meaning.
fn lessons(path: &Path, count: usize) -> Vec<Lesson<Scene, Task>> {
    let household = Household::new();
    let file = std::fs::File::open(path).unwrap();
    let rows = BufReader::new(flate2::read::GzDecoder::new(file)).lines();
    let rows = rows.map(|line| serde_json::from_str::<Row>(&line.unwrap()).unwrap());
    let taught = ["CleanObject", "HeatObject", "CoolObject"];
    let kept = rows.filter(|row| row.suspect != Some(true) && taught.contains(&row.act.as_str()));
    let short = kept.filter(|row| row.u.split(' ').count() <= 9);
    let lesson = |(index, row): (usize, Row)| {
        let program = row.prims?.join("; ").parse::<Program>().ok()?;
        let (scene, task) = household.stage(&Stage::Seed { seed: index as u64 }).ok()?;
        let utterance = Utterance::new(&row.u).ok()?;
        let (scene, task) = (Arc::new(scene), Arc::new(task));
        Some(Lesson { utterance, program, scene, task, mentioned: None })
    };
    short.step_by(9).enumerate().filter_map(lesson).take(count).collect()
}

#[derive(Default)]
struct Tally {
    right: usize,
    wrong: usize,
    impossible: usize,
    unsure: usize,
}

/// For each primitive except GOTO, OPEN and CLOSE, sentences that mean it alone, spread evenly.
fn cases(path: &Path) -> Vec<Case> {
    let file = std::fs::File::open(path).unwrap();
    let lines = BufReader::new(flate2::read::GzDecoder::new(file)).lines();
    let mut all: BTreeMap<String, Vec<(String, Step)>> = BTreeMap::new();
    for line in lines {
        let row: Row = serde_json::from_str(&line.unwrap()).unwrap();
        let one = row.prims.filter(|prims| prims.len() == 1).map(|prims| prims[0].clone());
        let Some(step) = row.core.or(one) else { continue };
        let step: Step = step.parse().unwrap();
        let meant = ["PICKUP", "PUT", "TOGGLE"].contains(&step.operator.as_str());
        if row.suspect != Some(true) && meant {
            all.entry(step.operator.to_string()).or_default().push((row.u, step));
        }
    }
    let spread = |of: Vec<(String, Step)>| {
        let every = (of.len() / (SENTENCES + SENTENCES / 10)).max(1);
        let cases = of.into_iter().step_by(every).filter_map(|(text, right)| case(&text, right));
        cases.take(SENTENCES).collect::<Vec<Case>>()
    };
    all.into_values().flat_map(spread).collect()
}

/// A scene in which the step can run, with every other thing that the sentence may mean.
fn case(text: &str, right: Step) -> Option<Case> {
    let utterance = Utterance::new(text).ok()?;
    let mut builder = SceneBuilder::new(Room::Kitchen);
    let table = builder.stand("DiningTable").ok()?;
    let name = |index: usize| right.args[index].as_str();
    match right.operator.as_str() {
        "PICKUP" => {
            let thing = builder.put(name(0), table).or_else(|_| builder.stand(name(0))).ok()?;
            builder.stand_at(thing);
        }
        "PUT" => {
            builder.hold(name(0)).ok()?;
            let place = builder.put(name(1), table).or_else(|_| builder.stand(name(1))).ok()?;
            let _ = builder.open(place);
            builder.stand_at(place);
        }
        _ => {
            let thing = builder.put(name(0), table).or_else(|_| builder.stand(name(0))).ok()?;
            if text.contains("off") {
                let _ = builder.turn_on(thing);
            }
            builder.stand_at(thing);
        }
    }
    let scene = builder.build();
    let runs = Household::new().step(&mut scene.clone(), &task(), &right).is_ok();
    runs.then_some(Case { utterance, right, scene })
}

fn task() -> Task {
    let (_, task) = Household::new().stage(&Stage::Seed { seed: 1 }).unwrap();
    task
}

/// An answer may walk there first.
fn without_walks(program: &Program) -> Vec<&Step> {
    program.steps.iter().filter(|step| step.operator != "GOTO").collect()
}

fn measure(mind: &Mind, cases: &[Case], show: bool) -> BTreeMap<String, Tally> {
    let household = Household::new();
    let task = task();
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    for Case { utterance, right, scene } in cases {
        let moment =
            Moment { domain: &household, scene, task: &task, mentioned: None, handled: &[] };
        let answer = mind.interpret(moment, utterance);
        let tally = tallies.entry(right.operator.to_string()).or_default();
        let verdict = match &answer.outcome {
            Outcome::Understood { program, .. } if without_walks(program) == [right] => {
                tally.right += 1;
                continue;
            }
            Outcome::Understood { program, .. } => {
                tally.wrong += 1;
                format!("wrong: {program}")
            }
            Outcome::Impossible { program, reason, .. } => {
                tally.impossible += 1;
                format!("impossible: {program}: {reason}")
            }
            Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => {
                tally.unsure += 1;
                let near = answer.evidence.nearest.first();
                let near = near.map(|near| format!("{} {:.2}", near.exemplar, near.distance));
                format!("not sure: {}", near.unwrap_or_default())
            }
        };
        if show {
            println!("{right:<28} {verdict:<60} {utterance}");
        }
    }
    tallies
}

#[test]
fn recorded_sentences_are_understood_or_honestly_declined() {
    let data = apprentice_testkit::paths::root().join("../shared/data");
    let path = data.join("alfred_utterances.jsonl.gz");
    if !path.exists() {
        println!("skipped: there are no recorded sentences at {}", path.display());
        return;
    }
    let cases = cases(&path);
    let show = std::env::var_os("SHOW").is_some();
    let household = Household::new();
    for (name, right_min, wrong_max) in [("paper", 0.05, 0.30), ("default", 0.30, 0.20)] {
        let recipe = Recipe::parse(Recipe::builtin(name).unwrap()).unwrap();
        let mind = train(&household, &recipe, &[]).unwrap();
        let tallies = measure(&mind, &cases, show);
        let sum = |part: fn(&Tally) -> usize| tallies.values().map(part).sum::<usize>() as f64;
        let count = cases.len() as f64;
        let share = |part| 100.0 * sum(part) / count;
        println!(
            "{name}: of {count} sentences {:.0} % right, {:.0} % wrong, {:.0} % impossible, {:.0} % \
             not sure (threshold {:.2})",
            share(|t| t.right),
            share(|t| t.wrong),
            share(|t| t.impossible),
            share(|t| t.unsure),
            mind.report().threshold,
        );
        for (operator, tally) in &tallies {
            let Tally { right, wrong, impossible, unsure } = tally;
            println!(
                "  {operator}: {right} right, {wrong} wrong, {impossible} impossible, {unsure} not sure"
            );
        }
        assert!(sum(|t| t.right) >= right_min * count, "{name} understands too little");
        assert!(sum(|t| t.wrong) <= wrong_max * count, "{name} does too much that nobody asked");
    }
}

#[test]
fn many_lessons_leave_the_simple_requests_understood() {
    let data = apprentice_testkit::paths::root().join("../shared/data");
    let path = data.join("alfred_utterances.jsonl.gz");
    if !path.exists() {
        println!("skipped: there are no recorded sentences at {}", path.display());
        return;
    }
    let cases = cases(&path);
    let lessons = lessons(&path, 56);
    assert_eq!(lessons.len(), 56);
    let household = Household::new();
    for name in ["paper", "default"] {
        let recipe = Recipe::parse(Recipe::builtin(name).unwrap()).unwrap();
        let start = Instant::now();
        let base = train(&household, &recipe, &[]).unwrap();
        let base_ms = start.elapsed().as_secs_f64() * 1e3;
        let start = Instant::now();
        let mind = train(&household, &recipe, &lessons).unwrap();
        let train_ms = start.elapsed().as_secs_f64() * 1e3;
        let right =
            |tallies: BTreeMap<String, Tally>| tallies.values().map(|t| t.right).sum::<usize>();
        let before = right(measure(&base, &cases, false));
        let start = Instant::now();
        let after = measure(&mind, &cases, false);
        let interpret_us = start.elapsed().as_secs_f64() * 1e6 / cases.len() as f64;
        let wrong = after.values().map(|t| t.wrong).sum::<usize>();
        let after = right(after);
        println!(
            "{name}: base mind in {base_ms:.0} ms, with 56 lessons in {train_ms:.0} ms, one answer \
             in {interpret_us:.0} us; of {} sentences {before} right before and {after} after the \
             lessons, {wrong} wrong; {:?}",
            cases.len(),
            mind.report()
        );
        let half = before / 2;
        assert!(after > half, "{name}: lessons make simple requests fail: {before} to {after}");
    }
}
