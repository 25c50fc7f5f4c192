use super::super::draws::Draws;
use super::super::{Checkpoint, NoteSigner, Segment, Tree, VerifyError, verify};
use super::*;
use crate::events::{Header, commitment};
use crate::ids::{RequestId, Timestamp};

fn signer() -> NoteSigner {
    NoteSigner::new("lab.example.org/local", &[7; 32]).unwrap()
}

/// A log of some people, small enough to hold all of it.
struct Log {
    segments: Vec<Segment>,
    /// Of each segment.
    frames: Vec<Vec<Vec<u8>>>,
}

fn body(seq: u64) -> Vec<u8> {
    format!("body {seq}").into_bytes()
}

fn log(counts: &[usize]) -> Log {
    let mut log = Log { segments: Vec::new(), frames: Vec::new() };
    for (place, &count) in counts.iter().enumerate() {
        let (mut prev, mut frames, mut digests) = (Digest::ZERO, Vec::new(), Vec::new());
        for seq in 1..=count as u64 {
            let header = Header {
                stream: StreamKey([place as u8; 16]),
                seq: Seq::new(seq).unwrap(),
                at: Timestamp(seq),
                request: RequestId([1; 16]),
                prev,
                commitment: commitment(&[3; 32], &body(seq)),
                kind: 3,
                version: 1,
            };
            let frame = header.frame(b"sealed");
            prev = Digest::of(&frame);
            digests.push(prev);
            frames.push(frame);
        }
        let stream = StreamKey([place as u8; 16]);
        log.segments.push(Segment::of(stream, Seq::FIRST, &digests).unwrap());
        log.frames.push(frames);
    }
    log
}

impl Log {
    fn leaves(&self) -> Vec<TreeHash> {
        self.segments.iter().map(Segment::leaf).collect()
    }

    fn checkpoint(&self, size: usize) -> String {
        let root = Tree(&self.leaves()[..size]).root();
        let origin = "lab.example.org/local".to_owned();
        Checkpoint { origin, size: size as u64, root }.sign(&signer())
    }

    fn proof(&self, place: usize, at: usize, since: Option<usize>) -> Proof {
        let leaves = self.leaves();
        let segment = self.segments[place];
        let digests: Vec<Digest> =
            self.frames[place].iter().map(|frame| Digest::of(frame)).collect();
        Proof {
            record: Some(Inclusion {
                frame: self.frames[place][at].clone(),
                revealed: Some(Revealed { salt: [3; 32], body: body(at as u64 + 1) }),
                stream: segment.stream,
                first: segment.first,
                last: segment.last,
                head: segment.head,
                segment_path: Tree(&Segment::leaves(&digests)).path(at).unwrap(),
                leaf: place as u64,
                tree_path: Tree(&leaves).path(place).unwrap(),
            }),
            since: since.map(|size| Consistency {
                size: size as u64,
                path: Tree(&leaves).consistency(size).unwrap(),
            }),
            checkpoint: self.checkpoint(leaves.len()),
        }
    }
}

fn refusal(proof: &Proof, since: Option<&str>) -> VerifyError {
    verify(proof, &signer().public(), since).unwrap_err()
}

#[test]
fn every_record_of_every_segment_is_proved_and_read_back() {
    let log = log(&[1, 2, 3, 7, 8, 13]);
    for place in 0..log.segments.len() {
        for at in 0..log.frames[place].len() {
            let proof = log.proof(place, at, Some(4));
            assert_eq!(Proof::parse(proof.to_text().as_bytes()), Ok(proof.clone()));
            let older = log.checkpoint(4);
            let verified = verify(&proof, &signer().public(), Some(&older)).unwrap();
            let record = verified.record.unwrap();
            assert_eq!(record.digest, Digest::of(&log.frames[place][at]));
            assert_eq!((record.body, verified.since), (Some(body(at as u64 + 1)), Some(4)));
        }
    }
}

#[test]
fn a_changed_a_foreign_and_a_misplaced_record_are_refused() {
    let log = log(&[4, 4, 4]);
    let good = log.proof(1, 2, None);
    let with = |change: &dyn Fn(&mut Inclusion)| {
        let mut proof = good.clone();
        change(proof.record.as_mut().unwrap());
        refusal(&proof, None)
    };
    // The forger repairs whatever a checksum or the header would show.
    let forged = |change: &dyn Fn(&mut Header)| {
        let (mut header, sealed, _) = Header::unframe(&log.frames[1][2]).unwrap();
        change(&mut header);
        header.frame(sealed)
    };
    let later = forged(&|header| header.at = Timestamp(999));
    assert!(matches!(with(&|record| record.frame = later.clone()), VerifyError::Root { .. }));
    let mut flipped = log.frames[1][2].clone();
    flipped[130] ^= 1;
    assert!(matches!(with(&|record| record.frame = flipped.clone()), VerifyError::Record(_)));
    let other = log.frames[1][1].clone();
    assert!(matches!(with(&|record| record.frame = other.clone()), VerifyError::Root { .. }));
    let foreign = log.frames[0][2].clone();
    let elsewhere = with(&|record| record.frame = foreign.clone());
    assert!(matches!(elsewhere, VerifyError::Elsewhere { seq: 3, .. }));
    assert!(matches!(with(&|record| record.leaf = 0), VerifyError::Root { .. }));
    assert!(matches!(with(&|record| record.leaf = 3), VerifyError::TreePath { size: 3 }));
    assert!(matches!(with(&|record| record.head = Digest::ZERO), VerifyError::Root { .. }));
    let longer = with(&|record| record.last = Seq::new(9).unwrap());
    assert!(matches!(longer, VerifyError::SegmentPath));
    let whole =
        with(&|record| (record.first, record.last) = (Seq::FIRST, Seq::new(u64::MAX).unwrap()));
    assert!(matches!(whole, VerifyError::SegmentPath));
    let short = with(&|record| record.last = Seq::new(2).unwrap());
    assert!(matches!(short, VerifyError::Elsewhere { .. }));
    let words = Revealed { salt: [3; 32], body: b"other words".to_vec() };
    let lied = with(&|record| record.revealed = Some(words.clone()));
    assert_eq!(lied, VerifyError::Commitment);
    let mut last = log.proof(1, 3, None);
    last.record.as_mut().unwrap().head = Digest::ZERO;
    assert_eq!(refusal(&last, None), VerifyError::Head);
}

