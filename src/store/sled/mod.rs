//! The log on `sled`: one tree per tenant, one committer, group commit.

mod adopt;
mod cache;
mod check;
mod commit;
mod quiet;
mod read;
mod sizes;
#[cfg(test)]
mod tests;
mod watch;

pub(in crate::store) use self::adopt::Adopter;
pub(in crate::store) use self::cache::SledCache;
pub(in crate::store) use self::check::{check_cache, check_log};
pub(in crate::store) use self::read::{KEY_BYTES, chunk_key};

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, RwLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use self::commit::{Committer, Job, Syncer};
use self::quiet::guarded;
use self::read::{Frames, Records, frame_at, last_seqs};
use self::sizes::Sizes;
use self::watch::{InHand, Watch};
use crate::events::{Batch, Head, Header, Record};
use crate::fairness::Room;
use crate::ids::{Seq, StreamId, StreamKey, TenantId};
use crate::limits::{COMMIT_QUEUE_BYTES_MAX, COMMIT_QUEUE_MAX, COMMIT_S_MAX};
use crate::store::checks;
use crate::store::disk::closed::{ClosedMark, Part};
use crate::store::disk::files::sync_dir;
use crate::store::disk::lock::DirLock;
use crate::store::log::heads::{Heads, HeadsFile, HeadsRead};
use crate::store::log::{AppendError, EventLog, Pending, ReadError, SealedRecords};
use crate::store::sealing::keys::Keys;
use crate::store::sealing::seal::{Draft, Walk, before};

/// Bytes of pages that `sled` keeps; it uses up to three times as much.
const CACHE_BYTES: u64 = 64 * 1024 * 1024;
/// Streams with records have their records in the tree `events/<tenant>`.
const TREE_PREFIX: &str = "events/";

/// For how long a database that was dropped may keep its file.
const LET_GO_MAX: Duration = Duration::from_secs(5);

/// Whose records stand in the tree of that name; none for trees that hold no records.
pub(in crate::store) fn tenant_of_tree(name: &[u8]) -> Option<TenantId> {
    let name = std::str::from_utf8(name).ok()?.strip_prefix(TREE_PREFIX)?;
    TenantId::new(name).ok()
}

/// The embedded log.
///
/// *Durable* means: batch applied, `flush`, `fdatasync` of sled's file (its flush alone does not
/// reach the disk), the new heads written to a file of our own, `fdatasync` of that. Only then are
/// promises kept and do readers see the records. After the first I/O error the log is poisoned: it
/// acknowledges nothing until it is opened again.
pub struct SledLog {
    shared: Arc<Shared>,
    sender: Option<SyncSender<Job>>,
    committer: Option<JoinHandle<()>>,
    /// Disconnected when the committer has ended.
    ended: Mutex<Receiver<()>>,
    _watch: Watch,
    /// Left when the database is closed: fields are dropped in this order.
    mark: Option<ClosedMark>,
    /// Held until all of that is done.
    _lock: Option<Arc<DirLock>>,
}

/// What the committer and the readers share.
struct Shared {
    db: ::sled::Db,
    keys: Arc<Keys>,
    /// What is durable. Readers see nothing beyond it.
    heads: RwLock<Heads>,
    poisoned: OnceLock<String>,
    /// What waits for the committer.
    waiting: CommitQueue,
    sizes: Sizes,
    in_hand: InHand,
    /// A group was given up; the committer may never come back from it.
    hangs: AtomicBool,
}

/// Room for batches that wait for the committer.
struct CommitQueue(Mutex<CommitQueueRooms>);

struct CommitQueueRooms {
    batches: Room,
    bytes: Room,
}

/// Something that was there and is not any more, found when a log is opened.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Damage {
    #[error(
        "stream {stream}: {acknowledged} records were acknowledged, but only {found} exist; \
         the last {} are lost", acknowledged - found
    )]
    LostTail { stream: StreamId, acknowledged: u64, found: u64 },
    #[error("stream {stream}: {error}")]
    Record { stream: StreamId, error: ReadError },
    #[error("the heads file, which guards against lost records, is damaged: {reason}")]
    Heads { reason: String },
    /// What a check of a copy saw and said.
    #[error("{0}")]
    Seen(String),
}

/// Why a log cannot be opened; the opening of a directory adds the directory and what to do.
#[derive(Debug)]
pub(in crate::store) enum LogError {
    Io(io::Error),
    Database(String),
    Damaged(Vec<Damage>),
}

