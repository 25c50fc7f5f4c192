//! Signed notes: a text, a blank line, and a line for each signature, in the form of C2SP's
//! *signed-note*.

use std::fmt;
use std::str::FromStr;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use ed25519_dalek::{Signer as _, SigningKey, VerifyingKey};
use sha2::{Digest, Sha256};

/// The kind of key that is an Ed25519 key.
const ED25519: u8 = 1;
/// An em dash and a space begin a line with a signature.
const MARK: &str = "\u{2014} ";
/// Signatures that one note may carry: witnesses may add theirs.
const SIGNATURES_MAX: usize = 64;
/// Bytes of the name of a key.
const NAME_BYTES_MAX: usize = 255;

/// Why a note shows nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoteError {
    #[error("it is not a signed note: {reason}")]
    Form { reason: &'static str },
    #[error("the note has no signature by {key}")]
    Unsigned { key: String },
    #[error("the signature by {key} does not match the note")]
    Signature { key: String },
}

/// Why a text is no public key or no name for one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum KeyNameError {
    #[error(
        "a name such as lab.example.org/local has 1 to {NAME_BYTES_MAX} visible ASCII characters \
         and no plus sign"
    )]
    Name,
    #[error("a public key looks like NAME+8 hexadecimal digits+base64; this one has {reason}")]
    Key { reason: &'static str },
}

/// A public key with the name of the log that it signs for: all that an auditor needs to be given.
/// Shows as `NAME+8 hexadecimal digits+base64 of 01 and the key`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VerifierKey {
    name: String,
    key: VerifyingKey,
}

impl VerifierKey {
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Tells keys of one name apart: the start of the SHA-256 of name, line feed, 1 and key.
    fn hash(&self) -> [u8; 4] {
        let mut hasher = Sha256::new();
        hasher.update(self.name.as_bytes());
        hasher.update([b'\n', ED25519]);
        hasher.update(self.key.as_bytes());
        *hasher.finalize().first_chunk().expect("SHA-256 has 32 bytes")
    }

    /// The text of `note`, when this key signed it.
    ///
    /// Signatures by other keys are ignored: they are for other readers.
    ///
    /// - errors: [`NoteError`]; never panics, whatever the note.
    pub fn open<'n>(&self, note: &'n str) -> Result<&'n str, NoteError> {
        let (text, signatures) = parts(note)?;
        let mut found = false;
        for (name, bytes) in signatures {
            let Some((hash, signature)) = bytes.split_first_chunk::<4>() else { continue };
            if name != self.name || *hash != self.hash() {
                continue;
            }
            let wrong = NoteError::Signature { key: self.name.clone() };
            let signature: &[u8; 64] = signature.try_into().map_err(|_| wrong.clone())?;
            // Strict: one text and one signature, and no key that signs everything.
            self.key
                .verify_strict(text.as_bytes(), &ed25519_dalek::Signature::from_bytes(signature))
                .map_err(|_| wrong)?;
            found = true;
        }
        match found {
            true => Ok(text),
            false => Err(NoteError::Unsigned { key: self.to_string() }),
        }
    }
}

type Signatures<'n> = Vec<(&'n str, Vec<u8>)>;

/// Text, names and signatures.
fn parts(note: &str) -> Result<(&str, Signatures<'_>), NoteError> {
    let wrong = |reason| NoteError::Form { reason };
    if note.chars().any(|c| c.is_ascii_control() && c != '\n') {
        return Err(wrong("it holds control characters"));
    }
    let at = note.rfind("\n\n").ok_or_else(|| wrong("no blank line before its signatures"))?;
    // The last line feed of the text belongs to it.
    let (text, rest) = (&note[..=at], &note[at + 2..]);
    let rest = rest.strip_suffix('\n').ok_or_else(|| wrong("its last line has no end"))?;
    let mut signatures = Vec::new();
    for line in rest.split('\n') {
        if signatures.len() == SIGNATURES_MAX {
            return Err(wrong("too many signatures"));
        }
        let line =
            line.strip_prefix(MARK).ok_or_else(|| wrong("a line that is not a signature"))?;
        let (name, bytes) =
            line.split_once(' ').ok_or_else(|| wrong("a signature without a name"))?;
        check_name(name).map_err(|_| wrong("a signature without a proper name"))?;
        let bytes = STANDARD.decode(bytes).map_err(|_| wrong("a signature that is not base64"))?;
        if bytes.len() < 5 {
            return Err(wrong("a signature that is too short"));
        }
        signatures.push((name, bytes));
    }
    Ok((text, signatures))
}

