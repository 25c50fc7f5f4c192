//! The paper's baseline: a core grammar over the seeds answers first, otherwise a neural
//! sequence-to-sequence model (section 4 of the paper; Jia and Liang 2016). Each is a recipe.

use std::sync::Arc;

use apprentice::grounding::Moment;
use apprentice::language::{Answerer, Exemplar, Outcome, Program, Utterance};
use apprentice::learning::{Lesson, Mind, Recipe, train};
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Words, World};
use apprentice_study::known_minds::stage;

fn recipe(name: &str) -> Recipe {
    Recipe::parse(Recipe::builtin(name).unwrap()).unwrap()
}

/// A person in a kitchen, before and after lessons.
struct Talk {
    household: Household,
    recipe: Recipe,
    scene: Arc<Scene>,
    task: Arc<Task>,
    lessons: Vec<Lesson<Scene, Task>>,
    mind: Mind,
}

impl Talk {
    fn new(name: &str) -> Talk {
        let household = Household::new();
        let (scene, task) = household.stage(&stage()).unwrap();
        let recipe = recipe(name);
        let mind = train(&household, &recipe, &[]).unwrap();
        let (scene, task) = (Arc::new(scene), Arc::new(task));
        Talk { household, recipe, scene, task, lessons: Vec::new(), mind }
    }

    fn teach(&mut self, text: &str, program: &str) {
        self.lessons.push(Lesson {
            utterance: Utterance::new(text).unwrap(),
            program: program.parse::<Program>().unwrap(),
            scene: self.scene.clone(),
            task: self.task.clone(),
            mentioned: None,
        });
        self.mind = train(&self.household, &self.recipe, &self.lessons).unwrap();
    }

    /// What was understood, even if it cannot be done here, and which part understood it.
    fn ask(&self, text: &str) -> (String, Vec<Answerer>) {
        let moment = Moment {
            domain: &self.household,
            scene: &self.scene,
            task: &self.task,
            mentioned: None,
            handled: &[],
        };
        let answer = self.mind.interpret(moment, &Utterance::new(text).unwrap());
        let said = match answer.outcome {
            Outcome::Understood { program, .. } | Outcome::Impossible { program, .. } => {
                program.to_string()
            }
            Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => "?".to_owned(),
        };
        (said, answer.evidence.answered_by)
    }
}

/// The lifted forms with names in their slots, and the program with the same names.
fn said(exemplar: &Exemplar) -> (String, String) {
    let names = [("mug", "Mug"), ("fridge", "Fridge"), ("microwave", "Microwave")];
    let mut text = exemplar.utterance.to_string();
    let mut program = exemplar.program.to_string();
    for (place, (name, kind)) in names.iter().enumerate() {
        text = text.replacen("<obj>", name, 1);
        program = program.replace(&format!("<obj:{}>", place + 1), kind);
    }
    (text, program)
}

const WASH: &str = "GOTO SinkBasin; PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug";

#[test]
fn the_grammar_answers_every_seed_and_its_closed_class_variants() {
    let talk = Talk::new("grammar");
    let by = vec![Answerer::Grammar];
    for seed in &talk.household.seeds().exemplars {
        let (text, program) = said(seed);
        if text.starts_with("switch ") {
            // A switch is a thing too, and the paper's abstraction reads it as one. Every training
            // requires that the grammar has the seed.
            continue;
        }
        assert_eq!(talk.ask(&text), (program.clone(), by.clone()), "{text}");
        let mut politely = format!("please {text}");
        for name in ["mug", "fridge", "microwave"] {
            politely = politely.replace(&format!("the {name}"), &format!("a {name}"));
        }
        assert_eq!(talk.ask(&politely), (program, by.clone()), "{politely}");
    }
    let check = |text: &str, program: &str| {
        assert_eq!(talk.ask(text), (program.to_owned(), by.clone()), "{text}");
    };
    check("walk over to the mug beside the fridge", "GOTO Mug");
    check("put the mug into the fridge by the microwave", "PUT Mug Fridge");
    check("put the mug that is on the fridge in the microwave", "PUT Mug Microwave");
    check("get the mug out of the microwave on top of the fridge", "PICKUP Mug");
    check("turn the microwave next to the fridge off", "TOGGLE Microwave");
}