impl SledLog {
    /// Opens the database `<dir>/log` and the heads file `<dir>/HEADS`, making both if `fresh`.
    pub(in crate::store) fn open(
        dir: &Path,
        keys: Arc<Keys>,
        fresh: bool,
        lock: Arc<DirLock>,
        leave_mark: bool,
    ) -> Result<SledLog, LogError> {
        let patience = Duration::from_secs(COMMIT_S_MAX);
        let mut log = SledLog::open_with(dir, keys, fresh, patience, |path| {
            let file = OpenOptions::new().read(true).write(true).open(path)?;
            Ok(Box::new(move || file.sync_data()))
        })?;
        log._lock = Some(lock);
        log.mark = leave_mark.then(|| ClosedMark::new(dir, Part::Log));
        Ok(log)
    }

    /// The tenants that have records.
    pub fn tenants(&self) -> Vec<TenantId> {
        let heads = self.shared.heads.read().expect("no holder of the heads panics");
        heads.keys().cloned().collect()
    }

    /// `syncer` makes, from the path of sled's file, what syncs it; tests make one that fails.
    fn open_with(
        dir: &Path,
        keys: Arc<Keys>,
        fresh: bool,
        patience: Duration,
        syncer: impl FnOnce(&Path) -> io::Result<Syncer>,
    ) -> Result<SledLog, LogError> {
        let database = dir.join("log");
        let heads_path = dir.join("HEADS");
        let recorded = HeadsFile::read(&heads_path).map_err(LogError::Io)?;
        // Nothing was acknowledged by a directory whose making was interrupted, and its files may
        // be half written, by a full disk for one: they are made again. The heads file would know.
        let nothing_known = |read: &HeadsRead| read.damage.is_none() && read.heads.is_empty();
        let fresh = fresh && recorded.as_ref().is_none_or(nothing_known);
        let recorded = match fresh {
            true => None,
            false => recorded,
        };
        if fresh && database.exists() {
            std::fs::remove_dir_all(&database).map_err(LogError::Io)?;
        }
        if !fresh && !database.join("db").is_file() {
            let missing = format!("{} is missing", database.join("db").display());
            return Err(LogError::Database(missing));
        }
        let db = open_database(&database, CACHE_BYTES).map_err(LogError::Database)?;
        let recorded = acknowledged(recorded, fresh)?;
        let heads = guarded(|| compare(&db, &recorded)).map_err(LogError::Database)??;
        // What sled holds beyond the recorded heads was never acknowledged. It is kept, and made
        // as durable as the rest before anybody reads it.
        guarded(|| db.flush()).map_err(LogError::Database)?.map_err(database_error)?;
        let mut sync = syncer(&database.join("db")).map_err(LogError::Io)?;
        sync().map_err(LogError::Io)?;
        sync_dir(&database).map_err(LogError::Io)?;
        let heads_file = HeadsFile::replace(&heads_path, &heads).map_err(LogError::Io)?;

        let shared = Arc::new(Shared {
            db,
            keys,
            sizes: Sizes::new(heads.clone()),
            heads: RwLock::new(heads),
            poisoned: OnceLock::new(),
            waiting: CommitQueue::new(),
            in_hand: InHand::default(),
            hangs: AtomicBool::new(false),
        });
        // Never full: the rooms for what waits are smaller.
        let (sender, receiver) = sync_channel(2 * COMMIT_QUEUE_MAX);
        let (ending, ended) = sync_channel(0);
        let committer = Committer::new(shared.clone(), heads_file, sync);
        let committer = std::thread::Builder::new()
            .name("committer".to_owned())
            .spawn(move || {
                let _ending = ending;
                committer.run(&receiver);
            })
            .map_err(LogError::Io)?;
        let _watch = Watch::start(shared.clone(), patience).map_err(LogError::Io)?;
        let (sender, committer, ended) = (Some(sender), Some(committer), Mutex::new(ended));
        Ok(SledLog { shared, sender, committer, ended, _watch, mark: None, _lock: None })
    }

    /// Where to read from record `from` on: a walk that begins there, and the end; none when there
    /// is no such record.
    fn from(
        &self,
        stream: &StreamId,
        from: Seq,
    ) -> Result<Option<(::sled::Tree, Walk, Head)>, ReadError> {
        let head = self.shared.head(stream);
        if from.get() > head.seq {
            return Ok(None);
        }
        let tree = guarded(|| self.shared.tree(&stream.tenant)).map_err(store_error)??;
        let last = match before(from) {
            None => Head::EMPTY,
            Some(before) => head_at(&tree, stream.key, before)?,
        };
        Ok(Some((tree, Walk::after(stream.key, last), head)))
    }

