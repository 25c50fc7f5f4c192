use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use serde_json::{Value, json};

use super::embedded;
use super::failure::Failure;
use super::passport::Passport;
use super::shown;
use crate::frontends::{Followed, Follower, Position};
use crate::ids::{Seq, StreamKey, WithinTenant};

/// Follow what a lab's service records, and miss nothing: each record once, as soon as it is durable.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice follow --connect tcp://robot.example:7117 --key auditor.key --server-key server.pub
  apprentice follow --connect tcp://robot.example:7117 --key operator.key --server-key server.pub \\
      --plain --json --state positions.json >> records.ndjson

The service must have been started with --feed. Each record is held against its digest and its
predecessor's; with --state, against what was seen before, too. A record that was printed just before a
kill may be printed again.

Exit codes: 0 interrupted, 1 no answer, not admitted (any more), or a log that was rewritten, 2 an argument
that cannot be used.")]
pub struct Arguments {
    /// The service's door with keys.
    #[arg(long, value_name = "ENDPOINT")]
    connect: String,
    #[command(flatten)]
    passport: Passport,
    /// Records in the clear; for operators.
    #[arg(long)]
    plain: bool,
    /// One JSON object per line; sealed records with all of their bytes.
    #[arg(long)]
    json: bool,
    /// Go on where this file says, and keep it up to date.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// End when nothing came for so many seconds, instead of never.
    #[arg(long, value_name = "SECONDS")]
    until_quiet: Option<u64>,
}

/// How long a look at the feed takes before signals are looked at.
const LOOK: Duration = Duration::from_millis(200);

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    if !arguments.passport.is_given() {
        return Err(Failure::bad_input("a feed lets in only those with a key: name it with --key"));
    }
    let positions = arguments.state.as_deref().map(read).transpose()?.unwrap_or_default();
    let client = arguments.passport.client(&arguments.connect, embedded::user("follower")?)?;
    let mut follower = match arguments.plain {
        true => Follower::plain(client, positions),
        false => Follower::sealed(client, positions),
    };
    let stopped = Arc::new(AtomicBool::new(false));
    let stop = stopped.clone();
    ctrlc::set_handler(move || stop.store(true, Ordering::SeqCst))
        .map_err(|error| Failure::failed(format!("signals cannot be heard: {error}")))?;
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
            let frame: String = record.frame.0.iter().map(|byte| format!("{byte:02x}")).collect();
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
        Failure::bad_input(format!("{} holds no positions: {reason}", path.display()))
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
