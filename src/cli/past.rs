//! The private copy of a data directory that commands about the past read.

use std::path::PathBuf;

use super::data_dir;
use super::failure::Failure;
use crate::ids::{StreamId, TenantId, UserId};
use crate::store::{self, OpenError, PrivateCopy, Store};

/// A store that was copied, for reading only.
pub struct Past {
    pub store: Store,
    /// The directory that the person named.
    directory: PathBuf,
    /// Removed when dropped, after the store.
    _copy: PrivateCopy,
}

/// Copies the closed data directory and opens the copy.
///
/// - errors: one sentence: with code 2 there is none, it is in use, or it cannot be read; with code
///   1 records that were acknowledged are lost.
pub fn open(flag: Option<PathBuf>) -> Result<Past, Failure> {
    let directory = data_dir::choose(flag)?;
    let copy = store::copy_private(&directory).map_err(Failure::bad_input)?;
    let store = copy.open().map_err(|error| match error {
        // Nothing is wrong with what the person asked for.
        OpenError::Damaged { .. } | OpenError::Database { .. } => Failure::failed(error),
        _ => Failure::bad_input(error),
    })?;
    Ok(Past { store, directory, _copy: copy })
}

impl Past {
    /// - errors: with code 2 when nobody of `tenant` was ever recorded.
    pub fn check_tenant(&self, tenant: &TenantId) -> Result<(), Failure> {
        let known = self.store.log.tenants().map_err(Failure::failed)?;
        if known.contains(tenant) {
            return Ok(());
        }
        let known: Vec<&str> = known.iter().map(TenantId::as_str).collect();
        let known = match known.is_empty() {
            true => "nobody was recorded yet".to_owned(),
            false => format!("its tenants are {}; name one of them", known.join(", ")),
        };
        Err(Failure::bad_input(format!(
            "{} holds no records of tenant {tenant}: {known}",
            self.directory.display()
        )))
    }

    /// The stream of a person who has records.
    ///
    /// - errors: with code 2 when the tenant or the person is unknown.
    pub fn stream(&self, tenant: &TenantId, user: &UserId) -> Result<StreamId, Failure> {
        self.check_tenant(tenant)?;
        let stream = self.store.keys.stream_id(tenant, user).map_err(Failure::bad_input)?;
        match self.store.log.head(&stream).map_err(Failure::failed)?.seq {
            0 => Err(Failure::bad_input(format!(
                "{} holds no records of user {:?} in tenant {tenant}; name a person who talked \
                 with this directory's service",
                self.directory.display(),
                user.as_str()
            ))),
            _ => Ok(stream),
        }
    }
}
