//! The developers' commands. `cargo xtask test` is what CI runs.

mod budget;
mod drills;
mod machine;
mod release;
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
        /// Fail at a stage that takes longer than xtask/budget.toml allows, instead of warning.
        #[arg(long)]
        enforce_budget: bool,
    },
    /// The checks before every commit: format, lints, unit tests, the tables of ARCHITECTURE.md.
    ///
    /// Takes under a minute when the build tree is warm.
    Check,
    /// Installs what the tests need and this Debian machine lacks, and says what it installs.
    Setup,
    /// The checks before a release, besides `test`: the release build trains the same minds, two
    /// release builds in different folders are the same bytes, and the long runs.
    ///
    /// Takes hours.
    ReleaseCheck {
        /// Leave out the long runs of the simulator, the kills and the power cuts.
        #[arg(long)]
        short: bool,
    },
    /// The simulator: any number of seeds, in the release build.
    ///
    /// Example: cargo xtask simulate --seeds 1000000
    Simulate {
        /// How many seeds; one if only --seed is given.
        #[arg(long)]
        seeds: Option<u64>,
        /// The first seed.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// The service killed: any number of SIGKILLs, in the release build.
    ///
    /// Example: cargo xtask crash --kills 1000
    Crash {
        #[arg(long)]
        kills: u64,
        /// A seed that an earlier run printed; random by default.
        #[arg(long)]
        seed: Option<u64>,
    },
    /// The power cut: any number of images of a disk, in the release build. Needs root.
    ///
    /// Example: cargo xtask powerloss --images 500
    Powerloss {
        #[arg(long)]
        images: u64,
        /// A seed that an earlier run printed; random by default.
        #[arg(long)]
        seed: Option<u64>,
    },
    /// Hostile bytes: any number of cases for every decoder, in the release build.
    ///
    /// Example: cargo xtask fuzz --cases 100000000 --seed 7
    Fuzz {
        #[arg(long)]
        cases: u64,
        /// A seed that an earlier run printed; random by default.
        #[arg(long)]
        seed: Option<u64>,
        /// Only decoders whose name contains this.
        #[arg(long)]
        target: Option<String>,
    },
    /// A closed directory damaged: any number of flipped bits, in the release build.
    ///
    /// Example: cargo xtask damage --flips 20000
    Damage {
        #[arg(long)]
        flips: u64,
        /// A seed that an earlier run printed; random by default.
        #[arg(long)]
        seed: Option<u64>,
    },
    /// The benchmarks behind docs/performance.md.
    Bench {
        /// Passed to `cargo bench`.
        filter: Option<String>,
    },
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Test { only, enforce_budget } => stage::run_all(&only, enforce_budget),
        Task::Check => stage::check(),
        Task::Setup => machine::setup().map(|missing| {
            missing.iter().for_each(|sentence| eprintln!("xtask: {sentence}"));
            println!("this machine has what the tests need");
        }),
        Task::ReleaseCheck { short } => release::check(short),
        Task::Simulate { seeds, seed } => drills::simulate(seeds.unwrap_or(1), seed),
        Task::Crash { kills, seed } => drills::crash(kills, seed),
        Task::Powerloss { images, seed } => drills::powerloss(images, seed),
        Task::Fuzz { cases, seed, target } => drills::fuzz(cases, seed, target.as_deref()),
        Task::Damage { flips, seed } => drills::damage(flips, seed),
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
