use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use apprentice::client::{Followed, Follower, Position};
use apprentice::ids::{Seq, StreamKey, WithinTenant};
use clap::Args;
use data_encoding::HEXLOWER;
use serde_json::{Value, json};

use super::credentials::Credentials;
use super::embedded;
use super::failure::Failure;
use super::shown;

/// Print each new record of a lab as soon as it is durable. No record is missed or repeated.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice follow --connect tcp://robot.example:7117 --key auditor.key --server-key server.pub
  apprentice follow --connect tcp://robot.example:7117 --key operator.key --server-key server.pub \\
      --plain --json --state positions.json >> records.ndjson

The service must run with --feed. Each record is checked against its own digest and the digest of the
record before it. With --state, it is also checked against the records of earlier runs. After a kill,
the last record may be printed again.

Exit codes: 0 interrupted; 1 no answer, the key is not admitted, or the log was rewritten; 2 an
argument cannot be used.")]
pub struct Arguments {
    /// The service's endpoint with keys.
    #[arg(long, value_name = "ENDPOINT")]
    connect: String,
    #[command(flatten)]
    credentials: Credentials,
    /// Print decrypted records. This needs an operator key.
    #[arg(long)]
    plain: bool,
    /// Print one JSON object per line. Sealed records contain all their bytes.
    #[arg(long)]
    json: bool,
    /// Start after the position in this file, and update the file.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Stop after this many seconds without a record.
    #[arg(long, value_name = "SECONDS")]
    until_quiet: Option<u64>,
}

/// How long a look at the feed takes before signals are looked at.
const LOOK: Duration = Duration::from_millis(200);

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    if !arguments.credentials.is_given() {
        return Err(Failure::bad_input("a feed needs a key; name yours with --key"));
    }
    let positions = arguments.state.as_deref().map(read).transpose()?.unwrap_or_default();
    let client = arguments.credentials.client(&arguments.connect, embedded::user("follower")?)?;
    let mut follower = match arguments.plain {
        true => Follower::plain(client, positions),
        false => Follower::sealed(client, positions),
    };
    let stopped = Arc::new(AtomicBool::new(false));
    let stop = stopped.clone();
    ctrlc::set_handler(move || stop.store(true, Ordering::SeqCst))
        .map_err(|error| Failure::failed(format!("signals cannot be handled: {error}")))?;
    let (mut quiet, mut unkept) = (Duration::ZERO, false);
    while !stopped.load(Ordering::SeqCst) {
        match follower.next(if unkept { Duration::ZERO } else { LOOK }).map_err(Failure::failed)? {
            Some(followed) => {
                show(&followed, arguments.json).map_err(|error| {
                    Failure::failed(format!("standard output cannot be written: {error}"))
                })?;
                (quiet, unkept) = (Duration::ZERO, true);
            }
            // After the last of those that came together.
            None if unkept => {
                keep(&arguments, &follower)?;
                unkept = false;
            }
            None => {
                quiet += LOOK;
                if arguments.until_quiet.is_some_and(|limit| quiet.as_secs() >= limit) {
                    break;
                }
            }
        }
    }
    // What was received and not printed is not kept either: the positions are those of the last
    // record that was given out only when nothing is left.
    match unkept {
        true => Ok(()),
        false => keep(&arguments, &follower),
    }
}

fn show(followed: &Followed, as_json: bool) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match (followed, as_json) {
        (Followed::Sealed(record), true) => {
            let frame = HEXLOWER.encode(&record.frame.0);
            let (stream, digest) = (record.stream.to_hex(), record.digest.to_hex());
            let seq = record.seq.get();
            let line = json!({"stream": stream, "seq": seq, "digest": digest, "frame": frame});
            writeln!(out, "{}", shown::json(&line))?;
        }
        (Followed::Sealed(record), false) => {
            let (stream, seq, digest) = (record.stream, record.seq, record.digest.short());
            let bytes = record.frame.0.len();
            writeln!(out, "{stream} {seq:>6}  {digest}  {bytes} bytes")?;
        }
        (Followed::Plain(record), true) => {
            let line = serde_json::to_value(record).unwrap_or(Value::Null);
            writeln!(out, "{}", shown::json(&line))?;
        }
        (Followed::Plain(record), false) => {
            let (stream, seq, kind) = (record.stream, record.seq, &record.kind);
            let event = shown::json(&record.event);
            let line = format!("{stream} {seq:>6}  {kind:<21}  {event}");
            out.write_all(shown::lines([line]).as_bytes())?;
        }
        (Followed::Erased { stream, last }, true) => {
            let line = json!({"stream": stream.to_hex(), "seq": last.seq.get(), "erased": true});
            writeln!(out, "{line}")?;
        }
        (Followed::Erased { stream, last }, false) => {
            writeln!(out, "{stream} {:>6}  (this person was erased)", last.seq)?;
        }
    }
    out.flush()
}

fn read(path: &Path) -> Result<WithinTenant<Position>, Failure> {
    let bad = |reason: String| {
        Failure::bad_input(format!("{} is not a file of positions: {reason}", path.display()))
    };
    let text = match fs::read_to_string(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(WithinTenant::new()),
        text => text.map_err(|error| bad(error.to_string()))?,
    };
    let read: BTreeMap<String, (u64, String)> =
        serde_json::from_str(&text).map_err(|error| bad(error.to_string()))?;
    let position = |(stream, (seq, digest)): (String, (u64, String))| {
        let seq = Seq::new(seq).ok_or("records are numbered from 1 on")?;
        let digest = digest.parse().map_err(|_| "a digest has 64 hexadecimal digits")?;
        let stream = stream.parse().map_err(|_| "a stream has 32 hexadecimal digits")?;
        Ok((stream, Position { seq, digest }))
    };
    read.into_iter().map(position).collect::<Result<_, &str>>().map_err(|it| bad(it.to_owned()))
}

fn keep(arguments: &Arguments, follower: &Follower) -> Result<(), Failure> {
    let Some(path) = &arguments.state else { return Ok(()) };
    let text = |(stream, at): (StreamKey, &Position)| {
        (stream.to_hex(), json!([at.seq.get(), at.digest.to_hex()]))
    };
    let positions: serde_json::Map<String, Value> = follower.positions().iter().map(text).collect();
    let new = path.with_extension("new");
    fs::write(&new, format!("{}\n", Value::Object(positions)))
        .and_then(|()| fs::rename(&new, path))
        .map_err(|error| Failure::failed(format!("{} cannot be written: {error}", path.display())))
}
