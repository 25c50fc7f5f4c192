//! Prints the event log, for people and for programs.

mod show;

pub use show::{json, readable, utc};

use std::io::Write;

use apprentice::events::Times;
use apprentice::ids::Seq;
use clap::{Args, Subcommand};

use super::failure::Failure;
use super::past::{OfOne, Whose};
use super::shown;

/// Print the records of a user.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice log show --user you
  apprentice log show --data lab --user ada --json | jq .event.goal

Recorded times never go backwards. If the wall clock did not move forward after the previous record, the
time is held, and a line below it says so.

Exit codes: 1 a record cannot be read (the records before it are printed); 2 the directory cannot be
used or has no such user.")]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Print one user's records, oldest first.
    Show(Show),
}

#[derive(Debug, Args)]
struct Show {
    #[command(flatten)]
    whose: Whose,
    /// Print one JSON object per record, complete but without times.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.verb {
        Verb::Show(arguments) => show(arguments),
    }
}

fn show(arguments: Show) -> Result<(), Failure> {
    let OfOne { past, stream, .. } = arguments.whose.open()?;
    let mut stdout = std::io::stdout().lock();
    let mut times = Times::default();
    for record in past.store.log.read(&stream, Seq::FIRST).map_err(Failure::failed)? {
        let record = record.map_err(Failure::failed)?;
        let text = match arguments.json {
            true => shown::json(&show::json(&record)) + "\n",
            false => shown::lines(show::readable(&record, times.is_held(&record))),
        };
        stdout.write_all(text.as_bytes()).map_err(|error| {
            Failure::failed(format!("the log cannot be written to standard output: {error}"))
        })?;
    }
    Ok(())
}
