use chacha20poly1305::aead::{Aead, KeyInit, Payload};
use chacha20poly1305::{XChaCha20Poly1305, XNonce};
use zeroize::{Zeroize, ZeroizeOnDrop};

use super::entropy::Entropy;
use crate::events::{Batch, Event, Head, Header, Record, commitment, decode, encode};
use crate::ids::{Digest, RequestId, Seq, StreamKey, Timestamp};
use crate::limits::{BATCH_BYTES_MAX, BATCH_EVENTS_MAX, RECORD_BYTES_MAX};
use crate::store::log::{AppendError, ReadError, SealedRecord};

/// Bytes that sealing adds in front of the sealed text: the random nonce of XChaCha20.
pub(in crate::store) const NONCE_BYTES: usize = 24;
const SALT_BYTES: usize = 32;
/// The bytes of a header that are bound to its body by the seal: all but length and checksum,
/// which follow from the sealed bytes.
const BOUND_BYTES: usize = Header::BYTES - 8;

/// A 256-bit secret: one person's data key, or the key that wraps it. Wiped when dropped, and it
/// does not print.
#[derive(Clone, Zeroize, ZeroizeOnDrop)]
pub struct DataKey([u8; 32]);

impl std::fmt::Debug for DataKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("DataKey(..)")
    }
}

impl DataKey {
    pub fn from_bytes(bytes: [u8; 32]) -> DataKey {
        DataKey(bytes)
    }

    pub fn random(entropy: &dyn Entropy) -> DataKey {
        let mut key = DataKey([0; 32]);
        entropy.fill(&mut key.0);
        key
    }

    pub(in crate::store) fn expose(&self) -> &[u8; 32] {
        &self.0
    }

    /// nonce(24) ‖ XChaCha20-Poly1305(`plain`), bound to `bound`.
    pub(in crate::store) fn seal(
        &self,
        entropy: &dyn Entropy,
        bound: &[u8],
        plain: &[u8],
    ) -> Vec<u8> {
        let mut nonce = [0; NONCE_BYTES];
        entropy.fill(&mut nonce);
        let payload = Payload { msg: plain, aad: bound };
        let text = XChaCha20Poly1305::new((&self.0).into())
            .encrypt(XNonce::from_slice(&nonce), payload)
            .expect("a text below 256 GiB is sealed in memory");
        [&nonce[..], &text].concat()
    }

    /// The plain text again; none when key, bound bytes or sealed bytes are not the ones of
    /// [`DataKey::seal`].
    pub(in crate::store) fn open(&self, bound: &[u8], sealed: &[u8]) -> Option<Vec<u8>> {
        let (nonce, text) = sealed.split_at_checked(NONCE_BYTES)?;
        let payload = Payload { msg: text, aad: bound };
        XChaCha20Poly1305::new((&self.0).into()).decrypt(XNonce::from_slice(nonce), payload).ok()
    }

    /// Opens a record's sealed body: the salt and the body that its header commits to. Whoever is
    /// given both can read this record and no other.
    ///
    /// - errors: [`ReadError::Seal`]: another key, or other bytes than were sealed.
    pub fn reveal(
        &self,
        header: &Header,
        sealed: &[u8],
    ) -> Result<([u8; SALT_BYTES], Vec<u8>), ReadError> {
        let seq = header.seq.get();
        let wrong = |reason: &str| ReadError::Seal { seq, reason: reason.to_owned() };
        let plain = self
            .open(&bound_bytes(header), sealed)
            .ok_or_else(|| wrong("the seal does not match the key, the header or the bytes"))?;
        let (salt, body) = plain
            .split_first_chunk::<SALT_BYTES>()
            .ok_or_else(|| wrong("the sealed text is shorter than its salt"))?;
        if commitment(salt, body) != header.commitment {
            return Err(wrong("the body does not match the commitment in the header"));
        }
        Ok((*salt, body.to_vec()))
    }
}

/// A batch whose bodies are encoded and within the limits, ready to be sealed behind a head.
#[derive(Debug)]
pub struct Draft {
    request: RequestId,
    at: Timestamp,
    events: Vec<(Event, Vec<u8>)>,
    bytes: usize,
}

