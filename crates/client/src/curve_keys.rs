//! CURVE keys and their files. A file is a ZeroMQ certificate, which `pyzmq` and `czmq` can read.

use std::fmt;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};

use apprentice_core::ids::PublicKey;
use zeroize::Zeroizing;

use crate::z85;

/// A CURVE key: its public half and its secret half. The secret half is overwritten when the key is
/// dropped, and is never printed.
#[derive(Clone)]
pub struct CurveKey {
    public: PublicKey,
    secret: Zeroizing<[u8; 32]>,
}

/// Why there is no key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CurveKeyError {
    /// A key that may be in use is never replaced.
    #[error(
        "the key file {path} already exists; name another file, or remove it if it is not needed"
    )]
    Exists {
        /// The file.
        path: String,
    },
    /// There is no such file.
    #[error("there is no key file {path}; make one with `apprentice keys new --out {path}`")]
    Absent {
        /// The file.
        path: String,
    },
    /// Other users of the machine can read the file.
    #[error("the key file {path} can be read by others (mode {mode:03o}); run: chmod 600 {path}")]
    Permissions {
        /// The file.
        path: String,
        /// Its permissions, such as octal 644.
        mode: u32,
    },
    /// The file has no key in it.
    #[error("the key file {path} is damaged: {reason}; restore it, or make another key")]
    Malformed {
        /// The file.
        path: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The file cannot be read or written.
    #[error("the key file {path} cannot be used: {reason}")]
    Io {
        /// The file.
        path: String,
        /// What the operating system says.
        reason: String,
    },
    /// The text is neither a public key nor a file with one.
    #[error(
        "{text:?} is not a public key: expected 40 characters, or a file that contains them, such as \
         the .pub file that `apprentice keys new` writes"
    )]
    NoPublicKey {
        /// Its first characters.
        text: String,
    },
    /// ZeroMQ was built without CURVE.
    #[error("this build of ZeroMQ cannot make keys: {reason}; {}", REBUILD_WITH_CURVE)]
    NoCurve {
        /// What ZeroMQ says.
        reason: String,
    },
}

/// Part of a message: what to do if ZeroMQ was built without CURVE.
pub const REBUILD_WITH_CURVE: &str = "build apprentice inside its own workspace, where Cargo.toml \
     replaces zeromq-src by deploy/libzmq, or listen on tcp://127.0.0.1:PORT only";

/// Bytes that are read of a file. A certificate has fewer; a file that was named by mistake must
/// not fill the memory.
const KEY_FILE_BYTES_MAX: u64 = 64 * 1024;

impl CurveKey {
    /// Makes a key from random bytes of the operating system.
    ///
    /// - errors: [`CurveKeyError::NoCurve`].
    pub fn new() -> Result<CurveKey, CurveKeyError> {
        let pair = zmq::CurveKeyPair::new()
            .map_err(|error| CurveKeyError::NoCurve { reason: error.to_string() })?;
        let secret = Zeroizing::new(pair.secret_key);
        Ok(CurveKey { public: PublicKey(pair.public_key), secret })
    }

    /// The public half.
    pub fn public(&self) -> &PublicKey {
        &self.public
    }

    /// The secret half.
    pub fn secret(&self) -> &[u8; 32] {
        &self.secret
    }

    /// Writes the key into a new file that only its owner can read, and the public half into a file
    /// beside it ([`public_file`]). Both are durable on return.
    ///
    /// - returns: the file with the public half.
    /// - errors: one of the files exists, or cannot be written.
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

    /// Reads the key from a file that [`CurveKey::write_new`] wrote.
    ///
    /// - errors: there is no such file, other users can read it, or it has no key in it.
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

    /// Reads the key from a file. Makes the key and the file if there is none.
    ///
    /// - errors: as [`CurveKey::read`] and [`CurveKey::write_new`].
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

// The secret half must not get into a log line.
impl fmt::Debug for CurveKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CurveKey({}, ..)", z85::show(&self.public))
    }
}

/// Reads a public key as a person names it.
///
/// - `text`: the 40 characters of the key, or the name of a file that contains them.
/// - errors: it is neither, or the file cannot be read.
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

/// The file with the public half of the key in `path`: the same name with `.pub` added.
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
