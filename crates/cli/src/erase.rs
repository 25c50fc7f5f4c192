use apprentice::events::PersonErased;
use apprentice::ids::TenantId;
use clap::Args;
use serde_json::json;

use super::admin_client::Place;
use super::embedded;
use super::failure::Failure;

/// Erase a user: destroy their key.
///
/// Their records, minds and snapshots can no longer be decrypted. The sealed records stay in the log,
/// so every chain, every checkpoint and all other proofs still verify. `audit` reports the stream as
/// erased. The tenant's own stream records the erasure, signed. A new user may use the name. The
/// robot of this new user knows no lessons.
///
/// Older backups and exports still contain the key: destroy them. Some file systems and flash disks
/// keep overwritten blocks: encrypt the disk.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice erase --data lab --tenant robotics --user ada
  apprentice erase --data lab --user you --json
  apprentice erase --tenant robotics --user ada --connect tcp://robot.example:7117 \
      --key operator.key --server-key server.pub

You cannot undo this, and the command does not ask. If it is interrupted, the next command or service
that opens the directory finishes it. If you repeat it, it erases the user who has the name by then, or
it says that there is no such user.

Exit codes: 0 erased; 1 it failed; 2 there is no such user or directory.")]
pub struct Arguments {
    #[command(flatten)]
    place: Place,
    /// The lab of the user.
    #[arg(long, value_name = "NAME", default_value = "local")]
    tenant: String,
    /// The user.
    #[arg(long, value_name = "NAME")]
    user: String,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let tenant = TenantId::new(&arguments.tenant).map_err(Failure::bad_input)?;
    let user = embedded::user(&arguments.user)?;
    let erased = arguments.place.enter(false)?.erase(&tenant, &user)?;
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
            "erased: the {last} records of stream {tenant}/{stream} can no longer be decrypted\n\
             not erased: older backups and exports still contain the key; destroy them too"
        ),
    }
}
