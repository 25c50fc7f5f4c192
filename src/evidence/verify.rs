use super::checkpoint::CheckpointError;
use super::{
    Checkpoint, Inclusion, Proof, Segment, TreeHash, VerifierKey, is_consistent, root_by_path,
};
use crate::events::{Header, HeaderError, commitment};
use crate::ids::Digest;

/// What a proof shows, once [`verify`] has found nothing wrong with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verified {
    pub checkpoint: Checkpoint,
    pub record: Option<VerifiedRecord>,
    /// The size of the older tree that the present one begins with.
    pub since: Option<u64>,
}

/// A record that stood in the log when the checkpoint was signed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VerifiedRecord {
    pub header: Header,
    pub digest: Digest,
    /// The body that the record commits to, where it was revealed.
    pub body: Option<Vec<u8>>,
}

/// Why a proof does not show what it claims.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum VerifyError {
    #[error("the checkpoint: {0}")]
    Checkpoint(CheckpointError),
    #[error("the older checkpoint: {0}")]
    Older(CheckpointError),
    #[error("the record is not as it was written: {0}")]
    Record(HeaderError),
    #[error("the record is number {seq} of stream {stream}, and the segment does not contain it")]
    Elsewhere { stream: String, seq: u64 },
    #[error("the path in the segment does not match its number of records")]
    SegmentPath,
    #[error("the record is the last of its segment, but its digest is not the segment's head")]
    Head,
    #[error("the path in the tree does not match the position and the tree's size of {size}")]
    TreePath { size: u64 },
    #[error(
        "the record and its paths give the root {found}, but the checkpoint signs {signed}: this is \
         not the record that was in the log"
    )]
    Root { found: TreeHash, signed: TreeHash },
    #[error("the salt and the body do not match the commitment in the record")]
    Commitment,
    #[error(
        "the log was rolled back: the older checkpoint has {older} segments, but this one only {newer}"
    )]
    RolledBack { older: u64, newer: u64 },
    #[error(
        "the file does not show how the log grew from {older} segments to {newer}; ask for a proof \
         made with --since and the older checkpoint"
    )]
    NotShown { older: u64, newer: u64 },
    #[error(
        "the log was forked: its {newer} segments do not begin with the {older} segments of the older \
         checkpoint"
    )]
    Forked { older: u64, newer: u64 },
}

/// Checks everything a proof says, with the log's public key and nothing else.
///
/// - `since`: a checkpoint of the same log that was kept from earlier.
/// - errors: the first thing that does not hold.
pub fn verify(
    proof: &Proof,
    key: &VerifierKey,
    since: Option<&str>,
) -> Result<Verified, VerifyError> {
    let checkpoint = Checkpoint::open(&proof.checkpoint, key).map_err(VerifyError::Checkpoint)?;
    let record = match &proof.record {
        Some(record) => Some(verify_record(record, &checkpoint)?),
        None => None,
    };
    let since = match since {
        Some(older) => Some(verify_growth(proof, &checkpoint, older, key)?),
        None => None,
    };
    Ok(Verified { checkpoint, record, since })
}

fn verify_record(
    record: &Inclusion,
    checkpoint: &Checkpoint,
) -> Result<VerifiedRecord, VerifyError> {
    let (header, _, digest) = Header::unframe(&record.frame).map_err(VerifyError::Record)?;
    let Inclusion { stream, first, last, head, .. } = *record;
    let seq = header.seq;
    if header.stream != stream || seq < first || seq > last {
        let stream = header.stream.to_hex();
        return Err(VerifyError::Elsewhere { stream, seq: seq.get() });
    }
    if seq == last && digest != head {
        return Err(VerifyError::Head);
    }
    // The first number is at least 1, so that the count fits.
    let (index, count) = (seq.get() - first.get(), last.get() - first.get() + 1);
    let root = root_by_path(index, count, TreeHash::of_leaf(&digest.0), &record.segment_path)
        .ok_or(VerifyError::SegmentPath)?;
    let leaf = Segment { stream, first, last, root, head }.leaf();
    let size = checkpoint.size;
    let found = root_by_path(record.leaf, size, leaf, &record.tree_path)
        .ok_or(VerifyError::TreePath { size })?;
    if found != checkpoint.root {
        return Err(VerifyError::Root { found, signed: checkpoint.root });
    }
    let body = match &record.revealed {
        None => None,
        Some(revealed) if commitment(&revealed.salt, &revealed.body) == header.commitment => {
            Some(revealed.body.clone())
        }
        Some(_) => return Err(VerifyError::Commitment),
    };
    Ok(VerifiedRecord { header, digest, body })
}

fn verify_growth(
    proof: &Proof,
    checkpoint: &Checkpoint,
    older: &str,
    key: &VerifierKey,
) -> Result<u64, VerifyError> {
    let before = Checkpoint::open(older, key).map_err(VerifyError::Older)?;
    let (older, newer) = (before.size, checkpoint.size);
    if older > newer {
        return Err(VerifyError::RolledBack { older, newer });
    }
    let path = match &proof.since {
        Some(since) if since.size == older => &since.path[..],
        // Two equal sizes, or none at first, need no path.
        _ if older == newer || older == 0 => &[],
        _ => return Err(VerifyError::NotShown { older, newer }),
    };
    match is_consistent((older, before.root), (newer, checkpoint.root), path) {
        true => Ok(older),
        false => Err(VerifyError::Forked { older, newer }),
    }
}
