//! Compares the whole log with what this binary computes from it.

use std::sync::Arc;

use serde::Serialize;

use super::Difference;
use super::auditor::{Auditor, BaseMinds};
use crate::ids::{Digest, StreamId, StreamKey, TenantId, UserId};
use crate::parallel::{Progress, in_order};
use crate::store::{ReadError, Store};
use crate::world::Domain;

/// What an audit does besides reading, checking and folding every record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Scrutiny {
    /// Decide every recorded command again, with the mind of its moment.
    pub repropose: bool,
    /// Train every recorded mind again.
    pub retrain: bool,
}

/// Everything an audit found. Holds no time and no path: equal logs give equal reports.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AuditReport {
    /// In the order of tenants and stream keys.
    pub streams: Vec<StreamReport>,
    pub counts: Counts,
}

/// What an audit found in one stream.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StreamReport {
    pub tenant: TenantId,
    pub stream: StreamKey,
    /// None when the first record cannot be read, or the person was erased.
    pub user: Option<UserId>,
    /// The person's key was destroyed: only what needs no key was checked.
    pub erased: bool,
    /// The last record that was checked, and its digest.
    pub head: u64,
    pub head_digest: Digest,
    /// The state after it, and the mind it names; none for an erased person.
    pub state_digest: Option<Digest>,
    pub mind: Option<Digest>,
    /// The first place at which the log and this binary part.
    pub difference: Option<Difference>,
    pub counts: Counts,
}

/// How much was checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counts {
    pub streams: u64,
    pub erased_streams: u64,
    pub records: u64,
    pub episodes: u64,
    pub utterances: u64,
    /// Records whose time was held, so that it is not what the wall clock read.
    pub held_times: u64,
    /// Closed segments that were compared with their records.
    pub segments: u64,
    /// Commands that were decided again, utterances among them.
    pub reproposed: u64,
    pub reproposed_utterances: u64,
    /// Commands that would be recorded otherwise today.
    pub proposals_differ: u64,
    /// Minds that reproposing needed and no cache held; they were trained again.
    pub minds_missing: u64,
    /// Trainings that were done again: those of lessons, and those of base minds.
    pub retrained: u64,
    pub retrained_base: u64,
    pub trainings_differ: u64,
    /// Streams with a difference.
    pub streams_differ: u64,
}

impl Counts {
    fn add(&mut self, other: &Counts) {
        let Counts {
            streams,
            erased_streams,
            records,
            episodes,
            utterances,
            held_times,
            segments,
            reproposed,
            reproposed_utterances,
            proposals_differ,
            minds_missing,
            retrained,
            retrained_base,
            trainings_differ,
            streams_differ,
        } = other;
        self.streams += streams;
        self.erased_streams += erased_streams;
        self.records += records;
        self.episodes += episodes;
        self.utterances += utterances;
        self.held_times += held_times;
        self.segments += segments;
        self.reproposed += reproposed;
        self.reproposed_utterances += reproposed_utterances;
        self.proposals_differ += proposals_differ;
        self.minds_missing += minds_missing;
        self.retrained += retrained;
        self.retrained_base += retrained_base;
        self.trainings_differ += trainings_differ;
        self.streams_differ += streams_differ;
    }
}

/// The streams of one tenant, or of all.
///
/// - errors: the store does not say which streams it has.
pub fn streams_of(store: &Store, tenant: Option<&TenantId>) -> Result<Vec<StreamId>, ReadError> {
    let tenants = match tenant {
        Some(tenant) => vec![tenant.clone()],
        None => store.log.tenants()?,
    };
    let streams = tenants.iter().map(|tenant| store.log.streams(tenant));
    Ok(streams.collect::<Result<Vec<_>, _>>()?.concat())
}

/// Audits `streams`, several at once on `threads` threads; the report does not depend on how many.
/// `progress` is told of records.
///
/// One record of each is in memory at a time, and one mind.
pub fn audit<D: Domain>(
    domain: &Arc<D>,
    store: &Store,
    streams: &[StreamId],
    scrutiny: Scrutiny,
    threads: usize,
    progress: &dyn Progress,
) -> AuditReport {
    let heads = streams.iter().map(|stream| store.log.head(stream).map_or(0, |head| head.seq));
    progress.expect(heads.sum());
    let bases = BaseMinds::default();
    // Progress counts records, which the auditors do.
    let mut streams = in_order(threads, &(), streams, |stream| {
        Auditor::new(domain, store, stream, scrutiny, &bases).audit(progress)
    });
    streams.sort_by(|a: &StreamReport, b| (&a.tenant, a.stream.0).cmp(&(&b.tenant, b.stream.0)));
    let mut counts = Counts::default();
    streams.iter().for_each(|stream| counts.add(&stream.counts));
    AuditReport { streams, counts }
}
