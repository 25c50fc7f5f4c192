//! Every transcript in `tests/transcripts/` is played on a real service, each as a new person.
//! Every answer must be the one in the file.
//!
//! After a change that is meant to change answers, `apprentice transcript run FILE` prints the new
//! ones. Read them before you replace the old ones.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use apprentice::service::{Config, Data, Service};
use apprentice::world::household::Household;
use apprentice_cli::TranscriptFile;

fn files() -> Vec<PathBuf> {
    let folder = apprentice_testkit::paths::root().join("tests/transcripts");
    let entries = std::fs::read_dir(&folder).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|ending| ending == "txt"));
    files.sort();
    files
}

fn service(recipe_text: &str) -> Service {
    let mut config = Config::new(Arc::new(Household::new()), Data::Memory);
    config.recipe_text = recipe_text.to_owned();
    Service::start(config).unwrap()
}

#[test]
fn every_transcript_gets_the_answers_it_has() {
    let files = files();
    assert!(files.len() >= 40, "only {} transcripts", files.len());
    let stories: Vec<TranscriptFile> =
        files.iter().map(|file| TranscriptFile::read(file).unwrap()).collect();
    let mut services: BTreeMap<String, Service> = BTreeMap::new();
    for story in &stories {
        let recipe = story.recipe_text().unwrap();
        services.entry(recipe).or_insert_with_key(|recipe| service(recipe));
    }

    // Several people talk to one service at once. No person may get another's answers.
    let next = AtomicUsize::new(0);
    let play = || {
        let mut wrong = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(story) = stories.get(number) else { return wrong };
            let service = &services[&story.recipe_text().unwrap()];
            let client = service.connect(story.person(number).unwrap()).unwrap();
            match story.play(&client) {
                Ok(played) => wrong.extend(played.differences),
                Err(failure) => wrong.push(failure.to_string()),
            }
        }
    };
    let wrong: Vec<String> = thread::scope(|scope| {
        let players: Vec<_> = (0..4).map(|_| scope.spawn(play)).collect();
        players.into_iter().flat_map(|player| player.join().unwrap()).collect()
    });
    assert!(wrong.is_empty(), "{} transcripts differ:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn running_a_transcript_prints_one_that_checks_and_runs_to_itself() {
    let folder = tempfile::tempdir().unwrap();
    let written = folder.path().join("bare.txt");
    std::fs::write(
        &written,
        "# bare acts\ntask clean Mug CounterTop\nepisode\n> go to the mug\n> \n\n> boogie\ndone\n\
         teach \"boogie\" := nothing\nlearn\n",
    )
    .unwrap();
    let service = service(apprentice::learning::Recipe::builtin("default").unwrap());
    let mut number = 0;
    let mut play = |path: &Path| {
        number += 1;
        let story = TranscriptFile::read(path).unwrap();
        story.play(&service.connect(story.person(number).unwrap()).unwrap()).unwrap()
    };
    let first = play(&written);
    assert!(first.differences.is_some_and(|diff| diff.contains("+= GOTO Mug (action 1)")));
    for answer in ["\n= GOTO Mug (action 1)\n", "\nx bad_utterance (", "\n? not sure ("] {
        assert!(first.text.contains(answer), "{answer:?} is missing in\n{}", first.text);
    }
    assert!(first.text.ends_with("\nlearn 44 examples\n"), "{}", first.text);
    let filled = folder.path().join("filled.txt");
    std::fs::write(&filled, &first.text).unwrap();
    let second = play(&filled);
    assert_eq!(second.differences, None);
    assert_eq!(second.text, first.text);
}
