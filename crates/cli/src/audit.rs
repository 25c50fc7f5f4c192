use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;

use apprentice::ids::{StreamKey, TenantId};
use apprentice::plain::count;
use apprentice::replay::{self, AuditReport, Counts, Scrutiny, StreamReport};
use apprentice::world::household::Household;
use clap::Args;

use super::bar::Bar;
use super::failure::Failure;
use super::{past, shown};

/// Check every record against what this program computes.
///
/// Reads every record, checks its checksum, number, chain and seal, and applies it to the user's
/// session, with the digests of the scenes. The audit works on a copy and does not change the
/// directory.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice audit --data lab
  apprentice audit --data lab --repropose --retrain
  apprentice audit --data lab --tenant local --json | jq .counts

The results go to standard output and the progress bar to standard error. docs/replay.md says what
each digest covers and what an audit cannot see.

Exit codes: 0 no differences; 1 there are differences (the first one of each stream is shown); 2 the
directory cannot be used or has no such tenant.")]
pub struct Arguments {
    /// The data directory. The command works on a copy of it
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Audit only this lab.
    #[arg(long, value_name = "NAME")]
    tenant: Option<String>,
    /// Decide every recorded command again, each with the mind of its time, and compare the result
    /// with the record.
    #[arg(long)]
    repropose: bool,
    /// Train every recorded mind again and compare its digest with the record.
    #[arg(long)]
    retrain: bool,
    /// Print one JSON object, without times.
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
        _ if stream.stream == StreamKey::TENANT => "the tenant's own stream".to_owned(),
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
            "{} with a held time: the clock did not move forward",
            n(counts.held_times, "record")
        ));
    }
    if counts.segments > 0 {
        lines.push(format!("checked {} against their records", n(counts.segments, "segment")));
    }
    if counts.erased_streams > 0 {
        lines.push(format!(
            "{} of erased users: only the chain was checked",
            n(counts.erased_streams, "stream")
        ));
    }
    if scrutiny.repropose {
        let known = match (counts.proposals_differ, counts.streams_differ) {
            (1.., 0) => " (an older version recorded the same meaning in another form)",
            _ => "",
        };
        lines.push(format!(
            "re-decided {} ({} of them utterances): {} differ{known}; minds retrained because \
             missing: {}",
            n(counts.reproposed, "command"),
            counts.reproposed_utterances,
            counts.proposals_differ,
            counts.minds_missing,
        ));
    }
    if scrutiny.retrain {
        lines.push(format!(
            "retrained {} with lessons and {}: {} differ",
            n(counts.retrained, "mind"),
            n(counts.retrained_base, "base mind"),
            counts.trainings_differ
        ));
    }
    lines.push(match counts.streams_differ {
        0 => "no differences".to_owned(),
        differ => format!("differences in {}", n(differ, "stream")),
    });
    lines
}
