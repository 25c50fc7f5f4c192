use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use data_encoding::{HEXLOWER, HEXLOWER_PERMISSIVE};
use zeroize::Zeroizing;

use super::entropy::Entropy;
use super::seal::DataKey;
use crate::ids::{StreamId, StreamKey, TenantId, UserId};
use crate::store::disk::files::{make_dir, overwrite_and_remove, sync_dir, write_whole};

/// User keys held in memory; then the cache starts afresh. Above `AWAKE_USERS_MAX`.
const CACHED_KEYS_MAX: usize = 16_384;
const KEY_FILE_HEAD: &str = "apprentice user key 1\n";
const WRAPPING: &str = "apprentice 1: wrapping of user keys";
const SIGNING: &str = "apprentice 1: signing";
const STREAM_KEYS: &str = "apprentice 1: stream keys";

/// Why a key cannot be had.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum KeyError {
    #[error(
        "tenant {tenant} has no key file {path}; restore it from a backup, or add the tenant first"
    )]
    NoTenant { tenant: TenantId, path: String },
    #[error("the key file {path} can be read by others (mode {mode:03o}); run: chmod 600 {path}")]
    Permissions { path: String, mode: u32 },
    #[error("the key file {path} is damaged: {reason}; restore it from a backup")]
    Malformed { path: String, reason: String },
    #[error("the key of stream {stream} is missing: {path}; restore it from a backup")]
    Missing { stream: StreamId, path: String },
    #[error("the user of stream {stream} was erased")]
    Erased { stream: StreamId },
    #[error(
        "tenant {tenant} has one secret in the environment variable {variable} and another in the \
         file {path}; keep the one that sealed its records"
    )]
    TwoSecrets { tenant: TenantId, variable: String, path: String },
    #[error(
        "the secret of tenant {tenant} in {place} opens no user's key in this directory; give the \
         secret that sealed its records"
    )]
    WrongSecret { tenant: TenantId, place: String },
    #[error("the keys are open for reading only")]
    ReadOnly,
    #[error("the key file {path} cannot be used: {reason}")]
    Io { path: String, reason: String },
}

/// The secrets: one per tenant, and one per person, wrapped by the tenant's.
///
/// They live *outside* the log's database, whose old pages would keep a destroyed key, as one small
/// file each:
///
/// - `<tenant>.key`: 64 hexadecimal digits, mode 0600; instead of the file, the environment variable
///   `APPRENTICE_TENANT_KEY_<TENANT>` may hold them (capital letters, `_` for `-`), so that a copy of
///   the directory opens nothing;
/// - `users/<tenant>/<stream key>.key`: the wrapped data key;
/// - `users/<tenant>/<stream key>.erased`: empty; says that the key is gone on purpose.
pub struct Keys {
    entropy: Arc<dyn Entropy>,
    home: Home,
    held: Mutex<Held>,
}

enum Home {
    Memory,
    Directory { dir: PathBuf, writable: bool },
}

#[derive(Default)]
struct Held {
    tenants: BTreeMap<TenantId, DataKey>,
    users: BTreeMap<StreamId, DataKey>,
    /// Only for keys in memory; a directory has a file for each.
    erased: Vec<StreamId>,
}

/// A new key, and its file unless it is in memory.
struct Made {
    key: DataKey,
    path: Option<PathBuf>,
}

impl std::fmt::Debug for Keys {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Keys(..)")
    }
}

impl Keys {
    /// Keys that end with the process; every tenant exists.
    pub fn in_memory(entropy: Arc<dyn Entropy>) -> Keys {
        Keys { entropy, home: Home::Memory, held: Mutex::default() }
    }

