//! The header of a record: what links the records of a stream, and can be checked without a key.

use crate::ids::{Digest, RequestId, Seq, StreamKey, Timestamp};

/// A record's fixed header, big-endian, [`Header::BYTES`] long:
///
/// | bytes | field |
/// |---|---|
/// | 4 | magic `APR1` |
/// | 16 | stream key |
/// | 8 | sequence number |
/// | 8 | time, µs since the epoch |
/// | 16 | request id |
/// | 32 | digest of the previous record |
/// | 32 | commitment, BLAKE3(salt ‖ body) |
/// | 2 | event kind |
/// | 2 | body version |
/// | 4 | length of the sealed body |
/// | 4 | CRC-32 (IEEE) over the 124 bytes before and the sealed body |
///
/// It can be walked by a tool that knows no event and holds no key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// The stream that it belongs to.
    pub stream: StreamKey,
    /// Its place in the stream, from 1.
    pub seq: Seq,
    /// Microseconds since the epoch.
    pub at: Timestamp,
    /// The request that it came from.
    pub request: RequestId,
    /// The digest of the record before it; zero for the first.
    pub prev: Digest,
    /// See [`commitment()`].
    pub commitment: Digest,
    /// The number of the event's kind.
    pub kind: u16,
    /// The version of the body's format.
    pub version: u16,
}

/// What is wrong with the bytes of a record.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum HeaderError {
    /// It ends before its header does.
    #[error("the record has {found} bytes, fewer than a header's {}", Header::BYTES)]
    Short {
        /// Bytes.
        found: usize,
    },
    /// It is no record.
    #[error("the record does not start with the magic APR1")]
    Magic,
    /// Its body is longer or shorter than its header says.
    #[error("the header says {said} bytes of sealed body, there are {found}")]
    Length {
        /// Bytes, as the header says.
        said: usize,
        /// Bytes that are there.
        found: usize,
    },
    /// A bit of it is another one.
    #[error("the record's checksum is {found:08x}, its header says {said:08x}")]
    Checksum {
        /// As the header says.
        said: u32,
        /// Of the bytes that are there.
        found: u32,
    },
    /// Numbers start at 1.
    #[error("the record carries the sequence number 0")]
    Seq,
}

const MAGIC: [u8; 4] = *b"APR1";

impl Header {
    /// How many there are.
    pub const BYTES: usize = 128;

    /// The header's bytes followed by the sealed body, with length and checksum filled in.
    pub fn frame(&self, sealed: &[u8]) -> Vec<u8> {
        let mut out = Vec::with_capacity(Header::BYTES + sealed.len());
        out.extend_from_slice(&MAGIC);
        out.extend_from_slice(&self.stream.0);
        out.extend_from_slice(&self.seq.get().to_be_bytes());
        out.extend_from_slice(&self.at.0.to_be_bytes());
        out.extend_from_slice(&self.request.0);
        out.extend_from_slice(&self.prev.0);
        out.extend_from_slice(&self.commitment.0);
        out.extend_from_slice(&self.kind.to_be_bytes());
        out.extend_from_slice(&self.version.to_be_bytes());
        let length = u32::try_from(sealed.len()).expect("a sealed body is below 4 GiB (limits)");
        out.extend_from_slice(&length.to_be_bytes());
        let checksum = checksum(&out, sealed);
        out.extend_from_slice(&checksum.to_be_bytes());
        out.extend_from_slice(sealed);
        out
    }

    /// Reads a framed record back: header, sealed body, and the record's digest.
    ///
    /// - errors: [`HeaderError`]; never panics, whatever the bytes.
    pub fn unframe(bytes: &[u8]) -> Result<(Header, &[u8], Digest), HeaderError> {
        if bytes.len() < Header::BYTES {
            return Err(HeaderError::Short { found: bytes.len() });
        }
        let (head, sealed) = bytes.split_at(Header::BYTES);
        let mut fields = Fields(head);
        if fields.take::<4>() != MAGIC {
            return Err(HeaderError::Magic);
        }
        let stream = StreamKey(fields.take());
        let seq = u64::from_be_bytes(fields.take());
        let at = Timestamp(u64::from_be_bytes(fields.take()));
        let request = RequestId(fields.take());
        let prev = Digest(fields.take());
        let commitment = Digest(fields.take());
        let kind = u16::from_be_bytes(fields.take());
        let version = u16::from_be_bytes(fields.take());
        let said = u32::from_be_bytes(fields.take()) as usize;
        let said_checksum = u32::from_be_bytes(fields.take());
        if said != sealed.len() {
            return Err(HeaderError::Length { said, found: sealed.len() });
        }
        let found = checksum(&head[..Header::BYTES - 4], sealed);
        if found != said_checksum {
            return Err(HeaderError::Checksum { said: said_checksum, found });
        }
        let seq = Seq::new(seq).ok_or(HeaderError::Seq)?;
        let header = Header { stream, seq, at, request, prev, commitment, kind, version };
        Ok((header, sealed, Digest::of(bytes)))
    }
}

struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (field, rest) = self.0.split_first_chunk().expect("the caller checked the length");
        self.0 = rest;
        *field
    }
}

fn checksum(head: &[u8], sealed: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(head);
    hasher.update(sealed);
    hasher.finalize()
}

/// The hiding commitment to a body: BLAKE3(salt ‖ body). Revealing salt and body proves one record
/// and no other.
pub fn commitment(salt: &[u8; 32], body: &[u8]) -> Digest {
    let mut hasher = blake3::Hasher::new();
    hasher.update(salt);
    hasher.update(body);
    Digest(*hasher.finalize().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Header {
        Header {
            stream: StreamKey([7; 16]),
            seq: Seq::FIRST,
            at: Timestamp(12),
            request: RequestId([9; 16]),
            prev: Digest::ZERO,
            commitment: commitment(&[1; 32], b"body"),
            kind: 3,
            version: 1,
        }
    }

    #[test]
    fn a_framed_record_is_read_back() {
        let bytes = header().frame(b"sealed");
        let (read, sealed, digest) = Header::unframe(&bytes).unwrap();
        assert_eq!(read, header());
        assert_eq!(sealed, b"sealed");
        assert_eq!(digest, Digest::of(&bytes));
    }

    #[test]
    fn every_flipped_bit_is_noticed() {
        let bytes = header().frame(b"sealed");
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(Header::unframe(&damaged).is_err(), "bit {bit}");
        }
        for length in 0..bytes.len() {
            assert!(Header::unframe(&bytes[..length]).is_err(), "{length} bytes");
        }
    }
}
