//! CURVE keys and their files. A file is a ZeroMQ certificate, as `pyzmq` and `czmq` read it too.

use std::fmt;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};

use apprentice_core::ids::PublicKey;
use zeroize::Zeroizing;

use crate::z85;

/// A CURVE key with its secret half.
#[derive(Clone)]
pub struct CurveKey {
    public: PublicKey,
    secret: Zeroizing<[u8; 32]>,
}

/// Why a key cannot be had.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CurveKeyError {
    #[error(
        "the key file {path} already exists; name another file, or remove it if it is not needed"
    )]
    Exists { path: String },
    #[error("there is no key file {path}; make one with `apprentice keys new --out {path}`")]
    Absent { path: String },
    #[error("the key file {path} can be read by others (mode {mode:03o}); run: chmod 600 {path}")]
    Permissions { path: String, mode: u32 },
    #[error("the key file {path} is damaged: {reason}; restore it, or make another key")]
    Malformed { path: String, reason: &'static str },
    #[error("the key file {path} cannot be used: {reason}")]
    Io { path: String, reason: String },
    #[error(
        "{text:?} is not a public key: expected 40 characters, or a file that contains them, such as \
         the .pub file that `apprentice keys new` writes"
    )]
    NoPublicKey { text: String },
    #[error("this build of ZeroMQ cannot make keys: {reason}; {}", REBUILD_WITH_CURVE)]
    NoCurve { reason: String },
}

/// What to do about a ZeroMQ without CURVE.
pub const REBUILD_WITH_CURVE: &str = "build apprentice inside its own workspace, where Cargo.toml \
     replaces zeromq-src by deploy/libzmq, or listen on tcp://127.0.0.1:PORT only";

/// More than a certificate ever has, so that a wrong name does not fill the memory.
const KEY_FILE_BYTES_MAX: u64 = 64 * 1024;

impl CurveKey {
    /// A new key from the system's randomness.
    pub fn new() -> Result<CurveKey, CurveKeyError> {
        let pair = zmq::CurveKeyPair::new()
            .map_err(|error| CurveKeyError::NoCurve { reason: error.to_string() })?;
        let secret = Zeroizing::new(pair.secret_key);
        Ok(CurveKey { public: PublicKey(pair.public_key), secret })
    }

    pub fn public(&self) -> &PublicKey {
        &self.public
    }

    pub fn secret(&self) -> &[u8; 32] {
        &self.secret
    }

    /// Writes the key into a new file that its owner alone can read, and its public half beside it
    /// with the ending `.pub`. Durable on return.
    ///
    /// - errors: the file is there: a key that is in use must not be written over.
    pub fn write_new(&self, path: &Path) -> Result<PathBuf, CurveKeyError> {
        let secret = Zeroizing::new(format!(
            "# A secret CURVE key of apprentice. Anyone who has it can connect as you.\n\
             curve\n    public-key = \"{}\"\n    secret-key = \"{}\"\n",
            z85::show(&self.public),
            *Zeroizing::new(z85::encode(&self.secret)),
        ));
        write(path, secret.as_bytes(), 0o600)?;
        let public = public_file(path);
        let text = format!("{}\n", z85::show(&self.public));
        match write(&public, text.as_bytes(), 0o644) {
            Ok(()) => Ok(public),
            Err(error) => {
                let _ = fs::remove_file(path);
                Err(error)
            }
        }
    }

    /// - errors: no such file, one that others can read, or no key in it.
    pub fn read(path: &Path) -> Result<CurveKey, CurveKeyError> {
        let (text, mode) = read_text(path)?;
        if mode & 0o077 != 0 {
            return Err(CurveKeyError::Permissions { path: show(path), mode: mode & 0o777 });
        }
        let damaged = |reason| CurveKeyError::Malformed { path: show(path), reason };
        let field = |name| certificate_field(&text, name);
        let public = field("public-key").ok_or(damaged("it holds no public-key"))?;
        let secret = field("secret-key").ok_or(damaged("it holds no secret-key"))?;
        let public = z85::read(public).ok_or(damaged("its public-key is not a key"))?;
        let secret = z85::decode(secret).ok_or(damaged("its secret-key is not a key"))?;
        Ok(CurveKey { public, secret: Zeroizing::new(secret) })
    }

    /// The key of `path`, which is made when it is not there.
    pub fn read_or_make(path: &Path) -> Result<CurveKey, CurveKeyError> {
        match CurveKey::read(path) {
            Err(CurveKeyError::Absent { .. }) => {}
            found => return found,
        }
        let key = CurveKey::new()?;
        key.write_new(path)?;
        Ok(key)
    }
}

// The secret must not slip into a log line.
impl fmt::Debug for CurveKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CurveKey({}, ..)", z85::show(&self.public))
    }
}

