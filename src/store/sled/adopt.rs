use std::fs::OpenOptions;
use std::io;
use std::path::{Path, PathBuf};

use super::quiet::guarded;
use super::read::{chunk_key, chunks};
use super::{CACHE_BYTES, TREE_PREFIX, open_database};
use crate::events::Head;
use crate::ids::{StreamId, TenantId};
use crate::limits::COMMIT_GROUP_BYTES_MAX;
use crate::store::disk::closed::{ClosedMark, Part};
use crate::store::disk::files::sync_dir;
use crate::store::log::heads::{Heads, HeadsFile};

/// Puts records that were sealed elsewhere into the log of a directory that nobody has open. Nothing
/// counts before [`Adopter::finish`].
pub(in crate::store) struct Adopter {
    db: ::sled::Db,
    dir: PathBuf,
    heads: Heads,
    batch: ::sled::Batch,
    batch_of: Option<TenantId>,
    batch_bytes: usize,
}

type Done<T> = Result<T, String>;

impl Adopter {
    /// The caller holds the directory's lock.
    pub(in crate::store) fn open(dir: &Path) -> Done<Adopter> {
        Part::Log.lift_mark(dir).map_err(text)?;
        let read = HeadsFile::read(&dir.join("HEADS")).map_err(text)?;
        let heads = match read {
            Some(read) => match read.damage {
                None => read.heads,
                Some(damage) => return Err(format!("the heads file is damaged: {damage}")),
            },
            None => return Err("the heads file is missing".to_owned()),
        };
        let db = open_database(&dir.join("log"), CACHE_BYTES)?;
        let (batch, dir) = (::sled::Batch::default(), dir.to_owned());
        Ok(Adopter { db, dir, heads, batch, batch_of: None, batch_bytes: 0 })
    }

    pub(in crate::store) fn holds(&self, tenant: &TenantId) -> bool {
        self.heads.contains_key(tenant)
    }

    /// Puts a record whose place in its chain the caller has proved.
    pub(in crate::store) fn put(
        &mut self,
        stream: &StreamId,
        head: Head,
        frame: &[u8],
    ) -> Done<()> {
        if self.batch_of.as_ref() != Some(&stream.tenant)
            || self.batch_bytes >= COMMIT_GROUP_BYTES_MAX
        {
            self.write()?;
            self.batch_of = Some(stream.tenant.clone());
        }
        for (chunk, value) in chunks(frame) {
            self.batch.insert(&chunk_key(stream.key, head.seq, chunk), value);
        }
        self.batch_bytes += frame.len();
        self.heads.entry(stream.tenant.clone()).or_default().insert(stream.key, head);
        Ok(())
    }

    fn write(&mut self) -> Done<()> {
        let batch = std::mem::take(&mut self.batch);
        self.batch_bytes = 0;
        let Some(tenant) = self.batch_of.take() else { return Ok(()) };
        let name = format!("{TREE_PREFIX}{tenant}");
        guarded(|| self.db.open_tree(name)?.apply_batch(batch))?.map_err(text)
    }

    /// Takes back what was put for a tenant and never finished.
    pub(in crate::store) fn forget(&mut self, tenant: &TenantId) -> Done<()> {
        self.heads.remove(tenant);
        let name = format!("{TREE_PREFIX}{tenant}");
        guarded(|| self.db.drop_tree(name))?.map_err(text).map(|_| ())
    }

    /// Makes all of it durable, the heads last: with them it counts.
    pub(in crate::store) fn finish(mut self) -> Done<()> {
        self.write()?;
        guarded(|| self.db.flush())?.map_err(text)?;
        let database = self.dir.join("log");
        let file = OpenOptions::new().write(true).open(database.join("db")).map_err(text)?;
        file.sync_data().map_err(text)?;
        sync_dir(&database).map_err(text)?;
        HeadsFile::replace(&self.dir.join("HEADS"), &self.heads).map_err(text)?;
        let mark = ClosedMark::new(&self.dir, Part::Log);
        drop(self);
        drop(mark);
        Ok(())
    }
}

fn text(error: impl Into<io::Error>) -> String {
    error.into().to_string()
}
