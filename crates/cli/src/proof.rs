use std::num::NonZeroU64;
use std::path::PathBuf;

use apprentice::actors::fold_tenant;
use apprentice::ids::Seq;
use apprentice::replay::{self, ProveError, Wanted};
use clap::Args;

use super::checkpoint::{older, write};
use super::failure::Failure;
use super::past::{OfOne, Whose};

/// Write a proof that a record was in the log when a checkpoint was signed.
///
/// `apprentice verify` and tools/verify.py need only this file and the log's public key. The record in
/// the file is sealed. It shows only times and lengths.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice proof --data lab --user ada --seq 17 --out ada-17.proof
  apprentice proof --data lab --user ada --seq 17 --reveal --out ada-17-open.proof
  apprentice proof --data lab --user ada --seq 17 --since may.checkpoint --out ada-17.proof

`apprentice log show --user ada` prints the numbers of records. A checkpoint covers a record after its
episode has ended, or after `apprentice checkpoint`.

Exit codes: 1 no checkpoint covers the record yet, or the log is not the one that was signed; 2 the
directory, the user or a file cannot be used.")]
pub struct Arguments {
    #[command(flatten)]
    whose: Whose,
    /// The number of the record.
    #[arg(long, value_name = "N")]
    seq: NonZeroU64,
    /// Put the decrypted record into the file, with the evidence that it is the right one.
    #[arg(long)]
    reveal: bool,
    /// Also prove that the log only grew since this checkpoint.
    #[arg(long, value_name = "OLD_CHECKPOINT")]
    since: Option<PathBuf>,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let OfOne { past, tenant, stream, .. } = arguments.whose.open()?;
    let registry = fold_tenant(&past.store, &tenant).map_err(Failure::failed)?;
    let signer = replay::signer_of(&past.store, &tenant).map_err(Failure::bad_input)?;
    let since = arguments.since.as_deref().map(|path| older(path, &signer.public()));
    let wanted = Wanted {
        record: Seq::new(arguments.seq.get()).map(|seq| (&stream, seq)),
        reveal: arguments.reveal,
        since: since.transpose()?.map(|checkpoint| checkpoint.size),
    };
    let proof = replay::prove(&past.store, &tenant, &registry, &wanted);
    let proof = proof.map_err(|error| match error {
        ProveError::Absent { .. } => Failure::bad_input(error),
        _ => Failure::failed(error),
    })?;
    write(arguments.out.as_deref(), &proof.to_text())
}
