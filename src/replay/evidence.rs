//! Between the log and its evidence: which segments are due, whether the recorded ones agree with
//! the records, and proofs.

use crate::events::{EventKind, Header, SegmentClosed};
use crate::evidence::{
    self, Checkpoint, CheckpointError, Consistency, Inclusion, KeyNameError, NoteSigner, Proof,
    Revealed, Segment, Tree, TreeHash,
};
use crate::ids::{Digest, Seq, Signature, StreamId, TenantId};
use crate::store::{EventLog, FeedError, KeyError, Keys, ReadError, Store};
use crate::tenancy::Registry;

/// The name of a service that was given none.
pub const ORIGIN: &str = "apprentice";

/// How far a stream is to be covered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Through {
    /// Up to the last end of an episode.
    Episodes,
    /// Up to its last record.
    Head,
}

/// The segments of `stream` that are due from record `from` on: one for each end of an episode or of
/// a whole life, and the rest where `through` says so. A function of the records alone; it needs no
/// key.
pub fn due_segments(
    log: &dyn EventLog,
    stream: &StreamId,
    from: Seq,
    through: Through,
) -> Result<Vec<SegmentClosed>, ReadError> {
    let ends = [EventKind::EpisodeEnded as u16, EventKind::SessionClosed as u16];
    let (mut due, mut first, mut digests) = (Vec::new(), from, Vec::new());
    let mut close = |first: Seq, digests: &mut Vec<Digest>| {
        let segment = Segment::of(stream.key, first, digests);
        digests.clear();
        due.extend(segment.map(closed));
    };
    for record in log.sealed(stream, from)? {
        let record = record?;
        digests.push(record.digest);
        if ends.contains(&record.header.kind) {
            close(first, &mut digests);
            first = record.header.seq.next();
        }
    }
    if through == Through::Head {
        close(first, &mut digests);
    }
    Ok(due)
}

fn closed(segment: Segment) -> SegmentClosed {
    let Segment { stream, first, last, root, head } = segment;
    SegmentClosed { stream, first, last, root: Digest(root.0), head }
}

/// A recorded segment as the leaf it is.
pub fn leaf_of(closed: &SegmentClosed) -> TreeHash {
    let SegmentClosed { stream, first, last, root, head } = *closed;
    Segment { stream, first, last, root: TreeHash(root.0), head }.leaf()
}

/// The leaves of a tenant's tree.
pub fn leaves_of(registry: &Registry) -> Vec<TreeHash> {
    registry.segments().iter().map(|segment| leaf_of(&segment.closed)).collect()
}

/// Where the records that a segment speaks for are not those it was closed over.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SegmentError {
    #[error("some of its records are missing: {0}")]
    Missing(String),
    #[error("the root of its records is {found}")]
    Root { found: TreeHash },
    #[error("its last record has the digest {found}")]
    Head { found: Digest },
    #[error(transparent)]
    Read(#[from] ReadError),
}

/// Reads the records of a closed segment again and compares.
///
/// - returns: their digests, and the sealed bytes of record `wanted`, if it is one of them.
pub fn check_segment(
    log: &dyn EventLog,
    tenant: &TenantId,
    segment: &SegmentClosed,
    wanted: Option<Seq>,
) -> Result<(Vec<Digest>, Option<Vec<u8>>), SegmentError> {
    let stream = StreamId { tenant: tenant.clone(), key: segment.stream };
    let (mut digests, mut frame) = (Vec::new(), None);
    for record in log.sealed(&stream, segment.first)? {
        let record = record?;
        digests.push(record.digest);
        if Some(record.header.seq) == wanted {
            frame = Some(record.frame);
        }
        if record.header.seq == segment.last {
            break;
        }
    }
    let count = segment.last.get() - segment.first.get() + 1;
    let found = match Segment::of(segment.stream, segment.first, &digests) {
        Some(found) if digests.len() as u64 == count => found,
        _ => {
            let there = digests.len();
            return Err(SegmentError::Missing(format!("{there} of {count} exist")));
        }
    };
    if found.head != segment.head {
        return Err(SegmentError::Head { found: found.head });
    }
    if found.root.0 != segment.root.0 {
        return Err(SegmentError::Root { found: found.root });
    }
    Ok((digests, frame))
}

