use std::time::Duration;

use clap::Args;

use super::credentials::Credentials;
use super::failure::Failure;
use super::{embedded, terminal};

/// How long to wait for a service to say hello.
const HELLO_PATIENCE: Duration = Duration::from_secs(5);
/// How long one request is retried once the conversation runs.
const PATIENCE: Duration = Duration::from_secs(60);

/// Talk to a running service.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice talk --connect tcp://127.0.0.1:7117 --user ada
  apprentice talk --connect tcp://127.0.0.1:7117 --user ada < requests.txt
  apprentice talk --connect tcp://robot.example:7117 --user ada --key lab.key --server-key server.pub

Exit codes: 0 the conversation ended; 1 the service failed or did not answer; 2 the arguments are wrong.")]
pub struct Arguments {
    /// The address of the service.
    #[arg(long, value_name = "ENDPOINT")]
    connect: String,
    #[command(flatten)]
    credentials: Credentials,
    /// Your name. Each user has their own robot and their own lessons.
    #[arg(long, value_name = "NAME", default_value = "you")]
    user: String,
    /// Fixes the scenes and the tasks. Each new task uses the next seed.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The first task. Repeat the option to choose the tasks after it. Later tasks are random.
    #[arg(long, value_name = "'clean Mug CounterTop'")]
    task: Vec<String>,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let user = embedded::user(&arguments.user)?;
    let client =
        arguments.credentials.client(&arguments.connect, user)?.with_patience(HELLO_PATIENCE);
    client.hello().map_err(Failure::failed)?;
    let client = client.with_patience(PATIENCE);
    terminal::talk(&client, arguments.seed, arguments.task, None)
}
