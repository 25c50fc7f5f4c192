//! The readers of files that are private to this room, each for bytes in memory: for `tests/hostile`,
//! which throws everything at them. None panics, and none takes more memory than a small multiple
//! of what it is given.

use std::path::Path;
use std::sync::Arc;

use serde::de::DeserializeOwned;

use crate::events::Head;
use crate::ids::{StreamId, TenantId};
use crate::store::caches::origin::Origin;
use crate::store::caches::snapshots;
use crate::store::directory::layout;
use crate::store::exchange::export::{ExportFrame, ExportReader};
use crate::store::log::heads;
use crate::store::sealing::entropy::Entropy;
use crate::store::sealing::keys::{KeyError, Keys};
use crate::store::sealing::seal::DataKey;

/// A heads file.
///
/// - returns: how many streams it knows.
/// - errors: what of it cannot be trusted.
pub fn heads(bytes: &[u8]) -> Result<usize, String> {
    let read = heads::parse(bytes);
    match read.damage {
        None => Ok(read.heads.values().map(|streams| streams.len()).sum()),
        Some(reason) => Err(reason),
    }
}

/// The one line of the file `LAYOUT`.
pub fn layout(bytes: &[u8]) -> Option<u32> {
    layout::number(bytes)
}

/// A whole export.
///
/// - returns: its frames.
/// - errors: the number of the bad frame, and a sentence.
pub fn export(bytes: &[u8]) -> Result<u64, (u64, String)> {
    let mut reader = ExportReader::of(bytes);
    while !matches!(reader.next()?, ExportFrame::End) {}
    Ok(reader.frames)
}

/// A tenant's secret.
pub fn tenant_key(
    tenant: &TenantId,
    file: &[u8],
    entropy: Arc<dyn Entropy>,
) -> Result<Keys, KeyError> {
    Keys::of_secret(tenant, file, Path::new("tenant.key"), entropy)
}

/// A person's wrapped key.
pub fn user_key(keys: &Keys, stream: &StreamId, file: &[u8]) -> Result<DataKey, KeyError> {
    keys.unwrap(stream, file, Path::new("user.key"))
}

/// A snapshot after it was unsealed.
pub fn snapshot<T: DeserializeOwned>(blob: &[u8]) -> Option<(Origin, Head, T)> {
    let (origin, plain) = Origin::split(blob)?;
    let (head, state) = snapshots::read(plain)?;
    Some((origin, head, state))
}
