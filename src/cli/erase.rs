use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::failure::Failure;
use super::{data_dir, embedded};
use crate::actors::{Book, OrderError};
use crate::events::PersonErased;
use crate::ids::TenantId;
use crate::store;

/// Erase a person: destroy the key that everything of theirs is sealed with.
///
/// Their records stay where they are and are noise from then on, so that every chain, every
/// checkpoint and everybody else's proofs still verify; `audit` reports them as erased. Their minds
/// and snapshots are dropped, and the tenant's stream says what was done, signed. The name may be
/// used again: by somebody new, who was taught nothing.
///
/// What this cannot reach: backups and exports made before, which keep the key, and blocks that a
/// copying file system or a flash disk keeps after they were overwritten. Destroy the backups, and
/// encrypt the disk.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice erase --data lab --tenant robotics --user ada
  apprentice erase --data lab --user you --json

It can not be taken back, and asks nothing. Doing it again is harmless.

Exit codes: 0 erased, 1 it went wrong, 2 there is no such person, or no such directory.")]
pub struct Arguments {
    /// The data directory; no service may have it open
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// The lab the person belongs to.
    #[arg(long, value_name = "NAME", default_value = "local")]
    tenant: String,
    /// The person.
    #[arg(long, value_name = "NAME")]
    user: String,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let tenant = TenantId::new(&arguments.tenant).map_err(Failure::bad_input)?;
    let user = embedded::user(&arguments.user)?;
    let directory = data_dir::choose(arguments.data)?;
    data_dir::must_hold_data(&directory)?;
    let store = store::open(&directory).map_err(Failure::bad_input)?;
    let stream = store.keys.stream_id(&tenant, &user).map_err(Failure::bad_input)?;
    let mut book = Book::open(store).map_err(Failure::failed)?;
    let erased = book.erase(&stream).map_err(|error| match error {
        OrderError::NobodyThere { .. } => Failure::bad_input(error),
        error => Failure::failed(error),
    })?;
    say(&tenant, &erased, arguments.json);
    Ok(())
}

/// Says what was erased, without the name.
pub fn say(tenant: &TenantId, erased: &PersonErased, as_json: bool) {
    let PersonErased { stream, last, head, signature } = erased;
    match as_json {
        true => println!(
            "{}",
            json!({
                "tenant": tenant, "stream": stream, "records": last,
                "head": head, "signature": signature,
            })
        ),
        false => println!(
            "erased: the {last} records of stream {tenant}/{stream} are noise from now on\n\
             not reached: backups and exports made before; destroy them too"
        ),
    }
}
