use std::path::PathBuf;

use clap::Args;

use super::embedded::{self, Wanted};
use super::failure::Failure;
use super::{data_dir, recipe};
use crate::frontends::show_key;
use crate::service::Data;
use crate::store::FaultPlan;

/// Serve people and programs over ZeroMQ.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice serve --data lab --zmq tcp://127.0.0.1:7117
  apprentice serve --data lab --zmq ipc:///run/apprentice.socket --log-format json
  apprentice serve --data labs --curve tcp://0.0.0.0:7117
  apprentice serve --data labs --curve tcp://0.0.0.0:7117 --feed tcp://0.0.0.0:7200
  apprentice serve --data trial --zmq tcp://127.0.0.1:7117 --fault-plan deploy/drills/bad-day.toml

Standard output names the endpoints that were opened, one on a line (a port 0 takes a free one), and
the service's own key, which those need who come in by --curve.
schema/wire.md describes the wire. SIGTERM and SIGINT end it in order; a kill loses nothing that was
answered either.

Exit codes: 0 it was stopped, 1 the service cannot go on, 2 the directory or the endpoint cannot be used.")]
pub struct Arguments {
    /// Where everything is kept [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Where to listen without keys; may be given again. Everybody who reaches it may talk as
    /// anybody and give orders, so it is loopback or a socket file.
    #[arg(long, value_name = "ENDPOINT", required_unless_present = "curve")]
    zmq: Vec<String>,
    /// Where to listen with keys, on any address; may be given again. Only those come in whose key
    /// `apprentice tenant admit` let in.
    #[arg(long, value_name = "ENDPOINT")]
    curve: Vec<String>,
    /// Where to publish what is recorded: each lab with auditors or operators gets two endpoints of
    /// its own, one of sealed records and one of plain ones. With a port, the ports from there on.
    #[arg(long, value_name = "ENDPOINT", requires = "curve")]
    feed: Option<String>,
    /// The service's own key, made when missing [default: keys/server.curve in the data directory]
    #[arg(long, value_name = "FILE", requires = "curve")]
    server_key: Option<PathBuf>,
    /// The recipe that new people start with: default, default-1, default-2, paper, grammar, seq2seq,
    /// seq2seq-grammar, or a file.
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    recipe: String,
    /// Let appends fail on purpose, by this plan: a drill, never for real participants.
    #[arg(long, value_name = "FILE")]
    fault_plan: Option<PathBuf>,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let recipe_text = recipe::load(&arguments.recipe)?;
    let faults = arguments.fault_plan.as_deref().map(FaultPlan::read).transpose();
    let faults = faults.map_err(Failure::bad_input)?;
    let directory = data_dir::choose(arguments.data)?;
    eprintln!("apprentice: everything is kept in {}", directory.display());
    if faults.is_some() {
        eprintln!("apprentice: FAULT DRILL: appends fail on purpose; let no participant in");
    }
    let data = Data::Directory(directory);
    let wanted = Wanted {
        data,
        recipe_text,
        listen: arguments.zmq,
        listen_curve: arguments.curve,
        feed: arguments.feed,
        server_key: arguments.server_key,
        faults,
    };
    let service = embedded::start(wanted)?;
    ctrlc::set_handler(service.stopper())
        .map_err(|error| Failure::failed(format!("signals cannot be heard: {error}")))?;
    for endpoint in service.endpoints() {
        println!("serving at {endpoint}");
        tracing::info!(%endpoint, "serving");
    }
    for endpoint in service.curve_endpoints() {
        println!("serving with keys at {endpoint}");
        tracing::info!(%endpoint, "serving with keys");
    }
    for (tenant, plain, endpoint) in service.feed_endpoints() {
        let kind = if plain { "plain" } else { "sealed" };
        println!("{kind} feed of {tenant} at {endpoint}");
    }
    if let Some(key) = service.server_key() {
        println!("server key {}", show_key(key));
    }
    if let Some(reason) = service.wait() {
        return Err(Failure::failed(reason));
    }
    tracing::info!("stopping");
    service.stop().map_err(Failure::failed)
}
