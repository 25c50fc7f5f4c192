use std::path::PathBuf;

use apprentice::ids::TenantId;
use apprentice::plain::count;
use apprentice::store::{self, Salvaged, Share};
use clap::Args;
use serde_json::json;

use super::data_dir;
use super::failure::Failure;
use super::shown;

/// Copy everything readable from a damaged data directory into a new one.
///
/// Copies all keys, and each user's records up to the first record that is missing or damaged. Does
/// not change the damaged directory. Works even if its database does not open.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice salvage --data lab --out lab-rescued
  apprentice salvage --data lab --out lab-rescued --json | jq .lost

If it is interrupted, it leaves DIR2.unfinished, which the next run replaces. DIR2 appears only when
it is complete.

Exit codes: 0 nothing was lost; 1 something was lost (it is listed); 2 nothing could be rescued.")]
pub struct Arguments {
    /// The damaged data directory [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// The new directory. It must be empty or not exist.
    #[arg(long, value_name = "DIR2")]
    out: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let directory = data_dir::choose(arguments.data)?;
    let salvaged = store::salvage(&directory, &arguments.out).map_err(Failure::bad_input)?;
    let lost = losses(&salvaged);
    let kept: u64 = salvaged.streams.iter().map(|found| found.valid.seq).sum();
    match arguments.json {
        true => println!("{}", shown::json(&as_json(&salvaged, kept))),
        false => {
            print!("{}", shown::lines(lost.iter().map(|sentence| format!("lost: {sentence}"))));
            let shares = salvaged.by_tenant();
            let shares = shares.iter().map(|(tenant, share)| of_tenant(tenant, share));
            print!("{}", shown::lines(shares));
            let people = salvaged.streams.iter().filter(|found| !found.stream.is_tenants());
            let people = people.filter(|found| found.valid.seq > 0).count();
            println!("kept: {kept} records of {people} people");
        }
    }
    match salvaged.is_complete() {
        true => Ok(()),
        false => Err(Failure::differences()),
    }
}

/// One lab's line.
fn of_tenant(tenant: &TenantId, share: &Share) -> String {
    let Share { people, records, own, lost, hurt } = share;
    let kept = format!(
        "tenant {tenant}: kept {records} records of {people} people and {own} records of its own \
         (keys, quotas, erasures)"
    );
    match hurt {
        0 => format!("{kept}; lost nothing"),
        _ => {
            let (streams, lost) = (count(*hurt, "stream"), count(*lost, "record"));
            format!("{kept}; lost something in {streams} (at least {lost})")
        }
    }
}

fn losses(salvaged: &Salvaged) -> Vec<String> {
    let mut lost = Vec::new();
    for found in &salvaged.streams {
        for loss in &found.losses {
            lost.push(format!("stream {}: {loss}", found.stream));
        }
    }
    if let Some(reason) = &salvaged.heads_damage {
        lost.push(format!(
            "the heads file, so records may be missing at the end of any stream: {reason}"
        ));
    }
    if salvaged.unclaimed > 0 {
        lost.push(format!("{} streams whose tenant is unknown", salvaged.unclaimed));
    }
    lost.extend(salvaged.lost_keys.iter().map(|key| format!("the key file {key}")));
    lost
}

fn as_json(salvaged: &Salvaged, kept: u64) -> serde_json::Value {
    let streams: Vec<_> = salvaged
        .streams
        .iter()
        .map(|found| {
            let lost: Vec<String> = found.losses.iter().map(ToString::to_string).collect();
            json!({
                "stream": found.stream.to_string(),
                "acknowledged": found.acknowledged,
                "kept": found.valid.seq,
                "head": found.valid.digest.to_hex(),
                "lost": lost,
            })
        })
        .collect();
    let share = |share: Share| {
        json!({
            "people": share.people,
            "records": share.records,
            "own": share.own,
            "lost": share.lost,
            "hurt": share.hurt,
        })
    };
    let tenants = salvaged.by_tenant().into_iter();
    let tenants: serde_json::Map<_, _> =
        tenants.map(|(tenant, of)| (tenant.to_string(), share(of))).collect();
    json!({ "kept": kept, "lost": losses(salvaged), "tenants": tenants, "streams": streams })
}
