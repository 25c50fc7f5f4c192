use std::sync::Arc;

use super::*;
use crate::grounding::Moment;
use crate::grounding::bench::{Bench, Scene, say};
use crate::language::{Answer, Outcome, Symbol};
use crate::numerics::Rng;
use crate::world::Words;

type BenchLesson = Lesson<Scene, ()>;

fn recipe(name: &str) -> Recipe {
    Recipe::parse(Recipe::builtin(name).unwrap()).unwrap()
}

/// `tiny` with other lines.
fn tiny_with(changes: &[(&str, &str)]) -> Recipe {
    let mut text = Recipe::builtin("tiny").unwrap().to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    Recipe::parse(&text).unwrap()
}

fn lesson(utterance: &str, program: &str, scene: &Scene) -> BenchLesson {
    Lesson {
        utterance: say(utterance),
        program: program.parse().unwrap(),
        scene: Arc::new(scene.clone()),
        task: Arc::new(()),
        mentioned: None,
    }
}

fn ask(mind: &Mind, scene: &Scene, utterance: &str) -> Answer {
    let bench = Bench::new();
    mind.interpret(
        Moment { domain: &bench, scene, task: &(), mentioned: None, handled: &[] },
        &say(utterance),
    )
}

fn understood(answer: &Answer) -> String {
    match &answer.outcome {
        Outcome::Understood { program, .. } => program.to_string(),
        other => format!("{other:?}"),
    }
}

fn bench_scene() -> Scene {
    Scene::with("Box ToolBox Knife Table Lamp Block")
}

#[test]
fn a_lesson_is_lifted_by_what_it_mentions() {
    let bench = Bench::new();
    let check = |recipe: &Recipe, lesson: BenchLesson, utterance: &str, program: &str| {
        let lifted = lift(&bench, recipe, &lesson);
        assert_eq!(lifted.utterance.to_string(), utterance);
        assert_eq!(lifted.program.to_string(), program);
    };
    let scene = bench_scene();
    let tiny = tiny_with(&[]);
    check(
        &tiny,
        lesson("stow the knife", "GO Box; TAKE Knife; PUT Knife Box", &scene),
        "stow the <thing>",
        "GO Box; TAKE <thing:1>; PUT <thing:1> Box",
    );
    check(
        &tiny,
        lesson("in the box stow the knife", "TAKE Knife; PUT Knife Box", &scene),
        "in the <thing> stow the <thing>",
        "TAKE <thing:2>; PUT <thing:2> <thing:1>",
    );
    // "block" is first a Block here, but the program acts on the Brick.
    check(
        &tiny,
        lesson("nudge the block", "GO Brick", &scene),
        "nudge the <thing>",
        "GO <thing:1>",
    );
    let holding = scene.clone().holding("Knife");
    let on_table = |text| lesson(text, "PUT Knife Table", &holding);
    check(&tiny, on_table("stow it"), "stow <thing>", "PUT <thing:1> Table");
    check(&tiny, on_table("tidy up"), "tidy up", "PUT Knife Table");
    let held = tiny_with(&[("held = false", "held = true")]);
    check(&held, on_table("tidy up"), "tidy up", "PUT <held> Table");
    let mut spoken = lesson("stow it", "TAKE Knife", &scene);
    spoken.mentioned = Some(Symbol::new("Knife"));
    check(&tiny, spoken, "stow <thing>", "TAKE <thing:1>");
}

#[test]
fn a_place_is_lifted_away_only_when_the_program_does_not_need_it() {
    let bench = Bench::new();
    let recipe = tiny_with(&[("locations = false", "locations = true")]);
    let scene = bench_scene();
    let check = |program: &str, utterance: &str, lifted_program: &str| {
        let lifted =
            lift(&bench, &recipe, &lesson("fetch the knife from the box", program, &scene));
        assert_eq!(lifted.utterance.to_string(), utterance);
        assert_eq!(lifted.program.to_string(), lifted_program);
    };
    check("TAKE Knife", "fetch the <thing>", "TAKE <thing:1>");
    check(
        "GO Box; TAKE Knife",
        "fetch the <thing> from the <thing>",
        "GO <thing:2>; TAKE <thing:1>",
    );
    let mind =
        train(&bench, &recipe, &[lesson("fetch the knife from the box", "TAKE Knife", &scene)]);
    let mind = mind.unwrap();
    for text in ["fetch the knife", "fetch the knife from the lamp", "fetch the knife from the box"]
    {
        assert_eq!(understood(&ask(&mind, &scene, text)), "TAKE Knife", "{text}");
    }
}

