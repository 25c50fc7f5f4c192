//! Good and bad proofs of a small log. Everything that is otherwise random is fixed.

use apprentice::events::{Batch, Event, Head, Header, SessionClosed};
use apprentice::evidence::{
    Checkpoint, Consistency, Inclusion, NoteSigner, Proof, Revealed, Segment, Tree, TreeHash,
};
use apprentice::ids::{Digest, RequestId, Seq, StreamKey, Timestamp};
use apprentice::store::{DataKey, Draft, SeededEntropy};

/// A file for the folder `schema/golden/proofs`. The first word of its name says what it is.
pub struct Vector {
    pub name: String,
    pub proof: Vec<u8>,
    /// An older checkpoint to compare with.
    pub since: Option<Vec<u8>>,
}

const ORIGIN: &str = "lab.example.org/local";

fn signer() -> NoteSigner {
    NoteSigner::new(ORIGIN, b"a key that protects nothing.....").unwrap()
}

pub fn key() -> String {
    signer().public().to_string()
}

fn data_key() -> DataKey {
    DataKey::from_bytes(*b"a key that protects nothing.....")
}

/// Segments with these numbers of records, one person each.
struct Log {
    frames: Vec<Vec<Vec<u8>>>,
    segments: Vec<Segment>,
}

fn log(counts: &[usize]) -> Log {
    let mut log = Log { frames: Vec::new(), segments: Vec::new() };
    for (place, &count) in counts.iter().enumerate() {
        let stream = StreamKey([b'a' + place as u8; 16]);
        let closed = |seq| Event::SessionClosed(SessionClosed { reason: format!("reason {seq}") });
        let batch = Batch {
            request: RequestId(*b"golden request 1"),
            at: Timestamp(1_700_000_000_000_000),
            events: (1..=count).map(closed).collect(),
        };
        let entropy = SeededEntropy::new(place as u64);
        let sealed = Draft::encode(batch).unwrap().seal(&data_key(), &entropy, stream, Head::EMPTY);
        let digests: Vec<Digest> = sealed.records.iter().map(|record| record.digest).collect();
        log.segments.push(Segment::of(stream, Seq::FIRST, &digests).unwrap());
        log.frames.push(sealed.frames);
    }
    log
}

impl Log {
    fn leaves(&self) -> Vec<TreeHash> {
        self.segments.iter().map(Segment::leaf).collect()
    }

    fn checkpoint(&self, size: usize) -> String {
        let root = Tree(&self.leaves()[..size]).root();
        Checkpoint { origin: ORIGIN.to_owned(), size: size as u64, root }.sign(&signer())
    }

    fn proof(&self, place: usize, seq: usize, since: Option<usize>) -> Proof {
        let (leaves, segment) = (self.leaves(), self.segments[place]);
        let frames = &self.frames[place];
        let digests: Vec<Digest> = frames.iter().map(|frame| Digest::of(frame)).collect();
        let record = Inclusion {
            frame: frames[seq - 1].clone(),
            revealed: None,
            stream: segment.stream,
            first: segment.first,
            last: segment.last,
            head: segment.head,
            segment_path: Tree(&Segment::leaves(&digests)).path(seq - 1).unwrap(),
            leaf: place as u64,
            tree_path: Tree(&leaves).path(place).unwrap(),
        };
        let since = since.map(|size| Consistency {
            size: size as u64,
            path: Tree(&leaves).consistency(size).unwrap(),
        });
        Proof { record: Some(record), since, checkpoint: self.checkpoint(leaves.len()) }
    }
}

fn revealed(mut proof: Proof) -> Proof {
    let record = proof.record.as_mut().unwrap();
    let (header, sealed, _) = Header::unframe(&record.frame).unwrap();
    let (salt, body) = data_key().reveal(&header, sealed).unwrap();
    record.revealed = Some(Revealed { salt, body });
    proof
}