    /// Keys under `dir`, which is made if missing. An erasure that a crash cut short is finished.
    pub fn open(dir: &Path, entropy: Arc<dyn Entropy>) -> Result<Keys, KeyError> {
        let users = dir.join("users");
        make_dir(&users).map_err(|error| cannot(&users, &error))?;
        for path in
            list(&users)?.iter().map(|tenant| list(tenant)).collect::<Result<Vec<_>, _>>()?
        {
            finish_erasures(&path)?;
        }
        // A process that died between giving a key its name and syncing the directory has left a
        // key that looks as good as any other and would be gone after a power cut.
        let tenants = list(&users)?;
        for each in tenants.iter().map(PathBuf::as_path).chain([&*users, dir]) {
            sync_dir(each).map_err(|error| cannot(each, &error))?;
        }
        let home = Home::Directory { dir: dir.to_owned(), writable: true };
        Ok(Keys { entropy, home, held: Mutex::default() })
    }

    /// Keys that somebody else's `dir` holds: nothing is made and nothing erased.
    pub fn open_read_only(dir: &Path, entropy: Arc<dyn Entropy>) -> Keys {
        let home = Home::Directory { dir: dir.to_owned(), writable: false };
        Keys { entropy, home, held: Mutex::default() }
    }

    /// The keys of one tenant whose secret stands somewhere else than in a data directory.
    ///
    /// - `secret`: the text of its key file.
    pub(in crate::store) fn of_secret(
        tenant: &TenantId,
        secret: &[u8],
        path: &Path,
        entropy: Arc<dyn Entropy>,
    ) -> Result<Keys, KeyError> {
        let text = std::str::from_utf8(secret).map_err(|_| malformed(path, "it is not text"))?;
        let keys = Keys::in_memory(entropy);
        keys.held().tenants.insert(tenant.clone(), tenant_key_of(text, path)?);
        Ok(keys)
    }

    /// Opens the bytes of a person's key file.
    pub(in crate::store) fn unwrap(
        &self,
        stream: &StreamId,
        file: &[u8],
        path: &Path,
    ) -> Result<DataKey, KeyError> {
        self.unwrapped(&mut self.held(), stream, file, path)
    }

    fn unwrapped(
        &self,
        held: &mut Held,
        stream: &StreamId,
        file: &[u8],
        path: &Path,
    ) -> Result<DataKey, KeyError> {
        let wrapped = std::str::from_utf8(file)
            .ok()
            .and_then(|text| text.strip_prefix(KEY_FILE_HEAD))
            .and_then(|rest| unhex(rest.trim_end()))
            .ok_or_else(|| malformed(path, "it does not hold a wrapped key"))?;
        let opened = self
            .wrapping_key(held, &stream.tenant)?
            .open(&wrapping_bound(stream), &wrapped)
            .map(Zeroizing::new)
            .ok_or_else(|| malformed(path, "the tenant's key does not open it"))?;
        let bytes: &[u8; 32] = opened
            .as_slice()
            .try_into()
            .map_err(|_| malformed(path, "it does not hold a key of 32 bytes"))?;
        Ok(DataKey::from_bytes(*bytes))
    }

    /// Whether the tenant's secret is the one that wrapped the keys of these people. Damage that
    /// turns it into another secret would make everybody a stranger without a word.
    ///
    /// - errors: none of the keys that are there opens.
    pub fn check_opens(&self, tenant: &TenantId, streams: &[StreamId]) -> Result<(), KeyError> {
        let Home::Directory { dir, .. } = &self.home else { return Ok(()) };
        let mut seen = None;
        for stream in streams {
            match self.user_key(stream) {
                Ok(_) => return Ok(()),
                Err(KeyError::Malformed { .. }) => seen = Some(()),
                Err(_) => {}
            }
        }
        match seen {
            None => Ok(()),
            Some(()) => {
                let variable = variable_of(tenant);
                let place = match std::env::var_os(&variable) {
                    Some(_) => format!("the environment variable {variable}"),
                    None => format!("the file {}", show(&tenant_path(dir, tenant))),
                };
                Err(KeyError::WrongSecret { tenant: tenant.clone(), place })
            }
        }
    }

