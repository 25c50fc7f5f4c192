//! Talks to a running service: starts a task, says one sentence and prints the answer.
//!
//! `cargo run --package apprentice-client --example talk -- tcp://127.0.0.1:7117`

use std::error::Error;

use apprentice_client::{Client, Told};
use apprentice_core::ids::UserId;
use apprentice_core::language::Outcome;
use apprentice_core::world::Stage;

/// The answer to one sentence, from the service at `endpoint`.
pub fn answer(endpoint: &str, sentence: &str) -> Result<String, Box<dyn Error>> {
    let client = Client::connect(endpoint, UserId::new("ada")?)?;
    client.start(Stage::Task { task: "clean Mug CounterTop".to_owned(), seed: 7 })?;
    let reply = client.say(sentence)?;
    client.done()?;
    let answers = reply.told.iter().filter_map(|told| match told {
        Told::Answered { answer, .. } => Some(&answer.outcome),
        _ => None,
    });
    let answers = answers.map(|outcome| match outcome {
        Outcome::Understood { program, .. } => format!("done: {program}"),
        Outcome::Impossible { reason, .. } => format!("impossible: {reason}"),
        Outcome::NotSure => "not sure".to_owned(),
        Outcome::Asked { question } => question.text.clone(),
        Outcome::Told { text } => text.clone(),
    });
    Ok(answers.collect())
}

pub fn main() -> Result<(), Box<dyn Error>> {
    let endpoint = std::env::args().nth(1).ok_or("name an endpoint: tcp://127.0.0.1:7117")?;
    let sentence = "go to the mug";
    println!("{sentence}: {}", answer(&endpoint, sentence)?);
    Ok(())
}