#[test]
fn one_lesson_is_enough_for_the_same_and_other_objects() {
    let bench = Bench::new();
    let recipe = recipe("tiny");
    let scene = bench_scene();
    let base = train(&bench, &recipe, &[]).unwrap();
    assert_eq!(ask(&base, &scene, "frobnicate the knife").outcome, Outcome::NotSure);
    let lessons = [lesson("frobnicate the knife", "TAKE Knife; PUT Knife Box", &scene)];
    let mind = train(&bench, &recipe, &lessons).unwrap();
    let check = |text, program: &str| assert_eq!(understood(&ask(&mind, &scene, text)), program);
    check("frobnicate the knife", "TAKE Knife; PUT Knife Box");
    check("Frobnicate the tool box.", "TAKE ToolBox; PUT ToolBox Box");
    let forbidden = ask(&mind, &scene, "frobnicate the lamp").outcome;
    assert!(matches!(forbidden, Outcome::Impossible { step: 0, .. }), "{forbidden:?}");
    assert_ne!(mind.digest(), base.digest());
    assert_eq!(mind.exemplars().last().unwrap().1, Some(0));
    assert_eq!(mind.report().exemplars, base.report().exemplars + 1);
}

/// Utterances of made-up verbs, particles and known names; programs that run from the scene.
fn random_lessons(rng: &mut Rng, count: usize, scene: &Scene) -> Vec<BenchLesson> {
    let verbs = ["frobnicate", "rinse", "warm", "put", "turn", "tidy", "fetch", "take"];
    let tails = ["", "up", "down", "now", "with care", "and stop", "please", "for me", "it"];
    let movable = ["knife", "box", "tool box", "block"];
    let types = ["Knife", "Box", "ToolBox", "Block"];
    let mut lessons: Vec<BenchLesson> = Vec::new();
    while lessons.len() < count {
        let which = rng.below(4);
        let verb = verbs[rng.below(verbs.len())];
        let filler = ["", "all of", "quickly", "over"][rng.below(4)];
        let tail = tails[rng.below(tails.len())];
        let name = movable[which];
        let utterance = format!("{verb} {filler} the {name} {tail}");
        let thing = types[which];
        let other = types[(which + 1 + rng.below(3)) % 4];
        let program = [
            format!("TAKE {thing}"),
            format!("TAKE {thing}; PUT {thing} Table"),
            format!("SWITCH Lamp; TAKE {thing}"),
            format!("TAKE {other}; PUT {other} Table; TAKE {thing}"),
            format!("GO {thing}; GO Lamp"),
        ][rng.below(5)]
        .clone();
        lessons.push(lesson(&utterance, &program, scene));
    }
    lessons
}

#[test]
fn what_was_taught_is_understood_at_once_whatever_the_words() {
    let seed = 17;
    println!("seed {seed}");
    let mut rng = Rng::from_u64(seed);
    let bench = Bench::new();
    let scene = bench_scene();
    let recipe = recipe("tiny");
    for round in 0..12 {
        let mut mind = train(&bench, &recipe, &[]).unwrap();
        let mut lessons: Vec<BenchLesson> = Vec::new();
        for lesson in random_lessons(&mut rng, 6, &scene) {
            // Two programs for the same words cannot both be recalled: a session asks first.
            let new = lift(&bench, &recipe, &lesson);
            let known = mind.exemplars();
            let mut known = known.iter().map(|(old, _)| old);
            if known.any(|old| old.utterance == new.utterance && old.program != new.program) {
                continue;
            }
            lessons.push(lesson);
            mind = train(&bench, &recipe, &lessons).unwrap();
            for taught in &lessons {
                let found = understood(&ask(&mind, &scene, taught.utterance.as_str()));
                assert_eq!(
                    found,
                    taught.program.to_string(),
                    "round {round}: {}",
                    taught.utterance
                );
            }
        }
        for seed in &bench.seeds().exemplars {
            let mine = mind.exemplars().iter().any(|(exemplar, _)| exemplar == seed);
            assert!(mine, "{}", seed.utterance);
        }
    }
}