    pub fn entropy(&self) -> &dyn Entropy {
        &*self.entropy
    }

    /// Makes the tenant's secret unless there is one. Returns whether it was made.
    ///
    /// A caller must be sure that the tenant has no records yet: they would be lost
    /// behind a new key.
    pub fn make_tenant(&self, tenant: &TenantId) -> Result<bool, KeyError> {
        let mut held = self.held();
        match self.tenant_key(&mut held, tenant) {
            Ok(_) => return Ok(false),
            Err(KeyError::NoTenant { .. }) => {}
            Err(error) => return Err(error),
        }
        let dir = self.writable()?;
        let path = tenant_path(dir, tenant);
        let key = DataKey::random(&*self.entropy);
        let text = Zeroizing::new(format!("{}\n", *hex(key.expose())));
        write_whole(&path, text.as_bytes())
            .and_then(|()| sync_dir(dir))
            .map_err(|error| cannot(&path, &error))?;
        held.tenants.insert(tenant.clone(), key);
        Ok(true)
    }

    /// Whether the tenant's secret can be used.
    pub fn check_tenant(&self, tenant: &TenantId) -> Result<(), KeyError> {
        self.tenant_key(&mut self.held(), tenant).map(|_| ())
    }

    /// The stream of a person: a keyed hash of the name, so that nobody without the tenant's
    /// secret can tell from the log who is in it, not even by guessing names. A name whose person was
    /// erased stands for somebody new: the next life of that name.
    pub fn stream_id(&self, tenant: &TenantId, user: &UserId) -> Result<StreamId, KeyError> {
        let mut held = self.held();
        let mut life = 0;
        loop {
            let stream = self.stream_of_life(&mut held, tenant, user, life)?;
            if !self.is_erased(&held, &stream) {
                return Ok(stream);
            }
            life += 1;
        }
    }

    /// - `life`: how many bearers of this name were erased before.
    fn stream_of_life(
        &self,
        held: &mut Held,
        tenant: &TenantId,
        user: &UserId,
        life: u64,
    ) -> Result<StreamId, KeyError> {
        let secret = self.tenant_key(held, tenant)?;
        let key = Zeroizing::new(blake3::derive_key(STREAM_KEYS, secret.expose()));
        let mut hasher = blake3::Hasher::new_keyed(&key);
        hasher.update(user.as_str().as_bytes());
        if life > 0 {
            // No name holds a zero byte.
            hasher.update(b"\0").update(&life.to_be_bytes());
        }
        let hash = hasher.finalize();
        let (key, _) = hash.as_bytes().split_first_chunk().expect("a hash has 32 bytes");
        Ok(StreamId { tenant: tenant.clone(), key: StreamKey(*key) })
    }

    fn is_erased(&self, held: &Held, stream: &StreamId) -> bool {
        match &self.home {
            Home::Memory => held.erased.contains(stream),
            // A key in memory is not an erased one, so the disk need not be read.
            Home::Directory { .. } if held.users.contains_key(stream) => false,
            Home::Directory { dir, .. } => user_path(dir, stream, "erased").exists(),
        }
    }

    /// Everybody of `tenant` whose key was destroyed, as the files say, in the order of their keys.
    pub fn erased(&self, tenant: &TenantId) -> Result<Vec<StreamId>, KeyError> {
        let mut found = match &self.home {
            Home::Memory => {
                let held = self.held();
                held.erased.iter().filter(|stream| stream.tenant == *tenant).cloned().collect()
            }
            Home::Directory { dir, .. } => {
                let people = dir.join("users").join(tenant.as_str());
                let paths = if people.is_dir() { list(&people)? } else { Vec::new() };
                let names = paths.iter().filter(|path| path.extension() == Some("erased".as_ref()));
                let keys = names.filter_map(|path| path.file_stem()?.to_str()?.parse().ok());
                keys.map(|key| StreamId { tenant: tenant.clone(), key }).collect::<Vec<_>>()
            }
        };
        found.sort();
        Ok(found)
    }

