use std::path::PathBuf;

use apprentice::service::Data;
use apprentice::store::HISTORY_FILE;
use clap::Args;

use super::embedded::{self, Wanted};
use super::failure::Failure;
use super::{data_dir, recipe, terminal};

/// Start a service inside this process and talk to it.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The data directory [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Your name. Each user has their own robot and their own lessons.
    #[arg(long, value_name = "NAME", default_value = "you")]
    user: String,
    /// Fixes the scenes and the tasks. Each new task uses the next seed.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The first task. Repeat the option to choose the tasks after it. Later tasks are random.
    #[arg(long, value_name = "'clean Mug CounterTop'")]
    task: Vec<String>,
    /// The recipe for a new user: default, default-1, default-2, paper, grammar, seq2seq,
    /// seq2seq-grammar, or a file.
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    recipe: String,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let user = embedded::user(&arguments.user)?;
    let recipe_text = recipe::load(&arguments.recipe)?;
    let directory = data_dir::choose(arguments.data)?;
    eprintln!("apprentice: everything is kept in {}", directory.display());
    let history = directory.join(HISTORY_FILE);
    let service = embedded::start(Wanted::inside(Data::Directory(directory), recipe_text))?;
    let client = service.connect(user).map_err(Failure::failed)?;
    let talked = terminal::talk(&client, arguments.seed, arguments.task, Some(&history));
    drop(client);
    let stopped = service.stop().map_err(Failure::failed);
    talked.and(stopped)
}