#[test]
fn a_mind_is_a_function_of_recipe_and_lessons_alone() {
    let bench = Bench::new();
    let recipe = recipe("tiny");
    let scene = bench_scene();
    let mut rng = Rng::from_u64(4);
    let lessons = random_lessons(&mut rng, 5, &scene);
    let one = train(&bench, &recipe, &lessons).unwrap();
    let two = train(&bench, &recipe, &lessons).unwrap();
    assert_eq!(one.digest(), two.digest());
    assert_eq!(one.to_bytes(), two.to_bytes());
    let fewer = train(&bench, &recipe, &lessons[..4]).unwrap();
    assert_ne!(one.digest(), fewer.digest());
    let forgotten = train(&bench, &recipe, &lessons[1..]).unwrap();
    assert_ne!(forgotten.digest(), fewer.digest());
    let salted = tiny_with(&[("embedding = 16", "embedding = 16\nsalt = \"other\"")]);
    assert_ne!(train(&bench, &salted, &lessons).unwrap().digest(), one.digest());
}

#[test]
fn a_stored_mind_is_the_same_mind() {
    let bench = Bench::new();
    let recipe = recipe("tiny");
    let scene = bench_scene();
    let lessons = random_lessons(&mut Rng::from_u64(9), 4, &scene);
    for lessons in [&lessons[..0], &lessons[..]] {
        let mind = train(&bench, &recipe, lessons).unwrap();
        let read = Mind::from_bytes(&bench, &recipe, &mind.to_bytes()).unwrap();
        assert_eq!(read.digest(), mind.digest());
        assert_eq!(read.report(), mind.report());
        assert_eq!(read.exemplars(), mind.exemplars());
        for text in ["take the box", "juggle the lamp", "rinse the knife", "put it on the table"] {
            assert_eq!(ask(&read, &scene, text), ask(&mind, &scene, text), "{text}");
        }
    }
}

#[test]
fn bytes_that_are_no_mind_are_refused_with_the_reason() {
    let seed = 3;
    println!("seed {seed}");
    let mut rng = Rng::from_u64(seed);
    let bench = Bench::new();
    let recipe = recipe("tiny");
    let lessons = random_lessons(&mut rng, 2, &bench_scene());
    let mind = train(&bench, &recipe, &lessons).unwrap();
    let bytes = mind.to_bytes();
    let read = |bytes: &[u8]| Mind::from_bytes(&bench, &recipe, bytes);
    for _ in 0..400 {
        let mut damaged = bytes.clone();
        let at = rng.below(damaged.len());
        damaged[at] ^= 1 << rng.below(8);
        // A damaged number may still make a mind, but never the mind of that digest.
        if let Ok(other) = read(&damaged) {
            assert_eq!(other.digest(), crate::ids::Digest::of(&damaged));
        }
        assert!(read(&bytes[..at]).is_err());
        let noise: Vec<u8> = (0..at % 300).map(|_| rng.next_u64() as u8).collect();
        assert!(read(&noise).is_err());
    }
    let longer = [bytes.clone(), vec![0]].concat();
    assert!(read(&longer).is_err());
    let other = tiny_with(&[("spelling = false", "spelling = true")]);
    let error = Mind::from_bytes(&bench, &other, &bytes).unwrap_err().to_string();
    assert!(error.contains("trained with the recipe"), "{error}");
}

#[test]
fn a_seed_that_lost_its_program_is_named_with_what_swallowed_it() {
    // Two seeds of one form cannot both keep their programs.
    let bench = Bench::with_seeds(&[
        ("take the <thing>", "TAKE <thing:1>"),
        ("take the <thing>", "GO <thing:1>"),
    ]);
    let error = train(&bench, &recipe("tiny"), &[]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the seed \"take the <thing>\" would no longer mean GO <thing:1>: the seed \"take the \
         <thing>\" makes it TAKE <thing:1>; forget that lesson or say it in other words"
    );
}