/// Whether something may be the name of a key and the origin of a log.
pub(super) fn check_name(name: &str) -> Result<(), KeyNameError> {
    let fine = (1..=NAME_BYTES_MAX).contains(&name.len())
        && name.bytes().all(|byte| byte.is_ascii_graphic() && byte != b'+');
    if fine { Ok(()) } else { Err(KeyNameError::Name) }
}

impl fmt::Display for VerifierKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let key = STANDARD.encode([&[ED25519], &self.key.as_bytes()[..]].concat());
        write!(f, "{}+{:08x}+{key}", self.name, u32::from_be_bytes(self.hash()))
    }
}

impl FromStr for VerifierKey {
    type Err = KeyNameError;

    fn from_str(text: &str) -> Result<VerifierKey, KeyNameError> {
        let wrong = |reason| KeyNameError::Key { reason };
        // Base64 may hold plus signs itself.
        let mut parts = text.splitn(3, '+');
        let (Some(name), Some(hash), Some(key)) = (parts.next(), parts.next(), parts.next()) else {
            return Err(wrong("fewer than two plus signs"));
        };
        check_name(name)?;
        let bytes = STANDARD.decode(key).map_err(|_| wrong("no base64 at its end"))?;
        let Some((&ED25519, key)) = bytes.split_first() else {
            return Err(wrong("another kind of key at its end"));
        };
        let key: &[u8; 32] = key.try_into().map_err(|_| wrong("a key of another length"))?;
        let key = VerifyingKey::from_bytes(key).map_err(|_| wrong("a key that is not a point"))?;
        if key.is_weak() {
            return Err(wrong("a weak key, for which signatures show nothing"));
        }
        let found = VerifierKey { name: name.to_owned(), key };
        match hash == format!("{:08x}", u32::from_be_bytes(found.hash())) {
            true => Ok(found),
            false => Err(wrong("a name, digits and a key that do not belong together")),
        }
    }
}

/// Signs for one log. The secret half of a [`VerifierKey`]; wiped when dropped.
pub struct NoteSigner {
    name: String,
    key: SigningKey,
}

impl fmt::Debug for NoteSigner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "NoteSigner({})", self.name)
    }
}

