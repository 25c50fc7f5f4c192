use super::{Tree, TreeHash};
use crate::ids::{Digest, Seq, StreamKey};

/// A run of records of one stream that a leaf of the tenant's tree speaks for.
///
/// The leaf's bytes, big-endian, [`Segment::BYTES`] long:
///
/// | bytes | field |
/// |---|---|
/// | 4 | magic `APS1` |
/// | 16 | stream key |
/// | 8 | sequence number of the first record |
/// | 8 | sequence number of the last record |
/// | 32 | root of the Merkle tree over the digests of these records, in order |
/// | 32 | digest of the last record |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Segment {
    pub stream: StreamKey,
    pub first: Seq,
    pub last: Seq,
    pub root: TreeHash,
    /// The digest of the last record, which chains all before it.
    pub head: Digest,
}

const MAGIC: [u8; 4] = *b"APS1";

impl Segment {
    pub const BYTES: usize = 100;

    /// The segment of the records with these digests, the first of which is record `first`; none
    /// for no records.
    pub fn of(stream: StreamKey, first: Seq, digests: &[Digest]) -> Option<Segment> {
        let head = *digests.last()?;
        let last = Seq::new(first.get().checked_add(digests.len() as u64 - 1)?)?;
        let root = Tree(&Segment::leaves(digests)).root();
        Some(Segment { stream, first, last, root, head })
    }

    /// The leaves of a segment's own tree.
    pub fn leaves(digests: &[Digest]) -> Vec<TreeHash> {
        digests.iter().map(|digest| TreeHash::of_leaf(&digest.0)).collect()
    }

    pub fn to_bytes(&self) -> [u8; Segment::BYTES] {
        let parts: [&[u8]; 6] = [
            &MAGIC,
            &self.stream.0,
            &self.first.get().to_be_bytes(),
            &self.last.get().to_be_bytes(),
            &self.root.0,
            &self.head.0,
        ];
        parts.concat().try_into().expect("these parts have 100 bytes together")
    }

    /// The leaf of the tenant's tree.
    pub fn leaf(&self) -> TreeHash {
        TreeHash::of_leaf(&self.to_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaf_names_stream_range_root_and_head() {
        let digests = [Digest([1; 32]), Digest([2; 32])];
        let first = Seq::new(7).unwrap();
        let segment = Segment::of(StreamKey([9; 16]), first, &digests).unwrap();
        assert_eq!((segment.last.get(), segment.head), (8, digests[1]));
        let bytes = segment.to_bytes();
        assert_eq!(&bytes[..4], b"APS1");
        assert_eq!(
            &bytes[4..36],
            [&[9; 16][..], &[0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 8]].concat()
        );
        let root = TreeHash::of_node(TreeHash::of_leaf(&[1; 32]), TreeHash::of_leaf(&[2; 32]));
        assert_eq!(bytes[36..], [root.0, [2; 32]].concat());
    }

    #[test]
    fn no_records_and_a_range_beyond_the_last_number_are_no_segment() {
        assert_eq!(Segment::of(StreamKey([9; 16]), Seq::FIRST, &[]), None);
        let end = Seq::new(u64::MAX).unwrap();
        assert!(Segment::of(StreamKey([9; 16]), end, &[Digest::ZERO]).is_some());
        assert_eq!(Segment::of(StreamKey([9; 16]), end, &[Digest::ZERO; 2]), None);
    }
}