    /// The secret Ed25519 key that signs for a tenant.
    pub fn signing_secret(&self, tenant: &TenantId) -> Result<Zeroizing<[u8; 32]>, KeyError> {
        let secret = self.tenant_key(&mut self.held(), tenant)?;
        Ok(Zeroizing::new(blake3::derive_key(SIGNING, secret.expose())))
    }

    /// - errors: [`KeyError::Erased`], [`KeyError::Missing`] when there never was one, or why the
    ///   file cannot be used.
    pub fn user_key(&self, stream: &StreamId) -> Result<DataKey, KeyError> {
        self.find_user_key(&mut self.held(), stream)
    }

    /// Makes keys, durable on return, for those of `streams` that have none.
    ///
    /// - errors: [`KeyError::Erased`] when one of them was erased: its stream is final.
    pub fn make_user_keys(&self, streams: &[StreamId]) -> Result<(), KeyError> {
        let mut held = self.held();
        let mut made = BTreeMap::new();
        let durable = self.write_user_keys(&mut held, streams, &mut made);
        for (stream, Made { key, path }) in made {
            if durable.is_ok() {
                self.keep(&mut held, &stream, key);
            } else if let Some(path) = path {
                // A key that may not outlive a power cut must not seal anything: the next attempt
                // makes another.
                held.users.remove(&stream);
                let _ = fs::remove_file(path);
            }
        }
        durable
    }

    /// - `made`: the keys that were written, whether or not all went well.
    fn write_user_keys(
        &self,
        held: &mut Held,
        streams: &[StreamId],
        made: &mut BTreeMap<StreamId, Made>,
    ) -> Result<(), KeyError> {
        let mut dirs = Vec::new();
        for stream in streams {
            if made.contains_key(stream) {
                continue;
            }
            match self.find_user_key(held, stream) {
                Ok(_) => continue,
                Err(KeyError::Missing { .. }) => {}
                Err(error) => return Err(error),
            }
            let key = DataKey::random(&*self.entropy);
            let mut written = None;
            if let Home::Directory { .. } = self.home {
                let path = user_path(self.writable()?, stream, "key");
                let wrapped = self.wrapping_key(held, &stream.tenant)?.seal(
                    &*self.entropy,
                    &wrapping_bound(stream),
                    key.expose(),
                );
                let text = format!("{KEY_FILE_HEAD}{}\n", *hex(&wrapped));
                let dir = path.parent().expect("a key file has a directory").to_owned();
                make_dir(&dir)
                    .and_then(|()| write_whole(&path, text.as_bytes()))
                    .map_err(|error| cannot(&path, &error))?;
                dirs.push(dir);
                written = Some(path);
            }
            made.insert(stream.clone(), Made { key, path: written });
        }
        dirs.sort();
        dirs.dedup();
        dirs.iter().try_for_each(|dir| sync_dir(dir).map_err(|error| cannot(dir, &error)))
    }

    /// Destroys a person's key for good: every record, mind and snapshot of the stream is noise
    /// from now on, and every chain still verifies. Repeating it is harmless.
    pub fn erase_user_key(&self, stream: &StreamId) -> Result<(), KeyError> {
        let mut held = self.held();
        held.users.remove(stream);
        if let Home::Memory = self.home {
            held.erased.push(stream.clone());
            return Ok(());
        }
        let dir = self.writable()?;
        let mark = user_path(dir, stream, "erased");
        let parent = mark.parent().expect("a key file has a directory");
        // The mark comes first: a crash in between leaves an erasure to finish, never a doubt.
        make_dir(parent)
            .and_then(|()| write_whole(&mark, b""))
            .and_then(|()| sync_dir(parent))
            .map_err(|error| cannot(&mark, &error))?;
        finish_erasures(&[mark])
    }

