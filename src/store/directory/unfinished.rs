//! An import that a crash cut short, and what becomes of it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::error::{Fail, OpenError};
use crate::ids::TenantId;
use crate::store::disk::files::{overwrite_and_remove, sync_dir};
use crate::store::sled::Adopter;

/// The file that names the tenant while it is being imported.
pub(in crate::store) const MARK: &str = "IMPORTING";

/// Ends an import that was cut short in `dir`. If its heads are written, it is complete; otherwise it
/// is undone.
pub(in crate::store) fn settle(dir: &Path) -> Result<(), String> {
    let mark = dir.join(MARK);
    let name = match fs::read_to_string(&mark) {
        Ok(name) => name,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(format!("{}: {error}", mark.display())),
    };
    let text = |error: io::Error| error.to_string();
    let tenant = TenantId::new(&name)
        .map_err(|error| format!("{} does not name a tenant: {error}", mark.display()))?;
    let mut adopter = Adopter::open(dir)?;
    if !adopter.holds(&tenant) {
        tracing::warn!(%tenant, "an unfinished import is undone");
        adopter.forget(&tenant)?;
        let secret = dir.join("keys").join(format!("{tenant}.key"));
        overwrite_and_remove(&secret).map_err(text)?;
        let users = users_of(dir, &tenant);
        if users.exists() {
            fs::remove_dir_all(&users).map_err(text)?;
        }
    }
    adopter.finish()?;
    fs::remove_file(&mark).and_then(|()| sync_dir(dir)).map_err(text)
}

/// [`settle`] for the opening of a directory.
pub(super) fn settle_before_opening(dir: &Path) -> Result<(), OpenError> {
    settle(dir).map_err(|reason| {
        Fail(dir).io(&dir.join(MARK), format!("an unfinished import cannot be undone: {reason}"))
    })
}

/// The folder with the keys of a tenant's people.
pub(in crate::store) fn users_of(dir: &Path, tenant: &TenantId) -> PathBuf {
    dir.join("keys/users").join(tenant.as_str())
}