pub fn vectors() -> Vec<Vector> {
    let log = log(&[3, 5, 1, 4, 2]);
    let mut all = Vec::new();
    let mut add = |name: &str, proof: Vec<u8>, since: Option<String>| {
        let since = since.map(String::into_bytes);
        all.push(Vector { name: name.to_owned(), proof, since });
    };
    let plain = |proof: &Proof| proof.to_text().into_bytes();
    let good = log.proof(1, 3, None);
    let grown = log.proof(1, 3, Some(2));

    add("good-sealed", plain(&good), None);
    add("good-revealed", plain(&revealed(good.clone())), None);
    add("good-only-record", plain(&log.proof(2, 1, None)), None);
    add("good-head", plain(&log.proof(4, 2, None)), None);
    add("good-grown", plain(&grown), Some(log.checkpoint(2)));
    for size in 0..=5 {
        let proof = log.proof(0, 1, Some(size));
        add(&format!("good-grown-from-{size}"), plain(&proof), Some(log.checkpoint(size)));
    }
    add("good-no-growth", plain(&good), Some(log.checkpoint(5)));
    let growth = Proof { record: None, ..grown.clone() };
    add("good-growth-alone", plain(&growth), Some(log.checkpoint(2)));
    let small = log_of_one();
    add("good-tree-of-one", plain(&small.proof(0, 1, None)), None);
    let witness = NoteSigner::new("witness.example.net", &[9; 32]).unwrap();
    let line = |note: String| note.split("\n\n").nth(1).unwrap().to_owned();
    let text = good.checkpoint.split("\n\n").next().unwrap().to_owned() + "\n";
    let seen = good.checkpoint.clone() + &line(witness.sign(&text));
    add("good-witnessed", plain(&Proof { checkpoint: seen, ..good.clone() }), None);

    let changed = |change: &dyn Fn(&mut Inclusion)| {
        let mut proof = revealed(good.clone());
        change(proof.record.as_mut().unwrap());
        plain(&proof)
    };
    let forged = |record: &mut Inclusion, change: &dyn Fn(&mut Header)| {
        let (mut header, sealed, _) = Header::unframe(&record.frame).unwrap();
        let sealed = sealed.to_vec();
        change(&mut header);
        record.frame = header.frame(&sealed);
    };
    let later = changed(&|record| forged(record, &|header| header.at = Timestamp(1)));
    add("refused-changed-record", later, None);
    add("refused-damaged-record", changed(&|record| record.frame[140] ^= 1), None);
    add("refused-short-record", changed(&|record| record.frame.truncate(100)), None);
    add("refused-other-record", changed(&|record| record.frame = log.frames[1][1].clone()), None);
    let reordered = changed(&|record| forged(record, &|header| header.seq = Seq::new(2).unwrap()));
    add("refused-reordered-record", reordered, None);
    add("refused-other-stream", changed(&|record| record.frame = log.frames[0][2].clone()), None);
    add("refused-outside-segment", changed(&|record| record.last = Seq::new(2).unwrap()), None);
    add("refused-longer-segment", changed(&|record| record.last = Seq::new(9).unwrap()), None);
    let endless = changed(&|record| record.last = Seq::new(u64::MAX).unwrap());
    add("refused-endless-segment", endless, None);
    add("refused-other-head", changed(&|record| record.head = Digest::ZERO), None);
    let mut last = log.proof(1, 5, None);
    last.record.as_mut().unwrap().head = Digest::ZERO;
    add("refused-head-not-last", plain(&last), None);
    add("refused-other-place", changed(&|record| record.leaf = 0), None);
    add("refused-place-beyond-tree", changed(&|record| record.leaf = 5), None);
    add("refused-place-at-end-of-numbers", changed(&|record| record.leaf = u64::MAX), None);
    let shorter = changed(&|record| record.tree_path.truncate(1));
    add("refused-shorter-tree-path", shorter, None);
    let longer = changed(&|record| record.tree_path.push(TreeHash::empty()));
    add("refused-longer-tree-path", longer, None);
    add("refused-turned-segment-path", changed(&|record| record.segment_path.reverse()), None);
    let body = changed(&|record| record.revealed.as_mut().unwrap().body[5] ^= 1);
    add("refused-other-body", body, None);
    let salt = changed(&|record| record.revealed.as_mut().unwrap().salt[0] ^= 1);
    add("refused-other-salt", salt, None);

    let with = |checkpoint: String| plain(&Proof { checkpoint, ..good.clone() });
    let foreign = NoteSigner::new(ORIGIN, &[9; 32]).unwrap();
    add("refused-foreign-signature", with(foreign.sign(&text)), None);
    add("refused-no-signature", with(text.clone()), None);
    add("refused-larger-tree", with(good.checkpoint.replacen("\n5\n", "\n6\n", 1)), None);
    let renamed = text.replacen("local", "other", 1);
    add("refused-other-origin", with(signer().sign(&renamed)), None);
    let zero = text.replacen("\n5\n", "\n05\n", 1);
    add("refused-size-spelt-otherwise", with(signer().sign(&zero)), None);
    let spoiled = good.checkpoint.clone() + &line(signer().sign("something else\n"));
    add("refused-second-signature-wrong", with(spoiled), None);
    add(
        "refused-signature-cut",
        with(good.checkpoint[..good.checkpoint.len() - 1].to_owned()),
        None,
    );

    add("refused-growth-not-shown", plain(&good), Some(log.checkpoint(2)));
    add("refused-growth-from-elsewhere", plain(&log.proof(1, 3, Some(3))), Some(log.checkpoint(2)));
    add("refused-rolled-back", plain(&small.proof(0, 1, None)), Some(log.checkpoint(2)));
    let forked = self::log(&[3, 4, 1, 4, 2]);
    add("refused-forked", plain(&forked.proof(0, 1, Some(2))), Some(log.checkpoint(2)));
    let replaced = self::log(&[3, 5, 1, 4, 3]);
    add(
        "refused-forked-at-equal-size",
        plain(&replaced.proof(0, 1, None)),
        Some(log.checkpoint(5)),
    );
    add("refused-older-is-no-checkpoint", plain(&grown), Some("a note\n".to_owned()));
    add("refused-older-is-empty", plain(&grown), Some(String::new()));
    add("refused-older-is-foreign", plain(&grown), Some(foreign.sign(&text)));

    let text = grown.to_text();
    let edited = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1).into_bytes()
    };
    add("unreadable-title", edited("proof 1", "proof 2"), None);
    add("unreadable-no-blank-line", text.replace("\n\n", "\n").into_bytes(), None);
    add(
        "unreadable-nothing-shown",
        format!("apprentice proof 1\n\n{}", good.checkpoint).into(),
        None,
    );
    add("unreadable-unknown-line", edited("\nleaf", "\ncolour blue\nleaf"), None);
    add(
        "unreadable-order",
        {
            let lines: Vec<&str> = text.lines().collect();
            let mut turned = lines.clone();
            turned.swap(2, 4);
            turned.join("\n").into_bytes()
        },
        None,
    );
    add("unreadable-line-missing", edited("\nleaf 1", ""), None);
    add("unreadable-line-twice", edited("\nleaf 1", "\nleaf 1\nleaf 1"), None);
    add("unreadable-two-spaces", edited("\nleaf 1", "\nleaf  1"), None);
    add("unreadable-number", edited("\nleaf 1", "\nleaf 01"), None);
    add("unreadable-number-too-large", edited("\nleaf 1", "\nleaf 18446744073709551616"), None);
    add("unreadable-first-record-0", edited(" 1 5 ", " 0 5 "), None);
    add("unreadable-stream-key", edited("segment 6262", "segment 62"), None);
    add("unreadable-base64", edited("record QVBS", "record QVB"), None);
    add("unreadable-since-without-size", edited("since 2 ", "since "), None);
    let many =
        format!("\nsince 2{}\n\n", " AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=".repeat(66));
    let place = text.find("\nsince").unwrap();
    let rest = text[place..].split_once("\n\n").unwrap().1;
    add("unreadable-endless-path", format!("{}{many}{rest}", &text[..place]).into_bytes(), None);
    add("unreadable-no-text", [&text.as_bytes()[..40], &[0xff, 0xfe]].concat(), None);
    add("unreadable-empty", Vec::new(), None);
    all
}