    fn held(&self) -> MutexGuard<'_, Held> {
        // A panic while it was held leaves at worst a key that is read from its file again.
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn writable(&self) -> Result<&Path, KeyError> {
        match &self.home {
            Home::Directory { dir, writable: true } => Ok(dir),
            _ => Err(KeyError::ReadOnly),
        }
    }

    fn tenant_key(&self, held: &mut Held, tenant: &TenantId) -> Result<DataKey, KeyError> {
        if let Some(key) = held.tenants.get(tenant) {
            return Ok(key.clone());
        }
        let key = match &self.home {
            Home::Memory => DataKey::random(&*self.entropy),
            Home::Directory { dir, .. } => {
                let path = tenant_path(dir, tenant);
                let in_file = read_tenant_key(&path, tenant);
                match secret_in_environment(tenant)? {
                    None => in_file?,
                    Some(secret) => match in_file {
                        Ok(other) if other.expose() != secret.expose() => {
                            let (variable, path) = (variable_of(tenant), show(&path));
                            return Err(KeyError::TwoSecrets {
                                tenant: tenant.clone(),
                                variable,
                                path,
                            });
                        }
                        Ok(_) | Err(KeyError::NoTenant { .. }) => secret,
                        Err(error) => return Err(error),
                    },
                }
            }
        };
        held.tenants.insert(tenant.clone(), key.clone());
        Ok(key)
    }

    fn wrapping_key(&self, held: &mut Held, tenant: &TenantId) -> Result<DataKey, KeyError> {
        let secret = self.tenant_key(held, tenant)?;
        Ok(DataKey::from_bytes(blake3::derive_key(WRAPPING, secret.expose())))
    }

    fn find_user_key(&self, held: &mut Held, stream: &StreamId) -> Result<DataKey, KeyError> {
        if let Some(key) = held.users.get(stream) {
            return Ok(key.clone());
        }
        let Home::Directory { dir, .. } = &self.home else {
            return Err(match held.erased.contains(stream) {
                true => KeyError::Erased { stream: stream.clone() },
                false => KeyError::Missing { stream: stream.clone(), path: "in memory".into() },
            });
        };
        if user_path(dir, stream, "erased").exists() {
            return Err(KeyError::Erased { stream: stream.clone() });
        }
        let path = user_path(dir, stream, "key");
        let file = match fs::read(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Err(KeyError::Missing { stream: stream.clone(), path: show(&path) });
            }
            Err(error) => return Err(cannot(&path, &error)),
        };
        let key = self.unwrapped(held, stream, &file, &path)?;
        self.keep(held, stream, key.clone());
        Ok(key)
    }

    fn keep(&self, held: &mut Held, stream: &StreamId, key: DataKey) {
        // Keys in memory have no other copy; those of a directory can be read again.
        let readable_again = matches!(self.home, Home::Directory { .. });
        if readable_again && held.users.len() >= CACHED_KEYS_MAX {
            held.users.clear();
        }
        held.users.insert(stream.clone(), key);
    }
}

fn tenant_path(dir: &Path, tenant: &TenantId) -> PathBuf {
    dir.join(format!("{tenant}.key"))
}

/// Where a person's wrapped key stands below the directory of keys.
pub(in crate::store) fn user_file(stream: &StreamId) -> PathBuf {
    user_path(Path::new(""), stream, "key")
}

fn user_path(dir: &Path, stream: &StreamId, extension: &str) -> PathBuf {
    dir.join("users").join(stream.tenant.as_str()).join(format!("{}.{extension}", stream.key))
}

/// A wrapped key moved to another person's or tenant's file does not open there.
fn wrapping_bound(stream: &StreamId) -> Vec<u8> {
    [stream.tenant.as_str().as_bytes(), b"\0", &stream.key.0].concat()
}

