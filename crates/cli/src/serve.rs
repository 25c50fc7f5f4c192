use std::path::PathBuf;

use apprentice::client::show_key;
use apprentice::service::Data;
use apprentice::store::FaultPlan;
use clap::Args;

use super::embedded::{self, Wanted};
use super::failure::Failure;
use super::{data_dir, recipe};

/// Serve users and programs over ZeroMQ.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice serve --data lab --zmq tcp://127.0.0.1:7117
  apprentice serve --data lab --zmq ipc:///run/apprentice.socket --log-format json
  apprentice serve --data labs --curve tcp://0.0.0.0:7117
  apprentice serve --data labs --curve tcp://0.0.0.0:7117 --feed tcp://0.0.0.0:7200
  apprentice serve --data trial --zmq tcp://127.0.0.1:7117 --fault-plan deploy/drills/bad-day.toml

The service prints each endpoint that it opened on a line of standard output. Port 0 means a free
port. With --curve it also prints its own public key, which every client needs.
SIGTERM and SIGINT stop the service. A kill loses nothing that was answered.
schema/wire.md describes the messages.

Exit codes: 0 it was stopped; 1 the service failed; 2 the directory or an endpoint cannot be used.")]
pub struct Arguments {
    /// The data directory [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Listen here without keys. You can repeat this option. Anyone who can connect can speak for
    /// every user and give orders, so only loopback and socket files are allowed.
    #[arg(long, value_name = "ENDPOINT", required_unless_present = "curve")]
    zmq: Vec<String>,
    /// Listen here with keys, on any address. You can repeat this option. Only keys that you admitted
    /// with `apprentice tenant admit` can connect.
    #[arg(long, value_name = "ENDPOINT")]
    curve: Vec<String>,
    /// Publish new records here. Each lab with auditors or operators gets two endpoints: one for
    /// sealed records and one for plain records. If you give a port, the next ports are used too.
    #[arg(long, value_name = "ENDPOINT", requires = "curve")]
    feed: Option<String>,
    /// The service's own key. It is made if it is missing [default: keys/server.curve in the data directory]
    #[arg(long, value_name = "FILE", requires = "curve")]
    server_key: Option<PathBuf>,
    /// The recipe for new users: default, default-1, default-2, paper, grammar, seq2seq,
    /// seq2seq-grammar, or a file.
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    recipe: String,
    /// Make writes fail on purpose, by this plan. Only for drills, never with real participants.
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
        eprintln!("apprentice: FAULT DRILL: writes fail on purpose; do not let participants in");
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
        .map_err(|error| Failure::failed(format!("signals cannot be handled: {error}")))?;
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
