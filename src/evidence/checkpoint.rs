use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::note::check_name;
use super::{NoteError, NoteSigner, TreeHash, VerifierKey};

/// What a tenant's tree was at one moment, in the form of C2SP's *tlog-checkpoint*: three lines,
/// signed as a note whose key is named after the origin.
///
/// ```text
/// lab.example.org/local
/// 17
/// CsUYapGGPo4dkMgIAUqom/Xajj7h2fB2MPA3j2jxq2I=
///
/// — lab.example.org/local Az3grl…
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checkpoint {
    /// The name of the service, `/`, the tenant.
    pub origin: String,
    /// Leaves of the tree.
    pub size: u64,
    pub root: TreeHash,
}

/// Why a note is no checkpoint to go by.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    #[error(transparent)]
    Note(#[from] NoteError),
    #[error("it is not a checkpoint: {reason}")]
    Form { reason: &'static str },
    #[error("it is a checkpoint of {found}, not of {expected}")]
    Origin { found: String, expected: String },
}

impl Checkpoint {
    /// The signed note.
    pub fn sign(&self, signer: &NoteSigner) -> String {
        debug_assert_eq!(self.origin, signer.name(), "a log signs under its origin");
        signer.sign(&format!("{}\n{}\n{}\n", self.origin, self.size, STANDARD.encode(self.root.0)))
    }

    /// Reads a checkpoint that `key` signed for the log of its name.
    ///
    /// - errors: [`CheckpointError`]; never panics, whatever the note.
    pub fn open(note: &str, key: &VerifierKey) -> Result<Checkpoint, CheckpointError> {
        let checkpoint = Checkpoint::parse(key.open(note)?)?;
        match checkpoint.origin == key.name() {
            true => Ok(checkpoint),
            false => {
                let expected = key.name().to_owned();
                Err(CheckpointError::Origin { found: checkpoint.origin, expected })
            }
        }
    }

    /// Lines after the third are extensions that others may understand.
    fn parse(text: &str) -> Result<Checkpoint, CheckpointError> {
        let wrong = |reason| CheckpointError::Form { reason };
        let text = text.strip_suffix('\n').ok_or_else(|| wrong("its last line has no end"))?;
        let mut lines = text.split('\n');
        let (Some(origin), Some(size), Some(root)) = (lines.next(), lines.next(), lines.next())
        else {
            return Err(wrong("fewer than three lines"));
        };
        check_name(origin).map_err(|_| wrong("its first line is not an origin"))?;
        let size = number(size).ok_or_else(|| wrong("its second line is not a size"))?;
        let root = tree_hash(root).ok_or_else(|| wrong("its third line is not a hash"))?;
        if lines.any(str::is_empty) {
            return Err(wrong("it holds an empty line"));
        }
        Ok(Checkpoint { origin: origin.to_owned(), size, root })
    }
}

/// A number as it is always written: decimal, no sign, no zero in front.
pub(super) fn number(text: &str) -> Option<u64> {
    let plain =
        text.bytes().all(|byte| byte.is_ascii_digit()) && (text == "0" || !text.starts_with('0'));
    if plain { text.parse().ok() } else { None }
}

/// 32 bytes in base64.
pub(super) fn tree_hash(text: &str) -> Option<TreeHash> {
    STANDARD.decode(text).ok()?.try_into().ok().map(TreeHash)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signer() -> NoteSigner {
        NoteSigner::new("lab.example.org/local", &[7; 32]).unwrap()
    }

    fn checkpoint() -> Checkpoint {
        let origin = "lab.example.org/local".to_owned();
        Checkpoint { origin, size: 17, root: TreeHash::of_leaf(b"x") }
    }

    #[test]
    fn a_signed_checkpoint_is_read_back_and_looks_as_the_form_says() {
        let note = checkpoint().sign(&signer());
        let lines: Vec<&str> = note.lines().collect();
        assert_eq!(lines[..2], ["lab.example.org/local", "17"]);
        assert_eq!((lines.len(), lines[3]), (5, ""));
        assert!(lines[4].starts_with("\u{2014} lab.example.org/local "), "{note}");
        assert_eq!(Checkpoint::open(&note, &signer().public()), Ok(checkpoint()));
    }

    #[test]
    fn a_checkpoint_of_another_log_under_the_same_key_is_refused() {
        let text = format!("else\n17\n{}\n", STANDARD.encode([0; 32]));
        let error = Checkpoint::open(&signer().sign(&text), &signer().public()).unwrap_err();
        assert_eq!(error.to_string(), "it is a checkpoint of else, not of lab.example.org/local");
    }

    #[test]
    fn only_one_spelling_of_a_checkpoint_is_read() {
        let root = STANDARD.encode([0; 32]);
        let open = |text: String| Checkpoint::open(&signer().sign(&text), &signer().public());
        let origin = "lab.example.org/local";
        assert!(open(format!("{origin}\n1\n{root}\n")).is_ok());
        assert!(open(format!("{origin}\n1\n{root}\nan extension\n")).is_ok());
        for bad in [
            format!("{origin}\n1\n"),
            format!("{origin}\n01\n{root}\n"),
            format!("{origin}\n+1\n{root}\n"),
            format!("{origin}\n1 \n{root}\n"),
            format!("{origin}\n18446744073709551616\n{root}\n"),
            format!("{origin}\n\n1\n{root}\n"),
            format!("{origin}\n1\n{}\n", &root[..40]),
            format!("{origin}\n1\n{}\n", root.replace("A=", "B=")),
            format!("two words\n1\n{root}\n"),
        ] {
            let error = open(bad.clone()).unwrap_err();
            assert!(matches!(error, CheckpointError::Form { .. }), "{bad:?}: {error}");
        }
    }
}