impl Draft {
    /// - errors: [`AppendError::TooLarge`]: more than [`BATCH_EVENTS_MAX`] events, a body above
    ///   [`RECORD_BYTES_MAX`] or all bodies together above [`BATCH_BYTES_MAX`].
    pub fn encode(batch: Batch) -> Result<Draft, AppendError> {
        let too_large = |reason| Err(AppendError::TooLarge { reason });
        let found = batch.events.len();
        if found > BATCH_EVENTS_MAX {
            return too_large(format!("{found} events; the limit is {BATCH_EVENTS_MAX}"));
        }
        let mut events = Vec::with_capacity(found);
        let mut bytes = 0;
        for event in batch.events {
            let body = encode(&event);
            if body.len() > RECORD_BYTES_MAX {
                let (kind, found) = (event.kind(), body.len());
                return too_large(format!(
                    "a {kind:?} event has {found} bytes; the limit is {RECORD_BYTES_MAX}"
                ));
            }
            bytes += body.len();
            events.push((event, body));
        }
        if bytes > BATCH_BYTES_MAX {
            return too_large(format!("{bytes} bytes; the limit is {BATCH_BYTES_MAX}"));
        }
        Ok(Draft { request: batch.request, at: batch.at, events, bytes })
    }

    /// Bytes of all bodies before sealing.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Seals each body with `key` and chains the records behind `after`.
    ///
    /// - returns: the records as they will be read back, their framed bytes, and the new head.
    pub fn seal(
        self,
        key: &DataKey,
        entropy: &dyn Entropy,
        stream: StreamKey,
        after: Head,
    ) -> Sealed {
        let mut head = after;
        let mut sealed = Sealed { records: Vec::new(), frames: Vec::new(), head };
        for (event, body) in self.events {
            let mut plain = vec![0; SALT_BYTES];
            entropy.fill(&mut plain);
            plain.extend_from_slice(&body);
            let (kind, seq) = (event.kind(), head.next());
            let header = Header {
                stream,
                seq,
                at: self.at,
                request: self.request,
                prev: head.digest,
                commitment: Digest(*blake3::hash(&plain).as_bytes()),
                kind: kind as u16,
                version: kind.version(),
            };
            let frame = header.frame(&key.seal(entropy, &bound_bytes(&header), &plain));
            let digest = Digest::of(&frame);
            head = Head { seq: seq.get(), digest };
            sealed.records.push(Record {
                seq,
                at: self.at,
                request: self.request,
                prev: header.prev,
                digest,
                event,
            });
            sealed.frames.push(frame);
        }
        sealed.head = head;
        sealed
    }
}

/// What [`Draft::seal`] made.
#[derive(Debug)]
pub struct Sealed {
    pub records: Vec<Record>,
    /// As many as records, in the same order: what a backend stores.
    pub frames: Vec<Vec<u8>>,
    pub head: Head,
}

impl Sealed {
    /// Bytes of all frames.
    pub fn bytes(&self) -> u64 {
        self.frames.iter().map(|frame| frame.len() as u64).sum()
    }
}

fn bound_bytes(header: &Header) -> Vec<u8> {
    let mut bytes = header.frame(&[]);
    bytes.truncate(BOUND_BYTES);
    bytes
}

/// Walks the framed records of one stream and checks each: checksum, stream, dense sequence,
/// chain, seal, commitment, decoding. (Invariants `DenseSeq`, `Chained`.)
#[derive(Debug, Clone)]
pub struct Walk {
    stream: StreamKey,
    last: Head,
}

impl Walk {
    /// A walk whose next record is the one after `last`.
    pub fn after(stream: StreamKey, last: Head) -> Walk {
        Walk { stream, last }
    }

    pub fn stream(&self) -> StreamKey {
        self.stream
    }

    /// The last record walked over.
    pub fn last(&self) -> Head {
        self.last
    }

    /// Checks all that needs no key.
    pub fn step<'f>(&mut self, frame: &'f [u8]) -> Result<(Header, &'f [u8]), ReadError> {
        let seq = self.last.next().get();
        let (header, sealed, digest) =
            Header::unframe(frame).map_err(|error| ReadError::Header { seq, error })?;
        if header.seq.get() != seq {
            return Err(ReadError::Gap { expected: seq, found: header.seq.get() });
        }
        if header.stream != self.stream {
            let reason = format!("it belongs to stream {}", header.stream);
            return Err(ReadError::Seal { seq, reason });
        }
        if header.prev != self.last.digest {
            let (expected, found) = (self.last.digest.to_hex(), header.prev.to_hex());
            return Err(ReadError::Chain { seq, expected, found });
        }
        self.last = Head { seq, digest };
        Ok((header, sealed))
    }

    /// As [`Walk::step`], for a caller that keeps the frame.
    pub(in crate::store) fn sealed(&mut self, frame: Vec<u8>) -> Result<SealedRecord, ReadError> {
        let (header, _) = self.step(&frame)?;
        Ok(SealedRecord { header, digest: self.last.digest, frame })
    }

    /// Checks everything and opens the body.
    pub fn open(&mut self, key: &DataKey, frame: &[u8]) -> Result<Record, ReadError> {
        let (header, sealed) = self.step(frame)?;
        let seq = header.seq.get();
        let (_, body) = key.reveal(&header, sealed)?;
        let event = decode(header.kind, header.version, &body);
        Ok(Record {
            seq: header.seq,
            at: header.at,
            request: header.request,
            prev: header.prev,
            digest: self.last.digest,
            event: event.map_err(|error| ReadError::Decode { seq, error })?,
        })
    }
}