#[test]
fn a_rolled_back_and_a_forked_log_are_refused_and_growth_must_be_shown() {
    let long = log(&[1, 2, 3, 4, 5]);
    let older = long.checkpoint(3);
    assert!(verify(&long.proof(0, 0, Some(3)), &signer().public(), Some(&older)).is_ok());
    let silent = refusal(&long.proof(0, 0, None), Some(&older));
    assert_eq!(silent, VerifyError::NotShown { older: 3, newer: 5 });
    let other = refusal(&long.proof(0, 0, Some(2)), Some(&older));
    assert_eq!(other, VerifyError::NotShown { older: 3, newer: 5 });
    // Segments are gone.
    let short = log(&[1, 2]);
    let rolled = refusal(&short.proof(0, 0, None), Some(&older));
    assert_eq!(rolled, VerifyError::RolledBack { older: 3, newer: 2 });
    // The third segment is another one, whatever follows; and also where nothing follows.
    for counts in [&[1, 2, 4, 4, 5][..], &[1, 2, 4], &[2, 1, 3]] {
        let forked = log(counts);
        let error = refusal(&forked.proof(0, 0, Some(3)), Some(&older));
        assert_eq!(error, VerifyError::Forked { older: 3, newer: counts.len() as u64 });
    }
    // Two equal checkpoints, and one of an empty tree, need no path.
    for size in [0, 5] {
        let older = long.checkpoint(size);
        let verified = verify(&long.proof(0, 0, None), &signer().public(), Some(&older)).unwrap();
        assert_eq!(verified.since, Some(size as u64));
    }
}

#[test]
fn a_file_that_is_not_as_written_is_refused_with_its_line() {
    let good = log(&[4, 4, 4]).proof(1, 2, Some(2)).to_text();
    let refused = |text: &str| Proof::parse(text.as_bytes()).unwrap_err().to_string();
    let lines: Vec<&str> = good.lines().collect();
    let names: Vec<&str> = lines[1..8].iter().map(|line| line.split(' ').next().unwrap()).collect();
    assert_eq!(
        names,
        ["record", "revealed", "segment", "segment-path", "leaf", "tree-path", "since"]
    );
    for (number, part) in [(2, "line 2"), (4, "line 4"), (5, "line 5"), (6, "line 6")] {
        let without: Vec<&str> = [&lines[..number - 1], &lines[number..]].concat();
        let error = refused(&without.join("\n"));
        assert!(error.starts_with(part), "{error}");
    }
    assert!(refused(&good.replacen("leaf 1", "leaf 01", 1)).starts_with("line 6: "));
    assert!(refused(&good.replacen("\nleaf", "\nmore\nleaf", 1)).starts_with("line 6: "));
    assert!(refused(&good.replacen("proof 1", "proof 2", 1)).contains("does not begin"));
    assert!(refused("apprentice proof 1\n").contains("no blank line"));
    assert!(refused("apprentice proof 1\n\nnote").contains("proves nothing"));
    let upper = good.replacen("0101010101", "0A0A0A0A0A", 1);
    assert!(refused(&upper).contains("stream key"));
    let many = format!("apprentice proof 1\nsince 1{}\n\nx", hashes(&[TreeHash::empty(); 66]));
    assert!(refused(&many).contains("more hashes"));
    assert_eq!(Proof::parse(&[0xff; 40]), Err(ProofError::Text));
}

#[test]
fn no_flipped_bit_goes_unnoticed_and_no_bytes_make_the_reader_panic() {
    let log = log(&[4, 4, 4]);
    let (good, older) = (log.proof(1, 2, Some(2)).to_text(), log.checkpoint(2));
    let shown = |bytes: &[u8]| {
        let proof = Proof::parse(bytes).ok()?;
        verify(&proof, &signer().public(), Some(&older)).ok()
    };
    assert!(shown(good.as_bytes()).is_some());
    for bit in 0..good.len() * 8 {
        let mut bytes = good.clone().into_bytes();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(shown(&bytes).is_none(), "bit {bit}");
    }
    for length in 0..good.len() {
        assert!(shown(&good.as_bytes()[..length]).is_none(), "{length} bytes");
    }
    let mut draws = Draws::new("proofs");
    for round in 0..20_000 {
        let mut bytes = good.clone().into_bytes();
        for _ in 0..=draws.below(8) {
            let at = draws.below(bytes.len());
            match draws.below(4) {
                0 => bytes[at] = draws.next_u64() as u8,
                1 => bytes.truncate(at + 1),
                2 => bytes.insert(at, *draws.bytes(1).first().unwrap()),
                _ => bytes.swap(at, 0),
            }
        }
        if bytes != good.as_bytes() {
            assert!(shown(&bytes).is_none(), "round {round}: {:?}", bytes.escape_ascii());
        }
    }
}
