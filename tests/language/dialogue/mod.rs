//! What is said beside requests ([docs/dialogue.md]): questions, answers to the robot's questions, and
//! "that was wrong". No act ever follows from a question.
//!
//! [docs/dialogue.md]: ../../../docs/dialogue.md

mod questions;
mod which;
mod wrong;

use std::sync::{Arc, LazyLock};

use apprentice::client::{Command, Told};
use apprentice::language::Outcome;
use apprentice::learning::Recipe;
use apprentice::store::open_memory;
use apprentice::world::Stage;
use apprentice::world::household::Household;
use apprentice_testkit::diary::Diary;

const KITCHEN: &str = include_str!("../../transcripts/kitchen.toml");
const LIVING_ROOM: &str = include_str!("../../transcripts/living_room.toml");

/// One person's conversation with the recipe `default-3`.
struct Talk(Diary<Household>);

impl Talk {
    /// - `scene`: a scene file's text.
    fn new(scene: &str, task: &str) -> Talk {
        Talk::with("default-3", scene, task)
    }

    fn with(recipe: &str, scene: &str, task: &str) -> Talk {
        static HOUSEHOLD: LazyLock<Arc<Household>> = LazyLock::new(|| Arc::new(Household::new()));
        let recipe = Recipe::builtin(recipe).unwrap();
        let mut talk = Talk(Diary::new(&*HOUSEHOLD, &open_memory(), "ada", recipe));
        talk.start(scene, task);
        talk
    }

    fn start(&mut self, scene: &str, task: &str) {
        let stage = Stage::Scene { scene: scene.to_owned(), task: task.to_owned() };
        self.0.accept(&Command::StartEpisode { stage });
    }

    /// What came of an utterance: a program, `? `, `! reason`, `~ question`, `i answer`, or `marked`.
    fn say(&mut self, utterance: &str) -> String {
        let reply = self.0.say(utterance);
        match &reply.told[0] {
            Told::Answered { answer, .. } => match &answer.outcome {
                Outcome::Understood { program, .. } => program.to_string(),
                Outcome::Impossible { reason, .. } => format!("! {reason}"),
                Outcome::NotSure => "?".to_owned(),
                Outcome::Asked { question } => format!("~ {}", question.text),
                Outcome::Told { text } => format!("i {text}"),
            },
            Told::MarkedWrong { .. } => "marked".to_owned(),
            other => panic!("{utterance:?} led to {other:?}"),
        }
    }

    fn actions(&self) -> usize {
        self.0.session.status().actions.len()
    }

    /// The utterances that may be taught.
    fn to_teach(&self) -> Vec<String> {
        self.0.session.status().to_teach.into_iter().map(|said| said.utterance).collect()
    }
}

/// Says each line to one person, and reports all that differ together.
fn check(talk: &mut Talk, lines: &[(&str, &str)]) {
    let wrong: Vec<String> = lines
        .iter()
        .filter_map(|(said, expected)| {
            let found = talk.say(said);
            (found != *expected).then(|| format!("{said:?}: expected {expected}, found {found}"))
        })
        .collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), lines.len(), wrong.join("\n"));
}