/// The environment variable that may hold a tenant's secret instead of its file.
fn variable_of(tenant: &TenantId) -> String {
    let name = tenant.as_str().to_ascii_uppercase().replace('-', "_");
    format!("APPRENTICE_TENANT_KEY_{name}")
}

fn secret_in_environment(tenant: &TenantId) -> Result<Option<DataKey>, KeyError> {
    let variable = variable_of(tenant);
    match std::env::var_os(&variable) {
        None => Ok(None),
        Some(text) => {
            let text = Zeroizing::new(text.to_string_lossy().into_owned());
            tenant_key_of(&text, Path::new(&format!("${variable}"))).map(Some)
        }
    }
}

fn read_tenant_key(path: &Path, tenant: &TenantId) -> Result<DataKey, KeyError> {
    let text = match fs::read_to_string(path) {
        Ok(text) => Zeroizing::new(text),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(KeyError::NoTenant { tenant: tenant.clone(), path: show(path) });
        }
        Err(error) if error.kind() == io::ErrorKind::InvalidData => {
            return Err(malformed(path, "it is not text"));
        }
        Err(error) => return Err(cannot(path, &error)),
    };
    let mode = fs::metadata(path).map_err(|error| cannot(path, &error))?.permissions().mode();
    if mode & 0o077 != 0 {
        return Err(KeyError::Permissions { path: show(path), mode: mode & 0o777 });
    }
    tenant_key_of(&text, path)
}

fn tenant_key_of(text: &str, path: &Path) -> Result<DataKey, KeyError> {
    let bytes = unhex(text.trim_end()).map(Zeroizing::new).unwrap_or_default();
    let bytes: &[u8; 32] = bytes
        .as_slice()
        .try_into()
        .map_err(|_| malformed(path, "it does not hold 64 hexadecimal digits"))?;
    Ok(DataKey::from_bytes(*bytes))
}

fn finish_erasures(marks: &[PathBuf]) -> Result<(), KeyError> {
    for mark in marks.iter().filter(|path| path.extension().is_some_and(|e| e == "erased")) {
        for key in [mark.with_extension("key"), mark.with_extension("key.new")] {
            overwrite_and_remove(&key).map_err(|error| cannot(&key, &error))?;
        }
        let parent = mark.parent().expect("a key file has a directory");
        sync_dir(parent).map_err(|error| cannot(parent, &error))?;
    }
    Ok(())
}

fn list(dir: &Path) -> Result<Vec<PathBuf>, KeyError> {
    let entries = fs::read_dir(dir).and_then(|entries| {
        entries.map(|entry| entry.map(|entry| entry.path())).collect::<io::Result<Vec<_>>>()
    });
    entries.map_err(|error| cannot(dir, &error))
}

fn show(path: &Path) -> String {
    path.display().to_string()
}

fn cannot(path: &Path, error: &io::Error) -> KeyError {
    KeyError::Io { path: show(path), reason: error.to_string() }
}

fn malformed(path: &Path, reason: &str) -> KeyError {
    KeyError::Malformed { path: show(path), reason: reason.to_owned() }
}

fn hex(bytes: &[u8]) -> Zeroizing<String> {
    Zeroizing::new(HEXLOWER.encode(bytes))
}

