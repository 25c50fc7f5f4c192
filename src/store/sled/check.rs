use std::path::Path;

use super::quiet::guarded;
use super::read::walk;
use super::{CACHE_BYTES, Damage, LogError, TREE_PREFIX, acknowledged, compare, open_database};
use crate::ids::StreamId;
use crate::store::log::heads::HeadsFile;

/// Opens the database of `dir` and reads every record of it, without any key. It may write there:
/// only for copies.
///
/// - errors: the first damage of each stream, or why the database does not open at all.
pub(in crate::store) fn check_log(dir: &Path) -> Result<(), LogError> {
    let database = dir.join("log");
    if !database.join("db").is_file() {
        return Err(LogError::Database("its file log/db is missing".to_owned()));
    }
    let db = open_database(&database, CACHE_BYTES).map_err(LogError::Database)?;
    let recorded = HeadsFile::read(&dir.join("HEADS")).map_err(LogError::Io)?;
    let recorded = acknowledged(recorded, false)?;
    let heads = guarded(|| compare(&db, &recorded)).map_err(LogError::Database)??;
    let mut damage = Vec::new();
    for (tenant, streams) in heads {
        let tree = guarded(|| db.open_tree(format!("{TREE_PREFIX}{tenant}")));
        let tree = tree.map_err(LogError::Database)?.map_err(super::database_error)?;
        for (key, &head) in streams.iter() {
            let walked = guarded(|| walk(&tree, key, head));
            let walked = walked.unwrap_or_else(|reason| Err(super::store_error(reason)));
            if let Err(error) = walked {
                damage.push(Damage::Record {
                    stream: StreamId { tenant: tenant.clone(), key },
                    error,
                });
            }
        }
    }
    match damage.is_empty() {
        true => Ok(()),
        false => Err(LogError::Damaged(damage)),
    }
}

/// Opens a cache and reads every value of it. Only for copies.
pub(in crate::store) fn check_cache(path: &Path) -> Result<(), String> {
    let db = open_database(path, CACHE_BYTES)?;
    guarded(|| {
        for name in db.tree_names() {
            for entry in &db.open_tree(name)? {
                entry?;
            }
        }
        Ok::<(), ::sled::Error>(())
    })?
    .map_err(|error| super::sentence(&error))
}
