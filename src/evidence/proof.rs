//! The proof file: lines of text in a fixed order, and a checkpoint (`schema/proof.md`).

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::TreeHash;
use super::checkpoint::{number, tree_hash};
use crate::ids::{Digest, Seq, StreamKey};

const TITLE: &str = "apprentice proof 1";
/// Hashes of one path: a tree of 2^64 leaves needs 64, and a consistency proof one more.
const PATH_MAX: usize = 65;

/// A file that shows something without a database: that a record is in the log, that the log only
/// grew since an older checkpoint, or both.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Proof {
    pub record: Option<Inclusion>,
    pub since: Option<Consistency>,
    /// A signed note, as it was given out.
    pub checkpoint: String,
}

/// Where one record stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Inclusion {
    /// Header and sealed body: what the record's digest is over.
    pub frame: Vec<u8>,
    pub revealed: Option<Revealed>,
    /// The segment, without its root, which follows from the record and the path.
    pub stream: StreamKey,
    pub first: Seq,
    pub last: Seq,
    pub head: Digest,
    /// From the record to the segment's root.
    pub segment_path: Vec<TreeHash>,
    /// The segment's place among the leaves of the tenant's tree, from 0.
    pub leaf: u64,
    /// From the leaf to the root of the tree.
    pub tree_path: Vec<TreeHash>,
}

/// What the record's commitment is over. With it one can read this record, and no other.
#[derive(Clone, PartialEq, Eq)]
pub struct Revealed {
    pub salt: [u8; 32],
    pub body: Vec<u8>,
}

// A person's words must not slip into a log line.
impl std::fmt::Debug for Revealed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Revealed({} bytes)", self.body.len())
    }
}

/// What shows that the tree only grew.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Consistency {
    /// Leaves of the older tree.
    pub size: u64,
    pub path: Vec<TreeHash>,
}

/// Why a file is no proof that can be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ProofError {
    #[error("it does not begin with the line {TITLE:?}")]
    Title,
    #[error("it holds bytes that are not text")]
    Text,
    #[error("there is no blank line between the proof and the checkpoint")]
    Blank,
    #[error("line {line}: {reason}")]
    Line { line: usize, reason: String },
    #[error("it proves nothing: it names neither a record nor an older checkpoint")]
    Nothing,
}

impl Proof {
    pub fn to_text(&self) -> String {
        let mut text = format!("{TITLE}\n");
        let mut line = |words: String| {
            text.push_str(&words);
            text.push('\n');
        };
        if let Some(record) = &self.record {
            line(format!("record {}", STANDARD.encode(&record.frame)));
            if let Some(Revealed { salt, body }) = &record.revealed {
                line(format!("revealed {} {}", STANDARD.encode(salt), STANDARD.encode(body)));
            }
            let Inclusion { stream, first, last, head, .. } = record;
            line(format!("segment {stream} {first} {last} {head}"));
            line(format!("segment-path{}", hashes(&record.segment_path)));
            line(format!("leaf {}", record.leaf));
            line(format!("tree-path{}", hashes(&record.tree_path)));
        }
        if let Some(Consistency { size, path }) = &self.since {
            line(format!("since {size}{}", hashes(path)));
        }
        format!("{text}\n{}", self.checkpoint)
    }

    /// Reads what [`Proof::to_text`] writes, and nothing else.
    ///
    /// - errors: [`ProofError`]; never panics, whatever the bytes.
    pub fn parse(bytes: &[u8]) -> Result<Proof, ProofError> {
        let text = std::str::from_utf8(bytes).map_err(|_| ProofError::Text)?;
        if !text.strip_prefix(TITLE).is_some_and(|rest| rest.starts_with('\n')) {
            return Err(ProofError::Title);
        }
        let (lines, checkpoint) = text.split_once("\n\n").ok_or(ProofError::Blank)?;
        let mut lines = Lines { lines: lines.split('\n').collect(), at: 1 };
        let record = lines.inclusion()?;
        let since = lines.since()?;
        lines.end()?;
        if record.is_none() && since.is_none() {
            return Err(ProofError::Nothing);
        }
        Ok(Proof { record, since, checkpoint: checkpoint.to_owned() })
    }
}

fn hashes(path: &[TreeHash]) -> String {
    let mut words = String::new();
    for hash in path {
        let _ = write!(words, " {}", STANDARD.encode(hash.0));
    }
    words
}

