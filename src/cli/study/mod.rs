//! Studies: running the paper's experiments, with simulated teachers or recorded sentences.

mod run;

use clap::{Args, Subcommand};

use super::failure::Failure;

/// Run studies: simulated teachers or recorded people at the real service.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Run(run::Arguments),
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.verb {
        Verb::Run(arguments) => run::run(arguments),
    }
}