/// Why there are no checkpoints to go by.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CheckpointsError {
    #[error(transparent)]
    Feed(#[from] FeedError),
    #[error(transparent)]
    Key(#[from] KeyError),
    #[error("the name of the service: {0}")]
    Name(#[from] KeyNameError),
    #[error(
        "the newest checkpoint that was given out is not ours: {0}; was the tenant's key or the \
         name of the service replaced?"
    )]
    Foreign(CheckpointError),
    #[error(
        "the log was rolled back: its newest checkpoint has {signed} segments, the log {found}; \
         restore the newer log, or, if it is lost, move the file of checkpoints away and tell \
         everyone who keeps checkpoints of this log"
    )]
    RolledBack { signed: u64, found: u64 },
    #[error(
        "the log was forked: its first {signed} segments are not those of its newest checkpoint; \
         restore the log that was signed, or, if it is lost, move the file of checkpoints away and \
         tell everyone who keeps checkpoints of this log"
    )]
    Forked { signed: u64 },
}

/// Who signs a tenant's checkpoints.
pub fn signer_of(store: &Store, tenant: &TenantId) -> Result<NoteSigner, CheckpointsError> {
    let origin = store.checkpoints.origin()?;
    let name = format!("{}/{tenant}", origin.as_deref().unwrap_or(ORIGIN));
    Ok(NoteSigner::new(&name, &*store.keys.signing_secret(tenant)?)?)
}

/// The newest checkpoint of a tenant that was given out, once it was compared with the tree of
/// today; none when none was.
pub fn newest_checkpoint(
    store: &Store,
    tenant: &TenantId,
    registry: &Registry,
) -> Result<Option<(String, Checkpoint)>, CheckpointsError> {
    let Some(note) = store.checkpoints.newest(tenant)? else { return Ok(None) };
    let signer = signer_of(store, tenant)?;
    let checkpoint =
        Checkpoint::open(&note, &signer.public()).map_err(CheckpointsError::Foreign)?;
    let (signed, found) = (checkpoint.size, registry.segments().len() as u64);
    if signed > found {
        return Err(CheckpointsError::RolledBack { signed, found });
    }
    let size = usize::try_from(signed).expect("not above a count of things in memory");
    if Tree(&leaves_of(registry)[..size]).root() != checkpoint.root {
        return Err(CheckpointsError::Forked { signed });
    }
    Ok(Some((note, checkpoint)))
}

/// Signs the tree of a tenant, unless its newest checkpoint says the same, and keeps the checkpoint
/// with the others.
///
/// - returns: the signed note.
/// - errors: the tree does not continue the newest checkpoint, too: such a log is not signed.
pub fn keep_checkpoint(
    store: &Store,
    tenant: &TenantId,
    registry: &Registry,
) -> Result<String, CheckpointsError> {
    let leaves = leaves_of(registry);
    let size = leaves.len() as u64;
    if let Some((note, newest)) = newest_checkpoint(store, tenant, registry)?
        && newest.size == size
    {
        return Ok(note);
    }
    let signer = signer_of(store, tenant)?;
    let origin = signer.name().to_owned();
    let note = Checkpoint { origin, size, root: Tree(&leaves).root() }.sign(&signer);
    store.checkpoints.append(tenant, &note)?;
    Ok(note)
}

/// Signs what a tenant states.
pub fn sign_statement(
    keys: &Keys,
    tenant: &TenantId,
    statement: &[u8],
) -> Result<Signature, KeyError> {
    Ok(evidence::sign(&*keys.signing_secret(tenant)?, statement))
}

