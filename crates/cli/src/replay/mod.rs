//! A person's session at any moment of its history.

mod show;
mod transcript;

use std::io::{self, Write};
use std::sync::Arc;

use apprentice::ids::Seq;
use apprentice::replay::{self, Minds};
use apprentice::world::household::Household;
use clap::Args;

use super::failure::Failure;
use super::past::{OfOne, Whose};
use super::shown;

/// Rebuild a user's session as it was after any record.
///
/// Applies the records in order and checks every checksum, the chain and every scene digest. If the
/// mind of that time is not in the cache, it is trained again. The command works on a copy and does
/// not change the directory.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice replay --data lab --user ada
  apprentice replay --data lab --user ada --at 17 --json | jq .mind_digest
  apprentice replay --data lab --user ada --transcript > ada.txt && apprentice transcript check ada.txt

docs/replay.md says what each digest covers.

Exit codes: 0 the session was rebuilt; 1 the log and this program disagree (the message says where); 2
the directory cannot be used, or has no such tenant, user or record.")]
pub struct Arguments {
    #[command(flatten)]
    whose: Whose,
    /// Stop after this record [default: the last one]. `apprentice log show` prints the numbers.
    #[arg(long, value_name = "SEQ")]
    at: Option<u64>,
    /// Print the history up to there in the notation of docs/transcripts.md.
    #[arg(long, conflicts_with = "json")]
    transcript: bool,
    /// Print one JSON object with the whole state, without times and request ids.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let OfOne { past, tenant, user, stream } = arguments.whose.open()?;
    let head = past.store.log.head(&stream).map_err(Failure::failed)?.seq;
    let wanted = arguments.at.unwrap_or(head);
    let at = Seq::new(wanted).filter(|at| at.get() <= head).ok_or_else(|| {
        Failure::bad_input(format!(
            "user {:?} in tenant {tenant} has records 1 to {head}; there is no record {wanted}; \
             choose one of them with --at",
            user.as_str()
        ))
    })?;
    let (domain, minds) = (Arc::new(Household::new()), Minds::default());
    // From the first record on: a snapshot would save time and prove less.
    let rebuilt = replay::rebuild_at(&domain, &past.store, &stream, &minds, at);
    let session = rebuilt.map_err(Failure::failed)?;
    let mut stdout = io::BufWriter::new(io::stdout().lock());
    let written = if arguments.transcript {
        let records = past.store.log.read(&stream, Seq::FIRST).map_err(Failure::failed)?;
        transcript::write(&mut stdout, &domain, records, &session)?
    } else if arguments.json {
        writeln!(stdout, "{}", show::json(&tenant, &session, head))
    } else {
        let text = shown::lines(show::readable(&tenant, &session, head));
        stdout.write_all(text.as_bytes())
    };
    written.and_then(|()| stdout.flush()).map_err(|error| {
        Failure::failed(format!("the session cannot be written to standard output: {error}"))
    })
}
