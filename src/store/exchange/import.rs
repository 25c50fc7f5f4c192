use std::fs;
use std::io;
use std::path::Path;
use std::sync::Arc;

use super::export::{BadFrame, ExportFrame, ExportReader, Exported};
use crate::events::Head;
use crate::ids::{StreamId, TenantId};
use crate::store::directory::error::OpenError;
use crate::store::directory::open::{lock_existing, open};
use crate::store::directory::unfinished::{MARK, settle, users_of};
use crate::store::disk::files::{make_dir, sync_dir, write_whole};
use crate::store::sealing::entropy::OsEntropy;
use crate::store::sealing::keys::{KeyError, Keys, user_file};
use crate::store::sealing::seal::Walk;
use crate::store::sled::Adopter;

/// What was imported.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Imported {
    pub tenant: TenantId,
    pub counts: Exported,
}

/// Why nothing was imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    #[error("{path}, frame {frame}: {reason}; nothing was imported, use another copy of the file")]
    Damaged { path: String, frame: u64, reason: String },
    #[error("{path} cannot be read: {reason}")]
    Io { path: String, reason: String },
    #[error("the key file {path} does not open this export: {reason}; nothing was imported")]
    Key { path: String, reason: String },
    #[error(
        "the data directory {dir} already has records or keys of tenant {tenant}; choose another"
    )]
    Taken { dir: String, tenant: TenantId },
    #[error("{0}")]
    Open(#[from] OpenError),
    #[error("tenant {tenant} could not be imported into {dir}: {reason}; nothing was imported")]
    Failed { dir: String, tenant: TenantId, reason: String },
}

/// Puts the tenant of an export into the closed or new data directory `dir`: all of it or nothing.
///
/// - `key_file`: the tenant's secret.
pub fn import(dir: &Path, path: &Path, key_file: &Path) -> Result<Imported, ImportError> {
    let secret = fs::read(key_file).map(zeroize::Zeroizing::new).map_err(|error| {
        ImportError::Io { path: key_file.display().to_string(), reason: error.to_string() }
    })?;
    let imported = prove(path, &secret, key_file)?;
    let tenant = &imported.tenant;
    // Made if it is new, checked if it is not.
    drop(open(dir)?);
    let _lock = lock_existing(dir)?;
    let failed = |reason: String| ImportError::Failed {
        dir: dir.display().to_string(),
        tenant: tenant.clone(),
        reason,
    };
    let mut adopter = Adopter::open(dir).map_err(failed)?;
    let secret_path = dir.join("keys").join(format!("{tenant}.key"));
    // The tenant of a single-user directory gets a secret when the directory is made.
    let unused = *tenant == TenantId::local() && !users_of(dir, tenant).exists();
    if adopter.holds(tenant) || (secret_path.exists() && !unused) {
        adopter.finish().map_err(failed)?;
        let (dir, tenant) = (dir.display().to_string(), tenant.clone());
        return Err(ImportError::Taken { dir, tenant });
    }
    let put = write_whole(&dir.join(MARK), tenant.as_str().as_bytes())
        .and_then(|()| sync_dir(dir))
        .and_then(|()| write_whole(&secret_path, &secret))
        .and_then(|()| sync_dir(&dir.join("keys")))
        .map_err(|error| error.to_string())
        .and_then(|()| put_all(&mut adopter, dir, path, tenant))
        .and_then(|()| adopter.finish());
    // Either way: what was finished stays, what was not is taken back.
    settle(dir).map_err(failed)?;
    put.map_err(failed)?;
    Ok(imported)
}

/// Reads the whole file and proves each record and each key.
fn prove(path: &Path, secret: &[u8], key_file: &Path) -> Result<Imported, ImportError> {
    let mut reader = ExportReader::open(path).map_err(|error| ImportError::Io {
        path: path.display().to_string(),
        reason: error.to_string(),
    })?;
    let damaged = |(frame, reason): BadFrame| ImportError::Damaged {
        path: path.display().to_string(),
        frame,
        reason,
    };
    let bad_key = |error: KeyError| ImportError::Key {
        path: key_file.display().to_string(),
        reason: error.to_string(),
    };
    let ExportFrame::Tenant(tenant) = reader.next().map_err(damaged)? else {
        return Err(damaged((1, "it does not name a tenant".to_owned())));
    };
    let keys = Keys::of_secret(&tenant, secret, key_file, Arc::new(OsEntropy)).map_err(bad_key)?;
    let mut counts = Exported { people: 0, records: 0 };
    let mut person: Option<(Walk, Head)> = None;
    loop {
        let frame = reader.next().map_err(damaged)?;
        let number = reader.frames;
        if let (ExportFrame::Person { .. } | ExportFrame::End, Some((walk, head))) =
            (&frame, &person)
            && walk.last() != *head
        {
            let reason = format!("before it stand {} of {} records", walk.last().seq, head.seq);
            return Err(damaged((number, reason)));
        }
        match frame {
            ExportFrame::Tenant(_) => {
                return Err(damaged((number, "it names a second tenant".into())));
            }
            ExportFrame::Person { key, head, wrapped } => {
                let stream = StreamId { tenant: tenant.clone(), key };
                if let Some(wrapped) = wrapped {
                    keys.unwrap(&stream, &wrapped, key_file).map_err(bad_key)?;
                }
                counts.people += u64::from(!stream.is_tenants());
                person = Some((Walk::after(key, Head::EMPTY), head));
            }
            ExportFrame::Record(bytes) => {
                let Some((walk, _)) = &mut person else {
                    return Err(damaged((number, "it is a record of nobody".to_owned())));
                };
                walk.step(&bytes).map_err(|error| damaged((number, error.to_string())))?;
                counts.records += 1;
            }
            ExportFrame::End => return Ok(Imported { tenant, counts }),
        }
    }
}

/// The second reading: the file was proved, and still nothing is believed that changed meanwhile.
fn put_all(
    adopter: &mut Adopter,
    dir: &Path,
    path: &Path,
    tenant: &TenantId,
) -> Result<(), String> {
    let text = |error: io::Error| error.to_string();
    let users = users_of(dir, tenant);
    make_dir(&users).map_err(text)?;
    let mut reader = ExportReader::open(path).map_err(text)?;
    let mut person: Option<(StreamId, Walk)> = None;
    loop {
        match reader.next().map_err(|(frame, reason)| format!("frame {frame}: {reason}"))? {
            ExportFrame::Tenant(_) => {}
            ExportFrame::Person { key, wrapped, .. } => {
                let stream = StreamId { tenant: tenant.clone(), key };
                let file = dir.join("keys").join(user_file(&stream));
                match wrapped {
                    Some(wrapped) => write_whole(&file, &wrapped),
                    None => write_whole(&file.with_extension("erased"), b""),
                }
                .map_err(text)?;
                person = Some((stream, Walk::after(key, Head::EMPTY)));
            }
            ExportFrame::Record(bytes) => {
                let (stream, walk) = person.as_mut().ok_or("the file changed while it was read")?;
                walk.step(&bytes).map_err(|error| error.to_string())?;
                adopter.put(stream, walk.last(), &bytes)?;
            }
            ExportFrame::End => return sync_dir(&users).map_err(text),
        }
    }
}
