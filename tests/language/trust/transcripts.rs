//! Conversations with the answers that a person would expect, played on a real service.

use std::path::PathBuf;
use std::sync::Arc;

use apprentice::learning::Recipe;
use apprentice::service::{Config, Data, Service};
use apprentice::world::household::Household;
use apprentice_cli::TranscriptFile;

use super::talk::RECIPE;

fn files() -> Vec<PathBuf> {
    let folder = apprentice_testkit::paths::root().join("tests/language/trust/transcripts");
    let entries = std::fs::read_dir(&folder).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|ending| ending == "txt"));
    files.sort();
    files
}

#[test]
fn every_conversation_gets_the_answers_that_one_would_expect() {
    let files = files();
    assert_eq!(files.len(), 8, "the conversations that were given");
    let recipe = Recipe::builtin(RECIPE).unwrap_or_else(|| panic!("there is no recipe {RECIPE}"));
    let mut config = Config::new(Arc::new(Household::new()), Data::Memory);
    config.recipe_text = recipe.to_owned();
    let service = Service::start(config).unwrap();
    let mut wrong = Vec::new();
    for (number, file) in files.iter().enumerate() {
        let story = TranscriptFile::read(file).unwrap();
        assert_eq!(story.recipe_text().unwrap(), recipe, "{} names {RECIPE}", file.display());
        let client = service.connect(story.person(number).unwrap()).unwrap();
        match story.play(&client) {
            Ok(played) => wrong.extend(played.differences),
            Err(failure) => wrong.push(failure.to_string()),
        }
    }
    let (count, all) = (wrong.len(), files.len());
    assert!(wrong.is_empty(), "{count} of {all} conversations differ:\n{}", wrong.join("\n"));
}