#[test]
fn the_grammar_never_answers_by_guess() {
    let talk = Talk::new("grammar");
    let household = &talk.household;
    let mut answered = 0;
    for variant in &household.seeds().variants {
        let (text, program) = said(variant);
        let (found, _) = talk.ask(&text);
        assert!(found == program || found == "?", "{text}: {found}, not {program}");
        answered += usize::from(found == program);
    }
    let all = household.seeds().variants.len();
    println!("{answered} of {all} held-out variants are in the grammar");
    assert!(answered * 2 > all, "{answered} of {all}");
    for unknown in &household.seeds().unknown {
        let text = unknown.to_string().replacen("<obj>", "mug", 1).replacen("<obj>", "fridge", 1);
        assert_eq!(talk.ask(&text).0, "?", "{text}");
    }
}

#[test]
fn two_requests_in_one_are_read_clause_by_clause() {
    let talk = Talk::new("grammar");
    let (said, by) = talk.ask("go to the mug and pick it up");
    assert_eq!(said, "GOTO Mug; PICKUP Mug");
    assert_eq!(by, [Answerer::Grammar, Answerer::Grammar]);
}

#[test]
fn the_model_alone_writes_every_seed_and_always_answers() {
    let talk = Talk::new("seq2seq");
    for seed in &talk.household.seeds().exemplars {
        let (text, program) = said(seed);
        if !text.starts_with("switch ") {
            assert_eq!(talk.ask(&text), (program, vec![Answerer::Seq2seq]), "{text}");
        }
    }
    for unknown in &talk.household.seeds().unknown {
        if unknown.slots() > 0 {
            let text = unknown.to_string();
            let text = text.replacen("<obj>", "mug", 1).replacen("<obj>", "fridge", 1);
            assert_ne!(talk.ask(&text).0, "?", "{text}");
        }
    }
    // The paper's anecdote: it reads an untaught request as a primitive.
    let (program, _) = talk.ask("wash the coffee mug");
    println!("wash the coffee mug: {program}");
    assert!(program.ends_with(" Mug") && !program.contains(';'), "{program}");
}

#[test]
fn the_grammar_answers_first_and_the_answer_says_which_did() {
    let mut talk = Talk::new("seq2seq-grammar");
    for seed in &talk.household.seeds().exemplars {
        let (text, program) = said(seed);
        if !text.starts_with("switch ") {
            assert_eq!(talk.ask(&text), (program, vec![Answerer::Grammar]), "{text}");
        }
    }
    assert_eq!(talk.ask("wash the coffee mug").1, [Answerer::Seq2seq]);
    talk.teach("wash the coffee mug", WASH);
    assert_eq!(talk.ask("wash the coffee mug"), (WASH.to_owned(), vec![Answerer::Seq2seq]));
    let (said, by) = talk.ask("go to the sink and wash the mug");
    assert_eq!(said, format!("GOTO SinkBasin; {WASH}"));
    assert_eq!(by, [Answerer::Grammar, Answerer::Seq2seq]);
}

#[test]
fn one_lesson_is_recalled_for_other_things_and_rebuilt_to_the_bit() {
    for name in ["seq2seq", "seq2seq-grammar"] {
        let mut talk = Talk::new(name);
        let chill = "GOTO Fridge; OPEN Fridge; PUT Mug Fridge; CLOSE Fridge";
        for (text, program) in [("wash the coffee mug", WASH), ("chill the mug", chill)] {
            talk.teach(text, program);
            assert_eq!(talk.ask(text).0, program, "{name}");
            let other = text.replace("coffee mug", "mug").replace("mug", "apple");
            assert_eq!(talk.ask(&other).0, program.replace("Mug", "Apple"), "{name}");
        }
        let bytes = talk.mind.to_bytes();
        println!("{name}: {} bytes", bytes.len());
        let read = Mind::from_bytes(&talk.household, &talk.recipe, &bytes).unwrap();
        assert_eq!(read.digest(), talk.mind.digest(), "{name}");
        let lessons = talk.lessons.clone();
        let again = train(&talk.household, &talk.recipe, &lessons).unwrap();
        assert_eq!(again.digest(), talk.mind.digest(), "{name}");
    }
}

#[test]
fn a_lesson_does_not_change_what_the_grammar_says() {
    let mut talk = Talk::new("grammar");
    assert_eq!(talk.ask("wash the coffee mug").0, "?");
    let before = talk.mind.digest();
    talk.teach("wash the coffee mug", WASH);
    assert_eq!(talk.ask("wash the coffee mug").0, "?");
    assert_ne!(talk.mind.digest(), before, "the lesson is remembered all the same");
    assert_eq!(talk.ask("go to the mug").0, "GOTO Mug");
}