fn unhex(text: &str) -> Option<Vec<u8>> {
    HEXLOWER_PERMISSIVE.decode(text.as_bytes()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::sealing::entropy::OsEntropy;

    fn keys(dir: &Path) -> Keys {
        Keys::open(dir, Arc::new(OsEntropy)).unwrap()
    }

    fn ada(keys: &Keys) -> StreamId {
        keys.stream_id(&TenantId::local(), &UserId::new("ada").unwrap()).unwrap()
    }

    #[test]
    fn keys_are_found_again_after_a_restart() {
        let dir = tempfile::tempdir().unwrap();
        let first = keys(dir.path());
        assert!(first.make_tenant(&TenantId::local()).unwrap());
        let ada_before = ada(&first);
        first.make_user_keys(std::slice::from_ref(&ada_before)).unwrap();
        let key = first.user_key(&ada_before).unwrap();
        let second = keys(dir.path());
        assert!(!second.make_tenant(&TenantId::local()).unwrap());
        assert_eq!(ada(&second), ada_before);
        assert_eq!(second.user_key(&ada_before).unwrap().expose(), key.expose());
    }

    #[test]
    fn two_tenants_give_one_name_two_streams() {
        let keys = Keys::in_memory(Arc::new(OsEntropy));
        let ada = UserId::new("ada").unwrap();
        let one = keys.stream_id(&TenantId::new("one").unwrap(), &ada).unwrap();
        let two = keys.stream_id(&TenantId::new("two").unwrap(), &ada).unwrap();
        assert_ne!(one.key, two.key);
    }

    #[test]
    fn an_erased_key_leaves_no_file_and_never_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let first = keys(dir.path());
        first.make_tenant(&TenantId::local()).unwrap();
        let ada = ada(&first);
        first.make_user_keys(std::slice::from_ref(&ada)).unwrap();
        let path = user_path(dir.path(), &ada, "key");
        assert!(path.exists());
        first.erase_user_key(&ada).unwrap();
        first.erase_user_key(&ada).unwrap();
        assert!(!path.exists());
        for keys in [first, keys(dir.path())] {
            let erased = KeyError::Erased { stream: ada.clone() };
            assert_eq!(keys.user_key(&ada).unwrap_err(), erased);
            assert_eq!(keys.make_user_keys(std::slice::from_ref(&ada)).unwrap_err(), erased);
        }
    }

    #[test]
    fn an_erasure_cut_short_is_finished_at_the_next_start() {
        let dir = tempfile::tempdir().unwrap();
        let first = keys(dir.path());
        first.make_tenant(&TenantId::local()).unwrap();
        let ada = ada(&first);
        first.make_user_keys(std::slice::from_ref(&ada)).unwrap();
        fs::write(user_path(dir.path(), &ada, "erased"), b"").unwrap();
        let second = keys(dir.path());
        assert!(!user_path(dir.path(), &ada, "key").exists());
        assert_eq!(second.user_key(&ada).unwrap_err(), KeyError::Erased { stream: ada });
    }

    #[test]
    fn a_key_that_others_can_read_or_that_is_damaged_is_refused_with_the_act() {
        let dir = tempfile::tempdir().unwrap();
        keys(dir.path()).make_tenant(&TenantId::local()).unwrap();
        let path = dir.path().join("local.key");
        let name = UserId::new("ada").unwrap();
        let refusal = || keys(dir.path()).stream_id(&TenantId::local(), &name).unwrap_err();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
        let error = refusal().to_string();
        assert!(error.contains("mode 644") && error.contains("chmod 600"), "{error}");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        fs::write(&path, "not a key").unwrap();
        assert!(matches!(refusal(), KeyError::Malformed { .. }));
        fs::write(&path, [0xff, 0xfe]).unwrap();
        assert!(matches!(refusal(), KeyError::Malformed { .. }));
        fs::remove_file(&path).unwrap();
        assert!(matches!(refusal(), KeyError::NoTenant { .. }));
    }

    #[test]
    fn a_wrapped_key_under_another_name_does_not_open() {
        let dir = tempfile::tempdir().unwrap();
        let first = keys(dir.path());
        first.make_tenant(&TenantId::local()).unwrap();
        let (ada, eve) =
            (ada(&first), StreamId { tenant: TenantId::local(), key: StreamKey([9; 16]) });
        first.make_user_keys(std::slice::from_ref(&ada)).unwrap();
        fs::copy(user_path(dir.path(), &ada, "key"), user_path(dir.path(), &eve, "key")).unwrap();
        assert!(matches!(first.user_key(&eve), Err(KeyError::Malformed { .. })));
    }
}