/// A public key as a person names it: its 40 characters, or a file that holds it.
pub fn read_public(text: &str) -> Result<PublicKey, CurveKeyError> {
    if let Some(key) = z85::read(text) {
        return Ok(key);
    }
    let wrong = || CurveKeyError::NoPublicKey { text: text.chars().take(120).collect() };
    let (content, _) = match read_text(Path::new(text)) {
        Ok(read) => read,
        Err(CurveKeyError::Absent { .. }) => return Err(wrong()),
        Err(error) => return Err(error),
    };
    let key = certificate_field(&content, "public-key").unwrap_or(content.trim());
    z85::read(key).ok_or_else(wrong)
}

/// `NAME = "VALUE"` on a line of a certificate.
fn certificate_field<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.lines().find_map(|line| {
        let rest = line.trim().strip_prefix(name)?.trim_start().strip_prefix('=')?;
        rest.trim().strip_prefix('"')?.strip_suffix('"')
    })
}

fn read_text(path: &Path) -> Result<(Zeroizing<String>, u32), CurveKeyError> {
    let cannot = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound => CurveKeyError::Absent { path: show(path) },
        _ => CurveKeyError::Io { path: show(path), reason: error.to_string() },
    };
    let meta = fs::metadata(path).map_err(cannot)?;
    if !meta.is_file() || meta.len() > KEY_FILE_BYTES_MAX {
        let reason = "it is not a file of a few lines";
        return Err(CurveKeyError::Malformed { path: show(path), reason });
    }
    let bytes = Zeroizing::new(fs::read(path).map_err(cannot)?);
    let text = std::str::from_utf8(&bytes)
        .map_err(|_| CurveKeyError::Malformed { path: show(path), reason: "it is not text" })?;
    Ok((Zeroizing::new(text.to_owned()), meta.permissions().mode()))
}

fn write(path: &Path, bytes: &[u8], mode: u32) -> Result<(), CurveKeyError> {
    let cannot = |error: io::Error| match error.kind() {
        io::ErrorKind::AlreadyExists => CurveKeyError::Exists { path: show(path) },
        _ => CurveKeyError::Io { path: show(path), reason: error.to_string() },
    };
    let mut options = OpenOptions::new();
    let mut file = options.write(true).create_new(true).mode(mode).open(path).map_err(cannot)?;
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    file.write_all(bytes)
        .and_then(|()| file.sync_all())
        .and_then(|()| fs::File::open(folder)?.sync_all())
        .inspect_err(|_| drop(fs::remove_file(path)))
        .map_err(cannot)
}

/// Where the public half of the key in `path` stands.
pub fn public_file(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".pub");
    PathBuf::from(name)
}

fn show(path: &Path) -> String {
    path.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_written_for_its_owner_alone_and_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ada.key");
        let key = CurveKey::new().unwrap();
        let public = key.write_new(&path).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        let read = CurveKey::read(&path).unwrap();
        assert_eq!((read.public(), read.secret()), (key.public(), key.secret()));
        // A ZeroMQ certificate, which other programs read.
        let text = fs::read_to_string(&path).unwrap();
        for (name, half) in [("public-key", &key.public().0), ("secret-key", key.secret())] {
            let line = format!("    {name} = \"{}\"", zmq::z85_encode(half).unwrap());
            assert!(text.lines().any(|it| it == line), "{name}");
        }
        for named in [&*z85::show(key.public()), public.to_str().unwrap(), path.to_str().unwrap()] {
            assert_eq!(read_public(named).unwrap(), *key.public());
        }
        assert!(!format!("{key:?}").contains(&z85::encode(key.secret())));
        assert!(matches!(key.write_new(&path), Err(CurveKeyError::Exists { .. })));
        assert_eq!(CurveKey::read_or_make(&path).unwrap().public(), key.public());
    }

    #[test]
    fn a_key_that_cannot_be_used_is_refused_with_the_act() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ada.key");
        let refusal = || CurveKey::read(&path).unwrap_err().to_string();
        assert!(refusal().contains("keys new"), "{}", refusal());
        CurveKey::new().unwrap().write_new(&path).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        assert!(refusal().contains("mode 640") && refusal().contains("chmod 600"));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        for content in ["", "curve\n", "public-key = \"x\"\nsecret-key = \"y\"\n"] {
            fs::write(&path, content).unwrap();
            assert!(refusal().contains("is damaged"), "{}", refusal());
        }
        for text in ["", "no such file", "0123"] {
            assert!(matches!(read_public(text), Err(CurveKeyError::NoPublicKey { .. })), "{text}");
        }
        assert!(read_public(folder.path().to_str().unwrap()).is_err());
    }
}
