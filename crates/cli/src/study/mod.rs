//! `apprentice study`: the paper's experiments, and questions about what was recorded.

mod report;
mod rerun;
mod run;

use clap::{Args, Subcommand};

use super::failure::Failure;

/// Run studies, draw their figures, and rerun recorded sessions with other settings.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Run(run::Arguments),
    Report(report::Arguments),
    Rerun(rerun::Arguments),
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.verb {
        Verb::Run(arguments) => run::run(arguments),
        Verb::Report(arguments) => report::run(arguments),
        Verb::Rerun(arguments) => rerun::run(arguments),
    }
}
