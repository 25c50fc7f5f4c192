use std::io::Write;
use std::path::{Path, PathBuf};

use apprentice::events::{Record, decode};
use apprentice::evidence::{self, Proof, Verified, VerifiedRecord, VerifierKey};
use clap::Args;
use serde_json::{Value, json};

use super::failure::Failure;
use super::{log, shown};

/// Check a proof made by `apprentice proof` or `apprentice checkpoint`.
///
/// You need only the file and the log's public key: no data directory and no network.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice verify ada-17.proof --key lab.pub
  apprentice verify ada-17.proof --key lab.example.org/lab+1a2b3c4d+AZ…
  apprentice verify ada-17.proof --key lab.pub --since checkpoint-of-may

docs/evidence.md says what a proof shows and what it does not.

Exit codes: 0 the proof is valid; 1 it is not valid (the message says why); 2 the file is not a proof,
or the key is not a key.")]
pub struct Arguments {
    /// The file with the proof.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The log's public key, or a file that contains it. Get it from somebody you trust, not together
    /// with the proof.
    #[arg(long, value_name = "KEY")]
    key: String,
    /// An older checkpoint that you kept. The log must contain everything that it covers.
    #[arg(long, value_name = "OLD_CHECKPOINT")]
    since: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let key = public_key(&arguments.key)?;
    let bytes = read(&arguments.file)?;
    let proof = Proof::parse(&bytes).map_err(|error| {
        Failure::bad_input(format!("{} is not a proof: {error}", arguments.file.display()))
    })?;
    let since = arguments.since.as_deref().map(read).transpose()?;
    // What is no text is no checkpoint either, and is refused as that.
    let since = since.map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    let verified = evidence::verify(&proof, &key, since.as_deref());
    let text = match (&verified, arguments.json) {
        (Ok(verified), true) => shown::json(&as_json(verified)) + "\n",
        (Err(error), true) => {
            shown::json(&json!({ "verified": false, "reason": error.to_string() })) + "\n"
        }
        (Ok(verified), false) => shown::lines(readable(verified)),
        (Err(_), false) => String::new(),
    };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).map_err(|error| {
        Failure::failed(format!("the result cannot be written to standard output: {error}"))
    })?;
    match verified {
        Ok(_) => Ok(()),
        Err(error) => Err(Failure::failed(format!("not proved: {error}"))),
    }
}

/// - `named`: a public key, or a file that holds one.
pub(super) fn public_key(named: &str) -> Result<VerifierKey, Failure> {
    let text = match named.contains('+') {
        true => named.to_owned(),
        false => String::from_utf8_lossy(&read(Path::new(named))?).into_owned(),
    };
    text.trim().parse().map_err(|error| Failure::bad_input(format!("{named}: {error}")))
}

pub(super) fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    std::fs::read(path)
        .map_err(|error| Failure::bad_input(format!("{} cannot be read: {error}", path.display())))
}

/// The record as it was made, where its body was revealed and this version knows its kind.
fn opened(record: &VerifiedRecord) -> Option<Result<Record, String>> {
    let VerifiedRecord { header, digest, body } = record;
    let event = decode(header.kind, header.version, body.as_deref()?);
    Some(match event {
        Ok(event) => Ok(Record {
            seq: header.seq,
            at: header.at,
            request: header.request,
            prev: header.prev,
            digest: *digest,
            event,
        }),
        Err(error) => Err(error.to_string()),
    })
}

fn readable(verified: &Verified) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(record) = &verified.record {
        let (seq, stream) = (record.header.seq, record.header.stream);
        lines.push(format!("record {seq} of stream {stream} was in the log"));
        lines.push(format!("  digest {}", record.digest));
        match opened(record) {
            None => lines.push("  its body is sealed and was not revealed".to_owned()),
            Some(Ok(opened)) => {
                lines.extend(log::readable(&opened, false).iter().map(|line| format!("  {line}")));
            }
            Some(Err(reason)) => lines.push(format!("  its body was revealed; {reason}")),
        }
    }
    let checkpoint = &verified.checkpoint;
    if let Some(older) = verified.since {
        lines.push(format!("the log only grew, from {older} segments to {}", checkpoint.size));
    }
    let (origin, size, root) = (&checkpoint.origin, checkpoint.size, checkpoint.root);
    lines.push(format!("checkpoint of {origin}: {size} segments, root {root}"));
    lines
}

fn as_json(verified: &Verified) -> Value {
    let record = verified.record.as_ref().map(|record| {
        let header = &record.header;
        let body = match opened(record) {
            Some(Ok(opened)) => log::json(&opened)["event"].clone(),
            _ => Value::Null,
        };
        json!({
            "stream": header.stream,
            "seq": header.seq.get(),
            "kind": header.kind,
            "version": header.version,
            "digest": record.digest,
            "revealed": record.body.is_some(),
            "event": body,
        })
    });
    json!({
        "verified": true,
        "origin": verified.checkpoint.origin,
        "size": verified.checkpoint.size,
        "root": verified.checkpoint.root.to_string(),
        "since": verified.since,
        "record": record,
    })
}
