use std::time::Duration;

use clap::Args;

use super::failure::Failure;
use super::passport::Passport;
use super::{embedded, terminal};

/// How long a service may take to say hello before it is taken for absent.
const HELLO_PATIENCE: Duration = Duration::from_secs(5);
/// How long one request is retried once the conversation runs.
const PATIENCE: Duration = Duration::from_secs(60);

/// Talk to a service that runs elsewhere.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice talk --connect tcp://127.0.0.1:7117 --user ada
  apprentice talk --connect tcp://127.0.0.1:7117 --user ada < requests.txt
  apprentice talk --connect tcp://robot.example:7117 --user ada --key lab.key --server-key server.pub

Exit codes: 0 the conversation ended, 1 no answer or the service failed, 2 bad usage.")]
pub struct Arguments {
    /// Where the service listens.
    #[arg(long, value_name = "ENDPOINT")]
    connect: String,
    #[command(flatten)]
    passport: Passport,
    /// Who is talking: each person teaches a robot of their own.
    #[arg(long, value_name = "NAME", default_value = "you")]
    user: String,
    /// Fixes scenes and tasks; the next episode has the next seed.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// What the first tasks are about, in order; give it again for the next one. Later tasks are
    /// drawn.
    #[arg(long, value_name = "'clean Mug CounterTop'")]
    task: Vec<String>,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let user = embedded::user(&arguments.user)?;
    let client = arguments.passport.client(&arguments.connect, user)?.with_patience(HELLO_PATIENCE);
    client.hello().map_err(Failure::failed)?;
    let client = client.with_patience(PATIENCE);
    terminal::talk(&client, arguments.seed, arguments.task, None)
}