/// Where a walk that starts to read at `from` stands before its first step, if not at the start.
pub(in crate::store) fn before(from: Seq) -> Option<Seq> {
    Seq::new(from.get() - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::SessionClosed;
    use crate::invariants::Invariant;
    use crate::store::sealing::entropy::SeededEntropy;

    fn sealed() -> (DataKey, Sealed) {
        let entropy = SeededEntropy::new(1);
        let key = DataKey::random(&entropy);
        let closed = |reason: &str| Event::SessionClosed(SessionClosed { reason: reason.into() });
        let events = vec![closed("moved away"), closed("came back")];
        let batch = Batch { request: RequestId([3; 16]), at: Timestamp(5), events };
        let sealed =
            Draft::encode(batch).unwrap().seal(&key, &entropy, StreamKey([7; 16]), Head::EMPTY);
        (key, sealed)
    }

    #[test]
    fn a_sealed_batch_is_read_back_and_shows_no_word() {
        let (key, sealed) = sealed();
        let mut walk = Walk::after(StreamKey([7; 16]), Head::EMPTY);
        for (record, frame) in sealed.records.iter().zip(&sealed.frames) {
            assert_eq!(walk.open(&key, frame).as_ref(), Ok(record));
            assert!(!frame.windows(4).any(|window| window == b"away"));
        }
        assert_eq!(walk.last(), sealed.head);
    }

    #[test]
    fn another_key_another_stream_or_a_changed_header_is_noticed() {
        let (key, sealed) = sealed();
        let frame = &sealed.frames[0];
        let other = DataKey::from_bytes([1; 32]);
        let start = |stream| Walk::after(StreamKey([stream; 16]), Head::EMPTY);
        assert!(matches!(start(7).open(&other, frame), Err(ReadError::Seal { seq: 1, .. })));
        assert!(matches!(start(8).open(&key, frame), Err(ReadError::Seal { seq: 1, .. })));
        // A forger repairs the checksum; the seal still binds the header.
        let (mut header, body, _) = Header::unframe(frame).unwrap();
        header.at = Timestamp(6);
        let forged = header.frame(body);
        assert!(matches!(start(7).open(&key, &forged), Err(ReadError::Seal { seq: 1, .. })));
    }

    #[test]
    fn a_missing_or_repeated_record_breaks_the_walk() {
        let (_, sealed) = sealed();
        let mut walk = Walk::after(StreamKey([7; 16]), Head::EMPTY);
        let skipped = walk.clone().step(&sealed.frames[1]).unwrap_err();
        assert_eq!(skipped, ReadError::Gap { expected: 1, found: 2 });
        walk.step(&sealed.frames[0]).unwrap();
        let repeated = walk.clone().step(&sealed.frames[0]).unwrap_err();
        assert_eq!(repeated, ReadError::Gap { expected: 2, found: 1 });
        let mut elsewhere = Walk::after(StreamKey([7; 16]), Head { seq: 1, digest: Digest::ZERO });
        let unchained = elsewhere.step(&sealed.frames[1]).unwrap_err();
        assert!(matches!(unchained, ReadError::Chain { .. }));
        for (error, law) in [(skipped, Invariant::DenseSeq), (unchained, Invariant::Chained)] {
            assert!(error.to_string().contains(&law.to_string()), "{error}");
        }
    }

    #[test]
    fn a_batch_above_the_limits_is_refused_with_its_size() {
        let event = Event::SessionClosed(SessionClosed { reason: "x".repeat(RECORD_BYTES_MAX) });
        let stamp = (RequestId([0; 16]), Timestamp(0));
        let batch = |events| Batch { request: stamp.0, at: stamp.1, events };
        let error = Draft::encode(batch(vec![event])).unwrap_err().to_string();
        assert!(error.contains("SessionClosed"), "{error}");
        let many = vec![Event::SessionClosed(SessionClosed { reason: String::new() }); 17];
        let error = Draft::encode(batch(many)).unwrap_err().to_string();
        assert!(error.contains("17 events"), "{error}");
    }
}
