//! The event log, for people and programs to read.

mod show;

pub use show::json;

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::failure::Failure;
use super::{embedded, past};
use crate::ids::{Seq, TenantId};

/// Read what was recorded.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice log show --user you
  apprentice log show --data lab --user ada --json | jq .event.goal

Exit codes: 1 a record cannot be read (those before it are printed), 2 the directory cannot be used
or has no such person.")]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Print one person's records, oldest first.
    Show(Show),
}

#[derive(Debug, Args)]
struct Show {
    /// The data directory; it is copied first, and the copy is read
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// The lab the person belongs to.
    #[arg(long, value_name = "NAME", default_value = "local")]
    tenant: String,
    /// Whose records.
    #[arg(long, value_name = "NAME")]
    user: String,
    /// One JSON object per record, with everything in it and without times.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.verb {
        Verb::Show(arguments) => show(arguments),
    }
}

fn show(arguments: Show) -> Result<(), Failure> {
    let tenant = TenantId::new(&arguments.tenant).map_err(Failure::bad_input)?;
    let user = embedded::user(&arguments.user)?;
    let past = past::open(arguments.data)?;
    let (store, stream) = (&past.store, past.stream(&tenant, &user)?);
    let mut stdout = std::io::stdout().lock();
    for record in store.log.read(&stream, Seq::FIRST).map_err(Failure::failed)? {
        let record = record.map_err(Failure::failed)?;
        let lines = match arguments.json {
            true => vec![show::json(&record).to_string()],
            false => show::readable(&record),
        };
        for line in lines {
            writeln!(stdout, "{line}").map_err(|error| {
                Failure::failed(format!("the log cannot be written to standard output: {error}"))
            })?;
        }
    }
    Ok(())
}