impl NoteSigner {
    /// - `name`: the origin of the log.
    /// - `secret`: an Ed25519 secret key of 32 bytes.
    pub fn new(name: &str, secret: &[u8; 32]) -> Result<NoteSigner, KeyNameError> {
        check_name(name)?;
        Ok(NoteSigner { name: name.to_owned(), key: SigningKey::from_bytes(secret) })
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn public(&self) -> VerifierKey {
        VerifierKey { name: self.name.clone(), key: self.key.verifying_key() }
    }

    /// - `text`: ends with a line feed and holds no blank line at its end.
    pub fn sign(&self, text: &str) -> String {
        debug_assert!(text.ends_with('\n') && !text.ends_with("\n\n"), "{text:?}");
        let signature = self.key.sign(text.as_bytes());
        let bytes = [&self.public().hash()[..], &signature.to_bytes()].concat();
        format!("{text}\n{MARK}{} {}\n", self.name, STANDARD.encode(bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::super::draws::Draws;
    use super::*;

    fn signer() -> NoteSigner {
        NoteSigner::new("lab.example.org/local", &[7; 32]).unwrap()
    }

    #[test]
    fn the_example_of_the_signed_note_format_opens() {
        // From the documentation of golang.org/x/mod/sumdb/note, which the format comes from.
        let key = "PeterNeumann+c74f20a3+ARpc2QcUPDhMQegwxbzhKqiBfsVkmqq/LDE4izWy10TW";
        let key: VerifierKey = key.parse().unwrap();
        let text = "If you think cryptography is the answer to your problem,\n\
                    then you don't know what your problem is.\n";
        let note = format!(
            "{text}\n\u{2014} PeterNeumann x08go/ZJkuBS9UG/SffcvIAQxVBtiFupLLr8pAcElZInNIuGUgYN1FFYC2pZ\
             SNXgKvqfqdngotpRZb6KE6RyyBwJnAM=\n"
        );
        assert_eq!(key.open(&note), Ok(text));
        assert!(key.open(&note.replace("answer", "anchor")).is_err());
    }

    #[test]
    fn a_public_key_is_read_back_and_every_changed_letter_is_noticed() {
        let shown = signer().public().to_string();
        assert_eq!(shown.parse::<VerifierKey>().unwrap(), signer().public());
        for at in 0..shown.len() {
            for other in [b'A', b'b', b'0', b'+', b' '] {
                let mut bytes = shown.clone().into_bytes();
                bytes[at] = other;
                let changed = String::from_utf8(bytes).unwrap();
                assert!(changed == shown || changed.parse::<VerifierKey>().is_err(), "{changed}");
            }
        }
        assert!(NoteSigner::new("a b", &[7; 32]).is_err());
        assert!(NoteSigner::new("a+b", &[7; 32]).is_err());
        assert!(NoteSigner::new("", &[7; 32]).is_err());
    }

    #[test]
    fn a_note_opens_for_its_key_only() {
        let note = signer().sign("a line\nanother\n");
        assert_eq!(signer().public().open(&note), Ok("a line\nanother\n"));
        let other = NoteSigner::new("lab.example.org/local", &[8; 32]).unwrap();
        assert!(matches!(other.public().open(&note), Err(NoteError::Unsigned { .. })));
        let renamed = NoteSigner::new("lab.example.org/other", &[7; 32]).unwrap();
        assert!(matches!(renamed.public().open(&note), Err(NoteError::Unsigned { .. })));
        // A witness adds a line; both find theirs.
        let both =
            format!("{note}{}", other.sign("a line\nanother\n").split("\n\n").nth(1).unwrap());
        assert!(signer().public().open(&both).is_ok() && other.public().open(&both).is_ok());
        // A second signature of the same key that does not fit spoils the note.
        let foreign = signer().sign("something else\n");
        let spoiled = format!("{note}{}", foreign.split("\n\n").nth(1).unwrap());
        assert!(matches!(signer().public().open(&spoiled), Err(NoteError::Signature { .. })));
    }

    #[test]
    fn whatever_is_changed_in_a_note_it_does_not_open_and_nothing_panics() {
        let (note, key) = (signer().sign("a line\nanother\n"), signer().public());
        let mut draws = Draws::new("notes");
        for at in 0..note.len() * 8 {
            let mut bytes = note.clone().into_bytes();
            bytes[at / 8] ^= 1 << (at % 8);
            let opened = String::from_utf8(bytes).ok().is_some_and(|note| key.open(&note).is_ok());
            assert!(!opened, "bit {at}");
        }
        for length in 0..note.len() {
            assert!(note.get(..length).is_none_or(|short| key.open(short).is_err()), "{length}");
        }
        for _ in 0..2_000 {
            let length = draws.below(200);
            let noise = String::from_utf8_lossy(&draws.bytes(length)).into_owned();
            assert!(key.open(&noise).is_err() && noise.parse::<VerifierKey>().is_err());
            let mixed = format!("{noise}\n\n\u{2014} {noise}\n");
            assert!(key.open(&mixed).is_err());
        }
    }
}
