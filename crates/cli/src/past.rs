//! The private copy of a data directory that commands about the past read.

use std::path::PathBuf;

use apprentice::ids::{StreamId, TenantId, UserId};
use apprentice::store::{self, OpenError, PrivateCopy, Store};
use clap::Args;

use super::failure::Failure;
use super::{data_dir, embedded};

/// Whose records to read.
#[derive(Debug, Args)]
pub struct Whose {
    /// The data directory. The command works on a copy of it
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// The lab of the user.
    #[arg(long, value_name = "NAME", default_value = "local")]
    tenant: String,
    /// The user.
    #[arg(long, value_name = "NAME")]
    user: String,
}

/// A person's records in a copied store.
pub struct OfOne {
    pub past: Past,
    pub tenant: TenantId,
    pub user: UserId,
    pub stream: StreamId,
}

impl Whose {
    /// - errors: as [`open`] and [`Past::stream`], and names that are none.
    pub fn open(self) -> Result<OfOne, Failure> {
        let tenant = TenantId::new(&self.tenant).map_err(Failure::bad_input)?;
        let user = embedded::user(&self.user)?;
        let past = open(self.data)?;
        let stream = past.stream(&tenant, &user)?;
        Ok(OfOne { past, tenant, user, stream })
    }
}

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
    /// - errors: with code 2 when `tenant` has no records.
    pub fn check_tenant(&self, tenant: &TenantId) -> Result<(), Failure> {
        let known = self.store.log.tenants().map_err(Failure::failed)?;
        if known.contains(tenant) {
            return Ok(());
        }
        let known: Vec<&str> = known.iter().map(TenantId::as_str).collect();
        let known = match known.is_empty() {
            true => "it holds no records yet".to_owned(),
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
            0 => Err(self.stranger(tenant, user)),
            _ => Ok(stream),
        }
    }

    /// Why there are no records of `user`: the name may be wrong, or the tenant's secret may be.
    fn stranger(&self, tenant: &TenantId, user: &UserId) -> Failure {
        let recorded = self.store.log.streams(tenant).unwrap_or_default();
        match self.store.keys.check_opens(tenant, &recorded) {
            Err(error) => Failure::bad_input(error),
            Ok(()) => Failure::bad_input(format!(
                "{} holds no records of user {:?} in tenant {tenant}; name a user who talked to \
                 the service of this directory",
                self.directory.display(),
                user.as_str()
            )),
        }
    }
}