struct Lines<'t> {
    lines: Vec<&'t str>,
    /// The next line, from 0.
    at: usize,
}

impl<'t> Lines<'t> {
    /// The words after `name`, when that is the first word of the next line.
    fn optional(&mut self, name: &str) -> Option<Vec<&'t str>> {
        let mut words = self.lines.get(self.at)?.split(' ');
        if words.next() != Some(name) {
            return None;
        }
        self.at += 1;
        Some(words.collect())
    }

    fn wanted(&mut self, name: &str) -> Result<Vec<&'t str>, ProofError> {
        self.optional(name).ok_or_else(|| ProofError::Line {
            line: self.at + 1,
            reason: format!("the word {name:?} should stand at its beginning"),
        })
    }

    /// What is wrong with the line that was just taken.
    fn wrong(&self, reason: &str) -> ProofError {
        ProofError::Line { line: self.at, reason: reason.to_owned() }
    }

    fn path(&self, words: &[&str]) -> Result<Vec<TreeHash>, ProofError> {
        if words.len() > PATH_MAX {
            return Err(self.wrong("more hashes than any path has"));
        }
        let hashes: Option<Vec<TreeHash>> = words.iter().map(|word| tree_hash(word)).collect();
        hashes.ok_or_else(|| self.wrong("a word that is not a hash of 32 bytes in base64"))
    }

    fn inclusion(&mut self) -> Result<Option<Inclusion>, ProofError> {
        let Some(words) = self.optional("record") else { return Ok(None) };
        let [frame] = words[..] else { return Err(self.wrong("one word should follow")) };
        let base64 = || "a word that is not base64";
        let frame = STANDARD.decode(frame).map_err(|_| self.wrong(base64()))?;
        let revealed = match self.optional("revealed").as_deref() {
            None => None,
            Some(&[salt, body]) => {
                let salt =
                    tree_hash(salt).ok_or_else(|| self.wrong("a salt that is no 32 bytes"))?.0;
                let body = STANDARD.decode(body).map_err(|_| self.wrong(base64()))?;
                Some(Revealed { salt, body })
            }
            Some(_) => return Err(self.wrong("two words should follow")),
        };
        let words = self.wanted("segment")?;
        let [stream, first, last, head] = words[..] else {
            return Err(self.wrong("four words should follow"));
        };
        let seq = |word| number(word).and_then(Seq::new);
        let (Some(first), Some(last)) = (seq(first), seq(last)) else {
            return Err(self.wrong("a word that is not a sequence number"));
        };
        let stream = hex(stream, |text| text.parse::<StreamKey>().ok());
        let stream = stream.ok_or_else(|| self.wrong("a word that is not a stream key"))?;
        let head = hex(head, |text| text.parse::<Digest>().ok());
        let head = head.ok_or_else(|| self.wrong("a word that is not a digest"))?;
        let words = self.wanted("segment-path")?;
        let segment_path = self.path(&words)?;
        let words = self.wanted("leaf")?;
        let [leaf] = words[..] else { return Err(self.wrong("one word should follow")) };
        let leaf = number(leaf).ok_or_else(|| self.wrong("a word that is not a number"))?;
        let words = self.wanted("tree-path")?;
        let tree_path = self.path(&words)?;
        Ok(Some(Inclusion {
            frame,
            revealed,
            stream,
            first,
            last,
            head,
            segment_path,
            leaf,
            tree_path,
        }))
    }

    fn since(&mut self) -> Result<Option<Consistency>, ProofError> {
        let Some(words) = self.optional("since") else { return Ok(None) };
        let size = words.first().and_then(|word| number(word));
        let size = size.ok_or_else(|| self.wrong("no size follows"))?;
        Ok(Some(Consistency { size, path: self.path(&words[1..])? }))
    }

    fn end(&self) -> Result<(), ProofError> {
        match self.lines.len() > self.at {
            true => Err(ProofError::Line {
                line: self.at + 1,
                reason: "this line is unknown, or stands in the wrong place".to_owned(),
            }),
            false => Ok(()),
        }
    }
}

/// Hexadecimal digits as they are always written: in lower case.
fn hex<T>(text: &str, parse: impl FnOnce(&str) -> Option<T>) -> Option<T> {
    let plain = text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
    if plain { parse(text) } else { None }
}

#[cfg(test)]
mod tests;
