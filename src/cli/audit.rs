use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;

use clap::Args;

use super::bar::Bar;
use super::failure::Failure;
use super::{past, shown, terminal::count};
use crate::ids::{StreamKey, TenantId};
use crate::replay::{self, AuditReport, Counts, Scrutiny, StreamReport};
use crate::world::household::Household;

/// Hold everything recorded against what this program computes.
///
/// Every record is read, its checksum, number, chain and seal are checked, and it is folded into
/// its person's session, scene digests included. The directory is copied first and stays as it is.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice audit --data lab
  apprentice audit --data lab --repropose --retrain
  apprentice audit --data lab --tenant local --json | jq .counts

Counts are on standard output, progress on standard error. docs/replay.md says what each digest
covers and what an audit can not see.

Exit codes: 0 no differences; 1 differences, the first of each stream named; 2 the directory cannot
be used or has no such tenant.")]
pub struct Arguments {
    /// The data directory; it is copied first, and the copy is read
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Only this lab's people.
    #[arg(long, value_name = "NAME")]
    tenant: Option<String>,
    /// Interpret every recorded utterance again, with the mind of its moment, and decide every
    /// lesson again; compare what would be recorded today with what was.
    #[arg(long)]
    repropose: bool,
    /// Train every recorded mind again and compare digests.
    #[arg(long)]
    retrain: bool,
    /// One JSON object, without times.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let tenant = arguments.tenant.as_deref().map(TenantId::new).transpose();
    let tenant = tenant.map_err(Failure::bad_input)?;
    let past = past::open(arguments.data)?;
    if let Some(tenant) = &tenant {
        past.check_tenant(tenant)?;
    }
    let streams = replay::streams_of(&past.store, tenant.as_ref()).map_err(Failure::failed)?;
    let scrutiny = Scrutiny { repropose: arguments.repropose, retrain: arguments.retrain };
    let threads = thread::available_parallelism().map_or(1, |cores| cores.get());
    let (domain, bar) = (Arc::new(Household::new()), Bar::new("records"));
    let report = replay::audit(&domain, &past.store, &streams, scrutiny, threads, &bar);
    bar.finish();
    let text = match arguments.json {
        true => shown::json_pretty(&report) + "\n",
        false => readable(&report, scrutiny),
    };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).map_err(|error| {
        Failure::failed(format!("the audit cannot be written to standard output: {error}"))
    })?;
    match report.counts.streams_differ {
        0 => Ok(()),
        _ => Err(Failure::differences()),
    }
}

fn readable(report: &AuditReport, scrutiny: Scrutiny) -> String {
    let lines = report.streams.iter().flat_map(stream_lines);
    shown::lines(lines.chain(count_lines(&report.counts, scrutiny)))
}

fn stream_lines(stream: &StreamReport) -> Vec<String> {
    let who = match (&stream.user, stream.erased) {
        (Some(user), _) => user.to_string(),
        _ if stream.stream == StreamKey::TENANT => "the tenant's own".to_owned(),
        (None, true) => "erased".to_owned(),
        (None, false) => "unknown".to_owned(),
    };
    let short = stream.head_digest.short();
    let (tenant, key) = (&stream.tenant, stream.stream);
    let records = count(stream.counts.records, "record");
    let mut lines = vec![format!("{tenant}/{key}  {who}: {records}, head {short}")];
    if let Some(difference) = &stream.difference {
        lines.push(format!("  differs at {difference}"));
    }
    lines
}

fn count_lines(counts: &Counts, scrutiny: Scrutiny) -> Vec<String> {
    let n = |number: u64, what: &str| count(number, what);
    let mut lines = vec![format!(
        "audited {}: {}, {}, {}",
        n(counts.streams, "stream"),
        n(counts.records, "record"),
        n(counts.episodes, "episode"),
        n(counts.utterances, "utterance")
    )];
    if counts.held_times > 0 {
        lines.push(format!(
            "{} with a held time: the clock read no later than the record before",
            n(counts.held_times, "record")
        ));
    }
    if counts.segments > 0 {
        lines.push(format!("held {} against their records", n(counts.segments, "segment")));
    }
    if counts.erased_streams > 0 {
        lines.push(format!(
            "of {} only the chain was checked: the people behind them were erased",
            n(counts.erased_streams, "stream")
        ));
    }
    if scrutiny.repropose {
        lines.push(format!(
            "decided again: {}, {} of them; {} otherwise today; {} missing and trained for it",
            n(counts.reproposed, "command"),
            n(counts.reproposed_utterances, "utterance"),
            counts.proposals_differ,
            n(counts.minds_missing, "mind"),
        ));
    }
    if scrutiny.retrain {
        lines.push(format!(
            "trained again: {} of lessons, {}; {} with another digest",
            n(counts.retrained, "mind"),
            n(counts.retrained_base, "base mind"),
            counts.trainings_differ
        ));
    }
    lines.push(match counts.streams_differ {
        0 => "no differences".to_owned(),
        differ => format!("{} with differences", n(differ, "stream")),
    });
    lines
}
