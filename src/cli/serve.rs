use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::failure::Failure;
use super::{data_dir, embedded, recipe};
use crate::service::Data;

/// Serve people and programs over ZeroMQ.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice serve --data lab --zmq tcp://127.0.0.1:7117
  apprentice serve --data lab --zmq ipc:///run/apprentice.socket --log-format json

The first line on standard output names the endpoint that was opened (a port 0 takes a free one).
schema/wire.md describes the wire. Stop it with a signal at any time: what was answered is kept.

Exit codes: 1 the service cannot go on, 2 the directory or the endpoint cannot be used.")]
pub struct Arguments {
    /// Where everything is kept [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Where to listen; may be given again. Everybody who reaches it may talk as anybody, so bind
    /// loopback or a socket file.
    #[arg(long, value_name = "ENDPOINT", required = true)]
    zmq: Vec<String>,
    /// The recipe that new people start with: default, paper, or a file.
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    recipe: String,
}

/// How often the service is asked whether it goes on.
const WATCH: Duration = Duration::from_secs(3600);

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let recipe_text = recipe::load(&arguments.recipe)?;
    let directory = data_dir::choose(arguments.data)?;
    eprintln!("apprentice: everything is kept in {}", directory.display());
    let service = embedded::start(Data::Directory(directory), recipe_text, arguments.zmq)?;
    for endpoint in service.endpoints() {
        println!("serving at {endpoint}");
        tracing::info!(%endpoint, "serving");
    }
    loop {
        if let Some(reason) = service.wait_for_failure(WATCH) {
            return Err(Failure::failed(reason));
        }
    }
}