/// Why a proof cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProveError {
    #[error("the stream has {last} records; there is no record {seq}")]
    Absent { seq: u64, last: u64 },
    #[error(
        "record {seq} is not yet covered: closed segments reach record {covered} of this stream; \
         `apprentice checkpoint` closes the rest and signs it"
    )]
    NotCovered { seq: u64, covered: u64 },
    #[error(
        "record {seq} is in a closed segment that no checkpoint covers yet; `apprentice \
         checkpoint` signs one"
    )]
    NotSigned { seq: u64 },
    #[error("the records changed after their segment was closed: {0}")]
    Segment(#[from] SegmentError),
    #[error("the older checkpoint has {older} segments, but the newest one has only {newest}")]
    Older { older: u64, newest: u64 },
    #[error("the record cannot be revealed: {0}")]
    Sealed(ReadError),
    #[error("the record cannot be revealed: {0}")]
    Key(#[from] KeyError),
    #[error(transparent)]
    Checkpoints(#[from] CheckpointsError),
    #[error("no checkpoint was signed yet; run `apprentice checkpoint`")]
    Unsigned,
}

/// What a proof is to show.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wanted<'a> {
    /// A record of this stream.
    pub record: Option<(&'a StreamId, Seq)>,
    /// With its body in the clear.
    pub reveal: bool,
    /// The size of an older checkpoint that the log grew from.
    pub since: Option<u64>,
}

/// Makes a proof against the newest checkpoint that was given out.
///
/// - errors: [`ProveError`]; a proof that would not verify is not made.
pub fn prove(
    store: &Store,
    tenant: &TenantId,
    registry: &Registry,
    wanted: &Wanted<'_>,
) -> Result<Proof, ProveError> {
    let newest = newest_checkpoint(store, tenant, registry)?;
    let place = match wanted.record {
        Some((stream, seq)) => Some((seq, place_of(store, registry, stream, seq)?)),
        None => None,
    };
    let (checkpoint, newest) = newest.ok_or(ProveError::Unsigned)?;
    let size = usize::try_from(newest.size).expect("compared with the tree in memory");
    let leaves = &leaves_of(registry)[..size];
    let record = match place {
        None => None,
        Some((seq, place)) if place >= size => {
            return Err(ProveError::NotSigned { seq: seq.get() });
        }
        Some((seq, place)) => {
            let segment = &registry.segments()[place].closed;
            let (digests, frame) = check_segment(&*store.log, tenant, segment, Some(seq))?;
            let frame = frame.expect("the segment holds the record and was read to its end");
            let stream = StreamId { tenant: tenant.clone(), key: segment.stream };
            let revealed = match wanted.reveal {
                true => Some(reveal(store, &stream, &frame)?),
                false => None,
            };
            let at = usize::try_from(seq.get() - segment.first.get()).expect("read just now");
            let path = Tree(&Segment::leaves(&digests)).path(at);
            let tree_path = Tree(leaves).path(place);
            Some(Inclusion {
                frame,
                revealed,
                stream: segment.stream,
                first: segment.first,
                last: segment.last,
                head: segment.head,
                segment_path: path.expect("the record is one of them"),
                leaf: place as u64,
                tree_path: tree_path.expect("compared with the size"),
            })
        }
    };
    let since = match wanted.since {
        None => None,
        Some(older) => {
            let path = usize::try_from(older).ok().and_then(|size| Tree(leaves).consistency(size));
            let path = path.ok_or(ProveError::Older { older, newest: newest.size })?;
            Some(Consistency { size: older, path })
        }
    };
    Ok(Proof { record, since, checkpoint })
}

/// The segment that covers a record.
fn place_of(
    store: &Store,
    registry: &Registry,
    stream: &StreamId,
    seq: Seq,
) -> Result<usize, ProveError> {
    let last = store.log.head(stream).map_err(SegmentError::from)?.seq;
    if seq.get() > last {
        return Err(ProveError::Absent { seq: seq.get(), last });
    }
    let covers = |segment: &SegmentClosed| {
        segment.stream == stream.key && segment.first <= seq && seq <= segment.last
    };
    let place = registry.segments().iter().position(|segment| covers(&segment.closed));
    place.ok_or_else(|| ProveError::NotCovered {
        seq: seq.get(),
        covered: registry.uncovered(stream.key).get() - 1,
    })
}

fn reveal(store: &Store, stream: &StreamId, frame: &[u8]) -> Result<Revealed, ProveError> {
    let (header, sealed, _) = Header::unframe(frame).expect("it was checked when it was read");
    let key = store.keys.user_key(stream)?;
    let (salt, body) = key.reveal(&header, sealed).map_err(ProveError::Sealed)?;
    Ok(Revealed { salt, body })
}
