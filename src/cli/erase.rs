use clap::Args;
use serde_json::json;

use super::embedded;
use super::failure::Failure;
use super::office::Place;
use crate::events::PersonErased;
use crate::ids::TenantId;

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
  apprentice erase --tenant robotics --user ada --connect tcp://robot.example:7117 \
      --key operator.key --server-key server.pub

It can not be taken back, and asks nothing. Given again, it erases whoever bears the name by then, or says that
nobody does; cut short, it is finished by the next command or service that opens the directory.

Exit codes: 0 erased, 1 it went wrong, 2 there is no such person, or no such directory.")]
pub struct Arguments {
    #[command(flatten)]
    place: Place,
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
            "erased: the {last} records of stream {tenant}/{stream} are noise from now on\n\
             not reached: backups and exports made before; destroy them too"
        ),
    }
}
