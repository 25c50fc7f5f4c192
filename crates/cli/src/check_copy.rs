use std::path::PathBuf;

use apprentice::store;
use clap::{Args, ValueEnum};
use rustix::process::{
    Resource, Rlimit, Signal, getppid, set_parent_process_death_signal, setrlimit,
};

use super::failure::Failure;

/// Look at a copy of a suspicious directory and say what is wrong with it. The program starts itself
/// with this command, so that whatever a damaged database does hits only this process.
#[derive(Debug, Args)]
pub struct Arguments {
    #[arg(long, value_enum)]
    part: Part,
    /// Address space that this process may take, in bytes.
    #[arg(long)]
    memory: u64,
    /// The process that asked, in whose directory the copy stands.
    #[arg(long)]
    parent: i32,
    copy: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Part {
    Log,
    Cache,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let limit = |resource, bytes| {
        let limit = Rlimit { current: Some(bytes), maximum: Some(bytes) };
        setrlimit(resource, limit)
            .map_err(|error| Failure::failed(format!("this process cannot be limited: {error}")))
    };
    limit(Resource::As, arguments.memory)?;
    limit(Resource::Core, 0)?;
    // The next process that opens the directory replaces this copy, so no process may still write
    // into it.
    set_parent_process_death_signal(Some(Signal::KILL)).map_err(|error| {
        Failure::failed(format!("this process cannot be tied to its parent: {error}"))
    })?;
    if getppid().map(|parent| parent.as_raw_nonzero().get()) != Some(arguments.parent) {
        return Err(Failure::failed("the process that started this check has ended"));
    }
    let part = match arguments.part {
        Part::Log => "log",
        Part::Cache => "cache",
    };
    store::check_copy(&arguments.copy, part, &mut std::io::stdout().lock()).map_err(Failure::failed)
}