    /// The sentence that poisoned the log, if one did.
    pub fn poisoned(&self) -> Option<&str> {
        self.shared.poisoned.get().map(String::as_str)
    }
}

impl Drop for SledLog {
    fn drop(&mut self) {
        // The committer answers what is waiting, then ends with its channel.
        self.sender = None;
        let Some(committer) = self.committer.take() else { return };
        const LOOK_AGAIN: Duration = Duration::from_millis(100);
        let ended = self.ended.get_mut().unwrap_or_else(PoisonError::into_inner);
        while ended.recv_timeout(LOOK_AGAIN) == Err(RecvTimeoutError::Timeout) {
            if self.shared.hangs.load(Ordering::SeqCst) {
                // The committer may never return. The directory stays locked until the process
                // ends.
                std::mem::forget(self._lock.take());
                if let Some(mark) = self.mark.take() {
                    mark.forget();
                }
                return;
            }
        }
        // A committer that panicked has dropped its promises: everybody heard `Gone`.
        let orderly = committer.join().is_ok() && self.poisoned().is_none();
        if !orderly && let Some(mark) = self.mark.take() {
            // What failed may have left anything behind.
            mark.forget();
        }
    }
}

impl EventLog for SledLog {
    fn append(&self, stream: &StreamId, after: Head, batch: Batch) -> Pending {
        if let Some(reason) = self.shared.poisoned.get() {
            return Pending::kept(Err(AppendError::Poisoned { reason: reason.clone() }));
        }
        let draft = match Draft::encode(batch) {
            Ok(draft) => draft,
            Err(error) => return Pending::kept(Err(error)),
        };
        let bytes = draft.bytes();
        let (promise, pending) = Pending::promise();
        let job = Job { stream: stream.clone(), after, draft, promise };
        let sender = self.sender.as_ref().expect("only dropping the log takes it");
        if let Err(waiting) = self.shared.waiting.add(&stream.tenant, bytes) {
            job.answer(Err(AppendError::Busy { waiting }));
            return pending;
        }
        if let Err(refused) = sender.try_send(job) {
            let waiting = self.shared.waiting.remove(&stream.tenant, bytes);
            match refused {
                TrySendError::Full(job) => job.answer(Err(AppendError::Busy { waiting })),
                TrySendError::Disconnected(job) => job.answer(Err(AppendError::Gone)),
            }
        }
        pending
    }

    fn read<'a>(
        &'a self,
        stream: &StreamId,
        from: Seq,
    ) -> Result<Box<dyn Iterator<Item = Result<Record, ReadError>> + 'a>, ReadError> {
        match self.from(stream, from)? {
            None => Ok(Box::new(std::iter::empty())),
            Some((tree, walk, head)) => {
                let key = checks::key_to_read(&self.shared.keys, stream)?;
                Ok(Box::new(Records::new(&tree, key, walk, head)))
            }
        }
    }

    fn sealed<'a>(&'a self, stream: &StreamId, from: Seq) -> Result<SealedRecords<'a>, ReadError> {
        match self.from(stream, from)? {
            None => Ok(Box::new(std::iter::empty())),
            Some((tree, walk, head)) => Ok(Box::new(Frames::new(&tree, walk, head))),
        }
    }

    fn head(&self, stream: &StreamId) -> Result<Head, ReadError> {
        Ok(self.shared.head(stream))
    }

    fn streams(&self, tenant: &TenantId) -> Result<Vec<StreamId>, ReadError> {
        let heads = self.shared.heads.read().expect("no holder of the heads panics");
        let keys = heads.get(tenant).into_iter().flat_map(|streams| streams.keys());
        Ok(keys.map(|key| StreamId { tenant: tenant.clone(), key }).collect())
    }

    fn tenants(&self) -> Result<Vec<TenantId>, ReadError> {
        Ok(SledLog::tenants(self))
    }

    fn walk(&self, stream: &StreamId) -> Result<Head, ReadError> {
        let head = self.shared.head(stream);
        if head == Head::EMPTY {
            return Ok(head);
        }
        let tree = guarded(|| self.shared.tree(&stream.tenant)).map_err(store_error)??;
        read::walk(&tree, stream.key, head)
    }

    fn sealed_bytes(&self, tenant: &TenantId) -> Result<u64, ReadError> {
        self.shared
            .sizes
            .of(tenant, || guarded(|| self.shared.tree(tenant)).map_err(store_error)?)
    }
}