fn log_of_one() -> Log {
    log(&[2])
}

/// Draws that are always the same, named by their purpose.
pub struct Draws {
    purpose: &'static str,
    count: u64,
}

impl Draws {
    pub fn new(purpose: &'static str) -> Draws {
        Draws { purpose, count: 0 }
    }

    fn below(&mut self, limit: usize) -> usize {
        self.count += 1;
        let digest = Digest::of(format!("{} {}", self.purpose, self.count).as_bytes());
        (u64::from_be_bytes(*digest.0.first_chunk().unwrap()) % limit.max(1) as u64) as usize
    }

    /// The bytes with one to four changes: flipped, replaced, removed, doubled or cut.
    pub fn damaged(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for _ in 0..=self.below(4) {
            if bytes.is_empty() {
                break;
            }
            let at = self.below(bytes.len());
            match self.below(6) {
                0 => bytes[at] ^= 1 << self.below(8),
                1 => bytes[at] = b" \n+=/0AZ\t\r"[self.below(10)],
                2 => drop(bytes.remove(at)),
                3 => bytes.insert(at, bytes[at]),
                4 => bytes[at] = self.below(256) as u8,
                _ => {
                    let length = self.below(bytes.len());
                    if self.below(8) == 0 {
                        bytes.truncate(length);
                    }
                }
            }
        }
        bytes
    }
}
