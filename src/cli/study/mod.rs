//! `apprentice study`: the paper's experiments, and questions about what was recorded.

mod report;
mod rerun;

use clap::{Args, Subcommand};

use super::failure::Failure;

/// The paper's experiments, and what recorded people would have been answered otherwise.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Report(report::Arguments),
    Rerun(rerun::Arguments),
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.verb {
        Verb::Report(arguments) => report::run(arguments),
        Verb::Rerun(arguments) => rerun::run(arguments),
    }
}
