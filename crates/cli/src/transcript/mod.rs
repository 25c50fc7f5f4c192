//! Transcripts: the product in its own words, as tests, bug reports and documentation.
//! `docs/transcripts.md` is the grammar.

mod file;

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use apprentice::language::{Evidence, Outcome};
use apprentice::service::{Data, Service};
use apprentice_study::transcript;
use clap::{Args, Subcommand};

use super::embedded::{self, Wanted};
use super::failure::Failure;
pub use file::{PlayedFile, TranscriptFile};

/// Play transcripts: conversations as text, with the expected answers.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice transcript run tests/transcripts/wash.txt
  apprentice transcript check tests/transcripts/*.txt

docs/transcripts.md describes the notation.

Exit codes: 0 all answers agree; 1 some differ (a diff is printed); 2 a file cannot be read or has an
error (the message gives the line and the column).")]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Play one transcript with a new service and print it with the real answers.
    Run { file: PathBuf },
    /// Play each transcript and print the answers that differ, as a diff.
    Check {
        #[arg(required = true)]
        files: Vec<PathBuf>,
    },
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.verb {
        Verb::Run { file } => {
            let file = TranscriptFile::read(&file)?;
            write(&Services::default().play(&file)?.text)
        }
        Verb::Check { files } => check(&files),
    }
}

fn check(files: &[PathBuf]) -> Result<(), Failure> {
    // All are read before any is played: a slip of the pen in the last one shows at once.
    let files = files.iter().map(|file| TranscriptFile::read(file));
    let files = files.collect::<Result<Vec<_>, _>>()?;
    let mut services = Services::default();
    let mut agree = true;
    for file in &files {
        if let Some(diff) = services.play(file)?.differences {
            agree = false;
            write(&diff)?;
        }
    }
    match agree {
        true => Ok(()),
        false => Err(Failure::differences()),
    }
}

/// One service in memory for each recipe, and a new person for each file.
#[derive(Default)]
struct Services {
    by_recipe: BTreeMap<String, Service>,
    people: usize,
}

impl Services {
    fn play(&mut self, file: &TranscriptFile) -> Result<PlayedFile, Failure> {
        let recipe = file.recipe_text()?;
        if !self.by_recipe.contains_key(&recipe) {
            let service = embedded::start(Wanted::inside(Data::Memory, recipe.clone()))?;
            self.by_recipe.insert(recipe.clone(), service);
        }
        let service = &self.by_recipe[&recipe];
        self.people += 1;
        let client = service.connect(file.person(self.people)?).map_err(Failure::failed)?;
        file.play(&client)
    }
}

/// What came of an utterance, as a line of a transcript.
pub(super) fn show_answer(outcome: &Outcome, evidence: &Evidence, actions_before: u32) -> String {
    transcript::show(outcome, evidence, actions_before).1
}

fn write(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).map_err(|error| {
        Failure::failed(format!("the transcript cannot be written to standard output: {error}"))
    })
}