impl CommitQueue {
    fn new() -> CommitQueue {
        let batches = Room::new(COMMIT_QUEUE_MAX);
        CommitQueue(Mutex::new(CommitQueueRooms {
            batches,
            bytes: Room::new(COMMIT_QUEUE_BYTES_MAX),
        }))
    }

    /// Makes room for one more batch of a tenant.
    ///
    /// - errors: there is none; the batches that wait.
    fn add(&self, tenant: &TenantId, bytes: usize) -> Result<(), usize> {
        let mut rooms = self.rooms();
        if !rooms.batches.take(tenant, 1) {
            return Err(rooms.batches.total());
        }
        if !rooms.bytes.take(tenant, bytes) {
            rooms.batches.give_back(tenant, 1);
            return Err(rooms.batches.total());
        }
        Ok(())
    }

    /// - returns: the batches that wait now.
    fn remove(&self, tenant: &TenantId, bytes: usize) -> usize {
        let mut rooms = self.rooms();
        rooms.batches.give_back(tenant, 1);
        rooms.bytes.give_back(tenant, bytes);
        rooms.batches.total()
    }

    fn rooms(&self) -> MutexGuard<'_, CommitQueueRooms> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Shared {
    /// The first reason counts; the log stays poisoned until it is opened again.
    fn poison(&self, reason: String) {
        tracing::error!(%reason, "the log is poisoned: nothing is acknowledged until you restart the service");
        let _ = self.poisoned.set(reason);
    }

    fn head(&self, stream: &StreamId) -> Head {
        let heads = self.heads.read().expect("no holder of the heads panics");
        let found = heads.get(&stream.tenant).and_then(|streams| streams.get(&stream.key));
        found.copied().unwrap_or(Head::EMPTY)
    }

    fn tree(&self, tenant: &TenantId) -> Result<::sled::Tree, ReadError> {
        let name = format!("{TREE_PREFIX}{tenant}");
        self.db.open_tree(name).map_err(|error| store_error(sentence(&error)))
    }
}

/// Opens a `sled` database whose writes reach the disk only when we say so.
pub(in crate::store) fn open_database(path: &Path, cache_bytes: u64) -> Result<::sled::Db, String> {
    let config = ::sled::Config::new()
        .path(path)
        .cache_capacity(cache_bytes)
        // Background flushing would give "durable" a second meaning.
        .flush_every_ms(None);
    remove_unfinished_snapshots(path)
        .map_err(|error| format!("an unfinished file of it cannot be removed: {error}"))?;
    wait_until_let_go(&path.join("db"));
    guarded(|| config.open())?.map_err(|error| sentence(&error))
}

