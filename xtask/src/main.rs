//! The one tool of the house. `cargo xtask test` is what CI runs.

mod budget;
mod machine;
mod stage;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Builds, tests and measures apprentice.
#[derive(Parser)]
#[command(name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Everything CI checks: format, lints, tests, examples, licences. Installs what it needs.
    Test {
        /// Run only the stages with these names.
        #[arg(long, value_delimiter = ',')]
        only: Vec<String>,
    },
    /// The benchmarks behind docs/performance.md.
    Bench {
        /// Passed to `cargo bench`.
        filter: Option<String>,
    },
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Test { only } => stage::run_all(&only),
        Task::Bench { filter } => stage::bench(filter.as_deref()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(sentence) => {
            eprintln!("xtask: {sentence}");
            ExitCode::FAILURE
        }
    }
}
