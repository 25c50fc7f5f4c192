//! Layout 1, written by 0.1. It differs from layout 2 only in the database `cache/`. Its blobs do
//! not name the code that made them:
//!
//! - tree `models/<tenant>`: key = stream key (16) ‖ digest of the mind (32) ‖ number of the piece
//!   (4). The pieces in order are nonce ‖ sealed bytes of the mind, under the person's data key,
//!   with [`SealedMind::bound`] as associated data;
//! - tree `snapshots/<tenant>`: states, which no later version can read.

use std::collections::BTreeMap;

/// The beginning of the names of trees with minds. The tenant follows.
pub const MINDS: &str = "models/";
/// The beginning of the names of trees with snapshots.
pub const SNAPSHOTS: &str = "snapshots/";

/// Bytes of a mind's key, without the number of the piece.
const MIND_KEY: usize = 16 + 32;
const PIECE: usize = 4;

/// A mind in layout 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SealedMind {
    /// The key of the person's stream.
    pub stream: [u8; 16],
    /// Of the mind's bytes.
    pub digest: [u8; 32],
    /// Nonce, then the sealed bytes.
    pub sealed: Vec<u8>,
}

impl SealedMind {
    /// The associated data of the seal.
    pub fn bound(&self) -> Vec<u8> {
        [&b"apprentice 1: mind\0"[..], &self.stream, &self.digest].concat()
    }
}

/// Joins the pieces of a person's minds. Other keys are left out.
pub fn minds(entries: impl IntoIterator<Item = (Vec<u8>, Vec<u8>)>) -> Vec<SealedMind> {
    let pieces = entries.into_iter().filter(|(key, _)| key.len() == MIND_KEY + PIECE);
    let pieces: BTreeMap<Vec<u8>, Vec<u8>> = pieces.collect();
    let mut found: Vec<SealedMind> = Vec::new();
    for (key, piece) in pieces {
        let (stream, rest) = key.split_first_chunk().expect("its length was checked");
        let (digest, _) = rest.split_first_chunk().expect("its length was checked");
        match found.last_mut().filter(|mind| (&mind.stream, &mind.digest) == (stream, digest)) {
            Some(mind) => mind.sealed.extend(piece),
            None => found.push(SealedMind { stream: *stream, digest: *digest, sealed: piece }),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_come_together_in_order_and_minds_stay_apart() {
        let key = |stream: u8, digest: u8, piece: u32| {
            [vec![stream; 16], vec![digest; 32], piece.to_be_bytes().to_vec()].concat()
        };
        let entries = [
            (key(1, 2, 1), b"b".to_vec()),
            (key(1, 2, 0), b"a".to_vec()),
            (key(1, 3, 0), b"c".to_vec()),
            (b"no key".to_vec(), b"x".to_vec()),
        ];
        let found = minds(entries);
        let sealed: Vec<&[u8]> = found.iter().map(|mind| &mind.sealed[..]).collect();
        assert_eq!(sealed, [&b"ab"[..], b"c"]);
        assert_eq!(found[1].bound(), [&b"apprentice 1: mind\0"[..], &[1; 16], &[3; 32]].concat());
    }
}