/// Waits for the threads of a database of this process that was dropped a moment ago: one that has
/// written the last buffer may still hold the file, and its lock, for a moment. Whoever else holds it
/// is `sled`'s to report.
fn wait_until_let_go(file: &Path) {
    let Ok(file) = File::open(file) else { return };
    let began = Instant::now();
    while matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        if began.elapsed() >= LET_GO_MAX {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    // By name and not only by closing: a child that was forked a moment ago has this file, and with it
    // the lock, until it runs its own program. If it fails, closing it is what is left.
    let _ = file.unlock();
}

/// Removes what a process that was killed while the database wrote one of its own snapshots left of
/// it. `sled` 0.34.7 gives a snapshot its final name only when it is whole, and takes the former one
/// away after that, so that an unfinished one is never needed; but at the next opening it takes it for
/// the newest and refuses to open the whole database from then on.
fn remove_unfinished_snapshots(path: &Path) -> io::Result<()> {
    let entries = match fs::read_dir(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    for entry in entries {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with("snap.") && name.ends_with(".generating") {
            tracing::info!(file = %entry.path().display(), "an unfinished snapshot is removed");
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

/// What a heads file says was acknowledged.
fn acknowledged(read: Option<HeadsRead>, fresh: bool) -> Result<Heads, LogError> {
    let damaged = |reason| Err(LogError::Damaged(vec![Damage::Heads { reason }]));
    match read {
        Some(read) => match read.damage {
            None => Ok(read.heads),
            Some(reason) => damaged(reason),
        },
        None if fresh => Ok(Heads::new()),
        None => damaged("the file HEADS is missing".to_owned()),
    }
}

/// Compares what the database holds with what was acknowledged.
///
/// - returns: where each stream ends now.
/// - errors: [`LogError::Damaged`] with all that is missing or unreadable at a stream's end.
fn compare(db: &::sled::Db, recorded: &Heads) -> Result<Heads, LogError> {
    let mut heads = Heads::new();
    let mut damage = Vec::new();
    for name in db.tree_names() {
        let Some(tenant) = tenant_of_tree(&name) else { continue };
        let tree = db.open_tree(&name).map_err(database_error)?;
        let known = recorded.get(&tenant);
        for (key, seq) in last_seqs(&tree).map_err(LogError::Database)? {
            let acknowledged = known.and_then(|heads| heads.get(&key)).copied();
            let stream = StreamId { tenant: tenant.clone(), key };
            match end_of(&tree, &stream, acknowledged.unwrap_or(Head::EMPTY), seq) {
                Ok(head) => {
                    heads.entry(tenant.clone()).or_default().insert(key, head);
                }
                Err(found) => damage.push(found),
            }
        }
    }
    for (tenant, streams) in recorded {
        for (key, head) in streams.iter() {
            let stream = StreamId { tenant: tenant.clone(), key };
            let seen = heads.get(tenant).is_some_and(|streams| streams.contains_key(&key));
            let reported = damage.iter().any(|damage| damage.stream() == Some(&stream));
            if !seen && !reported {
                damage.push(Damage::LostTail { stream, acknowledged: head.seq, found: 0 });
            }
        }
    }
    match damage.is_empty() {
        true => Ok(heads),
        false => Err(LogError::Damaged(damage)),
    }
}

/// Where a stream ends whose last record in the tree has the number `last`.
fn end_of(
    tree: &::sled::Tree,
    stream: &StreamId,
    acknowledged: Head,
    last: u64,
) -> Result<Head, Damage> {
    let damaged = |error| Damage::Record { stream: stream.clone(), error };
    if last < acknowledged.seq {
        let (stream, acknowledged) = (stream.clone(), acknowledged.seq);
        return Err(Damage::LostTail { stream, acknowledged, found: last });
    }
    if let Some(seq) = Seq::new(acknowledged.seq) {
        let found = head_at(tree, stream.key, seq).map_err(damaged)?;
        if found != acknowledged {
            let (expected, found) = (acknowledged.digest.to_hex(), found.digest.to_hex());
            let reason = format!("the heads file says its digest is {expected}, it is {found}");
            return Err(damaged(ReadError::Seal { seq: acknowledged.seq, reason }));
        }
    }
    let mut walk = Walk::after(stream.key, acknowledged);
    while walk.last().seq < last {
        let frame = frame_at(tree, stream.key, walk.last().next()).map_err(damaged)?;
        walk.step(&frame).map_err(damaged)?;
    }
    Ok(walk.last())
}

/// The head a stream had when `seq` was its last record.
fn head_at(tree: &::sled::Tree, stream: StreamKey, seq: Seq) -> Result<Head, ReadError> {
    let frame = frame_at(tree, stream, seq)?;
    let (header, _, digest) =
        Header::unframe(&frame).map_err(|error| ReadError::Header { seq: seq.get(), error })?;
    match header.seq == seq {
        true => Ok(Head { seq: seq.get(), digest }),
        false => Err(ReadError::Gap { expected: seq.get(), found: header.seq.get() }),
    }
}

impl Damage {
    /// The stream it hurts, if it is one stream's.
    pub fn stream(&self) -> Option<&StreamId> {
        match self {
            Damage::LostTail { stream, .. } | Damage::Record { stream, .. } => Some(stream),
            Damage::Heads { .. } | Damage::Seen(_) => None,
        }
    }
}

fn store_error(reason: String) -> ReadError {
    ReadError::Store { reason }
}

fn database_error(error: ::sled::Error) -> LogError {
    LogError::Database(sentence(&error))
}

/// An error of the database for an operator.
fn sentence(error: &::sled::Error) -> String {
    match error {
        ::sled::Error::Corruption { .. } => "a page does not fit its checksum".to_owned(),
        ::sled::Error::Io(error) => error.to_string(),
        other => other.to_string(),
    }
}
